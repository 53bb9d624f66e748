//! Check mode (`$C`): the controller parses every line of a job and moves nothing. A reset ends check mode;
//! the controller also resets itself when it leaves the mode. The reset happens while stopped, so the
//! position stays valid.
//!
//! ```text
//!  $C ─▶ ok ─▶ report: Check ─▶ lines, as the buffer has room ─▶ all answered ─▶ reset ─▶ banner, result
//!    └─ error, or report: Idle: no check mode     ├─ report: not Check ─▶ hold, reset
//!                                                 └─ STOP ─▶ hold ─▶ report: Check or stopped ─▶ reset
//! ```
//!
//! Send no line before the controller reports check mode: outside it the lines would run. Likewise, don't
//! reset before a report shows that nothing moves: a reset in motion loses the position.

use super::activity::Activity;
use super::asks::{CheckNews, EngineAction, realtime};
use super::context::{Context, Report};
use super::heard::ReportedState;
use super::line::Meaning;
use super::lines::{WireLine, WordsInForce};
use super::routine::{Routine, SectionKind};
use super::settings;
use super::written::WrittenLine;
use crate::control::{Ending, Trust};
use crate::diagnostic::Diagnostic;
use crate::error;
use std::collections::VecDeque;
use std::sync::Arc;

/// Refused lines that are reported in full; the others are only counted.
const MOST_TOLD: u32 = 20;
const TOLD_EVERY: u32 = 50;
/// Idle reports after which we conclude that there is no check mode.
const RESTS: u32 = 2;
/// Longest time to stop if the controller has left check mode by itself.
const REST_MS: u64 = 10_000;
/// Errors of `$C` that mean "not now": not idle, locked.
const NOT_NOW: [u16; 2] = [8, 9];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Asked,
    /// `$C` was answered at `ms`. Send nothing before a report shows Check.
    Answered {
        ms: u64,
        rests: u32,
    },
    Reading,
    /// End requested at `ms`: reset as soon as a report shows that nothing moves. `reads`: lines were sent.
    Ending {
        ms: u64,
        reads: bool,
    },
    Left,
}

#[derive(Debug)]
pub(super) struct Checking {
    routine: Arc<Routine>,
    pen: WordsInForce,
    /// `at`: the next section, with the rest of the previous section in `lines`. With `written`, index of the
    /// next line.
    at: usize,
    lines: VecDeque<WireLine>,
    stage: Stage,
    line: u32,
    done: u32,
    of: u32,
    refused: u32,
    why: Option<Diagnostic>,
    /// Lines as in the files; if empty, lines as a job sends them.
    written: Arc<[WrittenLine]>,
}

impl Checking {
    fn new(routine: Arc<Routine>, written: Arc<[WrittenLine]>, place_mm: [f64; 3]) -> Self {
        let pen = WordsInForce::standing(place_mm);
        let mut counted = pen.clone();
        let sections = 0..routine.sections.len();
        let as_sent = || sections.map(|at| lines_of(&routine, at, &mut counted).len()).sum();
        let of: usize = if written.is_empty() { as_sent() } else { written.len() };
        let (lines, why) = (VecDeque::new(), None);
        let of = u32::try_from(of).unwrap_or(u32::MAX);
        let stage = Stage::Asked;
        Self { routine, pen, at: 0, lines, stage, line: 0, done: 0, of, refused: 0, why, written }
    }

    fn next(&mut self) -> Option<(String, usize, u32)> {
        if !self.written.is_empty() {
            let next = self.written.get(self.at)?;
            self.at += 1;
            return Some((next.text.clone(), next.section, next.line));
        }
        while self.lines.is_empty() && self.at < self.routine.sections.len() {
            self.lines = lines_of(&self.routine, self.at, &mut self.pen).into();
            self.at += 1;
        }
        let next = self.lines.pop_front()?;
        // Lines that the engine adds belong to the program line after them.
        let mut sources = std::iter::once(&next).chain(&self.lines).map(|line| line.source);
        let line = sources.find(|line| *line > 0).unwrap_or(self.line);
        self.line = line;
        Some((next.text, self.at.saturating_sub(1), self.line))
    }

    pub(super) fn over(&self, why: Option<Diagnostic>) -> EngineAction {
        let (done, of, refused) = (self.done, self.of, self.refused);
        EngineAction::Check(CheckNews::Over { done, of, refused, why })
    }
}

/// Lines of a section as a job sends them. Actions before its entry are sent as programmed.
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

impl Checking {
    pub(super) fn start(
        cx: &mut Context,
        routine: &Arc<Routine>,
        written: Arc<[WrittenLine]>,
    ) -> Result<Box<Self>, Diagnostic> {
        // Soft limits apply in check mode too: without homing they would refuse good lines.
        if settings::on(&cx.known.info.values, 20) && cx.known.trust != Trust::Trusted {
            return Err(error!("grbl.check_not_homed"));
        }
        let place = cx.known.place().ok_or_else(|| error!("grbl.no_report"))?;
        let (routine, _) = cx.known.fitted(routine);
        cx.send("$C", Meaning::CheckMode);
        Ok(Box::new(Self::new(routine, written, place)))
    }

    pub(super) fn on_mode_answer(mut self: Box<Self>, cx: &mut Context, error: Option<u16>) -> Activity {
        if self.stage != Stage::Asked {
            return Activity::Checking(self);
        }
        let Some(number) = error else {
            self.stage = Stage::Answered { ms: cx.now_ms, rests: 0 };
            return Activity::Checking(self);
        };
        let why = if NOT_NOW.contains(&number) {
            settings::refused(number, "$C")
        } else {
            error!("grbl.no_check_mode")
        };
        self.fail(cx, why)
    }

    /// Nothing was read; the controller is unchanged.
    fn fail(self, cx: &mut Context, why: Diagnostic) -> Activity {
        cx.out.push(self.over(Some(why)));
        cx.line.queue.clear();
        Activity::Ready
    }

    pub(super) fn feed(&mut self, cx: &mut Context) -> bool {
        if self.stage != Stage::Reading || cx.line.reset_at.is_some() {
            return false;
        }
        if let Some((text, section, line)) = self.next() {
            cx.send(&text, Meaning::Check { section, line });
            return true;
        }
        // Only after the last answer: the reset that leaves check mode drops unread lines.
        if cx.line.buffer.is_empty() {
            self.leave(cx, None);
        }
        false
    }

    pub(super) fn on_answer(
        &mut self,
        cx: &mut Context,
        text: &str,
        (section, line): (usize, u32),
        error: Option<u16>,
    ) {
        self.done += 1;
        let (done, of) = (self.done, self.of);
        if let Some(number) = error {
            self.refused += 1;
            if self.refused <= MOST_TOLD {
                let why = settings::refused(number, text).at(self.routine.program_of(section), line, 1);
                cx.out.push(EngineAction::Check(CheckNews::Refused { why }));
            }
        }
        if done.is_multiple_of(TOLD_EVERY) || done == of {
            cx.out.push(EngineAction::Check(CheckNews::Read { done, of }));
        }
    }

    pub(super) fn on_report(mut self: Box<Self>, cx: &mut Context, report: Report) -> Activity {
        if cx.line.reset_at.is_some() {
            return Activity::Checking(self);
        }
        // A report for an older query shows the state before the change.
        let asked_ms = cx.line.last_ask_ms;
        let is_older = |ms: u64| !report.fresh || asked_ms < ms;
        let (ms, rests) = match self.stage {
            Stage::Reading if report.doing != ReportedState::Check => return self.on_mode_left(cx),
            Stage::Ending { ms, reads } if !is_older(ms) => {
                self.end(cx, report.doing, ms, reads);
                return Activity::Checking(self);
            }
            Stage::Answered { ms, rests } if !is_older(ms) => (ms, rests),
            _ => return Activity::Checking(self),
        };
        match report.doing {
            ReportedState::Check => self.stage = Stage::Reading,
            ReportedState::Idle if rests + 1 < RESTS => self.stage = Stage::Answered { ms, rests: rests + 1 },
            ReportedState::Idle => return self.fail(cx, error!("grbl.no_check_mode")),
            _ => return self.on_mode_left(cx),
        }
        Activity::Checking(self)
    }

    /// The controller left check mode and may execute the lines sent.
    fn on_mode_left(mut self: Box<Self>, cx: &mut Context) -> Activity {
        let why = error!("grbl.check_left");
        (self.stage, self.why) = (Stage::Left, Some(why.clone()));
        cx.found(why);
        Activity::Checking(self).stop(cx, Ending::Alarm)
    }

    /// Leaves check mode; `why` is the reason to end early. A second request resets at once.
    pub(super) fn leave(&mut self, cx: &mut Context, why: Option<Diagnostic>) {
        let ends = match self.stage {
            Stage::Left => return,
            Stage::Ending { .. } => true,
            _ => why.is_none(),
        };
        if ends {
            self.why = self.why.take().or(why);
            self.stage = Stage::Left;
            return cx.reset();
        }
        let reads = self.stage == Stage::Reading;
        (self.stage, self.why) = (Stage::Ending { ms: cx.now_ms, reads }, why);
        cx.line.queue.clear();
        // If the controller left check mode unnoticed, the hold stops what it runs.
        cx.write(realtime::HOLD);
        // A report that is still due may show the state before the hold.
        cx.line.asked_ms = None;
    }

    /// A report while ending. A hold has no effect in check mode, so any other state means that lines may
    /// have run.
    fn end(&mut self, cx: &mut Context, doing: ReportedState, ms: u64, reads: bool) {
        let was_left = reads && doing != ReportedState::Check;
        let left = error!("grbl.check_left");
        if was_left && self.why.as_ref().is_none_or(|why| why.code != left.code) {
            self.why = Some(left.clone());
            cx.found(left);
        }
        let late = cx.now_ms >= ms + REST_MS;
        if late {
            cx.known.lose_place();
        } else if !doing.is_at_rest() && !doing.is_held_at_rest() {
            return cx.write(realtime::HOLD);
        }
        self.stage = Stage::Left;
        cx.reset();
    }

    /// The controller sent its banner: it is out of check mode.
    pub(super) fn on_banner(&self) -> EngineAction {
        let by_itself = (self.stage != Stage::Left).then(|| error!("grbl.check_reset"));
        self.over(self.why.clone().or(by_itself))
    }

    /// Program and line being checked: the oldest unanswered.
    pub(super) fn line_in_work(&self, cx: &Context) -> Option<(String, u32)> {
        cx.line.buffer.waiting().find_map(|sent| match &sent.meaning {
            Meaning::Check { section, line } => Some((self.routine.program_of(*section).to_owned(), *line)),
            _ => None,
        })
    }
}
