//! Whether the place that is believed in is still the place: two ways in which a report shows that it is not, and no banner or alarm.
//!
//! ```text
//!  work zero of a report   ≠ what `$#` lists for G54, G92 and the tool     damaged on its way, or another zero is in force
//!  at rest or in a job     then at rest at 0, 0, 0, where nothing leads    a board without switches began anew, and its banner was lost
//! ```
//!
//! Comes in: reports, stored places. Goes out: doubt. mm. Does not know who moves.

use super::asks::{EngineAction, EnginePhase};
use super::engine::Controller;
use super::hand::SAME_ZERO_MM;
use super::heard::{ControllerStatus, ReportedState};
use super::run::Run;
use crate::control::{Ending, Trust};
use crate::diagnostic::Diagnostic;

impl Controller {
    /// Where work zero is by the stored places, machine coordinates; none where they were not listed.
    pub(super) fn listed_zero_mm(&self) -> Option<[f64; 3]> {
        let offsets = &self.info.offsets;
        let of = |name: &str, axis: usize| offsets.get(name).and_then(|places| places.get(axis)).copied();
        let zero = |axis: usize| {
            let shift = of("G92", axis).unwrap_or(0.0);
            let tool = if axis == 2 { of("TLO", 0).unwrap_or(0.0) } else { 0.0 };
            Some(of("G54", axis)? + shift + tool)
        };
        Some([zero(0)?, zero(1)?, zero(2)?])
    }

    /// The largest offset of G92 and of the tool's length that is in force, as the stored places have it, mm.
    pub(super) fn offset_in_force(&self) -> Option<f64> {
        let all = ["G92", "TLO"].into_iter().filter_map(|name| self.info.offsets.get(name)).flatten();
        all.copied()
            .filter(|mm| libm::fabs(*mm) > SAME_ZERO_MM / 10.0)
            .max_by(|a, b| libm::fabs(*a).total_cmp(&libm::fabs(*b)))
    }

    /// Work zero without the length of the tool that is in, machine coordinates, mm: a reset takes that away.
    pub fn job_zero_mm(&self) -> Option<[f64; 3]> {
        let length = self.info.offsets.get("TLO").and_then(|places| places.first()).copied().unwrap_or(0.0);
        self.zero_mm.map(|[x, y, z]| [x, y, z - length])
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

    /// A report that follows `before`: whether the board has begun anew meanwhile. One with switches is locked then. In a job, where what
    /// follows is an end, nothing is known behind it.
    pub(super) fn began_anew(&mut self, before: Option<&ControllerStatus>) -> bool {
        let (Some(before), Some(now)) = (before, &self.status) else { return false };
        let was_elsewhere = before.machine_mm.is_some_and(|place| place != [0.0; 3]);
        let is_at_zero = now.doing == ReportedState::Idle && now.machine_mm == Some([0.0; 3]);
        if self.trust != Trust::Trusted || self.homes() || !was_elsewhere || !is_at_zero {
            return false;
        }
        let nothing_sent = self.buffer.is_empty() && self.queue.is_empty() && self.reset_at.is_none();
        match self.phase {
            EnginePhase::Ready | EnginePhase::ToolChange => {
                nothing_sent && before.doing == ReportedState::Idle
            }
            // What was sent behind a hold is not run.
            EnginePhase::Held => true,
            EnginePhase::Running | EnginePhase::Holding | EnginePhase::Stopping => {
                let place = self.zero_mm.map(|zero| zero.map(|value| -value));
                let leads_there = |run: &Run| place.is_some_and(|place| run.leads_to(place));
                if !self.run.as_ref().is_some_and(leads_there) {
                    self.lose_place();
                }
                false
            }
            _ => false,
        }
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
