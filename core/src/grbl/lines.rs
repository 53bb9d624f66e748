//! Turns sections into lines for the controller.
//!
//! ```text
//!  entry   G90 G0 Z safe ─ check ─ G90 G0 X Y  absolute: from any position the user left the head at
//!  work    G91 G1 Z-2.2 F100 · G91 G0 Z3.7     relative: a corrupted character leaves an offset that the
//!                                              next report shows; the next absolute move would hide it
//! ```
//!
//! The controller adds relative moves in single precision. This file computes the same sum and writes each
//! move as the difference to it. So the sum is never off by more than half the last digit.

use super::routine::{Bow, Course, RoutineAction, RoutineMove, Section, Spindle, TipPlace};
use crate::units::Length;
use std::fmt::Write;

/// Longest line sent, without its line ending: every member of the family accepts this length.
#[cfg(test)]
pub(super) const LONGEST_LINE: usize = 70;
/// Height tolerance, mm: the last digit of a report, and that of the zero.
const SAME_HEIGHT_MM: f64 = 0.002;
const DECIMALS: usize = 4;

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinePath {
    pub from_mm: [f64; 3],
    pub to_mm: [f64; 3],
    /// The arc in XY, if the path is one.
    pub bow: Option<Bow>,
    /// `None` for rapids.
    pub feed_mm_per_min: Option<f64>,
}

impl LinePath {
    /// Distance of `place_mm` from the path.
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

/// A line for the controller, without its line ending.
#[derive(Clone, Debug, PartialEq)]
pub struct WireLine {
    pub text: String,
    pub piece: Option<LinePath>,
    /// Line of the file; 0 for lines that the engine adds.
    pub source: u32,
}

/// Modal state of the controller after the lines sent: the sum of its relative moves and the words in force.
#[derive(Clone, Debug, Default)]
pub struct WordsInForce {
    sum: [f32; 3],
    pub feed_mm_per_min: Option<f64>,
    pub spindle: Spindle,
    /// Mist and flood in force.
    pub coolant: [bool; 2],
}

impl WordsInForce {
    /// The position that the controller has computed, mm.
    pub fn at(&self) -> [f64; 3] {
        self.sum.map(f64::from)
    }

    /// An absolute move with this text set the axis.
    pub fn stands(&mut self, axis: usize, text: &str) {
        self.sum[axis] = single(text);
    }

    /// State at this position, before any line.
    pub fn standing(place_mm: [f64; 3]) -> Self {
        Self { sum: place_mm.map(|value| single(&number(value))), ..Self::default() }
    }

    /// The modal words that every job relies on.
    pub fn words(&mut self) -> Vec<WireLine> {
        (self.spindle, self.coolant) = (Spindle::Off, [false; 2]);
        ["G21G17G90G94", "G54", "M5M9"].into_iter().map(|text| line(text.to_owned(), None, 0)).collect()
    }

    /// Rises to `safe`, or to the entry of `section` if that is higher; an absolute move. A tip above that
    /// height stays there: it descends only after it has reached the entry ([`Self::over`]).
    pub fn rise(&mut self, section: &Section, safe: Length) -> Vec<WireLine> {
        if self.is_above(section, safe) { Vec::new() } else { vec![self.goes_to_height(section, safe)] }
    }

    /// True if the tip is higher than it would rise.
    fn is_above(&self, section: &Section, safe: Length) -> bool {
        self.at()[2] > safe.max(section.entry[2]).mm() + SAME_HEIGHT_MM
    }

    fn goes_to_height(&mut self, section: &Section, safe: Length) -> WireLine {
        let high = number(safe.max(section.entry[2]).mm());
        let before = self.at();
        self.stands(2, &high);
        line(format!("G90G0Z{high}"), Some(rapid(before, self.at())), 0)
    }

    /// Moves over the entry of `section`, then down to `safe` if the tip was higher and the section cuts. At
    /// a tool change the length of the tool may be unknown, so it stays up. Then sets spindle and coolant,
    /// and waits `spin_up_s` for the spindle.
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

pub(super) fn line(text: String, piece: Option<LinePath>, source: u32) -> WireLine {
    WireLine { text, piece, source }
}

/// The shortest form with at most four decimals.
pub(super) fn number(value: f64) -> String {
    let mut text = format!("{value:.DECIMALS$}");
    if text.contains('.') {
        text.truncate(text.trim_end_matches('0').trim_end_matches('.').len());
    }
    if text == "-0" { "0".to_owned() } else { text }
}

/// A number as an 8-bit controller parses it: digits as an integer, then tenths in single precision.
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
    fn relative_words_never_drift() {
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
            // A controller that parses exactly differs by no more than its precision.
            assert!((0..3).all(|axis| (f64::from(sum[axis]) - pen.at()[axis]).abs() < 0.02));
        }
    }

    #[test]
    fn distance_to_an_arc_counts_only_its_own_side() {
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
    fn descent_starts_only_above_the_target() {
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
