//! Sections in the words that go over the wire.
//!
//! ```text
//!  entry   G90 G0 Z safe ─ look ─ G90 G0 X Y   absolute: from wherever a person left the head
//!  work    G91 G1 Z-2.2 F100 · G91 G0 Z3.7     relative: a character that was changed on the way leaves an offset behind that the
//!                                              next report shows; said absolutely, the next line would hide it
//! ```
//!
//! The controller adds relative moves in single precision. The same sum is made here, and every word is the difference to it, so that
//! the sum never strays further than half of the last digit.
//!
//! Comes in: sections. Goes out: lines with the path that each must follow. mm in flight. Does not know buffers.

use super::routine::{Bow, Course, RoutineAction, RoutineMove, Section, Spindle, TipPlace};
use crate::units::Length;
use std::fmt::Write;

/// Longest line that is sent, its end apart: every member of the family takes so much.
#[cfg(test)]
pub(super) const LONGEST_LINE: usize = 70;
/// What stands higher by less than this stands as high, mm: the last digit of a report, and that of the zero.
const SAME_HEIGHT_MM: f64 = 0.002;
/// Digits behind the point.
const DECIMALS: usize = 4;

/// The path of one line, mm in work coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinePath {
    /// Where it begins.
    pub from_mm: [f64; 3],
    /// Where it ends.
    pub to_mm: [f64; 3],
    /// The arc in the plane, if it is one.
    pub bow: Option<Bow>,
    /// Feed in mm/min; none for rapids.
    pub feed_mm_per_min: Option<f64>,
}

impl LinePath {
    /// How far `place_mm` is from it.
    pub fn distance(&self, place_mm: [f64; 3]) -> f64 {
        let Some(bow) = self.bow else { return to_line(self.from_mm, self.to_mm, place_mm) };
        let (x, y) = (place_mm[0] - bow.centre_mm[0], place_mm[1] - bow.centre_mm[1]);
        let turn = bow.turn_to(libm::atan2(y, x));
        let sweep = libm::fabs(bow.sweep_rad);
        let rise = self.to_mm[2] - self.from_mm[2];
        let at = |t: f64| {
            let [x, y] = bow.at(t);
            distance([x, y, self.from_mm[2] + rise * t], place_mm)
        };
        let ends = at(0.0).min(at(1.0));
        if turn > sweep { ends } else { at(turn / sweep.max(1e-12)).min(ends) }
    }
}

pub(super) fn distance(a_mm: [f64; 3], b_mm: [f64; 3]) -> f64 {
    libm::sqrt((0..3).map(|axis| (a_mm[axis] - b_mm[axis]) * (a_mm[axis] - b_mm[axis])).sum())
}

fn to_line(from: [f64; 3], to: [f64; 3], place: [f64; 3]) -> f64 {
    let way: [f64; 3] = core::array::from_fn(|axis| to[axis] - from[axis]);
    let length: f64 = way.iter().map(|part| part * part).sum();
    let along: f64 = (0..3).map(|axis| (place[axis] - from[axis]) * way[axis]).sum();
    let t = if length > 0.0 { (along / length).clamp(0.0, 1.0) } else { 0.0 };
    distance(core::array::from_fn(|axis| from[axis] + way[axis] * t), place)
}

/// A line for the wire, without its end.
#[derive(Clone, Debug, PartialEq)]
pub struct WireLine {
    /// Its text.
    pub text: String,
    /// The path that it makes, if it moves.
    pub piece: Option<LinePath>,
    /// Line of the file that it comes from; 0 for those that the engine adds.
    pub source: u32,
}

/// What the controller is known to hold: where the sum of its relative moves stands, and the words in force.
#[derive(Clone, Debug, Default)]
pub struct WordsInForce {
    sum: [f32; 3],
    /// Feed in force.
    pub feed_mm_per_min: Option<f64>,
    /// Spindle in force.
    pub spindle: Spindle,
    /// Mist and flood in force.
    pub coolant: [bool; 2],
}

impl WordsInForce {
    /// Where the controller counts itself, mm.
    pub fn at(&self) -> [f64; 3] {
        self.sum.map(f64::from)
    }

    /// It stands here: as an absolute move of this text brought it there.
    pub fn stands(&mut self, axis: usize, text: &str) {
        self.sum[axis] = single(text);
    }

    /// One that stands at this place, with nothing said yet.
    pub fn standing(place_mm: [f64; 3]) -> Self {
        Self { sum: place_mm.map(|value| single(&number(value))), ..Self::default() }
    }

    /// The words that everything else goes by.
    pub fn words(&mut self) -> Vec<WireLine> {
        (self.spindle, self.coolant) = (Spindle::Off, [false; 2]);
        ["G21G17G90G94", "G54", "M5M9"].into_iter().map(|text| line(text.to_owned(), None, 0)).collect()
    }

    /// Rises to `safe`, or to the entry of `section` where that is higher, absolutely. From above that it goes nowhere: a tip that somebody
    /// raised comes down over its place, not where it stands ([`Self::over`]).
    pub fn rise(&mut self, section: &Section, safe: Length) -> Vec<WireLine> {
        if self.is_above(section, safe) { Vec::new() } else { vec![self.goes_to_height(section, safe)] }
    }

    /// Whether it stands higher than it would rise.
    fn is_above(&self, section: &Section, safe: Length) -> bool {
        self.at()[2] > safe.max(section.entry[2]).mm() + SAME_HEIGHT_MM
    }

    fn goes_to_height(&mut self, section: &Section, safe: Length) -> WireLine {
        let high = number(safe.max(section.entry[2]).mm());
        let before = self.at();
        self.stands(2, &high);
        line(format!("G90G0Z{high}"), Some(rapid(before, self.at())), 0)
    }

    /// Goes over the entry of `section`, absolutely, and down to `safe` there where it stood above and cuts next: where tools are changed
    /// the length of the bit may not be known. Then spindle and coolant as it wants them, with so many seconds to come up to speed.
    pub fn over(&mut self, section: &Section, safe: Length, spin_up_s: f64) -> Vec<WireLine> {
        let before = self.at();
        let (x, y) = (number(section.entry[0].mm()), number(section.entry[1].mm()));
        self.stands(0, &x);
        self.stands(1, &y);
        let mut lines = vec![line(format!("G90G0X{x}Y{y}"), Some(rapid(before, self.at())), 0)];
        if section.cuts() && self.is_above(section, safe) {
            lines.push(self.goes_to_height(section, safe));
        }
        let turns = section.cuts() && section.spindle != Spindle::Off;
        if turns && self.spindle != section.spindle {
            lines.push(self.turn(section.spindle));
            lines.push(line(format!("G4P{}", number(spin_up_s.max(0.0))), None, 0));
        }
        if section.cuts() && section.coolant != self.coolant {
            lines.extend(self.cool(section.coolant));
        }
        lines
    }

    /// The spindle, switched.
    pub fn turn(&mut self, to: Spindle) -> WireLine {
        self.spindle = to;
        let text = match to {
            Spindle::Off => "M5".to_owned(),
            Spindle::On(speed) => format!("M3S{}", number(speed)),
            Spindle::Back(speed) => format!("M4S{}", number(speed)),
        };
        line(text, None, 0)
    }

    fn cool(&mut self, [mist, flood]: [bool; 2]) -> Vec<WireLine> {
        let off = (self.coolant[0] && !mist) || (self.coolant[1] && !flood);
        self.coolant = [mist, flood];
        let words = [(off, "M9"), (mist, "M7"), (flood, "M8")];
        words.into_iter().filter(|(on, _)| *on).map(|(_, word)| line(word.to_owned(), None, 0)).collect()
    }

    /// An action.
    pub fn act(&mut self, action: &RoutineAction) -> Vec<WireLine> {
        match action {
            RoutineAction::Go(step) => self.go(step).into_iter().collect(),
            RoutineAction::Spindle { to, line } => vec![WireLine { source: *line, ..self.turn(*to) }],
            RoutineAction::Wait { seconds, line: source } => {
                vec![line(format!("G4P{}", number(*seconds)), None, *source)]
            }
            RoutineAction::Coolant { mist, flood, line } => {
                let lines = self.cool([*mist, *flood]);
                lines.into_iter().map(|switched| WireLine { source: *line, ..switched }).collect()
            }
        }
    }

    fn go(&mut self, step: &RoutineMove) -> Option<WireLine> {
        let from = self.at();
        let arc = matches!(step.course, Course::Arc { .. });
        let mut text = match step.course {
            Course::Rapid => "G91G0",
            Course::Line => "G91G1",
            Course::Arc { ccw: false, .. } => "G91G2",
            Course::Arc { ccw: true, .. } => "G91G3",
        }
        .to_owned();
        let mut moves = arc;
        for (axis, letter) in ['X', 'Y', 'Z'].into_iter().enumerate() {
            let word = number(step.to[axis].mm() - from[axis]);
            if word != "0" || (arc && axis < 2) {
                let _ = write!(text, "{letter}{word}");
                self.sum[axis] += single(&word);
                moves = true;
            }
        }
        if let Course::Arc { centre, .. } = step.course {
            for (axis, letter) in ['I', 'J'].into_iter().enumerate() {
                let word = number(centre[axis].mm() - from[axis]);
                let _ = write!(text, "{letter}{word}");
            }
        }
        if !moves {
            return None;
        }
        let feeds = step.course != Course::Rapid;
        if feeds && self.feed_mm_per_min != Some(step.feed_mm_per_min) {
            self.feed_mm_per_min = Some(step.feed_mm_per_min);
            let _ = write!(text, "F{}", number(step.feed_mm_per_min));
        }
        let bow = bow_of(from, step);
        let feed = feeds.then_some(step.feed_mm_per_min);
        Some(line(
            text,
            Some(LinePath { from_mm: from, to_mm: self.at(), bow, feed_mm_per_min: feed }),
            step.line,
        ))
    }
}

fn bow_of(from: [f64; 3], step: &RoutineMove) -> Option<Bow> {
    let Course::Arc { centre, ccw } = step.course else { return None };
    let from: TipPlace = from.map(Length::from_mm);
    Some(Bow::of(from, step.to, centre, ccw))
}

fn rapid(from: [f64; 3], to: [f64; 3]) -> LinePath {
    LinePath { from_mm: from, to_mm: to, bow: None, feed_mm_per_min: None }
}

/// A line without a source.
pub(super) fn line(text: String, piece: Option<LinePath>, source: u32) -> WireLine {
    WireLine { text, piece, source }
}

/// A number as short as it can be said with four digits behind the point.
pub(super) fn number(value: f64) -> String {
    let mut text = format!("{value:.DECIMALS$}");
    if text.contains('.') {
        text.truncate(text.trim_end_matches('0').trim_end_matches('.').len());
    }
    if text == "-0" { "0".to_owned() } else { text }
}

/// A number as an 8-bit controller reads it: digits as a whole number, then tenths in single precision.
fn single(text: &str) -> f32 {
    let (negative, digits) = text.strip_prefix('-').map_or((false, text), |rest| (true, rest));
    let whole: u32 = digits
        .bytes()
        .filter(u8::is_ascii_digit)
        .fold(0_u32, |sum, digit| sum.wrapping_mul(10).wrapping_add(u32::from(digit - b'0')));
    let mut behind = digits.split_once('.').map_or(0, |(_, rest)| rest.len());
    let mut value = whole as f32;
    while behind >= 2 {
        value *= 0.01_f32;
        behind -= 2;
    }
    if behind > 0 {
        value *= 0.1_f32;
    }
    if negative { -value } else { value }
}

#[cfg(test)]
mod tests {
    use super::super::routine::SectionKind;
    use super::*;
    use crate::chance::Chance;

    #[test]
    fn relative_words_never_stray() {
        let mut chance = Chance::new(11);
        let mut pen = WordsInForce::default();
        let mut sum = [0.0_f32; 3];
        for _ in 0..20_000 {
            let to: TipPlace =
                core::array::from_fn(|_| Length::from_nm(chance.below(200_000_000) as i64 - 100_000_000));
            let step = RoutineMove { course: Course::Line, to, feed_mm_per_min: 100.0, line: 1 };
            let Some(line) = pen.go(&step) else { continue };
            assert!(line.text.len() <= LONGEST_LINE, "{}", line.text);
            for (axis, letter) in ['X', 'Y', 'Z'].into_iter().enumerate() {
                let Some((_, rest)) = line.text.split_once(letter) else { continue };
                let word: String = rest.chars().take_while(|c| !c.is_ascii_uppercase()).collect();
                sum[axis] += word.parse::<f32>().unwrap();
            }
            for (at, to) in pen.at().into_iter().zip(to) {
                assert!((at - to.mm()).abs() < 0.000_08, "{at} {to:?}");
            }
            // A controller that reads numbers exactly strays by no more than its precision.
            assert!((0..3).all(|axis| (f64::from(sum[axis]) - pen.at()[axis]).abs() < 0.02));
        }
    }

    #[test]
    fn a_place_on_the_arc_is_near_and_one_across_is_not() {
        let place = |x: f64, y: f64, z: f64| [x, y, z].map(Length::from_mm);
        let centre = [Length::ZERO; 2];
        let mut pen = WordsInForce::default();
        pen.stands(0, "10");
        let course = Course::Arc { centre, ccw: true };
        let step = RoutineMove { course, to: place(0.0, 10.0, -1.0), feed_mm_per_min: 60.0, line: 3 };
        let line = pen.go(&step).unwrap();
        assert_eq!(line.text, "G91G3X-10Y10Z-1I-10J0F60");
        let piece = line.piece.unwrap();
        let half = 10.0 * libm::sqrt(0.5);
        for (at, expected) in [
            ([half, half, -0.5], 0.0),
            ([10.0, 0.0, 0.0], 0.0),
            ([half, half, -1.5], 1.0),
            ([-10.0, 0.0, -1.0], 14.142),
        ] {
            assert!((piece.distance(at) - expected).abs() < 0.001, "{at:?} {}", piece.distance(at));
        }
    }

    #[test]
    fn from_above_nothing_goes_down_before_its_place_is_reached() {
        let entry = [3.0, 4.0, 2.0].map(Length::from_mm);
        let section = Section {
            kind: SectionKind::Hole(1),
            line: 1,
            entry,
            spindle: Spindle::Off,
            coolant: [false; 2],
            approach: 0,
            actions: Vec::new(),
        };
        for (from_mm, expected) in [
            (-1.5, vec!["G90G0Z8", "G90G0X3Y4"]),
            (8.0, vec!["G90G0Z8", "G90G0X3Y4"]),
            (40.0, vec!["G90G0X3Y4", "G90G0Z8"]),
        ] {
            let mut pen = WordsInForce::standing([20.0, 30.0, from_mm]);
            let safe = Length::from_mm(8.0);
            let up = pen.rise(&section, safe);
            let lines: Vec<WireLine> = up.into_iter().chain(pen.over(&section, safe, 0.0)).collect();
            let texts: Vec<&str> = lines.iter().map(|line| line.text.as_str()).collect();
            assert_eq!(texts, expected, "from {from_mm}");
            assert_eq!(pen.at(), [3.0, 4.0, 8.0], "from {from_mm}");
        }
    }

    #[test]
    fn numbers_are_short() {
        for (value, text) in [
            (0.0, "0"),
            (-0.00001, "0"),
            (1.0, "1"),
            (-2.5, "-2.5"),
            (0.12345, "0.1235"),
            (100.0, "100"),
            (1200.0, "1200"),
        ] {
            assert_eq!(number(value), text);
        }
    }
}
