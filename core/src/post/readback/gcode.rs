//! G-code: G0 to G3, G17, G20 and G21 (G70, G71), G90 and G91, drilling cycles, tools, spindle. What would change places and is not
//! followed is refused; what only tells the controller how to drive is passed over.
//!
//! Comes in: text. Goes out: moves for the hand, in mm. Does not know which controller it was written for: where they differ (the
//! centre of an arc) the file says which it is, or its arcs do.

use super::cycles::Cycle;
use super::hand::{Hand, Tip};
use super::words::{self, Word};
use crate::diagnostic::Diagnostic;

/// As high as a machine goes, in mm: where a move to its reference point ends.
const TOP_MM: f64 = 100.0;
/// Codes, in tenths, that change no place: waiting, the plane, offsets of tools, modes of driving.
const PASSED: &[u32] =
    &[40, 80, 90, 170, 400, 430, 490, 600, 601, 602, 610, 640, 641, 642, 670, 690, 940, 960, 970, 971];
/// The zero that holds where none is named: G54.
const FIRST_ZERO: u32 = 540;
/// Axes whose places are followed.
const AXES: [char; 3] = ['X', 'Y', 'Z'];

/// How moves go.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Motion {
    Rapid,
    Line,
    Arc { ccw: bool },
    Drill,
}

/// What holds from line to line.
struct State {
    motion: Motion,
    /// Millimetres in one unit.
    scale: f64,
    absolute: bool,
    centre_absolute: bool,
    cycle: Cycle,
    /// A cycle comes back to the height before it (G98).
    back: bool,
    tool: Option<u32>,
    /// The zero that places count from, G54 to G59 in tenths, once one is named or used.
    zero: Option<u32>,
    /// X, Y, Z of which nobody knows where they are since the machine went to a place of its own.
    unknown: [bool; 3],
    /// Some controllers change with the tool word alone: those that never say M6.
    changes_with_t: bool,
}

/// The words of a line by their letters, the last of each.
struct Line<'w> {
    words: &'w [Word],
}

impl Line<'_> {
    fn letter(&self, name: char) -> Option<f64> {
        self.words.iter().rev().find_map(|word| match word {
            Word::Letter(letter, number) if *letter == name => Some(*number),
            Word::Named(known, number) if known.chars().eq([name]) => Some(*number),
            _ => None,
        })
    }

    fn names(&self, name: char) -> bool {
        self.letter(name).is_some()
    }

    fn waits(&self) -> bool {
        self.codes('G').any(|code| code == 4.0)
    }

    fn codes(&self, name: char) -> impl Iterator<Item = f64> {
        self.words.iter().filter_map(move |word| match word {
            Word::Letter(letter, number) if *letter == name => Some(*number),
            _ => None,
        })
    }

    fn named(&self, name: &str) -> Option<f64> {
        self.words.iter().find_map(|word| match word {
            Word::Named(known, number) if known == name => Some(*number),
            _ => None,
        })
    }
}

/// Reads the file.
pub(super) fn read(hand: &mut Hand, text: &str) -> Result<(), Diagnostic> {
    let changes_with_t = !text.lines().any(|line| {
        let bare = words::bare(line);
        words::of(&bare).is_ok_and(|words| words.contains(&Word::Letter('M', 6.0)))
    });
    let mut state = State {
        motion: Motion::Rapid,
        scale: 1.0,
        absolute: true,
        centre_absolute: false,
        cycle: Cycle::default(),
        back: true,
        tool: None,
        zero: None,
        unknown: [false; 3],
        changes_with_t,
    };
    for (number, line) in (1..).zip(text.lines()) {
        hand.at_line(number)?;
        for comment in words::comments(line) {
            hand.comment(&comment);
        }
        let bare = words::bare(line);
        let bare = bare.trim();
        if bare.is_empty() || bare.starts_with('%') || is_name(bare) {
            continue;
        }
        let words = words::of(bare).map_err(|column| {
            let mut why = hand.refuse("readback.unknown_word", bare);
            why.place.iter_mut().for_each(|place| place.column = column as u32);
            why
        })?;
        if state.line(hand, &Line { words: &words })? {
            break;
        }
    }
    Ok(())
}

/// Whether a line only names the program: `O0001`.
fn is_name(bare: &str) -> bool {
    bare.strip_prefix(['O', ':']).is_some_and(|rest| rest.trim().chars().all(|c| c.is_ascii_digit()))
}

impl State {
    /// Follows one line; whether it is the last.
    fn line(&mut self, hand: &mut Hand, line: &Line<'_>) -> Result<bool, Diagnostic> {
        let strange = line.words.iter().find_map(|word| match word {
            Word::Named(name, _) if name.len() > 1 && name != "CR" => Some(name),
            _ => None,
        });
        if let Some(name) = strange {
            return Err(hand.refuse("readback.unknown_word", name));
        }
        let mut reference = None;
        let mut starts_cycle = false;
        for code in line.codes('G') {
            let tenths = libm::round(code * 10.0) as u32;
            match tenths {
                0 => self.motion = Motion::Rapid,
                10 => self.motion = Motion::Line,
                20 | 30 => self.motion = Motion::Arc { ccw: tenths == 30 },
                200 | 700 => self.scale = 25.4,
                210 | 710 => self.scale = 1.0,
                280 | 300 | 530 => reference = Some(tenths),
                540 | 550 | 560 | 570 | 580 | 590 => self.zero_at(hand, tenths)?,
                730 | 810 | 820 | 830 | 850 | 860 | 890 => {
                    (self.motion, starts_cycle) = (Motion::Drill, true);
                }
                800 => self.motion = Motion::Rapid,
                900 => self.absolute = true,
                910 => self.absolute = false,
                901 => self.centre_absolute = true,
                911 => self.centre_absolute = false,
                980 | 990 => self.back = tenths == 980,
                _ if PASSED.contains(&tenths) => {}
                _ => return Err(hand.refuse("readback.changes_place", format!("G{code}"))),
            }
        }
        self.tools(hand, line)?;
        let called = line.words.iter().find_map(|word| match word {
            Word::Call(name, numbers) => Some((name, numbers)),
            _ => None,
        });
        if let Some((name, numbers)) = called {
            self.call(hand, name, numbers)?;
        } else if let Some(tenths) = reference {
            self.reference(hand, line, tenths == 530)?;
        } else if !line.waits() {
            self.go(hand, line, starts_cycle)?;
        } else if let Some(axis) = ['Y', 'Z'].into_iter().find(|axis| line.names(*axis)) {
            return Err(hand.refuse("readback.changes_place", axis));
        }
        Ok(line.codes('M').any(|code| matches!(code as u32, 2 | 30)))
    }

    /// Places count from this zero: refused once they counted from another.
    fn zero_at(&mut self, hand: &Hand, tenths: u32) -> Result<(), Diagnostic> {
        if *self.zero.get_or_insert(tenths) == tenths {
            return Ok(());
        }
        Err(hand.refuse("readback.changes_place", format!("G{}", tenths / 10)))
    }

    fn tools(&mut self, hand: &mut Hand, line: &Line<'_>) -> Result<(), Diagnostic> {
        if let Some(rpm) = line.letter('S').filter(|_| !line.waits()) {
            hand.speed(rpm);
        }
        if let Some(tool) = line.letter('T') {
            self.tool = Some(tool as u32);
        }
        let changes =
            line.codes('M').any(|code| code == 6.0) || (self.changes_with_t && line.letter('T').is_some());
        if let Some(tool) = self.tool.filter(|tool| changes && *tool > 0) {
            hand.take(tool);
        }
        for code in line.codes('M') {
            match code as u32 {
                3 | 4 => hand.turn(true),
                5 => hand.turn(false),
                97..=99 => return Err(hand.refuse("readback.changes_place", format!("M{code}"))),
                _ => {}
            }
        }
        if let Some(axis) = ['A', 'B', 'C', 'U', 'V', 'W'].into_iter().find(|axis| line.names(*axis)) {
            return Err(hand.refuse("readback.changes_place", axis));
        }
        Ok(())
    }

    fn call(&mut self, hand: &mut Hand, name: &str, numbers: &[Option<f64>]) -> Result<(), Diagnostic> {
        match name {
            "CYCLE81" | "CYCLE82" | "CYCLE83" => {
                let cycle = Cycle::called(numbers, self.scale)
                    .ok_or_else(|| hand.refuse("readback.unknown_word", name))?;
                let at = (hand.tip.x, hand.tip.y);
                self.zero.get_or_insert(FIRST_ZERO);
                self.known(hand, [true, true, false])?;
                self.unknown = [false; 3];
                cycle.drill(hand, at)
            }
            "MSG" => Ok(()),
            _ => Err(hand.refuse("readback.unknown_word", name)),
        }
    }

    /// To the machine's own reference point, by the place that is named, or in the machine's coordinates: up is all that is known
    /// of that.
    fn reference(&mut self, hand: &mut Hand, line: &Line<'_>, own_places: bool) -> Result<(), Diagnostic> {
        let mut goes = AXES.map(|axis| line.names(axis));
        if goes == [false; 3] {
            if own_places {
                return Ok(());
            }
            goes = [true; 3];
        }
        if !own_places {
            let by = self.to(hand, line);
            if by != hand.tip {
                self.zero.get_or_insert(FIRST_ZERO);
                hand.line_to(by, true)?;
            }
        }
        if (goes[0] || goes[1]) && hand.tip.z < 0.0 {
            return Err(hand.refuse("readback.changes_place", if own_places { "G53" } else { "G28" }));
        }
        if goes[2] {
            hand.line_to(Tip { z: TOP_MM, ..hand.tip }, true)?;
        }
        // The reference point is up; a height in the machine's coordinates may be anywhere.
        let [x, y, z] = self.unknown;
        self.unknown = [x || goes[0], y || goes[1], if goes[2] { own_places } else { z }];
        Ok(())
    }

    /// Axes that are named where places count from zero are known again.
    fn names_again(&mut self, line: &Line<'_>) {
        for (unknown, axis) in self.unknown.iter_mut().zip(AXES) {
            *unknown &= !(self.absolute && line.names(axis));
        }
    }

    /// Refuses to cut where one of these axes is not known.
    fn known(&self, hand: &Hand, needed: [bool; 3]) -> Result<(), Diagnostic> {
        let open =
            self.unknown.into_iter().zip(needed).zip(AXES).find(|((open, needed), _)| *open && *needed);
        open.map_or(Ok(()), |(_, axis)| Err(hand.refuse("readback.place_unknown", axis)))
    }

    /// Where an axis goes.
    fn axis(&self, line: &Line<'_>, name: char, before: f64) -> f64 {
        match line.letter(name).map(|value| value * self.scale) {
            Some(value) if self.absolute => value,
            Some(value) => before + value,
            None => before,
        }
    }

    /// The place that a line names.
    fn to(&self, hand: &Hand, line: &Line<'_>) -> Tip {
        Tip {
            x: self.axis(line, 'X', hand.tip.x),
            y: self.axis(line, 'Y', hand.tip.y),
            z: self.axis(line, 'Z', hand.tip.z),
        }
    }

    fn go(&mut self, hand: &mut Hand, line: &Line<'_>, starts_cycle: bool) -> Result<(), Diagnostic> {
        if self.motion == Motion::Drill {
            return self.cycle(hand, line, starts_cycle);
        }
        let turns = matches!(self.motion, Motion::Arc { .. });
        let arc =
            turns && (['I', 'J', 'R'].into_iter().any(|name| line.names(name)) || line.named("CR").is_some());
        if !AXES.into_iter().any(|axis| line.names(axis)) && !arc {
            return Ok(());
        }
        let (from, to) = (hand.tip, self.to(hand, line));
        self.zero.get_or_insert(FIRST_ZERO);
        if line.letter('L').is_some_and(|times| times != 1.0) {
            return Err(hand.refuse("readback.changes_place", "L"));
        }
        if turns && line.letter('P').is_some_and(|turns| turns > 1.0) {
            return Err(hand.refuse("readback.changes_place", "P"));
        }
        self.names_again(line);
        if from.z < 0.0 || to.z < 0.0 {
            self.known(hand, [true; 3])?;
        } else if self.motion != Motion::Rapid {
            self.known(hand, [false, false, true])?;
        }
        match self.motion {
            Motion::Rapid => hand.line_to(to, true),
            Motion::Line | Motion::Drill => hand.line_to(to, false),
            Motion::Arc { ccw } => {
                let radius = line.letter('R').or_else(|| line.named("CR")).map(|radius| radius * self.scale);
                let centre = match radius {
                    Some(radius) => by_radius(from, to, radius, ccw)
                        .ok_or_else(|| hand.refuse("readback.no_arc", radius))?,
                    None => self.centre(line, from),
                };
                hand.arc_to(to, centre, ccw)
            }
        }
    }

    fn centre(&self, line: &Line<'_>, from: Tip) -> (f64, f64) {
        let offset = |name: char| line.letter(name).map(|value| value * self.scale);
        if self.centre_absolute {
            return (offset('I').unwrap_or(from.x), offset('J').unwrap_or(from.y));
        }
        (from.x + offset('I').unwrap_or(0.0), from.y + offset('J').unwrap_or(0.0))
    }

    fn cycle(&mut self, hand: &mut Hand, line: &Line<'_>, starts: bool) -> Result<(), Diagnostic> {
        self.zero.get_or_insert(FIRST_ZERO);
        if starts {
            self.cycle.before_mm = hand.tip.z;
        }
        self.cycle.back = self.back;
        let own = |name: char| line.letter(name).map(|value| value * self.scale);
        // Counted from here, R counts from the height before the cycle and Z from R.
        if let Some(reference) = own('R') {
            self.cycle.reference_mm =
                if self.absolute { reference } else { self.cycle.before_mm + reference };
        }
        if let Some(bottom) = own('Z') {
            self.cycle.bottom_mm = if self.absolute { bottom } else { self.cycle.reference_mm + bottom };
        }
        self.names_again(line);
        let times = ['L', 'K'].into_iter().find_map(|name| line.letter(name)).unwrap_or(1.0);
        if line.letter('X').is_none() && line.letter('Y').is_none() && !starts || times < 1.0 {
            return Ok(());
        }
        self.known(hand, [true, true, !self.absolute])?;
        self.unknown = [false; 3];
        let cycle = self.cycle;
        for _ in 0..times as u32 {
            let at = (self.axis(line, 'X', hand.tip.x), self.axis(line, 'Y', hand.tip.y));
            cycle.drill(hand, at)?;
        }
        Ok(())
    }
}

/// The centre of an arc by its radius: below zero for more than half a circle.
fn by_radius(from: Tip, to: Tip, radius: f64, ccw: bool) -> Option<(f64, f64)> {
    let (dx, dy) = (to.x - from.x, to.y - from.y);
    let chord = libm::hypot(dx, dy);
    if chord < 1e-9 {
        return None;
    }
    let square = radius * radius - chord * chord / 4.0;
    // A half circle may miss its own middle by what rounding leaves.
    let height = if square < 0.0 && libm::sqrt(-square) < 0.05 { 0.0 } else { libm::sqrt(square) };
    if height.is_nan() {
        return None;
    }
    let side = if ccw == (radius > 0.0) { height } else { -height };
    Some(((from.x + to.x) / 2.0 - dy / chord * side, (from.y + to.y) / 2.0 + dx / chord * side))
}
