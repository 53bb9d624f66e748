//! Identifies the controller on a newly opened port. The owner decides whether opening may reset the
//! controller.
//!
//! ```text
//!  usual   sends its banner, as most do ─────────────────────────────▶ identify ($I $$ $# $G)
//!          silent: ? ─ moves ─▶ hold ─ stopped ─▶ reset ─ banner ───────┘
//!  never   silent: ? ─ moves, is held … ─▶ wait ─ stopped ──────────────┘   only STOP resets or holds it
//! ```
//!
//! Either way the position is unknown until the machine is homed or its zero is set.

use super::asks::{EngineAction, EnginePhase, signs};
use super::engine::{Controller, Meaning};
use super::heard::ReportedState;
use annulus_core::diagnostic::Diagnostic;
pub(super) use annulus_core::grbl::ResetOnOpen;

impl Controller {
    pub(super) fn opened(&mut self, may: ResetOnOpen) {
        let now_ms = self.now_ms;
        *self = Self {
            now_ms,
            heard_ms: now_ms,
            since_ms: now_ms,
            phase: EnginePhase::Greeting,
            is_spared: may == ResetOnOpen::Never,
            depth: self.depth.restarted(),
            ..Self::default()
        };
    }

    /// True if the controller must not be disturbed: neither its type nor its activity is known.
    pub(super) fn spares(&self) -> bool {
        self.is_spared && self.phase == EnginePhase::Greeting && self.info.banner.is_empty()
    }

    pub(super) fn strange(&mut self, doing: ReportedState) {
        use ReportedState::{Alarm, Door, Hold, Home, Idle, Jog, Run};
        if matches!(doing, Run | Hold { .. } | Door { .. }) {
            self.may_be_low();
        }
        match doing {
            Idle | Alarm if self.spares() => {
                if self.idle() {
                    self.asks_who();
                }
            }
            _ if self.spares() => self.waits_for_rest(doing),
            // Stop it, then reset it to get its banner.
            Run | Jog | Home | Hold { rests: false } | Door { rests: false } => self.write(signs::HOLD),
            _ => self.reset(),
        }
    }

    pub(super) fn asks_who(&mut self) {
        for (index, text) in ["$I", "$$", "$#", "$G"].into_iter().enumerate() {
            self.send(text, Meaning::Greeting(index == 3));
        }
    }

    fn waits_for_rest(&mut self, doing: ReportedState) {
        if std::mem::replace(&mut self.is_waited_for, true) {
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
        self.found(Diagnostic::warning("grbl.busy_at_opening").with("state", word));
    }

    pub(super) fn silent(&mut self) {
        self.found(Diagnostic::error("grbl.no_answer"));
        // The controller may still receive: stop our own motion.
        if !self.spares() {
            self.write(signs::JOG_CANCEL);
            self.write(signs::HOLD);
        }
        self.out.push(EngineAction::Close);
        self.closed();
    }

    /// True if the identification is complete. A controller that started something meanwhile refused to list
    /// its settings: query again after it stops.
    pub(super) fn is_known(&self) -> bool {
        !self.info.values.is_empty() || !self.spares()
    }

    /// The type is known. The next report shows whether it is locked; older reports don't count.
    pub(super) fn is_met(&mut self) {
        if self.spares() {
            self.status = None;
        }
    }
}
