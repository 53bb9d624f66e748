//! G-code: G0 to G3, G17, G20 and G21 (G70, G71), G90 and G91, drilling cycles, tools, spindle. Words that
//! could change positions and are not followed are refused; words that only affect driving are skipped.
//!
//! Controllers differ in the centre of an arc: the file states the mode, or its arcs show it.

use super::cycles::Cycle;
use super::hand::{Hand, Tip};
use super::words::{self, Word};
use crate::diagnostic::Diagnostic;
use crate::gcode::{Interpreter, Judge, Refused, grbl};
use crate::{code, note};

/// Assumed height of the machine's reference point, in mm.
const TOP_MM: f64 = 100.0;
/// Codes, in tenths, that change no position: waiting, the plane, tool offsets, driving modes.
const PASSED: &[u32] =
    &[40, 80, 90, 170, 400, 430, 490, 600, 601, 602, 610, 640, 641, 642, 670, 690, 940, 960, 970, 971];
/// The default zero: G54.
const FIRST_ZERO: u32 = 540;
/// How far a half circle may miss its own middle by rounding, in mm.
const ROUNDED_MM: f64 = 0.05;
const AXES: [char; 3] = ['X', 'Y', 'Z'];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Motion {
    Rapid,
    Line,
    Arc { ccw: bool },
    Drill,
}

struct State {
    motion: Motion,
    scale: f64,
    absolute: bool,
    centre_absolute: bool,
    cycle: Cycle,
    /// The cycle returns to the height before it (G98).
    back: bool,
    tool: Option<u32>,
    /// The zero in use, G54 to G59 in tenths, once one is named or used.
    zero: Option<u32>,
    /// Axes X, Y, Z with unknown position, because the machine moved to a position in machine coordinates.
    unknown: [bool; 3],
    /// Some controllers change tools at the T word alone: those with files that never have M6.
    changes_with_t: bool,
    of: Interpreter,
    judge: Judge,
    /// Known controllers that have accepted every line until now.
    others: Vec<(Interpreter, Judge)>,
    has_started: bool,
    /// The program starts with a percent sign, and the next one ends it.
    is_in_percents: bool,
    has_ended: bool,
}

/// The words of a line by letter, the last of each.
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

pub(super) fn read(hand: &mut Hand, text: &str, of: Interpreter) -> Result<(), Diagnostic> {
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
        of,
        judge: Judge::new(of),
        others: others(of),
        has_started: false,
        is_in_percents: false,
        has_ended: false,
    };
    if of != Interpreter::Any {
        // Controllers start with a spindle speed of 0.
        hand.speed(0.0);
    }
    for (number, line) in (1..).zip(lines(of, text)) {
        hand.at_line(number)?;
        let block = Block::new(of, line);
        block.comments.iter().for_each(|comment| hand.comment(comment));
        if let Some(letter) = grbl::acts_at_once(line).filter(|_| of == Interpreter::Grbl) {
            hand.warning(code!("readback.acts_at_once"), letter.escape_debug());
        }
        if state.is_past_end(hand, line)? {
            break;
        }
        state.refuse_foreign(hand, line)?;
        state.note_start(line);
        if block.text.starts_with('%') || of == Interpreter::Any && is_name(&block.text) {
            continue;
        }
        let words = words::of(&block.text).map_err(|column| {
            let mut why = hand.refuse(code!("readback.unknown_word"), &block.text);
            why.place.iter_mut().for_each(|place| place.column = column as u32);
            why
        })?;
        state.accepts(hand, &block, &words)?;
        let words: Vec<Word> = words.into_iter().map(|word| taken(of, word)).collect();
        state.has_ended |= state.line(hand, &Line { words: &words })?;
    }
    if of == Interpreter::LinuxCnc && !state.has_ended {
        return Err(hand.refuse(code!("readback.no_end"), ""));
    }
    Ok(())
}

fn lines<'t>(of: Interpreter, text: &'t str) -> Box<dyn Iterator<Item = &'t str> + 't> {
    match of {
        Interpreter::Grbl => Box::new(grbl::lines(text)),
        _ => Box::new(text.lines()),
    }
}

fn taken(of: Interpreter, word: Word) -> Word {
    match word {
        Word::Letter(letter, value) => Word::Letter(letter, grbl::taken(of, letter, value)),
        named => named,
    }
}

/// A line as its controller takes it.
struct Block {
    /// Without comments, and without spaces for a controller that is known.
    text: String,
    comments: Vec<String>,
    /// The number that it starts with, if that isn't in the text.
    number: Option<f64>,
    /// Characters without spaces and comments.
    length: usize,
    whole: usize,
}

impl Block {
    fn new(of: Interpreter, line: &str) -> Self {
        let whole = line.chars().count();
        if of == Interpreter::Grbl {
            let bare = grbl::bare(line);
            let comments = bare.brackets.into_iter().chain(bare.remark);
            let comments = comments.map(|comment| comment.trim().to_owned()).collect();
            let length = bare.text.chars().count();
            return Self { text: bare.text, comments, number: None, length, whole };
        }
        let (bare, number) = (words::bare_with(line, of == Interpreter::Any), words::line_number(line));
        let spaceless = || bare.chars().filter(|c| !c.is_whitespace());
        let length = spaceless().count() + number.map_or(0, |number| format!("N{number}").len());
        // Controllers skip spaces everywhere, even in numbers.
        let text = if of == Interpreter::Any { bare.trim().to_owned() } else { spaceless().collect() };
        Self { text, comments: words::comments(line), number, length, whole }
    }
}

/// If the user named no controller: the known controllers, whose refusals are reported as well.
fn others(of: Interpreter) -> Vec<(Interpreter, Judge)> {
    let known = Interpreter::KNOWN.into_iter().filter(|_| of == Interpreter::Any);
    known.map(|one| (one, Judge::new(one))).collect()
}

/// Whether a controller accepts a line. Words with names are Sinumerik's, so known controllers refuse them.
fn judged(of: Interpreter, judge: &mut Judge, block: &Block, words: &[Word]) -> Result<(), Refused> {
    let named = words.iter().find_map(|word| match word {
        Word::Named(name, _) | Word::Call(name, _) => Some(name),
        Word::Letter(..) => None,
    });
    if let Some(name) = named.filter(|_| of != Interpreter::Any) {
        return Err(Refused { code: code!("gcode.unknown_word"), word: name.clone(), number: 2 });
    }
    let Some(letters) = lettered(block.number, words) else { return Ok(()) };
    judge.line(&letters, if of == Interpreter::LinuxCnc { block.whole } else { block.length })?;
    grbl::cut_short(of, &block.text).map_or(Ok(()), Err)
}

/// The words of a line by letters, for a judge; none if a cycle is called by its name.
fn lettered(number: Option<f64>, words: &[Word]) -> Option<Vec<(char, f64)>> {
    let number = number.map(|number| Some(('N', number)));
    let letters = words.iter().map(|word| match word {
        Word::Letter(letter, value) => Some((*letter, *value)),
        Word::Named(name, value) if name == "CR" => Some(('R', *value)),
        Word::Named(name, value) if name.len() == 1 => Some((name.chars().next()?, *value)),
        Word::Named(..) | Word::Call(..) => None,
    });
    number.into_iter().chain(letters).collect()
}

/// Whether a line has more than comments.
fn says(line: &str) -> bool {
    !words::bare(line).is_empty() || words::line_number(line).is_some()
}

/// Whether a line only names the program: `O0001`.
fn is_name(bare: &str) -> bool {
    bare.strip_prefix(['O', ':']).is_some_and(|rest| rest.trim().chars().all(|c| c.is_ascii_digit()))
}

impl State {
    /// Whether the program ended before this line and the controller skips the rest. Refuses lines after the end that only some run.
    fn is_past_end(&self, hand: &mut Hand, line: &str) -> Result<bool, Diagnostic> {
        let text = line.trim();
        if !self.has_ended || text.starts_with('%') || !says(line) {
            return Ok(false);
        }
        if self.of == Interpreter::LinuxCnc {
            hand.warning(code!("readback.after_end"), text);
            return Ok(true);
        }
        Err(hand.refuse(code!("readback.after_end"), text))
    }

    /// Refuses characters that the controller doesn't know, and lines that it skips while a switch is on.
    fn refuse_foreign(&self, hand: &mut Hand, line: &str) -> Result<(), Diagnostic> {
        let text = line.trim();
        let is_sign = text.starts_with('%');
        let is_foreign = match self.of {
            Interpreter::Grbl => is_sign,
            Interpreter::LinuxCnc => {
                is_sign && (text != "%" || self.has_started && !self.is_in_percents)
                    || words::foreign_to_linuxcnc(line).is_some()
            }
            _ => false,
        };
        if is_foreign && !self.has_ended {
            let word = words::foreign_to_linuxcnc(line).unwrap_or('%').escape_debug().to_string();
            let why = Refused { code: code!("gcode.unknown_word"), word, number: 1 };
            return Err(hand.placed(why.diagnostic(self.of)));
        }
        match self.of {
            Interpreter::Any if text.starts_with('/') => hand.warning(code!("readback.optional_line"), text),
            Interpreter::LinuxCnc | Interpreter::GrblHal if text.starts_with('/') => {
                return Err(hand.refuse(code!("readback.optional_line"), text));
            }
            _ => {}
        }
        Ok(())
    }

    /// Notes where the program starts, and its percent signs.
    fn note_start(&mut self, line: &str) {
        let is_sign = line.trim().starts_with('%');
        if is_sign {
            self.has_ended |= self.has_started;
            self.is_in_percents |= !self.has_started;
        }
        self.has_started |= is_sign || says(line);
    }

    /// Refuses a line that the controller refuses, and notes what others would.
    fn accepts(&mut self, hand: &mut Hand, block: &Block, words: &[Word]) -> Result<(), Diagnostic> {
        judged(self.of, &mut self.judge, block, words).map_err(|why| hand.placed(why.diagnostic(self.of)))?;
        self.others.retain_mut(|(of, judge)| match judged(*of, judge, block, words) {
            Ok(()) => true,
            Err(why) => {
                let note = note!("gcode.others_refuse", word = why.word, ..);
                hand.other_refuses(note.with("controller", of.name()).with("number", why.number));
                false
            }
        });
        Ok(())
    }

    /// Executes one line; true if it is the last.
    fn line(&mut self, hand: &mut Hand, line: &Line<'_>) -> Result<bool, Diagnostic> {
        let strange = line.words.iter().find_map(|word| match word {
            Word::Named(name, _) if name.len() > 1 && name != "CR" => Some(name),
            _ => None,
        });
        if let Some(name) = strange {
            return Err(hand.refuse(code!("readback.unknown_word"), name));
        }
        let mut reference = None;
        let mut starts_cycle = false;
        for code in line.codes('G') {
            let tenths = libm::round(code * 10.0) as u32;
            if libm::fabs(code * 10.0 - f64::from(tenths)) > 1e-6 {
                return Err(hand.refuse(code!("readback.changes_place"), format!("G{code}")));
            }
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
                _ => return Err(hand.refuse(code!("readback.changes_place"), format!("G{code}"))),
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
        } else if !self.waits_by_axis(line) {
            self.go(hand, line, starts_cycle)?;
        } else if let Some(axis) = moves_too(line) {
            return Err(hand.refuse(code!("readback.changes_place"), axis));
        }
        Ok(line.codes('M').any(|code| matches!(code as u32, 2 | 30)))
    }

    /// True if an axis word may be the dwell time: some controllers read G4 X5 as 5 s.
    fn waits_by_axis(&self, line: &Line<'_>) -> bool {
        self.of == Interpreter::Any && line.waits()
    }

    /// Sets the zero of positions; refused if another one was in use.
    fn zero_at(&mut self, hand: &Hand, tenths: u32) -> Result<(), Diagnostic> {
        if *self.zero.get_or_insert(tenths) == tenths {
            return Ok(());
        }
        Err(hand.refuse(code!("readback.changes_place"), format!("G{}", tenths / 10)))
    }

    fn tools(&mut self, hand: &mut Hand, line: &Line<'_>) -> Result<(), Diagnostic> {
        if let Some(rpm) = line.letter('S').filter(|_| !self.waits_by_axis(line)) {
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
                97..=99 => return Err(hand.refuse(code!("readback.changes_place"), format!("M{code}"))),
                _ => {}
            }
        }
        if let Some(axis) = ['A', 'B', 'C', 'U', 'V', 'W'].into_iter().find(|axis| line.names(*axis)) {
            return Err(hand.refuse(code!("readback.changes_place"), axis));
        }
        Ok(())
    }

    fn call(&mut self, hand: &mut Hand, name: &str, numbers: &[Option<f64>]) -> Result<(), Diagnostic> {
        match name {
            "CYCLE81" | "CYCLE82" | "CYCLE83" => {
                let cycle = Cycle::called(numbers, self.scale)
                    .ok_or_else(|| hand.refuse(code!("readback.unknown_word"), name))?;
                let at = (hand.tip.x, hand.tip.y);
                self.zero.get_or_insert(FIRST_ZERO);
                self.known(hand, [true, true, false])?;
                self.unknown = [false; 3];
                cycle.drill(hand, at)
            }
            "MSG" => Ok(()),
            _ => Err(hand.refuse(code!("readback.unknown_word"), name)),
        }
    }

    /// A move to the machine's reference point via the named position, or in machine coordinates: only the
    /// upward direction is known.
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
            let word = match () {
                () if own_places => "G53",
                () if line.codes('G').any(|code| code == 30.0) => "G30",
                () => "G28",
            };
            return Err(hand.refuse(code!("readback.changes_place"), word));
        }
        if goes[2] {
            hand.line_to(Tip { z: TOP_MM, ..hand.tip }, true)?;
        }
        // The reference point is up; a height in machine coordinates may be anywhere.
        let [x, y, z] = self.unknown;
        self.unknown = [x || goes[0], y || goes[1], if goes[2] { own_places } else { z }];
        Ok(())
    }

    /// Axes named in absolute mode are known again.
    fn names_again(&mut self, line: &Line<'_>) {
        for (unknown, axis) in self.unknown.iter_mut().zip(AXES) {
            *unknown &= !(self.absolute && line.names(axis));
        }
    }

    fn known(&self, hand: &Hand, needed: [bool; 3]) -> Result<(), Diagnostic> {
        let open =
            self.unknown.into_iter().zip(needed).zip(AXES).find(|((open, needed), _)| *open && *needed);
        open.map_or(Ok(()), |(_, axis)| Err(hand.refuse(code!("readback.place_unknown"), axis)))
    }

    fn axis(&self, line: &Line<'_>, name: char, before: f64) -> f64 {
        match line.letter(name).map(|value| value * self.scale) {
            Some(value) if self.absolute => value,
            Some(value) => before + value,
            None => before,
        }
    }

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
            return Err(hand.refuse(code!("readback.changes_place"), "L"));
        }
        if turns && line.letter('P').is_some_and(|turns| turns > 1.0) {
            return Err(hand.refuse(code!("readback.changes_place"), "P"));
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
                    Some(radius) => self
                        .by_radius(from, to, radius, ccw)
                        .ok_or_else(|| hand.refuse(code!("readback.no_arc_of_radius"), radius))?,
                    None => self.centre(line, from),
                };
                let to_centre = |tip: Tip| libm::hypot(tip.x - centre.0, tip.y - centre.1);
                if !self.of.takes_radii(to_centre(from), to_centre(to)) {
                    return Err(hand.refuse(code!("readback.no_arc"), format!("X {} Y {}", to.x, to.y)));
                }
                hand.arc_to(to, centre, ccw)
            }
        }
    }

    fn by_radius(&self, from: Tip, to: Tip, radius: f64, ccw: bool) -> Option<(f64, f64)> {
        let takes = self.of.takes_radius([from.x, from.y], [to.x, to.y], radius);
        takes.then(|| by_radius(from, to, radius, ccw)).flatten()
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
        // In relative mode R counts from the height before the cycle and Z from R.
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

/// The axis that a dwell line would also move. X alone may be the dwell time.
fn moves_too(line: &Line<'_>) -> Option<char> {
    let moves =
        line.codes('G').any(|code| code < 4.0) || ['P', 'F', 'S'].into_iter().any(|name| line.names(name));
    ['Y', 'Z'].into_iter().chain(moves.then_some('X')).find(|axis| line.names(*axis))
}

/// The centre of an arc by its radius: below zero for more than half a circle.
fn by_radius(from: Tip, to: Tip, radius: f64, ccw: bool) -> Option<(f64, f64)> {
    let (dx, dy) = (to.x - from.x, to.y - from.y);
    let chord = libm::hypot(dx, dy);
    if chord < 1e-9 {
        return None;
    }
    let square = radius * radius - chord * chord / 4.0;
    let height = if square < 0.0 && libm::sqrt(-square) < ROUNDED_MM { 0.0 } else { libm::sqrt(square) };
    if height.is_nan() {
        return None;
    }
    let side = if ccw == (radius > 0.0) { height } else { -height };
    Some(((from.x + to.x) / 2.0 - dy / chord * side, (from.y + to.y) / 2.0 + dx / chord * side))
}
