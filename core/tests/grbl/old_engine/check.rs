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

use super::asks::{EngineAction, EnginePhase, signs};
use super::engine::{Controller, Meaning};
use super::heard::ReportedState;
use super::lines::{WireLine, WordsInForce};
use super::routine::{Routine, SectionKind};
use super::settings;
use super::written::WrittenLine;
use annulus_core::control::{Ending, Trust};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::grbl::CheckNews;
use std::collections::VecDeque;
use std::sync::Arc;

const MOST_TOLD: u32 = 20;
const TOLD_EVERY: u32 = 50;
const RESTS: u32 = 2;
const REST_MS: u64 = 10_000;
const NOT_NOW: [u16; 2] = [8, 9];

#[derive(Clone, Copy, Debug, PartialEq)]
enum CheckStage {
    Asked,
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
pub(super) struct CheckRun {
    routine: Arc<Routine>,
    pen: WordsInForce,
    /// `at`: the next section, with the rest of the previous section in `lines`. With `written`, index of the
    /// next line.
    at: usize,
    lines: VecDeque<WireLine>,
    stage: CheckStage,
    line: u32,
    done: u32,
    of: u32,
    refused: u32,
    why: Option<Diagnostic>,
    written: Arc<[WrittenLine]>,
}

impl CheckRun {
    fn new(routine: Arc<Routine>, written: Arc<[WrittenLine]>, place_mm: [f64; 3]) -> Self {
        let pen = WordsInForce::standing(place_mm);
        let mut counted = pen.clone();
        let sections = 0..routine.sections.len();
        let as_sent = || sections.map(|at| lines_of(&routine, at, &mut counted).len()).sum();
        let of: usize = if written.is_empty() { as_sent() } else { written.len() };
        let (lines, why) = (VecDeque::new(), None);
        let of = u32::try_from(of).unwrap_or(u32::MAX);
        let stage = CheckStage::Asked;
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

    fn over(&self, why: Option<Diagnostic>) -> EngineAction {
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

impl Controller {
    pub(super) fn begin_check(&mut self, routine: Arc<Routine>, written: Arc<[WrittenLine]>) {
        if settings::on(&self.info.values, 20) && self.trust != Trust::Trusted {
            return self.found(Diagnostic::error("grbl.check_not_homed"));
        }
        let Some(place) = self.place() else {
            return self.found(Diagnostic::error("grbl.no_report"));
        };
        let (routine, _) = self.fitted(&routine);
        self.check = Some(CheckRun::new(routine, written, place));
        self.send("$C", Meaning::CheckMode);
        self.set(EnginePhase::Checking);
    }

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

    fn check_fails(&mut self, why: Diagnostic) {
        self.check_is_over(Some(why));
        self.rest();
    }

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

    pub(super) fn check_reported(&mut self, doing: ReportedState, asked_ms: Option<u64>) {
        if self.reset_at.is_some() {
            return;
        }
        let Some(check) = &mut self.check else { return };
        // A report for an older query shows the state before the change.
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

    fn check_was_left(&mut self) {
        let why = Diagnostic::error("grbl.check_left");
        if let Some(check) = &mut self.check {
            (check.stage, check.why) = (CheckStage::Left, Some(why.clone()));
        }
        self.found(why);
        self.stop(Ending::Alarm);
    }

    /// Leaves check mode; `why` is the reason to end early. A second request resets at once.
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

    /// A report while ending. A hold has no effect in check mode, so any other state means that lines may
    /// have run.
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

    pub(super) fn check_greeted(&mut self) {
        let Some(check) = self.check.take() else { return };
        let by_itself = (check.stage != CheckStage::Left).then(|| Diagnostic::error("grbl.check_reset"));
        let why = check.why.clone().or(by_itself);
        self.out.push(check.over(why));
    }

    pub(super) fn check_is_over(&mut self, why: Option<Diagnostic>) {
        if let Some(check) = self.check.take() {
            self.out.push(check.over(why));
        }
    }

    pub(super) fn checked_line(&self) -> Option<(String, u32)> {
        let routine = &self.check.as_ref()?.routine;
        self.buffer.waiting().find_map(|sent| match &sent.meaning {
            Meaning::Check { section, line, .. } => Some((routine.program_of(*section).to_owned(), *line)),
            _ => None,
        })
    }
}
