//! Reads programs for the GRBL family, ours and foreign, into sections.
//!
//! Supported: G0 G1 G2 G3 (centre by I and J, or R), G4, G17, G20 G21, G40 G49 G54 G61 G80 G90 G91 G91.1 G94,
//! M0 M1 M2 M6 M30, M3 M4 M5, M7 M8 M9, F S T N, and of these only what GRBL accepts in one line. Everything
//! else is refused with its line: the engine can't watch a move that it doesn't follow.

use super::gcode_words::Words;
use super::routine::{Course, Routine, RoutineAction, RoutineMove, Section, SectionKind, Spindle, TipPlace};
use super::written::{WrittenLine, written};
use crate::diagnostic::Diagnostic;
use crate::gcode::{Interpreter, Judge, grbl};
use crate::units::Length;
use crate::{code, note, warning};
use sha2::{Digest, Sha256};
use std::fmt::Write;

const MOST_LINES: usize = 2_000_000;
const FURTHEST_MM: f64 = 5_000.0;
const MOST_WARNINGS: usize = 20;
const TOOL_WORDS: &[&str] =
    &["tool", "bit", "drill", "mill", "endmill", "cutter", "insert", "change", "load", "mm", "inch"];
/// G words, in hundredths, that change no place.
const PASSED: &[u32] = &[1700, 4000, 4900, 5400, 6100, 9110, 9400];

/// Modal state of the program.
struct Reader<'t> {
    file: &'t str,
    line: u32,
    routine: Routine,
    at: [Option<Length>; 3],
    course: Option<Going>,
    unit_nm: f64,
    relative: bool,
    feed: f64,
    speed: f64,
    sense: i8,
    coolant: [bool; 2],
    /// The last comment, to be shown at a tool change.
    said: String,
    tool: Option<u32>,
    open: Open,
    /// Number of holes and toolpaths read.
    counts: (u32, u32),
    ended: bool,
    judge: Judge,
    written: Vec<WrittenLine>,
}

#[derive(Default)]
struct Open {
    line: u32,
    actions: Vec<RoutineAction>,
    cuts: bool,
    /// The tool moves in XY while it cuts.
    wanders: bool,
    /// Number of actions before the entry, once it is passed.
    approach: Option<usize>,
    entry: Option<TipPlace>,
    spindle: Spindle,
    coolant: [bool; 2],
}

#[derive(Clone, Copy, PartialEq)]
enum Going {
    Rapid,
    Line,
    Arc { ccw: bool },
}

/// Reads programs that run one after the other, each with its name; between two files the user changes the
/// tool.
pub fn read(name: &str, files: &[(String, String)]) -> Result<Routine, Diagnostic> {
    read_written(name, files).map(|(routine, _)| routine)
}

/// As [`read`], with the lines as in the files.
pub fn read_written(
    name: &str,
    files: &[(String, String)],
) -> Result<(Routine, Vec<WrittenLine>), Diagnostic> {
    let mut digest = Sha256::new();
    let mut routine = Routine { name: name.to_owned(), ..Routine::default() };
    let mut written = Vec::new();
    for (index, (file, text)) in files.iter().enumerate() {
        digest.update(text.as_bytes());
        digest.update([0]);
        if index > 0 {
            let tool = routine.tools.len() as u32;
            routine.tools.push(file.clone());
            routine.numbers.push(None);
            let last = routine.sections.pop();
            let mut change = last.unwrap_or_else(|| empty(SectionKind::Finish));
            change.kind = SectionKind::Change(tool);
            routine.sections.push(change);
        }
        routine.programs.push((routine.sections.len(), file.clone()));
        let lines;
        (routine, lines) = one(file, text, routine)?;
        written.extend(lines);
    }
    for byte in digest.finalize() {
        let _ = write!(routine.key, "{byte:02x}");
    }
    Ok((routine, written))
}

fn names_tool(said: &str) -> bool {
    let said = said.to_ascii_lowercase();
    let mut words = said.split(|c: char| !c.is_ascii_alphanumeric());
    said.contains("put in") || words.any(|word| TOOL_WORDS.contains(&word))
}

fn empty(kind: SectionKind) -> Section {
    let (actions, coolant) = (Vec::new(), [false; 2]);
    Section {
        kind,
        line: 0,
        entry: TipPlace::default(),
        spindle: Spindle::Off,
        coolant,
        approach: 0,
        actions,
    }
}

fn one(file: &str, text: &str, routine: Routine) -> Result<(Routine, Vec<WrittenLine>), Diagnostic> {
    let section = routine.sections.len();
    let counts = routine.cuts();
    let mut reader = Reader {
        file,
        line: 0,
        routine,
        at: [None; 3],
        course: None,
        unit_nm: 1e6,
        relative: false,
        feed: 0.0,
        speed: 0.0,
        sense: 0,
        coolant: [false; 2],
        said: String::new(),
        tool: None,
        open: Open::default(),
        counts,
        ended: false,
        judge: Judge::of_sender(Interpreter::Grbl),
        written: Vec::new(),
    };
    if text.lines().count() > MOST_LINES {
        return Err(reader.refuse(code!("grbl.too_long")));
    }
    for (number, line) in (1..).zip(grbl::lines(text)) {
        reader.line = number;
        let bare = reader.bare(line);
        if bare.is_empty() {
            continue;
        }
        if bare.starts_with('%') {
            let note = note!("grbl.percent_left_out").at(file, number, 1);
            reader.routine.warnings.push(note);
            continue;
        }
        if reader.ended {
            let why = warning!("readback.after_end", found = line.trim());
            reader.routine.warnings.push(why.at(file, number, 1));
            break;
        }
        let words =
            Words::of(&bare).map_err(|word| reader.refuse(code!("grbl.unknown_word")).with("word", word))?;
        let judged = reader.judge.line(&words.all, bare.len());
        let judged = judged.and_then(|()| grbl::cut_short(Interpreter::Grbl, &bare).map_or(Ok(()), Err));
        judged.map_err(|why| why.diagnostic(Interpreter::Grbl).at(file, number, 1))?;
        reader.follow(&words)?;
        let (text, is_changed) = written(&bare, &words, reader.circle_end(&words));
        reader.written.push(WrittenLine { section, line: number, text, is_changed });
    }
    reader.finish()
}

impl Reader<'_> {
    fn refuse(&self, code: &str) -> Diagnostic {
        Diagnostic::error(code).at(self.file, self.line, 1)
    }

    /// A line without its comments. Saves the comments for the user.
    fn bare(&mut self, line: &str) -> String {
        let bare = grbl::bare(line);
        bare.brackets.iter().for_each(|comment| self.keep(comment));
        bare.text
    }

    fn keep(&mut self, comment: &str) {
        let text = comment.trim();
        let text = text.strip_prefix("MSG,").or_else(|| text.strip_prefix("MSG")).unwrap_or(text).trim();
        self.said = text.chars().take(120).collect();
    }

    fn follow(&mut self, words: &Words) -> Result<(), Diagnostic> {
        let mut waits = false;
        for &code in &words.g {
            match code {
                0 => self.course = Some(Going::Rapid),
                100 => self.course = Some(Going::Line),
                200 => self.course = Some(Going::Arc { ccw: false }),
                300 => self.course = Some(Going::Arc { ccw: true }),
                400 => waits = true,
                2000 => self.unit_nm = 25.4e6,
                2100 => self.unit_nm = 1e6,
                8000 => self.course = None,
                9000 => self.relative = false,
                9100 => self.relative = true,
                _ if PASSED.contains(&code) => {}
                _ => {
                    let word = format!("G{}", f64::from(code) / 100.0);
                    return Err(self.refuse(code!("grbl.unknown_word")).with("word", word));
                }
            }
        }
        if let Some(feed) = words.letter(b'F') {
            self.feed = feed * self.unit_nm / 1e6;
        }
        if let Some(speed) = words.letter(b'S') {
            self.speed = speed;
        }
        if let Some(tool) = words.letter(b'T') {
            self.tool = Some(tool.clamp(0.0, 1e6) as u32);
        }
        self.switches(words)?;
        if waits {
            let seconds = words.letter(b'P').filter(|p| (0.0..=3600.0).contains(p));
            let seconds = seconds.ok_or_else(|| self.refuse(code!("grbl.no_wait")))?;
            self.open.actions.push(RoutineAction::Wait { seconds, line: self.line });
        }
        // A full circle may give only its centre.
        if words.any(b"XYZIJ") {
            self.go(words)?;
        }
        self.pauses(words)
    }

    fn switches(&mut self, words: &Words) -> Result<(), Diagnostic> {
        let before = (self.sense, self.coolant);
        for &code in &words.m {
            match code {
                3 => self.sense = 1,
                4 => self.sense = -1,
                5 => self.sense = 0,
                7 => self.coolant[0] = true,
                8 => self.coolant[1] = true,
                9 => self.coolant = [false; 2],
                0 | 1 | 2 | 6 | 30 => {}
                _ => return Err(self.refuse(code!("grbl.unknown_word")).with("word", format!("M{code}"))),
            }
        }
        let switched = words.m.iter().any(|code| (3..=5).contains(code));
        if switched || (before.0 != 0 && words.letter(b'S').is_some()) {
            self.open.actions.push(RoutineAction::Spindle { to: self.spindle(), line: self.line });
        }
        if self.coolant != before.1 {
            let [mist, flood] = self.coolant;
            self.open.actions.push(RoutineAction::Coolant { mist, flood, line: self.line });
        }
        Ok(())
    }

    fn spindle(&self) -> Spindle {
        match self.sense {
            0 => Spindle::Off,
            1 => Spindle::On(self.speed),
            _ => Spindle::Back(self.speed),
        }
    }

    fn pauses(&mut self, words: &Words) -> Result<(), Diagnostic> {
        if words.m.iter().any(|code| [0, 1, 6].contains(code)) {
            if self.open.cuts {
                self.close();
            }
            let name = match (&*self.said, self.tool) {
                ("", Some(tool)) => format!("T{tool}"),
                ("", None) => String::new(),
                (said, _) => said.to_owned(),
            };
            let tool = self.routine.tools.len() as u32;
            let has_new = self.tool != self.routine.numbers.last().copied().flatten();
            let is_change = words.m.contains(&6) || has_new || names_tool(&self.said);
            self.routine.stops.extend((!is_change).then_some(tool));
            self.routine.tools.push(if is_change { name } else { self.said.clone() });
            self.routine.numbers.push(self.tool);
            self.shut(SectionKind::Change(tool));
            self.said.clear();
        }
        if words.m.iter().any(|code| [2, 30].contains(code)) {
            self.ended = true;
        }
        Ok(())
    }

    /// End of a full circle without X and Y, in program units: GRBL requires one of them.
    fn circle_end(&self, words: &Words) -> Option<[f64; 2]> {
        let turns = matches!(self.course, Some(Going::Arc { .. })) && words.any(b"IJ");
        if !turns || words.any(b"XY") {
            return None;
        }
        let here = |axis: usize| self.at[axis].map_or(0.0, |place| place.nm() as f64 / self.unit_nm);
        Some(if self.relative { [0.0; 2] } else { [here(0), here(1)] })
    }

    /// Reports a rapid through or into the board, as `prove` does.
    fn rapid_in_board(&mut self, from: TipPlace, to: TipPlace) {
        let in_board = from[2] < Length::ZERO || to[2] < Length::ZERO;
        let in_plane = from[0] != to[0] || from[1] != to[1];
        if in_board && (in_plane || to[2] < from[2]) && self.routine.warnings.len() < MOST_WARNINGS {
            let [x, y, z] = to.map(Length::mm);
            let why = warning!("readback.fast_in_board", found = format!("X {x} Y {y} Z {z}"));
            self.routine.warnings.push(why.at(self.file, self.line, 0));
        }
    }

    fn length(&self, value: f64) -> Result<Length, Diagnostic> {
        let nm = libm::round(value * self.unit_nm);
        if libm::fabs(nm) > FURTHEST_MM * 1e6 {
            return Err(self.refuse(code!("grbl.too_far")));
        }
        Ok(Length::from_nm(nm as i64))
    }

    fn go(&mut self, words: &Words) -> Result<(), Diagnostic> {
        let going = self.course.ok_or_else(|| self.refuse(code!("grbl.no_course")))?;
        let before = self.at;
        for (axis, name) in [b'X', b'Y', b'Z'].into_iter().enumerate() {
            let Some(value) = words.letter(name) else { continue };
            let value = self.length(value)?;
            self.at[axis] = Some(match (self.relative, self.at[axis]) {
                (false, _) => value,
                (true, Some(from)) => from + value,
                (true, None) => return Err(self.refuse(code!("grbl.unknown_place"))),
            });
        }
        let far = self.at.iter().flatten().any(|place| place.abs() > Length::from_mm(FURTHEST_MM));
        if far {
            return Err(self.refuse(code!("grbl.too_far")));
        }
        let whole = |at: [Option<Length>; 3]| Some([at[0]?, at[1]?, at[2]?]);
        let (Some(from), Some(to)) = (whole(before), whole(self.at)) else {
            // Until every axis was given, moves only prepare the machine. The entry of the first section
            // gives the start position.
            return if going == Going::Rapid {
                Ok(())
            } else {
                Err(self.refuse(code!("grbl.unknown_place")))
            };
        };
        let course = match going {
            Going::Rapid => Course::Rapid,
            Going::Line => Course::Line,
            Going::Arc { ccw } => Course::Arc { centre: self.centre(words, from, to, ccw)?, ccw },
        };
        if course == Course::Rapid {
            self.rapid_in_board(from, to);
        } else if self.feed <= 0.0 {
            return Err(self.refuse(code!("grbl.no_feed")));
        }
        self.add(from, RoutineMove { course, to, feed_mm_per_min: self.feed, line: self.line });
        Ok(())
    }

    fn centre(
        &self,
        words: &Words,
        from: TipPlace,
        to: TipPlace,
        ccw: bool,
    ) -> Result<[Length; 2], Diagnostic> {
        if let Some(radius) = words.letter(b'R') {
            let (x, y) = ((to[0] - from[0]).mm(), (to[1] - from[1]).mm());
            let radius = radius * self.unit_nm / 1e6;
            let chord = libm::hypot(x, y);
            let rest = 4.0 * radius * radius - chord * chord;
            let ends = [from, to].map(|place| [place[0].mm(), place[1].mm()]);
            if chord == 0.0 || !grbl::has_circle(ends[0], ends[1], radius) {
                return Err(self.refuse(code!("grbl.no_arc")));
            }
            let side = if (radius > 0.0) == ccw { 1.0 } else { -1.0 };
            let h = side * libm::sqrt(rest.max(0.0)) / chord;
            let middle = [from[0].mm() + 0.5 * (x - y * h), from[1].mm() + 0.5 * (y + x * h)];
            return Ok(middle.map(Length::from_mm));
        }
        let (i, j) = (words.letter(b'I'), words.letter(b'J'));
        if i.is_none() && j.is_none() {
            return Err(self.refuse(code!("grbl.no_arc")));
        }
        let offset = |value: Option<f64>| self.length(value.unwrap_or(0.0));
        let centre = [from[0] + offset(i)?, from[1] + offset(j)?];
        let radius = |place: TipPlace| libm::hypot((place[0] - centre[0]).mm(), (place[1] - centre[1]).mm());
        let (begin, end) = (radius(from), radius(to));
        if begin <= 0.0 || !Interpreter::Grbl.takes_radii(begin, end) {
            return Err(self.refuse(code!("grbl.no_arc")));
        }
        Ok(centre)
    }

    fn add(&mut self, from: TipPlace, step: RoutineMove) {
        let in_plane = from[0] != step.to[0] || from[1] != step.to[1];
        let cuts = step.course != Course::Rapid;
        if self.open.cuts && !cuts && in_plane && from[2] > Length::ZERO {
            self.close();
        }
        let down = step.to[2] < from[2];
        if !cuts && in_plane && !down {
            self.routine.safe = self.routine.safe.max(step.to[2]);
        }
        let open = &mut self.open;
        if open.line == 0 {
            open.line = step.line;
        }
        if cuts || (down && !in_plane) {
            if open.entry.is_none() {
                self.routine.safe = self.routine.safe.max(from[2]);
                (open.entry, open.approach) = (Some(from), Some(open.actions.len()));
                (open.spindle, open.coolant) = match self.sense {
                    0 => (Spindle::Off, self.coolant),
                    1 => (Spindle::On(self.speed), self.coolant),
                    _ => (Spindle::Back(self.speed), self.coolant),
                };
            }
        } else if in_plane && !open.cuts {
            // The tool moved on before it cut: the entry is at the new position.
            (open.entry, open.approach) = (None, None);
        }
        open.wanders |= cuts && (in_plane || matches!(step.course, Course::Arc { .. }));
        open.cuts |= cuts;
        open.actions.push(RoutineAction::Go(step));
    }

    fn close(&mut self) {
        let kind = if self.open.wanders {
            self.counts.1 += 1;
            SectionKind::Toolpath(self.counts.1)
        } else {
            self.counts.0 += 1;
            SectionKind::Hole(self.counts.0)
        };
        self.shut(kind);
    }

    fn shut(&mut self, kind: SectionKind) {
        let open = std::mem::take(&mut self.open);
        let here = self.at.map(Option::unwrap_or_default);
        let (entry, approach) = (open.entry.unwrap_or(here), open.approach.unwrap_or(open.actions.len()));
        let (spindle, coolant) =
            if open.entry.is_some() { (open.spindle, open.coolant) } else { (self.spindle(), self.coolant) };
        let line = if open.line == 0 { self.line } else { open.line };
        let actions = open.actions;
        self.routine.sections.push(Section { kind, line, entry, spindle, coolant, approach, actions });
    }

    fn finish(mut self) -> Result<(Routine, Vec<WrittenLine>), Diagnostic> {
        if self.open.cuts {
            self.close();
        }
        self.shut(SectionKind::Finish);
        if self.at.iter().any(Option::is_none) || !self.routine.sections.iter().any(Section::cuts) {
            return Err(self.refuse(code!("grbl.nothing_to_do")));
        }
        if self.routine.safe <= Length::ZERO {
            return Err(self.refuse(code!("grbl.no_safe_height")));
        }
        Ok((self.routine, self.written))
    }
}

#[cfg(test)]
mod tests {
    use super::super::routine::Pause;
    use super::*;

    const BOARD: &str = "\
(A board)
G21 G17 G90 G91.1 G94
M5
G0 Z20.0000
G0 X0.0000 Y0.0000
(MSG, put in tool 1: 0.8 mm)
M0
M3 S10000
G4 P2
G0 X1 Y2
G0 Z0.5
G1 Z-1.8 F120
G0 Z2
G0 X5 Y2
G0 Z0.5
G1 Z-1.8
G0 Z2
M5
G0 Z20
G0 X0 Y0
(MSG, put in tool 2: V)
M0
M3 S9000
G0 X10 Y10
G1 Z-0.1 F60
G1 X20 F300
G3 X20 Y20 I0 J5
G0 Z2
G0 X30 Y10
G1 Z-0.1 F60
G0 Z2
M5
G0 Z20
G0 X0 Y0
M2
";

    fn routine(text: &str) -> Result<Routine, Diagnostic> {
        read("board", &[("board.nc".to_owned(), text.to_owned())])
    }

    #[test]
    fn own_program_splits_into_holes_toolpaths_and_changes() {
        let routine = routine(BOARD).unwrap();
        let kinds: Vec<_> = routine.sections.iter().map(|section| section.kind).collect();
        use SectionKind::{Change, Finish, Hole, Toolpath};
        assert_eq!(kinds, [Change(0), Hole(1), Hole(2), Change(1), Toolpath(1), Hole(3), Finish]);
        assert_eq!(routine.tools, ["put in tool 1: 0.8 mm", "put in tool 2: V"]);
        let mm = |place: TipPlace| place.map(Length::mm);
        let entries: Vec<_> = routine.sections.iter().map(|section| mm(section.entry)).collect();
        assert_eq!(entries[1], [1.0, 2.0, 20.0]);
        assert_eq!(entries[2], [5.0, 2.0, 2.0]);
        assert_eq!(entries[4], [10.0, 10.0, 20.0]);
        let spindles: Vec<_> = routine.sections.iter().map(|section| section.spindle).collect();
        assert_eq!(spindles[2], Spindle::On(10_000.0));
        assert_eq!((spindles[0], spindles[6]), (Spindle::Off, Spindle::Off));
        assert_eq!(routine.sections.iter().map(|section| section.line).collect::<Vec<_>>()[2], 14);
        // Every downward move is after the entry.
        for section in routine.sections.iter().filter(|section| section.cuts()) {
            let low = |action: &RoutineAction| matches!(action, RoutineAction::Go(step) if step.to[2] < section.entry[2]);
            assert!(!section.actions[..section.approach].iter().any(low));
        }
        assert_eq!(routine.safe, Length::from_mm(20.0));
        let [low, high] = routine.reach().unwrap().map(mm);
        assert!(
            (low[2] + 1.8).abs() < 1e-9 && (high[0] - 30.0).abs() < 1e-9 && (high[1] - 20.0).abs() < 1e-9
        );
    }

    #[test]
    fn inches_relative_moves_and_radii_are_followed() {
        let text = "G20 G90\nG0 Z0.2\nG0 X1 Y1\nG1 Z-0.05 F10\nG91\nG2 X1 Y-1 R1\nG1 X0.5\nG90 G0 Z0.2\n";
        let routine = routine(text).unwrap();
        let section = &routine.sections[0];
        let arcs: Vec<_> = section
            .actions
            .iter()
            .filter_map(|action| match action {
                RoutineAction::Go(RoutineMove { course: Course::Arc { centre, .. }, to, .. }) => {
                    Some((centre.map(Length::mm), to[0].mm()))
                }
                _ => None,
            })
            .collect();
        assert_eq!(arcs, [([25.4, 0.0], 50.8)]);
        assert_eq!(section.end().map(Length::mm), [63.5, 0.0, 5.08]);
    }

    #[test]
    fn unsupported_lines_are_refused_with_their_number() {
        let head = "G21 G90\nG0 Z5\nG0 X0 Y0\n";
        for (line, code) in [
            ("G81 X1 Y1 Z-1 R2 F100", "gcode.unknown_word"),
            ("G64", "gcode.unknown_word"),
            ("G92 X1", "grbl.unknown_word"),
            ("G1 X5", "gcode.no_feed"),
            ("G2 X5 Y5 F100", "gcode.no_centre"),
            ("G2 X5 Y5 I1 K1 F100", "grbl.no_arc"),
            ("G2 X5 Y5 I1 F100", "grbl.no_arc"),
            ("G0 X6000", "grbl.too_far"),
            ("G0 X1 X2", "gcode.repeated_word"),
            ("G0 X1 Y1 I3 J4", "gcode.unused_word"),
            ("M3.4", "gcode.not_whole"),
            ("G1.5 X1 F9", "gcode.not_whole"),
            ("M3 M5", "gcode.same_group"),
            ("G0 G1 X1 F9", "gcode.axes_twice"),
            ("G80 X1", "gcode.axes_without_motion"),
            ("G0 X", "grbl.unknown_word"),
            ("G0 A1", "gcode.unknown_word"),
            ("M98", "gcode.unknown_word"),
            ("G4", "gcode.missing_word"),
            ("G4 P9999", "grbl.no_wait"),
            ("G55", "grbl.unknown_word"),
            ("G1 Xé F1", "grbl.unknown_word"),
        ] {
            let why = routine(&format!("{head}{line}\n")).unwrap_err();
            let found = why.place.as_ref().map(|place| (place.file.as_str(), place.line));
            assert_eq!((why.code.as_str(), found), (code, Some(("board.nc", 4))), "{line}");
        }
        assert_eq!(routine(head).unwrap_err().code, "grbl.nothing_to_do");
        assert_eq!(routine("").unwrap_err().code, "grbl.nothing_to_do");
    }

    #[test]
    fn plain_stop_asks_for_no_tool() {
        let tool = |number, said| Pause::Tool { number, said };
        let stop = |said| Pause::Stop { said };
        for (lines, wanted) in [
            ("M0", stop("")),
            ("(MSG, blow the chips away)\nM0", stop("blow the chips away")),
            ("(MSG, tool 1)\nM0", tool(1, "tool 1")),
            ("(put in V 30)\nM0", tool(1, "put in V 30")),
            ("T5\nM0", tool(5, "")),
            ("M6 T5", tool(5, "")),
            ("M6", tool(1, "")),
            ("(drill 0.8)\nM6 T2", tool(2, "drill 0.8")),
        ] {
            let text = format!("G0 X0 Y0 Z2\n{lines}\nM3 S9000\nG1 Z-1 F9\nG0 Z2\n");
            assert_eq!(routine(&text).unwrap().pause(0), wanted, "{lines}");
        }
        let text = "G0 X0 Y0 Z2\nM6 T2\nG1 Z-1 F9\nG0 Z2\nM0\nG1 Z-1\nG0 Z2\n";
        assert_eq!(routine(text).unwrap().pause(1), stop(""));
    }

    #[test]
    fn dwell_does_not_hide_the_move_on_its_line() {
        let routine = routine("G0 Z2\nG0 X0 Y0\nG1 Z-1 F9\nG4 P1 X3\nG0 Z2\n").unwrap();
        assert_eq!(routine.reach().unwrap()[1][0], Length::from_mm(3.0));
    }

    #[test]
    fn rapids_in_the_board_are_reported_with_their_lines() {
        let head = "G0 Z2\nG0 X0 Y0\nG1 Z-1 F9\n";
        for (text, wanted) in [
            ("G0 X1\nG0 Z2\n", vec![4]),
            ("G0 Z-2\nG0 Z2\n", vec![4]),
            ("G0 Z2 X1\n", vec![4]),
            ("G0 Z2\nG0 X1\nG0 Z-1\nY2\nG1 Z2\n", vec![6, 7]),
            ("G0 Z2\nG0 X1\n", vec![]),
        ] {
            let routine = routine(&format!("{head}{text}")).unwrap();
            let lines: Vec<u32> = routine
                .warnings
                .iter()
                .filter_map(|why| why.place.as_ref())
                .map(|place| place.line)
                .collect();
            assert_eq!(lines, wanted, "{text}");
        }
    }

    #[test]
    fn lines_are_copied_except_tool_changes_and_arc_ends() {
        let text =
            "N1 G90 g0 z2 (up)\n\n%\nG0 X1 Y2\nT1 M6\nG1 Z-1 F9\nG2 I4.5\nG2 Z-2 I4.5\nG0 Z2\nM2\nG0 X9\n";
        let (_, lines) = read_written("b", &[("b.nc".to_owned(), text.to_owned())]).unwrap();
        let texts: Vec<_> =
            lines.iter().map(|line| (line.line, line.text.as_str(), line.is_changed)).collect();
        assert_eq!(
            texts,
            [
                (1, "N1G90G0Z2", false),
                (4, "G0X1Y2", false),
                (5, "T1M0", true),
                (6, "G1Z-1F9", false),
                (7, "G2I4.5X1Y2", true),
                (8, "G2Z-2I4.5X1Y2", true),
                (9, "G0Z2", false),
                (10, "M2", false),
            ]
        );
    }

    #[test]
    fn noise_never_panics() {
        let mut chance = crate::chance::Chance::new(3);
        for _ in 0..2_000 {
            let mut text: Vec<u8> = BOARD.bytes().collect();
            for _ in 0..1 + chance.below(8) {
                let at = chance.below(text.len());
                text[at] = chance.below(256) as u8;
            }
            let _ = routine(&String::from_utf8_lossy(&text));
        }
    }
}
