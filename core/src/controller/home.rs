//! Homing, and whether it was heard: the line has no checksum, and much that `$H` becomes on its way is answered with `ok` as well.
//!
//! ```text
//!  $H ─┬─ ok, some time later, and nothing else said ─▶ trusted
//!      ├─ ok at once, or behind an answer to something else ─▶ not heard: reset, told
//!      └─ no ok, and reports of rest ─▶ not heard: reset, told
//! ```
//!
//! Comes in: what is said while the machine looks for its switches. Goes out: trust, or a reset. ms. Does not know where switches are.

use super::asks::{EnginePhase, signs};
use super::engine::{Controller, Meaning};
use super::heard::{HeardLine, ReportedState};
use super::height::BoardHeight;
use super::settings;
use crate::control::Trust;
use crate::diagnostic::Diagnostic;

/// Nothing finds a switch twice in so short a time.
const QUICKEST_MS: u64 = 150;
/// Between two questions meanwhile: some answer at once, GRBL when it is done.
const ASK_MS: u64 = 1_000;
/// Reports of rest without an answer that are believed.
const REPORTS: u32 = 2;

/// What was noticed since `$H` was sent.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Homing {
    /// Something was answered that was not asked.
    other: bool,
    /// Reports of rest.
    rests: u32,
}

impl Controller {
    /// Looks for the switches, where there are any.
    pub(super) fn home(&mut self) {
        if !settings::on(&self.info.values, 22) {
            return self.found(Diagnostic::error("grbl.cannot_home"));
        }
        // From where nobody knew, its places count from elsewhere then, and the board is as much higher or lower.
        if self.trust != Trust::Trusted {
            self.height = BoardHeight::Unknown;
        }
        self.trust = Trust::Lost;
        if self.needs_reset {
            self.after_reset = Some(Meaning::Home);
            return self.reset();
        }
        self.send_home();
    }

    pub(super) fn send_home(&mut self) {
        self.send("$H", Meaning::Home);
        (self.homing, self.asked_ms) = (Homing::default(), None);
        self.set(EnginePhase::Homing);
    }

    /// What time brings meanwhile: silence is no fault of it.
    pub(super) fn time_homing(&mut self) {
        self.heard_ms = self.now_ms;
        if self.reset_at.is_none() && self.now_ms >= self.last_ask_ms.max(self.since_ms) + ASK_MS {
            self.write(signs::ASK);
            (self.last_ask_ms, self.asked_ms) = (self.now_ms, Some(self.now_ms));
        }
    }

    /// Notices what no homing says.
    pub(super) fn heard_homing(&mut self, heard: &HeardLine) {
        self.homing.other |= match heard {
            HeardLine::Message(text) => text.contains("Unlocked"),
            HeardLine::Other(text) => text.starts_with("[HLP"),
            HeardLine::Version { .. }
            | HeardLine::Options(_)
            | HeardLine::Setting { .. }
            | HeardLine::Modes(_) => true,
            _ => false,
        };
    }

    /// A report while it should look for its switches.
    pub(super) fn report_homing(&mut self, doing: ReportedState, fresh: bool) {
        let rests = matches!(doing, ReportedState::Idle | ReportedState::Alarm);
        self.homing.rests = if rests { self.homing.rests + u32::from(fresh) } else { 0 };
        if self.homing.rests >= REPORTS && self.reset_at.is_none() {
            self.unheard();
        }
    }

    /// `$H` was answered.
    pub(super) fn homed(&mut self) {
        if self.homing.other || self.now_ms < self.since_ms + QUICKEST_MS {
            return self.unheard();
        }
        self.status = None;
        self.trust = Trust::Trusted;
        self.set(EnginePhase::Ready);
    }

    fn unheard(&mut self) {
        self.found(Diagnostic::error("grbl.home_unheard"));
        self.reset();
    }
}
