//! Automatic tool change: sends the lines of the tool change macro instead of asking the user.
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

use super::activity::Activity;
use super::asks::EngineAction;
use super::context::{Context, Report};
use super::job::{Job, JobTool};
use super::known::{Known, SAME_ZERO_MM};
use super::line::{ChangerLine, Meaning};
use super::lines::number;
use super::measuring::Measuring;
use super::running::Running;
use super::settings;
use super::tool_change::ToolChange;
use crate::control::{BoardHeight, Ending};
use crate::diagnostic::Diagnostic;
use crate::error;
use std::collections::VecDeque;

/// Tolerance when checking that the tip is at its safe height, mm.
const SAME_MM: f64 = 0.02;
/// Modal words in force before and after the macro: M5 G17 G21 G94 G54.
const WORDS: [(char, u16); 5] = [('M', 50), ('G', 170), ('G', 210), ('G', 940), ('G', 540)];

#[derive(Debug)]
pub(super) struct Changing {
    pub(super) job: Box<Job>,
    tool: u32,
    left: VecDeque<String>,
    /// The current macro line.
    text: String,
    /// Number of the current line, from 1; 0 before the first.
    at: u32,
    /// Number of lines.
    of: u32,
    /// The macro has ended.
    is_behind: bool,
    /// All lines are answered; a report must show the final position.
    is_answered: bool,
    /// The query for that report was sent.
    is_asked: bool,
    /// Work zero before the change.
    zero_mm: [f64; 3],
}

impl Changing {
    pub(super) fn start(cx: &mut Context, job: Box<Job>, tool: u32) -> Activity {
        let (Some(zero_mm), Some(place)) = (cx.known.zero_mm, cx.known.place()) else {
            return Running::go(job).trouble(cx, error!("grbl.no_report"));
        };
        let Some((changer, safe_mm)) = job.changes() else { return Running::go(job) };
        let left = changer.lines.of_tool(changer.number(tool));
        // Forget the modal words, so that a lost `$G` answer is noticed.
        cx.known.modes = None;
        send_modal_defaults(cx);
        // A macro may start sideways: it begins at the safe height only.
        if place[2] < safe_mm - SAME_MM {
            cx.send(&format!("G90G0Z{}", number(safe_mm)), Meaning::Changer(ChangerLine::Word));
            cx.send("G4P0", Meaning::Changer(ChangerLine::Word));
        }
        cx.send("$G", Meaning::Changer(ChangerLine::Ready));
        Activity::Changing(Self {
            job,
            tool,
            of: left.len() as u32,
            left,
            text: String::new(),
            at: 0,
            is_behind: false,
            is_answered: false,
            is_asked: false,
            zero_mm,
        })
    }

    pub(super) fn progress(&self) -> [u32; 2] {
        [self.at.max(1), self.of]
    }

    fn trouble(self, cx: &mut Context, why: Diagnostic) -> Activity {
        Activity::Changing(self).trouble(cx, why)
    }

    pub(super) fn on_answer(mut self, cx: &mut Context, line: ChangerLine, error: Option<u16>) -> Activity {
        if let Some(number) = error {
            let why = if line == ChangerLine::Own {
                error!("changer.refused", line = self.at, text = &self.text, ..)
            } else {
                Diagnostic::error(&settings::error_code(number)).with("line", "")
            };
            return self.trouble(cx, why.with("number", number));
        }
        match line {
            ChangerLine::Word => {}
            ChangerLine::Own => cx.send("G4P0", Meaning::Changer(ChangerLine::Rest)),
            ChangerLine::Rest => self.send_next_line(cx),
            ChangerLine::Ready | ChangerLine::Again => self.is_answered = true,
        }
        Activity::Changing(self)
    }

    /// Sends the next macro line; after the last one our modal words and a query of the stored offsets.
    fn send_next_line(&mut self, cx: &mut Context) {
        if let Some(text) = self.left.pop_front() {
            self.at += 1;
            cx.send(&text, Meaning::Changer(ChangerLine::Own));
            self.text = text;
            return;
        }
        self.is_behind = true;
        // Forget offsets and modal words, so that a missing answer to `$#` or `$G` is noticed.
        for name in ["G54", "G92", "TLO"] {
            cx.known.info.offsets.remove(name);
        }
        cx.known.modes = None;
        send_modal_defaults(cx);
        cx.send("$#", Meaning::Changer(ChangerLine::Word));
        cx.send("$G", Meaning::Changer(ChangerLine::Again));
    }

    /// A status query is sent: it will show the final position of the head, if `is_empty`, the line.
    pub(super) fn on_query(&mut self, is_empty: bool) {
        self.is_asked = is_empty && self.is_answered;
    }

    pub(super) fn on_report(mut self, cx: &mut Context, report: Report) -> Activity {
        let place = cx.known.place().filter(|_| report.is_idle() && self.is_answered && self.is_asked);
        let Some(place) = place else { return Activity::Changing(self) };
        (self.is_answered, self.is_asked) = (false, false);
        if self.is_behind {
            return self.finish_change(cx, place);
        }
        let safe_mm = self.job.changes().map_or(0.0, |(_, safe_mm)| safe_mm);
        if let Some(why) = cx.known.other_word(&WORDS) {
            self.trouble(cx, why)
        } else if place[2] < safe_mm - SAME_MM {
            let why = error!("changer.not_up", z = format!("{:.3}", place[2]), ..);
            self.trouble(cx, why.with("safe", number(safe_mm)))
        } else {
            self.send_next_line(cx);
            Activity::Changing(self)
        }
    }

    fn other_tool(&self, known: &Known) -> Option<Diagnostic> {
        let (changer, _) = self.job.changes()?;
        let wanted = changer.number(self.tool).filter(|_| changer.lines.says_tool())?;
        let found = known.modes.as_ref()?.tool.filter(|found| *found != wanted)?;
        Some(error!("changer.other_tool", wanted = wanted, found = found))
    }

    /// Why the job can't continue after the macro.
    fn problem(&self, known: &Known) -> Option<Diagnostic> {
        if let Some(why) = known.other_word(&WORDS).or_else(|| self.other_tool(known)) {
            return Some(why);
        }
        if !known.info.offsets.contains_key("G54") {
            return Some(error!("grbl.answer_missing"));
        }
        let before = self.zero_mm;
        let off =
            |axis: usize| known.zero_mm.map_or(f64::INFINITY, |zero| libm::fabs(zero[axis] - before[axis]));
        // Z may differ: the macro may set a tool length.
        let off_mm = off(0).max(off(1));
        if off_mm > SAME_ZERO_MM {
            return Some(error!("changer.moved_zero", mm = format!("{off_mm:.3}")));
        }
        // Work zero is sent twice, in reports and in `$#`: a difference means that a line was damaged.
        known.check_listed()
    }

    /// The macro has ended: the tool is in, and the head may be elsewhere.
    fn finish_change(mut self, cx: &mut Context, place: [f64; 3]) -> Activity {
        if let Some(why) = self.problem(&cx.known) {
            return self.trouble(cx, why);
        }
        self.job.tool = JobTool::In(self.tool);
        cx.out.push(EngineAction::ToolFetched { tool: self.tool });
        let Some(setter) = self.job.setter() else {
            // All tools are equally long, or the macro compensates their lengths.
            cx.known.height = BoardHeight::OfThisBit;
            return Running::continue_with_tool(cx, self.job, place);
        };
        if cx.known.reference_mm.is_none() {
            // There is no reference to measure against. The user touches this tool off, then the setter
            // measures it.
            cx.known.change_tool(self.job.has_equal_tools());
            return ToolChange::start(cx, self.job);
        }
        cx.known.height = BoardHeight::OfAnotherBit;
        // If that is impossible, the job ends: no user is waiting there.
        if let Some(why) = cx.known.setter_refused(&setter) {
            return self.trouble(cx, why);
        }
        Measuring::start(cx, self.job, setter).unwrap_or_else(|job| Running::go(job).stop(cx, Ending::Alarm))
    }
}

fn send_modal_defaults(cx: &mut Context) {
    for text in ["M5M9", "G21G17G90G94", "G54"] {
        cx.send(text, Meaning::Changer(ChangerLine::Word));
    }
}
