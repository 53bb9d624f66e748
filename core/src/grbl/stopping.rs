//! Ends an activity: a feed hold, then a reset at standstill. A reset in motion would lose the position.

use super::activity::{Activity, Work};
use super::asks::realtime;
use super::context::{Context, Report};
use super::heard::ReportedState;
use crate::control::Ending;
use crate::diagnostic::Diagnostic;
use crate::warning;

/// Idle reports without the requested hold that count as proof.
pub(super) const IDLE_REPORTS: u32 = 4;
/// Longest time to stop.
const REST_MS: u64 = 10_000;

#[derive(Debug)]
pub(super) struct Stopping {
    pub(super) work: Work,
    pub(super) ending: Ending,
    idle_reports: u32,
}

impl Stopping {
    pub(super) fn on_report(mut self, cx: &mut Context, report: Report) -> Activity {
        if cx.line.reset_at.is_some() {
            return Activity::Stopping(self);
        }
        let late = cx.now_ms >= cx.since_ms + REST_MS;
        match report.doing {
            // At standstill a reset keeps the position.
            doing if doing == ReportedState::Check || doing.is_held_at_rest() => cx.reset(),
            doing if late || matches!(doing, ReportedState::Alarm | ReportedState::Sleep) => {
                cx.known.lose_place();
                cx.reset();
            }
            ReportedState::Idle => {
                // The hold may have come when nothing moved, or got lost: repeat it, then reset.
                self.idle_reports += 1;
                if self.idle_reports >= IDLE_REPORTS {
                    cx.reset();
                } else {
                    cx.write(realtime::HOLD);
                }
            }
            ReportedState::Run | ReportedState::Jog => cx.write(realtime::HOLD),
            _ => {}
        }
        Activity::Stopping(self)
    }
}

impl Activity {
    pub(super) fn stop(self, cx: &mut Context, ending: Ending) -> Self {
        if matches!(self, Self::Changing(_)) {
            cx.found(warning!("changer.stopped"));
        }
        cx.line.queue.clear();
        cx.write(realtime::HOLD);
        // A report that is still due may show the state before the hold.
        cx.line.asked_ms = None;
        Self::Stopping(Stopping { work: self.into_work(), ending, idle_reports: 0 })
    }

    /// Something differs from the plan of the job: stop and end it.
    pub(super) fn trouble(self, cx: &mut Context, why: Diagnostic) -> Self {
        if matches!(self, Self::Stopping(_)) || self.job().is_none() {
            return self;
        }
        cx.found(why);
        self.stop(cx, Ending::Alarm)
    }
}
