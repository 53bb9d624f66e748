//! A machine that changes its tools itself: lines of its owner that are sent where tools are changed, instead of asking a person.
//!
//! ```text
//!  ready  M5M9 G21G17G90G94 G54 · G90G0Z… · $G ?   spindle off, tip at its safe height: a look before the first of them
//!  lines  M6T3 · …                                 each alone: the next one once it is answered and the head at rest (G4P0)
//!  again  M5M9 G21G17G90G94 G54 · $# $G ?          the words in force, the stored places, the tool's number, where the head is now
//! ```
//!
//! Behind that the tool is measured on the tool setter, where there is one. Where there is none the lines leave its length in an offset, or
//! all are of one length: by the word of whoever wrote them. Zero of X and Y is where it was, or the job ends.
//!
//! Comes in: a tool that is wanted, answers and reports, from the engine. Goes out: lines. mm. Does not know what they do.

use super::asks::{EngineAction, EnginePhase, EngineStart};
use super::engine::{Controller, Meaning};
use super::hand::SAME_ZERO_MM;
use super::heard::ReportedState;
use super::height::BoardHeight;
use super::lines::number;
use super::routine::SectionKind;
use super::run::Run;
use super::setter::ToolSetter;
use super::settings;
use crate::diagnostic::Diagnostic;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Under this key the settings of a controller have the lines of its tool changer; none where a person changes tools.
pub const CHANGER_KEY: &str = "controller.changer";
/// What stands in them for the number of the tool.
pub const TOOL_MARK: &str = "{tool}";
/// The most lines.
const MOST_LINES: usize = 32;
/// The longest of them, the number of the tool in it.
const LONGEST: usize = 70;
/// The largest number of a tool.
const MOST_TOOLS: &str = "999";
/// Signs that a controller takes at once, wherever they stand.
const AT_ONCE: &[char] = &['!', '?', '~'];
/// How far below its safe height a tip may be, mm.
const SAME_MM: f64 = 0.02;
/// How long a line may take while the controller says that it rests, s: one that fetches a tool is answered when that is in.
pub(super) const LINE_S: f64 = 120.0;

/// Lines that change the tool.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ToolMacro(Vec<String>);

impl ToolMacro {
    /// Those of these lines, without what is empty of them; or why they cannot be sent.
    pub fn of_lines<'a>(lines: impl IntoIterator<Item = &'a str>) -> Result<Self, Diagnostic> {
        let lines: Vec<String> =
            lines.into_iter().map(|line| line.trim().to_owned()).filter(|line| !line.is_empty()).collect();
        if lines.len() > MOST_LINES {
            return Err(Diagnostic::error("changer.too_many").with("count", lines.len()));
        }
        let is_bad = |line: &&String| {
            let full = line.replace(TOOL_MARK, MOST_TOOLS);
            let is_sign = |sign: char| (' '..='~').contains(&sign) && !AT_ONCE.contains(&sign);
            full.len() > LONGEST
                || full.starts_with('$')
                || !full.chars().all(is_sign)
                || full.contains(['{', '}'])
        };
        match lines.iter().find(is_bad) {
            Some(line) => Err(Self::bad(line)),
            None => Ok(Self(lines)),
        }
    }

    /// That this cannot be sent.
    pub fn bad(text: impl ToString) -> Diagnostic {
        Diagnostic::error("changer.bad_line").with("text", text.to_string()).with("mark", TOOL_MARK)
    }

    /// The lines.
    pub fn lines(&self) -> &[String] {
        &self.0
    }

    /// Whether there are none: a person changes tools.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether they want to know which tool.
    fn asks_number(&self) -> bool {
        self.0.iter().any(|line| line.contains(TOOL_MARK))
    }

    /// Whether they tell the controller the number by a T word, which it says again when it is asked.
    fn says_tool(&self) -> bool {
        let word = format!("T{TOOL_MARK}");
        self.0
            .iter()
            .any(|line| line.to_ascii_uppercase().replace(' ', "").contains(&word.to_ascii_uppercase()))
    }

    /// The lines for the tool of this number.
    fn of_tool(&self, number: Option<u32>) -> VecDeque<String> {
        let number = number.map(|number| number.to_string()).unwrap_or_default();
        self.0.iter().map(|line| line.replace(TOOL_MARK, &number)).collect()
    }
}

/// A machine that changes the tools of a job itself.
#[derive(Clone, Debug, PartialEq)]
pub struct Changer {
    /// The lines that do it.
    pub lines: ToolMacro,
    /// The number of each of the routine's tools; none where nobody said one.
    pub numbers: Vec<Option<u32>>,
}

impl Changer {
    fn number(&self, tool: u32) -> Option<u32> {
        self.numbers.get(tool as usize).copied().flatten()
    }
}

/// What a line that was sent is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ChangerLine {
    /// A word of ours behind which others stand.
    Word,
    /// The last of those before the lines.
    Ready,
    /// A line of the owner.
    Own,
    /// The head stands still behind that.
    Rest,
    /// The last of those behind the lines.
    Again,
}

/// A change in work.
#[derive(Debug)]
pub(super) struct ChangerRun {
    tool: u32,
    left: VecDeque<String>,
    /// The line that is in work, and how many there are.
    text: String,
    at: u32,
    of: u32,
    /// The lines are done.
    is_behind: bool,
    /// All is answered: a report shows where that led.
    answered: bool,
    asked: bool,
    /// Work zero before.
    zero_mm: [f64; 3],
}

impl Controller {
    /// The line of the tool changer that is in work, from 1, and how many there are.
    pub fn changing(&self) -> Option<[u32; 2]> {
        self.changer.as_ref().map(|run| [run.at.max(1), run.of])
    }

    /// What of the tool changer keeps a job from being started, and what there is to say of it.
    pub(super) fn check_changer(&self, start: &EngineStart) -> Vec<Diagnostic> {
        let Some(changer) = &start.changer else { return Vec::new() };
        let sections = start.routine.sections.iter().skip(start.from);
        let later = sections.filter_map(|section| match section.kind {
            SectionKind::Change(tool) => Some(tool),
            _ => None,
        });
        let mut tools = start.routine.tool_at(start.from).into_iter().chain(later);
        let unknown = tools.find(|tool| changer.lines.asks_number() && changer.number(*tool).is_none());
        let name = |tool: u32| start.routine.tools.get(tool as usize).cloned().unwrap_or_default();
        let unknown = unknown.map(|tool| {
            let why = Diagnostic::error("changer.no_number").with("change", tool + 1);
            why.with("tool", name(tool))
        });
        let measures = start.setter.is_some() || start.same_length;
        let trusts = (!measures).then(|| Diagnostic::warning("changer.lengths"));
        unknown.into_iter().chain(trusts).collect()
    }

    /// Begins to change to a tool.
    pub(super) fn begin_change(&mut self, tool: u32) {
        let (Some(zero_mm), Some(place)) = (self.zero_mm, self.place()) else {
            return self.trouble(Diagnostic::error("grbl.no_report"));
        };
        let Some((changer, safe_mm)) = self.run.as_ref().and_then(Run::changes) else { return };
        let left = changer.lines.of_tool(changer.number(tool));
        let of = left.len() as u32;
        self.modes = None;
        self.set(EnginePhase::Changing);
        let (text, at, is_behind, answered, asked) = (String::new(), 0, false, false, false);
        self.changer = Some(ChangerRun { tool, left, text, at, of, is_behind, answered, asked, zero_mm });
        self.says_words();
        if place[2] < safe_mm - SAME_MM {
            self.send(&format!("G90G0Z{}", number(safe_mm)), Meaning::Changer(ChangerLine::Word));
            self.send("G4P0", Meaning::Changer(ChangerLine::Word));
        }
        self.send("$G", Meaning::Changer(ChangerLine::Ready));
    }

    fn says_words(&mut self) {
        for text in ["M5M9", "G21G17G90G94", "G54"] {
            self.send(text, Meaning::Changer(ChangerLine::Word));
        }
    }

    /// A line of it was answered, or refused.
    pub(super) fn changer_answered(&mut self, line: ChangerLine, error: Option<u16>) {
        let Some(run) = &mut self.changer else { return };
        if let Some(number) = error {
            let why = if line == ChangerLine::Own {
                Diagnostic::error("changer.refused").with("line", run.at).with("text", &run.text)
            } else {
                Diagnostic::error(&settings::error_code(number)).with("line", "")
            };
            return self.trouble(why.with("number", number));
        }
        match line {
            ChangerLine::Word => {}
            ChangerLine::Own => self.send("G4P0", Meaning::Changer(ChangerLine::Rest)),
            ChangerLine::Rest => self.changer_goes(),
            ChangerLine::Ready | ChangerLine::Again => run.answered = true,
        }
    }

    /// The next line; behind the last one the words that everything goes by, and what is stored.
    fn changer_goes(&mut self) {
        let Some(run) = &mut self.changer else { return };
        if let Some(text) = run.left.pop_front() {
            run.at += 1;
            run.text.clone_from(&text);
            return self.send(&text, Meaning::Changer(ChangerLine::Own));
        }
        run.is_behind = true;
        for name in ["G54", "G92", "TLO"] {
            self.info.offsets.remove(name);
        }
        self.modes = None;
        self.says_words();
        self.send("$#", Meaning::Changer(ChangerLine::Word));
        self.send("$G", Meaning::Changer(ChangerLine::Again));
    }

    /// The question that was asked now shows where the head is.
    pub(super) fn changer_asked(&mut self) {
        let idle = self.buffer.is_empty() && self.queue.is_empty();
        if let Some(run) = &mut self.changer {
            run.asked = idle && run.answered;
        }
    }

    /// A report while the tool is changed, or measured in the middle of that.
    pub(super) fn change_reported(&mut self, doing: ReportedState, fresh: bool) {
        if self.phase == EnginePhase::Measuring {
            self.setter_reported(doing, fresh);
        } else {
            self.changer_reported(doing, fresh);
        }
    }

    fn changer_reported(&mut self, doing: ReportedState, fresh: bool) {
        let rests = fresh && doing == ReportedState::Idle;
        let place = self.place();
        let Some(run) = self.changer.as_mut().filter(|run| rests && run.answered && run.asked) else {
            return;
        };
        let Some(place) = place else { return };
        (run.answered, run.asked) = (false, false);
        if run.is_behind {
            return self.is_changed(place);
        }
        let safe_mm = self.run.as_ref().and_then(Run::changes).map_or(0.0, |(_, safe_mm)| safe_mm);
        if let Some(why) = self.other_words() {
            self.trouble(why);
        } else if place[2] < safe_mm - SAME_MM {
            let why = Diagnostic::error("changer.not_up").with("z", format!("{:.3}", place[2]));
            self.trouble(why.with("safe", number(safe_mm)));
        } else {
            self.changer_goes();
        }
    }

    /// Why the words in force are not those that everything goes by, the spindle off.
    fn other_words(&self) -> Option<Diagnostic> {
        let Some(modes) = &self.modes else { return Some(Diagnostic::error("grbl.answer_missing")) };
        let wanted = [('M', 50), ('G', 170), ('G', 210), ('G', 940), ('G', 540)];
        let (letter, tenths) = wanted.into_iter().find(|(letter, tenths)| !modes.says(*letter, *tenths))?;
        let word = format!("{letter}{}", f64::from(tenths) / 10.0);
        Some(Diagnostic::error("grbl.modes_differ").with("word", word))
    }

    /// Why another tool is in than the one that was asked for, by the controller's own word.
    fn other_tool(&self, tool: u32) -> Option<Diagnostic> {
        let (changer, _) = self.run.as_ref()?.changes()?;
        let wanted = changer.number(tool).filter(|_| changer.lines.says_tool())?;
        let found = self.modes.as_ref()?.tool.filter(|found| *found != wanted)?;
        Some(Diagnostic::error("changer.other_tool").with("wanted", wanted).with("found", found))
    }

    /// The lines are done: the tool is in, and the head somewhere else.
    fn is_changed(&mut self, place: [f64; 3]) {
        let Some(run) = &self.changer else { return };
        let (tool, before) = (run.tool, run.zero_mm);
        if let Some(why) = self.other_words().or_else(|| self.other_tool(tool)) {
            return self.trouble(why);
        }
        if !self.info.offsets.contains_key("G54") {
            return self.trouble(Diagnostic::error("grbl.answer_missing"));
        }
        let off =
            |axis: usize| self.zero_mm.map_or(f64::INFINITY, |zero| libm::fabs(zero[axis] - before[axis]));
        let off_mm = off(0).max(off(1));
        if off_mm > SAME_ZERO_MM {
            return self.trouble(Diagnostic::error("changer.moved_zero").with("mm", format!("{off_mm:.3}")));
        }
        // What is reported and what is stored are said apart: where they differ a line was damaged on the way.
        if let Some(why) = self.check_listed() {
            return self.trouble(why);
        }
        let Some(run) = &mut self.run else { return };
        run.is_in = true;
        let setter = run.setter();
        self.out.push(EngineAction::ToolFetched { tool });
        match setter {
            None => {
                self.height = BoardHeight::OfThisBit;
                self.tool_ready(place);
            }
            Some(setter) if self.reference_mm.is_some() => {
                self.height = BoardHeight::OfAnotherBit;
                self.measures(setter);
            }
            // Nothing is known to go by: a person touches this one off, and it is measured next.
            Some(_) => {
                self.bit_is_another();
                self.set(EnginePhase::ToolChange);
            }
        }
    }

    /// The tool that is in is measured by itself; where that cannot be, nobody waits for it.
    pub(super) fn measures(&mut self, setter: ToolSetter) {
        match self.setter_refused(&setter) {
            Some(why) => self.trouble(why),
            None => self.measure_tool(setter),
        }
    }

    /// The tool that is in was measured: on, or by that to the change that waits for it.
    pub(super) fn is_measured(&mut self, place_mm: [f64; 3]) {
        let waits =
            self.run.as_ref().filter(|run| !run.is_unasked() && run.changes().is_some() && !run.is_in);
        match waits.map(|run| run.wanted) {
            Some(tool) => self.begin_change(tool),
            None => self.tool_ready(place_mm),
        }
    }

    /// A person is asked after all: what the machine cannot do itself. Told once for a change.
    pub(super) fn person_is_asked(&mut self) {
        let Some(run) = self.run.as_mut().filter(|run| run.changes().is_some()) else { return };
        if !std::mem::replace(&mut run.is_asked, true) {
            let tool = run.wanted;
            self.out.push(EngineAction::ToolWanted { tool });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_that_cannot_be_sent_are_no_macro() {
        let made = |text: &str| ToolMacro::of_lines(text.lines()).map_err(|why| why.code);
        let good = made("M6 T{tool}\n\n  G53 G0 Z-1 (up)  ").unwrap();
        assert_eq!(good.lines(), ["M6 T{tool}", "G53 G0 Z-1 (up)"]);
        assert_eq!(good.of_tool(Some(12)), ["M6 T12", "G53 G0 Z-1 (up)"]);
        assert!(good.asks_number() && made("").unwrap().is_empty());
        let long = format!("({})", "x".repeat(69));
        for bad in ["$H", "$20=0", "G0 X1 !", "G0 ~", "?", "M6 T{number}", "G0 X1\u{18}", "G0 Xä", &long] {
            assert_eq!(made(bad), Err("changer.bad_line".to_owned()), "{bad}");
        }
        assert_eq!(made(&"M5\n".repeat(32)).map(|lines| lines.lines().len()), Ok(32));
        assert_eq!(made(&"M5\n".repeat(33)), Err("changer.too_many".to_owned()));
    }
}
