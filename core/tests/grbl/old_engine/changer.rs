//! Automatic tool change: at a tool change, send the user's macro lines instead of asking the user.
//!
//! ```text
//!  ready  M5M9 G21G17G90G94 G54 · G90G0Z… · $G ?   spindle off, tip at safe height: checked before line 1
//!  lines  M6T3 · …                                 one at a time, each after the answer to G4P0 (stopped)
//!  again  M5M9 G21G17G90G94 G54 · $# $G ?          modal words, stored offsets, tool number, position
//! ```
//!
//! Afterwards the tool is measured if there is a tool setter. Without one, the macro's author is responsible:
//! the macro sets a length offset, or all tools have one length. If the zero of X or Y has changed, the job
//! ends.

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
use annulus_core::diagnostic::Diagnostic;
pub(super) use annulus_core::grbl::Changer;
use annulus_core::grbl::{TOOL_MARK, ToolMacro};
use std::collections::VecDeque;

const SAME_MM: f64 = 0.02;
/// Longest wait for an answer while the controller reports Idle, s: a tool fetching line is answered only
/// when the tool is in.
pub(super) const LINE_S: f64 = 120.0;

pub(super) trait Lines {
    fn asks_number(&self) -> bool;
    fn says_tool(&self) -> bool;
    fn of_tool(&self, number: Option<u32>) -> VecDeque<String>;
}

impl Lines for ToolMacro {
    fn asks_number(&self) -> bool {
        self.lines().iter().any(|line| line.contains(TOOL_MARK))
    }

    fn says_tool(&self) -> bool {
        let word = format!("T{TOOL_MARK}");
        self.lines()
            .iter()
            .any(|line| line.to_ascii_uppercase().replace(' ', "").contains(&word.to_ascii_uppercase()))
    }

    fn of_tool(&self, number: Option<u32>) -> VecDeque<String> {
        let number = number.map(|number| number.to_string()).unwrap_or_default();
        self.lines().iter().map(|line| line.replace(TOOL_MARK, &number)).collect()
    }
}

pub(super) trait Numbers {
    fn number(&self, tool: u32) -> Option<u32>;
}

impl Numbers for Changer {
    fn number(&self, tool: u32) -> Option<u32> {
        self.numbers.get(tool as usize).copied().flatten()
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ChangerLine {
    Word,
    Ready,
    Own,
    Rest,
    Again,
}

#[derive(Debug)]
pub(super) struct ChangerRun {
    tool: u32,
    left: VecDeque<String>,
    text: String,
    at: u32,
    of: u32,
    is_behind: bool,
    answered: bool,
    asked: bool,
    zero_mm: [f64; 3],
}

impl Controller {
    pub fn changing(&self) -> Option<[u32; 2]> {
        self.changer.as_ref().map(|run| [run.at.max(1), run.of])
    }

    pub(super) fn check_changer(&self, start: &EngineStart) -> Vec<Diagnostic> {
        let Some(changer) = &start.changer else { return Vec::new() };
        let sections = start.routine.sections.iter().skip(start.from);
        let later = sections.filter_map(|section| match section.kind {
            SectionKind::Change(tool) if !start.routine.stops.contains(&tool) => Some(tool),
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

    /// Sends the next macro line; after the last one our modal words and a query of the stored offsets.
    fn changer_goes(&mut self) {
        let Some(run) = &mut self.changer else { return };
        if let Some(text) = run.left.pop_front() {
            run.at += 1;
            run.text.clone_from(&text);
            return self.send(&text, Meaning::Changer(ChangerLine::Own));
        }
        run.is_behind = true;
        // Forget offsets and modal words, so that a missing answer to `$#` or `$G` is noticed.
        for name in ["G54", "G92", "TLO"] {
            self.info.offsets.remove(name);
        }
        self.modes = None;
        self.says_words();
        self.send("$#", Meaning::Changer(ChangerLine::Word));
        self.send("$G", Meaning::Changer(ChangerLine::Again));
    }

    pub(super) fn changer_asked(&mut self) {
        let idle = self.buffer.is_empty() && self.queue.is_empty();
        if let Some(run) = &mut self.changer {
            run.asked = idle && run.answered;
        }
    }

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

    fn other_words(&self) -> Option<Diagnostic> {
        let Some(modes) = &self.modes else { return Some(Diagnostic::error("grbl.answer_missing")) };
        let wanted = [('M', 50), ('G', 170), ('G', 210), ('G', 940), ('G', 540)];
        let (letter, tenths) = wanted.into_iter().find(|(letter, tenths)| !modes.says(*letter, *tenths))?;
        let word = format!("{letter}{}", f64::from(tenths) / 10.0);
        Some(Diagnostic::error("grbl.modes_differ").with("word", word))
    }

    fn other_tool(&self, tool: u32) -> Option<Diagnostic> {
        let (changer, _) = self.run.as_ref()?.changes()?;
        let wanted = changer.number(tool).filter(|_| changer.lines.says_tool())?;
        let found = self.modes.as_ref()?.tool.filter(|found| *found != wanted)?;
        Some(Diagnostic::error("changer.other_tool").with("wanted", wanted).with("found", found))
    }

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
        // Z may differ: the macro may set a tool length.
        let off_mm = off(0).max(off(1));
        if off_mm > SAME_ZERO_MM {
            return self.trouble(Diagnostic::error("changer.moved_zero").with("mm", format!("{off_mm:.3}")));
        }
        // Work zero is sent twice, in reports and in `$#`: a difference means that a line was damaged.
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
            // There is no reference to measure against. The user touches this tool off, then the setter
            // measures it.
            Some(_) => {
                self.bit_is_another();
                self.set(EnginePhase::ToolChange);
            }
        }
    }

    /// Measures the tool without asking. If that is impossible, the job ends: no user is waiting there.
    pub(super) fn measures(&mut self, setter: ToolSetter) {
        match self.setter_refused(&setter) {
            Some(why) => self.trouble(why),
            None => self.measure_tool(setter),
        }
    }

    pub(super) fn is_measured(&mut self, place_mm: [f64; 3]) {
        let waits =
            self.run.as_ref().filter(|run| !run.is_unasked() && run.changes().is_some() && !run.is_in);
        match waits.map(|run| run.wanted) {
            Some(tool) => self.begin_change(tool),
            None => self.tool_ready(place_mm),
        }
    }

    pub(super) fn person_is_asked(&mut self) {
        let Some(run) = self.run.as_mut().filter(|run| run.changes().is_some()) else { return };
        if !std::mem::replace(&mut run.is_asked, true) {
            let tool = run.wanted;
            self.out.push(EngineAction::ToolWanted { tool });
        }
    }
}
