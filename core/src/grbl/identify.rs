//! Identifies the controller on a newly opened port, or after it restarted. The owner decides whether opening
//! may reset the controller.
//!
//! ```text
//!  usual   sends its banner, as most do ─────────────────────────────▶ identify ($I $$ $# $G)
//!          silent: ? ─ moves ─▶ hold ─ stopped ─▶ reset ─ banner ───────┘
//!  never   silent: ? ─ moves, is held … ─▶ wait ─ stopped ──────────────┘   only STOP resets or holds it
//! ```
//!
//! Either way the position is unknown until the machine is homed or its zero is set.

use super::activity::Activity;
use super::asks::{EngineAction, realtime};
use super::context::{Context, Report};
use super::heard::ReportedState;
use super::homing::Homing;
use super::line::{AfterReset, Meaning};
use crate::warning;
use serde::{Deserialize, Serialize};

/// Key in the controller's settings for the effect of opening the port: `usual` or `never`.
pub const RESET_KEY: &str = "controller.reset_on_open";

/// Effect that opening the port may have on the controller.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ResetOnOpen {
    /// Opening may reset the controller, by the reset line that most boards have (DTR). A silent controller
    /// is reset when it is stopped.
    #[default]
    Usual,
    /// Only STOP resets the controller.
    Never,
}

impl ResetOnOpen {
    pub fn word(self) -> &'static str {
        match self {
            Self::Usual => "usual",
            Self::Never => "never",
        }
    }

    pub fn of(word: &str) -> Option<Self> {
        [Self::Usual, Self::Never].into_iter().find(|choice| choice.word() == word)
    }
}

#[derive(Debug)]
pub(super) enum Identify {
    /// The port was opened; no banner arrived.
    Silent {
        reset: ResetOnOpen,
        /// The user was informed that the controller is busy.
        is_busy_reported: bool,
    },
    Greeted,
}

impl Identify {
    pub(super) fn opened(reset: ResetOnOpen) -> Self {
        Self::Silent { reset, is_busy_reported: false }
    }

    pub(super) fn greeted(cx: &mut Context) -> Self {
        query_identity(cx);
        Self::Greeted
    }

    pub(super) fn is_silent(&self) -> bool {
        matches!(self, Self::Silent { .. })
    }

    /// True if the controller must not be disturbed: neither its type nor its activity is known.
    pub(super) fn must_not_disturb(&self) -> bool {
        matches!(self, Self::Silent { reset: ResetOnOpen::Never, .. })
    }

    /// STOP: holds the controller. A held one answers no query, even if it was idle before, so it is reset
    /// at standstill and identified after its banner.
    pub(super) fn on_stop(&mut self, cx: &mut Context) {
        cx.write(realtime::HOLD);
        cx.line.drop_lines();
        if let Self::Silent { reset, .. } = self {
            *reset = ResetOnOpen::Usual;
        }
    }

    pub(super) fn on_report(mut self, cx: &mut Context, report: Report) -> Activity {
        if self.is_silent() && cx.line.reset_at.is_none() {
            self.on_unidentified_report(cx, report.doing);
        }
        Activity::Identify(self)
    }

    /// A status report from a controller that sent no banner.
    fn on_unidentified_report(&mut self, cx: &mut Context, doing: ReportedState) {
        use ReportedState::{Alarm, Door, Hold, Home, Idle, Jog, Run};
        // What it runs may have the tool in the board.
        if matches!(doing, Run | Hold { .. } | Door { .. }) {
            cx.known.depth.may_be_low();
        }
        match doing {
            Idle | Alarm if self.must_not_disturb() => {
                if cx.line.is_idle() {
                    query_identity(cx);
                }
            }
            _ if self.must_not_disturb() => self.report_busy(cx, doing),
            // Stop it, then reset it to get its banner.
            Run | Jog | Home | Hold { rests: false } | Door { rests: false } => cx.write(realtime::HOLD),
            _ => cx.reset(),
        }
    }

    /// The controller runs something that we didn't start, and answers no queries meanwhile.
    fn report_busy(&mut self, cx: &mut Context, doing: ReportedState) {
        let Self::Silent { is_busy_reported, .. } = self else { return };
        if std::mem::replace(is_busy_reported, true) {
            return;
        }
        let word = match doing {
            ReportedState::Hold { .. } => "Hold",
            ReportedState::Jog => "Jog",
            ReportedState::Door { .. } => "Door",
            ReportedState::Check => "Check",
            ReportedState::Home => "Home",
            ReportedState::Sleep => "Sleep",
            ReportedState::Tool => "Tool",
            ReportedState::Idle | ReportedState::Alarm | ReportedState::Run => "Run",
        };
        cx.found(warning!("grbl.busy_at_opening", state = word));
    }

    /// All queries were answered. A controller that started something meanwhile refused to list its settings:
    /// query again after it stops. The next report shows whether it is locked; older reports don't count.
    pub(super) fn finish_identification(self, cx: &mut Context) -> Activity {
        if self.must_not_disturb() {
            if cx.known.info.values.is_empty() {
                return Activity::Identify(self);
            }
            cx.known.status = None;
        }
        cx.out.push(EngineAction::Greeted);
        match cx.line.after_reset.take() {
            Some(AfterReset::Home) => return Homing::start(cx),
            Some(AfterReset::Unlock) => cx.send("$X", Meaning::Unlock),
            None => {}
        }
        Activity::Ready
    }
}

fn query_identity(cx: &mut Context) {
    for (index, text) in ["$I", "$$", "$#", "$G"].into_iter().enumerate() {
        cx.send(text, Meaning::Identify(index == 3));
    }
}
