//! Whether the place that is believed in is still the place: two ways in which a report shows that it is not, and no banner or alarm.
//!
//! ```text
//!  work zero of a report   ≠ what `$#` lists for G54, G92 and the tool     damaged on its way, or another zero is in force
//!  at rest somewhere       then at rest at 0, 0, 0                         a board without switches began anew, and its banner was lost
//! ```
//!
//! Comes in: reports, stored places. Goes out: doubt. mm. Does not know who moves.

use super::asks::{EngineAction, EnginePhase};
use super::engine::Controller;
use super::hand::SAME_ZERO_MM;
use super::heard::{ControllerStatus, ReportedState};
use crate::control::{Ending, Trust};
use crate::diagnostic::Diagnostic;

impl Controller {
    /// Where work zero is by the stored places, machine coordinates; none where they were not listed.
    fn listed_zero_mm(&self) -> Option<[f64; 3]> {
        let offsets = &self.info.offsets;
        let of = |name: &str, axis: usize| offsets.get(name).and_then(|places| places.get(axis)).copied();
        let zero = |axis: usize| {
            let shift = of("G92", axis).unwrap_or(0.0);
            let tool = if axis == 2 { of("TLO", 0).unwrap_or(0.0) } else { 0.0 };
            Some(of("G54", axis)? + shift + tool)
        };
        Some([zero(0)?, zero(1)?, zero(2)?])
    }

    /// How far work zero is from where the stored places have it, if that is more than a report rounds.
    pub(super) fn zero_off_mm(&self) -> Option<[f64; 3]> {
        let (reported, listed) = self.zero_mm.zip(self.listed_zero_mm())?;
        let off: [f64; 3] = core::array::from_fn(|axis| reported[axis] - listed[axis]);
        off.iter().any(|off| libm::fabs(*off) > SAME_ZERO_MM).then_some(off)
    }

    /// What of that keeps a job from being started.
    pub(super) fn check_listed(&self) -> Option<Diagnostic> {
        let off = self.zero_off_mm()?;
        let told = |axis: usize| format!("{:.3}", off[axis]);
        let why = Diagnostic::error("grbl.zero_differs").with("x", told(0)).with("y", told(1));
        Some(why.with("z", told(2)))
    }

    /// A report that follows `before`: whether the board has begun anew meanwhile. One with switches is locked then.
    pub(super) fn began_anew(&self, before: &ControllerStatus, now: &ControllerStatus) -> bool {
        let rests = before.doing == ReportedState::Idle && now.doing == ReportedState::Idle;
        let waits = matches!(self.phase, EnginePhase::Ready | EnginePhase::ToolChange);
        let is_known = self.trust == Trust::Trusted && !self.homes();
        let was_elsewhere = before.machine_mm.is_some_and(|place| place != [0.0; 3]);
        let nothing_sent = self.buffer.is_empty() && self.queue.is_empty() && self.reset_at.is_none();
        rests && waits && is_known && was_elsewhere && nothing_sent && now.machine_mm == Some([0.0; 3])
    }

    /// It has: nothing is known of it any more.
    pub(super) fn greets_anew(&mut self) {
        self.lose_place();
        self.found(Diagnostic::error("grbl.reset_by_itself"));
        if self.run.take().is_some() {
            self.out.push(EngineAction::Ended(Ending::Alarm));
        }
        self.reset();
    }
}
