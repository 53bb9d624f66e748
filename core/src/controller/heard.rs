//! What a controller of the GRBL family says: one line in, one meaning out.
//!
//! Comes in: a line without its end. Goes out: a [`HeardLine`]; what is not understood stays as [`HeardLine::Other`], whole. Places in the
//! unit that the controller reports in (`$13`), which this file does not know.

use std::collections::BTreeMap;

/// Longest line that is kept; what is longer is noise.
pub const LONGEST_LINE: usize = 512;
/// Axes that are followed.
pub const AXES: usize = 3;

/// One line, understood.
#[derive(Clone, Debug, PartialEq)]
pub enum HeardLine {
    /// It began anew: `Grbl 1.1h ['$' for help]`.
    Banner(String),
    /// The oldest line was taken.
    Ok,
    /// The oldest line was refused.
    Error {
        /// The number of the error.
        number: u16,
    },
    /// It locked itself.
    Alarm {
        /// The number of the alarm.
        number: u16,
    },
    /// Where it is and what it does.
    Status(Box<ControllerStatus>),
    /// A setting and its value.
    Setting {
        /// Its number.
        number: u16,
        /// Its value, in its own unit.
        value: f64,
    },
    /// Version and the name that a person gave it: `[VER:1.1h.20190830:]`.
    Version {
        /// The version.
        version: String,
        /// What a person calls it.
        name: String,
    },
    /// Compiled options: letters, blocks of the planner, bytes of the receive buffer.
    Options(CompiledOptions),
    /// Another row of `$I`: name and value, such as `FIRMWARE` and `grblHAL`.
    About {
        /// What the row is of.
        name: String,
        /// What it says.
        value: String,
    },
    /// A stored place: `G54` to `G59`, `G28`, `G30`, `G92`, `TLO`.
    Offset {
        /// Which.
        name: String,
        /// Where, an axis each.
        places: Vec<f64>,
    },
    /// Where the probe met something; false where it met nothing.
    Probe {
        /// Where, in machine coordinates.
        place_mm: [f64; AXES],
        /// Whether it met something.
        met: bool,
    },
    /// The words in force: `G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0`.
    Modes(Modes),
    /// A message for people.
    Message(String),
    /// A start-up line and what became of it.
    Startup(String),
    /// Something else.
    Other(String),
}

/// Compiled options.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CompiledOptions {
    /// A letter for each option.
    pub letters: String,
    /// Blocks that the planner holds.
    pub blocks: u16,
    /// Bytes that the receive buffer holds.
    pub rx_bytes: u16,
}

/// The words in force.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Modes {
    /// G and M words, in tenths: G91.1 is 911.
    pub codes: Vec<(char, u16)>,
    /// Feed.
    pub feed_mm_per_min: f64,
    /// Spindle speed.
    pub speed_rpm: f64,
    /// The number of the tool.
    pub tool: Option<u32>,
}

impl Modes {
    /// Whether a word is in force; its code in tenths.
    pub fn says(&self, letter: char, tenths: u16) -> bool {
        self.codes.contains(&(letter, tenths))
    }
}

/// What the machine does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ReportedState {
    /// Nothing; its planner is empty.
    Idle,
    /// It moves.
    Run,
    /// Feed hold; whether it has come to rest.
    Hold {
        /// At rest.
        rests: bool,
    },
    /// It moves by hand.
    Jog,
    /// It is locked.
    Alarm,
    /// Safety door; whether it has come to rest.
    Door {
        /// At rest.
        rests: bool,
    },
    /// Check mode: nothing moves.
    Check,
    /// It looks for its end switches.
    Home,
    /// It sleeps.
    Sleep,
    /// It waits for a tool (grblHAL).
    Tool,
}

impl ReportedState {
    /// Nothing is in work: what was sent has been read.
    pub fn is_at_rest(self) -> bool {
        matches!(self, Self::Idle | Self::Alarm | Self::Check)
    }

    /// Something holds it, and it has come to rest.
    pub fn is_held_at_rest(self) -> bool {
        matches!(self, Self::Hold { rests: true } | Self::Door { rests: true } | Self::Tool)
    }
}

/// A status report.
#[derive(Clone, Debug, PartialEq)]
pub struct ControllerStatus {
    /// What it does.
    pub doing: ReportedState,
    /// Machine position, where told.
    pub machine_mm: Option<[f64; AXES]>,
    /// Work position, where told.
    pub work_mm: Option<[f64; AXES]>,
    /// Work zero in machine coordinates, where told.
    pub offset_mm: Option<[f64; AXES]>,
    /// Free blocks of the planner and free bytes of the receive buffer, where told.
    pub room: Option<(u16, u16)>,
    /// Number of the line in work, where told.
    pub line: Option<u32>,
    /// Feed of the moment.
    pub feed_mm_per_min: Option<f64>,
    /// Spindle speed.
    pub speed_rpm: Option<f64>,
    /// Inputs that are on, by their letters.
    pub pins: String,
    /// Overrides of feed, rapids and spindle, percent; told now and then.
    pub overrides: Option<[u16; 3]>,
    /// Spindle and coolant that are on, by their letters; told with the overrides.
    pub accessories: Option<String>,
}

/// What a line means.
pub fn hear(line: &str) -> HeardLine {
    let line = line.trim();
    let other = || HeardLine::Other(line.chars().take(LONGEST_LINE).collect());
    if line == "ok" {
        return HeardLine::Ok;
    }
    if let Some(number) = line.strip_prefix("error:") {
        return number.trim().parse().map_or_else(|_| other(), |number| HeardLine::Error { number });
    }
    if let Some(number) = line.strip_prefix("ALARM:") {
        return number.trim().parse().map_or_else(|_| other(), |number| HeardLine::Alarm { number });
    }
    if let Some(inside) = line.strip_prefix('<').and_then(|rest| rest.strip_suffix('>')) {
        return status(inside).map_or_else(other, |status| HeardLine::Status(Box::new(status)));
    }
    if let Some(inside) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
        return bracket(inside).unwrap_or_else(other);
    }
    if let Some((number, value)) = line.strip_prefix('$').and_then(|rest| rest.split_once('=')) {
        // Older ones add the name in brackets.
        let value = value.split(" (").next().unwrap_or_default().trim();
        if let (Ok(number), Ok(value)) = (number.parse(), value.parse::<f64>())
            && value.is_finite()
        {
            return HeardLine::Setting { number, value };
        }
        return other();
    }
    if line.starts_with('>') {
        return HeardLine::Startup(line.to_owned());
    }
    if is_banner(line) {
        return HeardLine::Banner(line.to_owned());
    }
    other()
}

/// Every member of the family greets with its name and how to get help.
fn is_banner(line: &str) -> bool {
    line.starts_with("Grbl ") && line.contains('[') || line.starts_with("GrblHAL ") && line.contains('[')
}

fn bracket(inside: &str) -> Option<HeardLine> {
    let (name, value) = inside.split_once(':')?;
    Some(match name {
        "MSG" => HeardLine::Message(value.trim().to_owned()),
        "VER" => {
            let (version, called) = value.split_once(':').unwrap_or((value, ""));
            HeardLine::Version { version: version.to_owned(), name: called.to_owned() }
        }
        "OPT" => {
            let mut fields = value.split(',');
            let letters = fields.next().unwrap_or_default().to_owned();
            let mut number = || fields.next().and_then(|field| field.trim().parse().ok()).unwrap_or(0);
            HeardLine::Options(CompiledOptions { letters, blocks: number(), rx_bytes: number() })
        }
        "GC" => HeardLine::Modes(modes(value)?),
        "PRB" => {
            let (places, met) = value.rsplit_once(':')?;
            HeardLine::Probe { place_mm: places3(places)?, met: met == "1" }
        }
        "TLO" => HeardLine::Offset { name: name.to_owned(), places: numbers(value)? },
        _ if name.starts_with('G') && name[1..].starts_with(|c: char| c.is_ascii_digit()) => {
            HeardLine::Offset { name: name.to_owned(), places: numbers(value)? }
        }
        _ => HeardLine::About { name: name.to_owned(), value: value.to_owned() },
    })
}

fn modes(text: &str) -> Option<Modes> {
    let mut modes = Modes::default();
    for word in text.split_whitespace() {
        let letter = word.chars().next()?;
        let number: f64 = word.get(letter.len_utf8()..)?.parse().ok().filter(|n: &f64| n.is_finite())?;
        match letter {
            'F' => modes.feed_mm_per_min = number,
            'S' => modes.speed_rpm = number,
            'T' => modes.tool = Some(number as u32),
            'G' | 'M' => modes.codes.push((letter, libm::round(number * 10.0) as u16)),
            _ => {}
        }
    }
    Some(modes)
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(|field| field.trim().parse().ok().filter(|n: &f64| n.is_finite())).collect()
}

fn places3(text: &str) -> Option<[f64; AXES]> {
    let all = numbers(text)?;
    all.get(..AXES)?.try_into().ok()
}

fn status(inside: &str) -> Option<ControllerStatus> {
    let mut fields = inside.split('|');
    let (word, sub) = fields.next().map(|first| first.split_once(':').unwrap_or((first, "")))?;
    let doing = match word {
        "Idle" => ReportedState::Idle,
        "Run" => ReportedState::Run,
        "Hold" => ReportedState::Hold { rests: sub != "1" },
        "Jog" => ReportedState::Jog,
        "Alarm" => ReportedState::Alarm,
        "Door" => ReportedState::Door { rests: sub != "2" && sub != "3" },
        "Check" => ReportedState::Check,
        "Home" => ReportedState::Home,
        "Sleep" => ReportedState::Sleep,
        "Tool" => ReportedState::Tool,
        _ => return None,
    };
    let named: BTreeMap<&str, &str> = fields.filter_map(|field| field.split_once(':')).collect();
    let place = |name: &str| named.get(name).map(|text| places3(text));
    let whole = |name: &str| named.get(name).and_then(|text| numbers(text));
    let speeds = whole("FS").or_else(|| whole("F")).unwrap_or_default();
    let limited = |n: f64| n.clamp(0.0, 65_535.0) as u16;
    // A report whose place cannot be read is no report.
    let (machine, work) = (turned(place("MPos"))?, turned(place("WPos"))?);
    (machine.is_some() || work.is_some()).then_some(())?;
    Some(ControllerStatus {
        doing,
        machine_mm: machine,
        work_mm: work,
        offset_mm: turned(place("WCO"))?,
        room: whole("Bf").and_then(|n| Some((limited(*n.first()?), limited(*n.get(1)?)))),
        line: named.get("Ln").and_then(|text| text.parse().ok()),
        feed_mm_per_min: speeds.first().copied(),
        speed_rpm: speeds.get(1).copied(),
        pins: named.get("Pn").unwrap_or(&"").to_string(),
        overrides: whole("Ov")
            .and_then(|n| Some([limited(*n.first()?), limited(*n.get(1)?), limited(*n.get(2)?)])),
        accessories: named.get("Ov").map(|_| named.get("A").unwrap_or(&"").to_string()),
    })
}

/// A field that is there but cannot be read makes the whole unreadable.
fn turned<T>(found: Option<Option<T>>) -> Option<Option<T>> {
    match found {
        Some(None) => None,
        Some(read) => Some(read),
        None => Some(None),
    }
}

/// Bytes put together to lines.
#[derive(Clone, Debug, Default)]
pub struct Ear {
    rest: Vec<u8>,
}

impl Ear {
    /// The lines that are whole after `bytes`. A line that is far too long is cut: it is noise.
    pub fn take(&mut self, bytes: &[u8]) -> Vec<String> {
        let mut lines = Vec::new();
        for &byte in bytes {
            if byte == b'\n' || byte == b'\r' || self.rest.len() >= LONGEST_LINE {
                if !self.rest.is_empty() {
                    lines.push(String::from_utf8_lossy(&self.rest).into_owned());
                    self.rest.clear();
                }
            } else {
                self.rest.push(byte);
            }
        }
        lines
    }

    /// Forgets half a line.
    pub fn clear(&mut self) {
        self.rest.clear();
    }
}
