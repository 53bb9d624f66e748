//! Homing, and whether it was heard: the line has no checksum, and much that `$H` becomes on its way is answered with `ok` as well.
//!
//! ```text
//!  $H ─┬─ ok, some time later, and nothing else said ─▶ a report ─┬─ every axis where its switch leaves it ─▶ trusted
//!      │                                                          └─ not, twice ─▶ told, not trusted
//!      ├─ ok at once, or behind an answer to something else ─▶ not heard: reset, told
//!      └─ no ok, and reports of rest ─▶ not heard: reset, told
//! ```
//!
//! Comes in: what is said while the machine looks for its switches. Goes out: trust, or a reset. ms. Where the switches leave it: `ends`.

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
/// The same once it has answered, and how long it may take to tell where it is.
const ASK_SOON_MS: u64 = 100;
const TOLD_MS: u64 = 5_000;
/// Reports of rest without an answer, or from elsewhere, that are believed.
const REPORTS: u32 = 2;

/// What was noticed since `$H` was sent.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Homing {
    /// Something was answered that was not asked.
    other: bool,
    /// Reports of rest.
    rests: u32,
    /// When it was answered.
    answered_ms: Option<u64>,
    /// Reports from where no switch leaves it.
    elsewhere: u32,
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
        let answered = self.homing.answered_ms;
        if answered.is_some_and(|answered| self.now_ms >= answered + TOLD_MS) && self.reset_at.is_none() {
            self.found(Diagnostic::error("grbl.no_report"));
            return self.set(EnginePhase::Ready);
        }
        let wait_ms = if answered.is_some() { ASK_SOON_MS } else { ASK_MS };
        if self.reset_at.is_none() && self.now_ms >= self.last_ask_ms.max(self.since_ms) + wait_ms {
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
        if self.homing.answered_ms.is_some() && doing == ReportedState::Idle {
            if fresh {
                self.judge_place();
            }
            return;
        }
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
        (self.status, self.asked_ms) = (None, None);
        self.homing.answered_ms = Some(self.now_ms);
    }

    /// It rests where homing left it: there every axis tells its ends, or that it did not look for its switch.
    fn judge_place(&mut self) {
        let Some(place) = self.status.as_ref().and_then(|status| status.machine_mm) else { return };
        let judged: [_; 3] = core::array::from_fn(|axis| self.info.ends_by(axis, place[axis]));
        let Some(axis) = (0..3).find(|axis| judged[*axis].is_none()) else {
            self.ends = judged.map(Option::flatten);
            self.trust = Trust::Trusted;
            return self.set(EnginePhase::Ready);
        };
        self.homing.elsewhere += 1;
        if self.homing.elsewhere >= REPORTS {
            let why = Diagnostic::error("grbl.home_elsewhere").with("axis", ["X", "Y", "Z"][axis]);
            self.found(why.with("place", format!("{:.3}", place[axis])));
            self.set(EnginePhase::Ready);
        }
    }

    fn unheard(&mut self) {
        self.found(Diagnostic::error("grbl.home_unheard"));
        self.reset();
    }
}
