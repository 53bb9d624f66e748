//! Parser for GRBL output: one line in, one meaning out.
//!
//! Positions stay in the controller's report unit (`$13`); the engine converts them.

use std::collections::BTreeMap;

/// Longest line that is stored; longer ones are noise.
pub const LONGEST_LINE: usize = 512;
/// Number of axes that we track.
pub const AXES: usize = 3;

#[derive(Clone, Debug, PartialEq)]
pub enum HeardLine {
    /// The controller restarted: `Grbl 1.1h ['$' for help]`.
    Banner(String),
    /// The oldest line was accepted.
    Ok,
    /// The oldest line was refused.
    Error {
        number: u16,
    },
    Alarm {
        number: u16,
    },
    Status(Box<ControllerStatus>),
    Setting {
        number: u16,
        value: f64,
    },
    /// Version and user-given name: `[VER:1.1h.20190830:]`.
    Version {
        version: String,
        name: String,
    },
    /// Compiled options: letters, planner blocks, receive buffer bytes.
    Options(CompiledOptions),
    /// Another row of `$I`, such as `FIRMWARE` and `grblHAL`.
    About {
        name: String,
        value: String,
    },
    /// A stored offset: `G54` to `G59`, `G28`, `G30`, `G92`, `TLO`.
    Offset {
        name: String,
        places: Vec<f64>,
    },
    Probe {
        /// In machine coordinates.
        place_mm: [f64; AXES],
        /// False if the probe met nothing.
        met: bool,
    },
    /// Modal words: `G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0`.
    Modes(Modes),
    Message(String),
    Startup(String),
    Other(String),
}

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CompiledOptions {
    /// One letter for each option.
    pub letters: String,
    pub blocks: u16,
    pub rx_bytes: u16,
}

/// Modal words.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Modes {
    /// G and M words, in tenths: G91.1 is 911.
    pub codes: Vec<(char, u16)>,
    pub feed_mm_per_min: f64,
    pub speed_rpm: f64,
    pub tool: Option<u32>,
}

impl Modes {
    /// True if a word is active; its code in tenths.
    pub fn says(&self, letter: char, tenths: u16) -> bool {
        self.codes.contains(&(letter, tenths))
    }

    /// The first of these words that is not active.
    pub(super) fn first_missing(&self, wanted: &[(char, u16)]) -> Option<String> {
        let (letter, tenths) = wanted.iter().find(|(letter, tenths)| !self.says(*letter, *tenths))?;
        Some(format!("{letter}{}", f64::from(*tenths) / 10.0))
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum ReportedState {
    /// Nothing is in the planner.
    Idle,
    Run,
    /// Feed hold; `rests`: motion has stopped.
    Hold {
        rests: bool,
    },
    Jog,
    Alarm,
    /// Safety door; `rests`: motion has stopped.
    Door {
        rests: bool,
    },
    /// Check mode: nothing moves.
    Check,
    Home,
    Sleep,
    /// Waiting for a tool (grblHAL).
    Tool,
}

impl ReportedState {
    /// True if nothing is in work and all lines were read.
    pub fn is_at_rest(self) -> bool {
        matches!(self, Self::Idle | Self::Alarm | Self::Check)
    }

    /// True if the machine is held and has stopped.
    pub fn is_held_at_rest(self) -> bool {
        matches!(self, Self::Hold { rests: true } | Self::Door { rests: true } | Self::Tool)
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct ControllerStatus {
    pub doing: ReportedState,
    pub machine_mm: Option<[f64; AXES]>,
    pub work_mm: Option<[f64; AXES]>,
    /// Work zero in machine coordinates, if reported.
    pub offset_mm: Option<[f64; AXES]>,
    /// Free planner blocks and free bytes of the receive buffer, if reported.
    pub room: Option<(u16, u16)>,
    /// Line number in work, if reported.
    pub line: Option<u32>,
    pub feed_mm_per_min: Option<f64>,
    pub speed_rpm: Option<f64>,
    /// Active inputs, by letter.
    pub pins: String,
    /// Overrides of feed, rapids and spindle, percent; in some reports only.
    pub overrides: Option<[u16; 3]>,
    /// Spindle and coolant that are on, by letter; reported with the overrides.
    pub accessories: Option<String>,
}

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
        // Older versions add the name in brackets.
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

/// Every member of the family sends its name and how to get help.
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
    // Without a readable position the report is useless.
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

/// A field that is present but unreadable invalidates the whole report.
fn turned<T>(found: Option<Option<T>>) -> Option<Option<T>> {
    match found {
        Some(None) => None,
        Some(read) => Some(read),
        None => Some(None),
    }
}

/// Assembles bytes into lines.
#[derive(Clone, Debug, Default)]
pub struct Ear {
    rest: Vec<u8>,
}

impl Ear {
    /// The lines completed by `bytes`. Overlong lines are cut: they are noise.
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

    /// Drops an incomplete line.
    pub fn clear(&mut self) {
        self.rest.clear();
    }
}
