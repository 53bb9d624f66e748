//! Check mode (`$C`): the controller reads every line of a job as it would run it, and moves nothing. It is left by beginning anew, as
//! the controller does by itself when it leaves that mode: at rest, so the place stays known.
//!
//! ```text
//!  $C ─▶ ok ─▶ a report says Check ─▶ lines, by the room in its buffer ─▶ all answered ─▶ reset ─▶ greeting, told
//!    └─ error, or reports of rest: it has no such mode          ├─ anything but Check is reported: hold, reset
//!                                                               └─ STOP ─▶ hold ─▶ a report says Check or rest ─▶ reset
//! ```
//!
//! No line is sent before the controller has said that it is in that mode: outside of it the same lines would be run. For the same reason
//! none is broken off by a reset before a report has said that nothing moves: in motion that would lose the place.
//!
//! Comes in: asks, answers, reports. Goes out: lines, what was refused of them. Does not know how that is shown.

use super::asks::{EngineAction, EnginePhase, signs};
use super::engine::{Controller, Meaning};
use super::heard::ReportedState;
use super::lines::{WireLine, WordsInForce};
use super::routine::{Routine, SectionKind};
use super::settings;
use crate::control::{Ending, Trust};
use crate::diagnostic::Diagnostic;
use std::collections::VecDeque;
use std::sync::Arc;

/// Refused lines that are told; the others are counted.
const MOST_TOLD: u32 = 20;
/// Between two tells of how far it is, lines.
const TOLD_EVERY: u32 = 50;
/// Reports of rest after which it has no check mode.
const RESTS: u32 = 2;
/// How long it may take to come to rest where it has left check mode by itself.
const REST_MS: u64 = 10_000;
/// Errors of `$C` that say that it cannot be now: not idle, locked.
const NOT_NOW: [u16; 2] = [8, 9];

/// What comes of a job that is read in check mode.
#[derive(Clone, Debug, PartialEq)]
pub enum CheckNews {
    /// So many lines were read.
    Read {
        /// Lines that were answered.
        done: u32,
        /// And how many there are.
        of: u32,
    },
    /// A line was refused.
    Refused {
        /// The error, at the line of the program.
        why: Diagnostic,
    },
    /// The controller has left check mode, or is gone.
    Over {
        /// Lines that were answered.
        done: u32,
        /// And how many there are.
        of: u32,
        /// How many of them were refused; not all of these were told.
        refused: u32,
        /// Why it did not come to its end.
        why: Option<Diagnostic>,
    },
}

/// How far it is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum CheckStage {
    /// `$C` was sent.
    Asked,
    /// It was answered, then; nothing is sent before a report says the same.
    Answered { ms: u64, rests: u32 },
    /// The controller is in check mode.
    Reading,
    /// It is to end, asked then: it begins anew once a report says that nothing moves. Lines were sent.
    Ending { ms: u64, reads: bool },
    /// It begins anew.
    Left,
}

/// A job that is read.
#[derive(Debug)]
pub(super) struct CheckRun {
    routine: Arc<Routine>,
    pen: WordsInForce,
    /// The section whose lines come next, and lines of the one before.
    at: usize,
    lines: VecDeque<WireLine>,
    stage: CheckStage,
    /// The line of the program in work.
    line: u32,
    done: u32,
    of: u32,
    refused: u32,
    why: Option<Diagnostic>,
}

impl CheckRun {
    fn new(routine: Arc<Routine>, place_mm: [f64; 3]) -> Self {
        let pen = WordsInForce::standing(place_mm);
        let mut counted = pen.clone();
        let sections = 0..routine.sections.len();
        let of: usize = sections.map(|at| lines_of(&routine, at, &mut counted).len()).sum();
        let (lines, why) = (VecDeque::new(), None);
        let of = u32::try_from(of).unwrap_or(u32::MAX);
        let stage = CheckStage::Asked;
        Self { routine, pen, at: 0, lines, stage, line: 0, done: 0, of, refused: 0, why }
    }

    /// The next line, with the section and the line of the program that it is of.
    fn next(&mut self) -> Option<(String, usize, u32)> {
        while self.lines.is_empty() && self.at < self.routine.sections.len() {
            self.lines = lines_of(&self.routine, self.at, &mut self.pen).into();
            self.at += 1;
        }
        let next = self.lines.pop_front()?;
        // What the engine adds belongs to what comes next.
        let mut sources = std::iter::once(&next).chain(&self.lines).map(|line| line.source);
        let line = sources.find(|line| *line > 0).unwrap_or(self.line);
        self.line = line;
        Some((next.text, self.at.saturating_sub(1), self.line))
    }

    fn over(&self, why: Option<Diagnostic>) -> EngineAction {
        let (done, of, refused) = (self.done, self.of, self.refused);
        EngineAction::Check(CheckNews::Over { done, of, refused, why })
    }
}

/// Lines of a section: as a job sends them, and what is before its entry in the words of the program.
fn lines_of(routine: &Routine, at: usize, pen: &mut WordsInForce) -> Vec<WireLine> {
    let Some(section) = routine.sections.get(at) else { return Vec::new() };
    let changed = at > 0 && matches!(routine.sections[at - 1].kind, SectionKind::Change(_));
    let mut lines = Vec::new();
    if at == 0 || changed {
        lines.extend(pen.words());
        lines.extend(pen.rise(section, routine.safe));
    }
    for (index, action) in section.actions.iter().enumerate() {
        if (at == 0 || changed) && index == section.approach {
            lines.extend(pen.over(section, routine.safe, 0.0));
        }
        lines.extend(pen.act(action));
    }
    lines
}

impl Controller {
    /// Begins.
    pub(super) fn begin_check(&mut self, routine: Arc<Routine>) {
        if settings::on(&self.info.values, 20) && self.trust != Trust::Trusted {
            return self.found(Diagnostic::error("grbl.check_not_homed"));
        }
        let Some(place) = self.place() else {
            return self.found(Diagnostic::error("grbl.no_report"));
        };
        self.check = Some(CheckRun::new(routine, place));
        self.send("$C", Meaning::CheckMode);
        self.set(EnginePhase::Checking);
    }

    /// `$C` was answered.
    pub(super) fn check_mode_answered(&mut self, error: Option<u16>) {
        let ms = self.now_ms;
        let Some(check) = self.check.as_mut().filter(|check| check.stage == CheckStage::Asked) else {
            return;
        };
        let Some(number) = error else {
            check.stage = CheckStage::Answered { ms, rests: 0 };
            return;
        };
        let why = if NOT_NOW.contains(&number) {
            Diagnostic::error(&settings::error_code(number)).with("number", number).with("line", "$C")
        } else {
            Diagnostic::error("grbl.no_check_mode")
        };
        self.check_fails(why);
    }

    /// Nothing was read, and the controller is as it was before.
    fn check_fails(&mut self, why: Diagnostic) {
        self.check_is_over(Some(why));
        self.rest();
    }

    /// Puts the next line into the queue, if there is one that may go.
    pub(super) fn feed_check(&mut self) -> bool {
        let is_idle = self.buffer.is_empty();
        if self.phase != EnginePhase::Checking || self.reset_at.is_some() {
            return false;
        }
        let Some(check) = self.check.as_mut().filter(|check| check.stage == CheckStage::Reading) else {
            return false;
        };
        if let Some((text, section, line)) = check.next() {
            self.send(&text, Meaning::Check { text: text.clone(), section, line });
            return true;
        }
        if is_idle {
            self.leave_check(None);
        }
        false
    }

    /// A line was answered.
    pub(super) fn check_answered(&mut self, text: &str, (section, line): (usize, u32), error: Option<u16>) {
        let Some(check) = &mut self.check else { return };
        check.done += 1;
        let (done, of) = (check.done, check.of);
        if let Some(number) = error {
            check.refused += 1;
            if check.refused <= MOST_TOLD {
                let why = Diagnostic::error(&settings::error_code(number)).with("number", number);
                let why = why.with("line", text).at(check.routine.program_of(section), line, 1);
                self.out.push(EngineAction::Check(CheckNews::Refused { why }));
            }
        }
        if done.is_multiple_of(TOLD_EVERY) || done == of {
            self.out.push(EngineAction::Check(CheckNews::Read { done, of }));
        }
    }

    /// A report meanwhile; it answers a question of `asked_ms`, or none.
    pub(super) fn check_reported(&mut self, doing: ReportedState, asked_ms: Option<u64>) {
        if self.reset_at.is_some() {
            return;
        }
        let Some(check) = &mut self.check else { return };
        // An older report is of before.
        let is_older = |ms: u64| asked_ms.is_none_or(|asked_ms| asked_ms < ms);
        let (ms, rests) = match check.stage {
            CheckStage::Reading if doing != ReportedState::Check => return self.check_was_left(),
            CheckStage::Ending { ms, reads } if !is_older(ms) => return self.check_ends(doing, ms, reads),
            CheckStage::Answered { ms, rests } if !is_older(ms) => (ms, rests),
            _ => return,
        };
        match doing {
            ReportedState::Check => check.stage = CheckStage::Reading,
            ReportedState::Idle if rests + 1 < RESTS => {
                check.stage = CheckStage::Answered { ms, rests: rests + 1 };
            }
            ReportedState::Idle => self.check_fails(Diagnostic::error("grbl.no_check_mode")),
            _ => self.check_was_left(),
        }
    }

    /// It is not in check mode any more, and may run what it was to read.
    fn check_was_left(&mut self) {
        let why = Diagnostic::error("grbl.check_left");
        if let Some(check) = &mut self.check {
            (check.stage, check.why) = (CheckStage::Left, Some(why.clone()));
        }
        self.found(why);
        self.stop(Ending::Alarm);
    }

    /// Out of check mode; `why` is what ended it before all was read. Asked twice: at once.
    pub(super) fn leave_check(&mut self, why: Option<Diagnostic>) {
        let ms = self.now_ms;
        let Some(check) = self.check.as_mut().filter(|check| check.stage != CheckStage::Left) else { return };
        let ends = matches!(check.stage, CheckStage::Ending { .. });
        if ends || why.is_none() {
            check.why = check.why.take().or(why);
            check.stage = CheckStage::Left;
            return self.reset();
        }
        let reads = check.stage == CheckStage::Reading;
        (check.stage, check.why) = (CheckStage::Ending { ms, reads }, why);
        self.queue.clear();
        self.write(signs::HOLD);
        self.asked_ms = None;
    }

    /// A report while it is to end. In check mode a hold is none: whatever else it says, lines may have been run.
    fn check_ends(&mut self, doing: ReportedState, ms: u64, reads: bool) {
        let was_left = reads && doing != ReportedState::Check;
        let left = Diagnostic::error("grbl.check_left");
        if let Some(check) = self.check.as_mut().filter(|_| was_left)
            && check.why.as_ref().is_none_or(|why| why.code != left.code)
        {
            check.why = Some(left.clone());
            self.found(left);
        }
        let late = self.now_ms >= ms + REST_MS;
        if late {
            self.lose_place();
        } else if !doing.is_at_rest() && !doing.is_held_at_rest() {
            return self.write(signs::HOLD);
        }
        if let Some(check) = &mut self.check {
            check.stage = CheckStage::Left;
        }
        self.reset();
    }

    /// The controller greeted: it is out of check mode.
    pub(super) fn check_greeted(&mut self) {
        let Some(check) = self.check.take() else { return };
        let by_itself = (check.stage != CheckStage::Left).then(|| Diagnostic::error("grbl.check_reset"));
        let why = check.why.clone().or(by_itself);
        self.out.push(check.over(why));
    }

    /// Something else ended it: an alarm, a cable.
    pub(super) fn check_is_over(&mut self, why: Option<Diagnostic>) {
        if let Some(check) = self.check.take() {
            self.out.push(check.over(why));
        }
    }

    /// The line of the program that is being read, and its text: the oldest without an answer.
    pub(super) fn checked_line(&self) -> Option<(String, u32)> {
        let routine = &self.check.as_ref()?.routine;
        self.buffer.waiting().find_map(|sent| match &sent.meaning {
            Meaning::Check { section, line, .. } => Some((routine.program_of(*section).to_owned(), *line)),
            _ => None,
        })
    }
}
