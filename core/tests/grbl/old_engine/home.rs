//! Homing, and whether the controller received `$H`. The line has no checksum, and many damaged forms of `$H`
//! are also answered `ok`.
//!
//! ```text
//!  $H ─┬─ ok after some time, and no other output ─▶ report ─┬─ axes where switches leave them ─▶ trusted
//!      │                                                     └─ elsewhere, twice ─▶ reported, not trusted
//!      ├─ ok at once, or after other output ─▶ not received: reset, reported
//!      └─ no ok, and reports of Idle ─▶ not received: reset, reported
//! ```
//!
//! Position where the limit switches leave an axis: `ends`.

use super::asks::{EnginePhase, signs};
use super::depth::TipDepth;
use super::ends::Ends;
use super::engine::{Controller, Meaning};
use super::heard::{HeardLine, ReportedState};
use super::height::BoardHeight;
use super::settings;
use annulus_core::control::Trust;
use annulus_core::diagnostic::Diagnostic;

const QUICKEST_MS: u64 = 150;
/// Status query interval during homing: some firmwares answer at once, GRBL only at the end.
const ASK_MS: u64 = 1_000;
const ASK_SOON_MS: u64 = 100;
const TOLD_MS: u64 = 5_000;
const REPORTS: u32 = 2;

#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Homing {
    other: bool,
    rests: u32,
    answered_ms: Option<u64>,
    elsewhere: u32,
}

impl Controller {
    pub(super) fn home(&mut self) {
        if !settings::on(&self.info.values, 22) {
            return self.found(Diagnostic::error("grbl.cannot_home"));
        }
        // If the position was unknown, homing moves the coordinates, so the board height is no longer valid.
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

    pub(super) fn homed(&mut self) {
        if self.homing.other || self.now_ms < self.since_ms + QUICKEST_MS {
            return self.unheard();
        }
        // Older reports show positions before homing.
        (self.status, self.asked_ms) = (None, None);
        self.homing.answered_ms = Some(self.now_ms);
    }

    /// The machine stopped after homing: the position shows the ends of each axis, or that an axis did not
    /// look for its switch.
    fn judge_place(&mut self) {
        let Some(place) = self.status.as_ref().and_then(|status| status.machine_mm) else { return };
        let judged: [_; 3] = core::array::from_fn(|axis| self.info.ends_by(axis, place[axis]));
        let Some(axis) = (0..3).find(|axis| judged[*axis].is_none()) else {
            self.ends = judged.map(Option::flatten);
            self.trust = Trust::Trusted;
            // Homing leaves Z fully up.
            self.depth = TipDepth::default();
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
