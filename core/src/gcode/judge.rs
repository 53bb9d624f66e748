//! Checks a program line by line, as a controller does before it executes a line.

use super::table::{Axes, FEED_MODE, Row, find};
use super::{Interpreter, Refused, grbl};
use crate::code;

/// Largest line number and tool number of GRBL.
const LARGEST_LINE: u32 = 10_000_000;
const LARGEST_TOOL: u8 = 255;
/// Work zeros that G10 of GRBL may set.
const MOST_ZEROS: f64 = 6.0;
/// M words that LinuxCNC allows on one line.
const MOST_M: usize = 4;
const RAPID: u32 = 0;
const LINE: u32 = 100;
const ARCS: [u32; 2] = [200, 300];
const DWELL: u32 = 400;
const SET_ZERO: u32 = 1000;
const MACHINE: u32 = 5300;
const NO_MOTION: u32 = 8000;
const INVERSE_TIME: u32 = 9300;
const ABSOLUTE: u32 = 9000;
const RELATIVE: u32 = 9100;
const TOOL_LENGTH: u32 = 4310;
const WAIT_FOR_INPUT: u32 = 6600;
/// Drilling cycles that need Q, the depth of each peck.
const PECKS: [u32; 2] = [7300, 8300];
/// Drilling cycles that need P, the dwell at the bottom.
const DWELLS: [u32; 4] = [8200, 8600, 8800, 8900];
const CYCLES: std::ops::RangeInclusive<u32> = 8100..=8900;
/// Codes that have decimals.
const WITH_PARTS: [u32; 9] = [2800, 3000, 3800, 4300, 5900, 6100, 9000, 9100, 9200];

fn refused<T>(code: &'static str, word: impl Into<String>, number: u16) -> Result<T, Refused> {
    Err(Refused { code, word: word.into(), number })
}

#[derive(Clone, Debug)]
pub struct Judge {
    of: Interpreter,
    /// The sender adds the end point of a full circle, which GRBL requires.
    completes_circles: bool,
    /// Accept tool changes and mist: the sender changes tools, and mist is a firmware option.
    takes_options: bool,
    motion: u32,
    feed: f64,
    is_inverse_time: bool,
    is_relative: bool,
}

/// The words of one line, sorted.
struct Words<'w> {
    all: &'w [(char, f64)],
    g: Vec<&'static Row>,
    m: Vec<&'static Row>,
}

impl Words<'_> {
    fn value(&self, letter: char) -> Option<f64> {
        self.all.iter().find(|(name, _)| *name == letter).map(|(_, value)| *value)
    }

    fn has(&self, letter: char) -> bool {
        self.value(letter).is_some()
    }

    fn any(&self, letters: &str) -> bool {
        letters.chars().any(|letter| self.has(letter))
    }

    fn says(&self, code: u32) -> bool {
        self.g.iter().any(|row| row.code == code)
    }

    /// The motion that the line itself names.
    fn motion(&self) -> Option<&'static Row> {
        self.g.iter().copied().find(|row| row.axes == Axes::Motion)
    }
}

impl Judge {
    pub fn new(of: Interpreter) -> Self {
        let motion = if of == Interpreter::LinuxCnc { NO_MOTION } else { RAPID };
        Self {
            of,
            completes_circles: false,
            takes_options: false,
            motion,
            feed: 0.0,
            is_inverse_time: false,
            is_relative: false,
        }
    }

    /// For lines that Annulus rewrites before sending: it adds end points of full circles and changes tools
    /// itself.
    pub fn of_sender(of: Interpreter) -> Self {
        Self { completes_circles: true, takes_options: true, ..Self::new(of) }
    }

    /// Checks a line of `length` characters without spaces and comments.
    pub fn line(&mut self, all: &[(char, f64)], length: usize) -> Result<(), Refused> {
        if length > self.of.longest_line() {
            return refused(code!("gcode.line_too_long"), length.to_string(), 11);
        }
        let words = self.words(all).map_err(|why| self.first_refused(all).unwrap_or(why))?;
        let motion = self.axes(&words)?;
        self.missing(&words, motion)?;
        self.unused(&words, motion)?;
        self.holds(&words);
        Ok(())
    }

    fn words<'w>(&self, all: &'w [(char, f64)]) -> Result<Words<'w>, Refused> {
        let words = Words { all, g: self.codes(all, 'G')?, m: self.codes(all, 'M')? };
        self.repeats(&words)?;
        self.conflicts(&words)?;
        self.values(&words)?;
        Ok(words)
    }

    /// The first reason in the order of the words, in which GRBL looks at them.
    fn first_refused(&self, all: &[(char, f64)]) -> Option<Refused> {
        let lengths = (1..all.len()).filter(|_| self.of == Interpreter::Grbl);
        lengths.filter_map(|length| all.get(..length)).find_map(|first| self.words(first).err())
    }

    fn codes(&self, all: &[(char, f64)], letter: char) -> Result<Vec<&'static Row>, Refused> {
        let mut rows = Vec::new();
        for (_, value) in all.iter().filter(|(name, _)| *name == letter) {
            let read = match self.of {
                Interpreter::Grbl => grbl::code(letter, *value).map(f64::from),
                _ => Ok(value * 100.0),
            };
            let hundredths = match read {
                Ok(hundredths) => hundredths,
                Err(23) => return refused(code!("gcode.not_whole"), format!("{letter}{value}"), 23),
                Err(number) => {
                    return refused(code!("gcode.unknown_word"), format!("{letter}{value}"), number);
                }
            };
            let whole = libm::round(hundredths);
            if libm::fabs(hundredths - whole) > 1e-6 || (letter == 'M' && libm::fmod(whole, 100.0) != 0.0) {
                return refused(code!("gcode.not_whole"), format!("{letter}{value}"), 23);
            }
            let taken = self.takes_options && letter == 'M' && [600.0, 700.0].contains(&whole);
            let of = if taken { Interpreter::Any } else { self.of };
            let is_user_m = letter == 'M' && self.of == Interpreter::LinuxCnc && (1e4..2e4).contains(&whole);
            match find(of, letter, if whole < 0.0 { u32::MAX } else { whole as u32 }) {
                Some(row) => rows.push(row),
                None if self.of == Interpreter::Any || is_user_m => {}
                None if self.of != Interpreter::Grbl && self.has_no_parts(letter, whole) => {
                    return refused(code!("gcode.not_whole"), format!("{letter}{value}"), 23);
                }
                None => return refused(code!("gcode.unknown_word"), format!("{letter}{value}"), 20),
            }
        }
        Ok(rows)
    }

    /// True if a code with decimals is known only without them. Codes that exist with decimals are excluded.
    fn has_no_parts(&self, letter: char, hundredths: f64) -> bool {
        let part = libm::fmod(hundredths, 100.0);
        let base = (hundredths - part).max(0.0) as u32;
        part != 0.0 && !WITH_PARTS.contains(&base) && find(self.of, letter, base).is_some()
    }

    fn repeats(&self, words: &Words<'_>) -> Result<(), Refused> {
        for (at, (letter, _)) in words.all.iter().enumerate() {
            if !['G', 'M'].contains(letter) && words.all[..at].iter().any(|(before, _)| before == letter) {
                return refused(code!("gcode.repeated_word"), letter.to_string(), 25);
            }
        }
        Ok(())
    }

    fn conflicts(&self, words: &Words<'_>) -> Result<(), Refused> {
        let takes = |row: &&&Row| {
            let is_length = self.of.is_grbl() && row.group == 8;
            row.axes != Axes::Free || is_length
        };
        let mut taking = words.g.iter().filter(takes);
        if let (Some(one), Some(other)) = (taking.next(), taking.next()) {
            return refused(code!("gcode.axes_twice"), pair('G', one.code, other.code), 24);
        }
        for (letter, rows) in [('G', &words.g), ('M', &words.m)] {
            for (at, row) in rows.iter().enumerate() {
                if let Some(before) = rows[..at].iter().find(|before| before.group == row.group) {
                    return refused(code!("gcode.same_group"), pair(letter, before.code, row.code), 21);
                }
            }
        }
        Ok(())
    }

    fn values(&self, words: &Words<'_>) -> Result<(), Refused> {
        for (at, &(letter, value)) in words.all.iter().enumerate() {
            let is_late_number = self.of == Interpreter::LinuxCnc && letter == 'N' && at > 0;
            let is_foreign = match self.of {
                Interpreter::Grbl => !"GMFIJKLNPRSTXYZ".contains(letter),
                Interpreter::GrblHal => !"GMDEFHIJKLNPQRSTXYZ".contains(letter),
                Interpreter::LinuxCnc | Interpreter::Any => !letter.is_ascii_alphabetic(),
            };
            if is_foreign || is_late_number {
                return refused(code!("gcode.unknown_word"), format!("{letter}{value}"), 20);
            }
            if "FNPST".contains(letter) && value < 0.0 {
                return refused(code!("gcode.negative"), format!("{letter}{value}"), 4);
            }
            if self.of != Interpreter::Grbl && "TNLH".contains(letter) && libm::trunc(value) != value {
                return refused(code!("gcode.not_whole"), format!("{letter}{value}"), 23);
            }
            if self.of.is_grbl() && letter == 'N' && value > f64::from(LARGEST_LINE) {
                return refused(code!("gcode.too_large"), format!("N{value}"), 27);
            }
            if self.of == Interpreter::Grbl && letter == 'T' && value > f64::from(LARGEST_TOOL) {
                return refused(code!("gcode.too_large"), format!("T{value}"), 38);
            }
        }
        Ok(())
    }

    fn axes(&self, words: &Words<'_>) -> Result<Option<u32>, Refused> {
        let waits = self.of == Interpreter::Any && words.says(DWELL);
        let has_axes = words.any("XYZABCUVW") && !waits;
        if let Some(row) = words.g.iter().find(|row| row.axes == Axes::Needed)
            && !words.any("XYZABCUVW")
        {
            let number = if row.code == TOOL_LENGTH { 37 } else { 26 };
            return refused(code!("gcode.no_axis"), named('G', row.code), number);
        }
        let is_owned = words.g.iter().any(|row| [Axes::Own, Axes::Needed].contains(&row.axes));
        let named_motion = words.motion().map(|row| row.code);
        let after = if words.says(NO_MOTION) { NO_MOTION } else { self.motion };
        let motion = named_motion.unwrap_or(after);
        if words.says(MACHINE) && ![RAPID, LINE].contains(&motion) {
            return refused(code!("gcode.not_rapid_or_line"), "G53", 30);
        }
        let moves_by_centre = !self.of.is_grbl() && ARCS.contains(&motion) && words.any("IJ");
        let is_strict = self.of.is_grbl() && has_axes && motion == NO_MOTION;
        if is_strict || (!is_owned && has_axes && motion == NO_MOTION) {
            return refused(code!("gcode.axes_without_motion"), axes_of(words), 31);
        }
        if self.of == Interpreter::LinuxCnc && words.says(MACHINE) && named_motion.is_none() && !has_axes {
            return refused(code!("gcode.not_rapid_or_line"), "G53", 30);
        }
        let moves = named_motion.is_some() || (!is_owned && (has_axes || moves_by_centre));
        Ok(moves.then_some(motion))
    }

    fn missing(&self, words: &Words<'_>, motion: Option<u32>) -> Result<(), Refused> {
        for row in words.g.iter().chain(&words.m) {
            if let Some(letter) = row.needs.chars().find(|letter| !words.has(*letter)) {
                return refused(code!("gcode.missing_word"), letter, 28);
            }
        }
        if self.of == Interpreter::Grbl && words.says(SET_ZERO) {
            grbl_zero(words)?;
        }
        if self.of == Interpreter::Any && words.says(DWELL) && !words.any("PXUFS") {
            return refused(code!("gcode.missing_word"), 'P', 28);
        }
        if self.of == Interpreter::LinuxCnc {
            if words.m.len() > MOST_M {
                return refused(
                    code!("gcode.same_group"),
                    words.m.iter().map(|row| named('M', row.code)).collect::<Vec<_>>().join(" "),
                    21,
                );
            }
            let waits = words.m.iter().any(|row| row.code == WAIT_FOR_INPUT);
            if waits
                && words.value('L').is_some_and(|how| how != 0.0)
                && words.value('Q').is_none_or(|q| q <= 0.0)
            {
                return refused(code!("gcode.missing_word"), 'Q', 28);
            }
        }
        let Some(motion) = motion else { return Ok(()) };
        if motion != RAPID && self.of != Interpreter::Any {
            let is_inverse = self.is_inverse_time || words.says(INVERSE_TIME);
            let feed = words.value('F').unwrap_or(if is_inverse { 0.0 } else { self.feed });
            if feed == 0.0 {
                return refused(code!("gcode.no_feed"), named('G', motion), 22);
            }
        }
        if self.of != Interpreter::Any && (CYCLES.contains(&motion) || PECKS.contains(&motion)) {
            self.cycle(words, motion)?;
        }
        if (3820..=3850).contains(&motion) && !words.any("XYZ") {
            return refused(code!("gcode.no_axis"), named('G', motion), 26);
        }
        if ARCS.contains(&motion) { self.arc(words, motion) } else { Ok(()) }
    }

    /// True if coordinates are relative (G91) on this line.
    fn is_relative_on(&self, words: &Words<'_>) -> bool {
        words.says(RELATIVE) || self.is_relative && !words.says(ABSOLUTE)
    }

    /// Refuses a drilling cycle that lacks words on its first line, or has bad values.
    fn cycle(&self, words: &Words<'_>, motion: u32) -> Result<(), Refused> {
        let own = if PECKS.contains(&motion) {
            "Q"
        } else if DWELLS.contains(&motion) {
            "P"
        } else {
            ""
        };
        let needed = ["R", "Z", own].concat();
        if let Some(letter) = needed.chars().find(|letter| motion != self.motion && !words.has(*letter)) {
            return refused(code!("gcode.missing_word"), letter, 28);
        }
        for letter in ['Q', 'L'] {
            if let Some(value) = words.value(letter).filter(|value| *value <= 0.0) {
                return refused(code!("gcode.not_positive"), format!("{letter}{value}"), 4);
            }
        }
        match (words.value('R'), words.value('Z')) {
            (Some(back), Some(bottom)) if back < bottom && !self.is_relative_on(words) => {
                refused(code!("gcode.back_below_bottom"), format!("R{back}"), 33)
            }
            _ => Ok(()),
        }
    }

    fn arc(&self, words: &Words<'_>, motion: u32) -> Result<(), Refused> {
        let by_radius = words.has('R');
        let needs_end = (self.of.is_grbl() && !self.completes_circles) || by_radius;
        if needs_end && !words.any("XYZ") {
            return refused(code!("gcode.no_axis"), named('G', motion), 26);
        }
        if needs_end && self.of.is_grbl() && !words.any("XY") {
            return refused(code!("gcode.no_axis"), named('G', motion), 32);
        }
        if !by_radius && !words.any("IJ") {
            return refused(code!("gcode.no_centre"), named('G', motion), 35);
        }
        Ok(())
    }

    fn unused(&self, words: &Words<'_>, motion: Option<u32>) -> Result<(), Refused> {
        let row = motion.and_then(|motion| find(self.of, 'G', motion));
        let arc = motion.is_some_and(|motion| ARCS.contains(&motion));
        let arc_words = match (arc, words.has('R'), self.of) {
            (false, ..) => "",
            (true, true, Interpreter::Grbl) => "R",
            (true, true, _) => "RP",
            (true, false, Interpreter::Grbl) => "IJK",
            (true, false, Interpreter::LinuxCnc) => "IJP",
            (true, false, _) => "IJKP",
        };
        let takes_axes = motion.is_some() || words.g.iter().any(|row| row.axes != Axes::Free);
        let named_codes = words.g.iter().chain(&words.m).map(|row| row.uses);
        // An unknown controller may have M words and tool offsets that use any value word.
        let any_m = words.all.iter().filter(|(letter, _)| *letter == 'M').count() > words.m.len();
        let free = match self.of {
            Interpreter::Any if any_m => "PQLDHOCR",
            Interpreter::Any => "DHOC",
            Interpreter::LinuxCnc if any_m => "PQ",
            _ => "",
        };
        let used: Vec<&str> =
            named_codes.chain(row.map(|row| row.uses)).chain(["GMFNST", arc_words, free]).collect();
        let is_axis = |letter: char| takes_axes && "XYZABCUVW".contains(letter);
        let unused = words
            .all
            .iter()
            .find(|(letter, _)| !is_axis(*letter) && !used.iter().any(|letters| letters.contains(*letter)));
        match unused {
            Some((letter, value)) => refused(code!("gcode.unused_word"), format!("{letter}{value}"), 36),
            None => Ok(()),
        }
    }

    fn holds(&mut self, words: &Words<'_>) {
        if let Some(row) = words.motion() {
            self.motion = row.code;
        } else if words.says(NO_MOTION) {
            self.motion = NO_MOTION;
        }
        if let Some(row) = words.g.iter().find(|row| row.group == FEED_MODE) {
            let inverse = row.code == INVERSE_TIME;
            // The feed of one mode isn't a feed of the other.
            if inverse != self.is_inverse_time || self.of == Interpreter::LinuxCnc {
                self.feed = 0.0;
            }
            self.is_inverse_time = inverse;
        }
        self.feed = words.value('F').unwrap_or(self.feed);
        self.is_relative = self.is_relative_on(words);
    }
}

/// Refuses a G10 of which GRBL knows neither the work zero nor the way to set it. P alone or L alone is enough for it.
fn grbl_zero(words: &Words<'_>) -> Result<(), Refused> {
    if !words.any("PL") {
        return refused(code!("gcode.missing_word"), 'P', 28);
    }
    if let Some(zero) = words.value('P').filter(|zero| libm::trunc(*zero) > MOST_ZEROS) {
        return refused(code!("gcode.unknown_word"), format!("P{zero}"), 29);
    }
    let how = libm::trunc(words.value('L').unwrap_or(0.0));
    match words.value('R') {
        _ if how == 20.0 => Ok(()),
        None if how == 2.0 => Ok(()),
        Some(turn) if how == 2.0 => refused(code!("gcode.unknown_word"), format!("R{turn}"), 20),
        _ => refused(code!("gcode.unknown_word"), format!("L{how}"), 20),
    }
}

/// A code as it is written: G38.2.
fn named(letter: char, code: u32) -> String {
    let number = f64::from(code) / 100.0;
    format!("{letter}{number}")
}

fn pair(letter: char, one: u32, other: u32) -> String {
    format!("{} {}", named(letter, one), named(letter, other))
}

fn axes_of(words: &Words<'_>) -> String {
    words.all.iter().map(|(letter, _)| *letter).filter(|letter| "XYZABCUVW".contains(*letter)).collect()
}
