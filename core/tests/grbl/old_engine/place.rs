//! Detects a wrong position that no banner or alarm announced, from the reports.
//!
//! ```text
//!  work zero of a report   ≠ G54, G92 and tool length in `$#`     damaged, or another zero is active
//!  stopped or in a job     then stopped at 0, 0, 0, not a target  a controller without limit switches
//!                                                                 restarted, and its banner was lost
//! ```

use super::asks::{EngineAction, EnginePhase};
use super::engine::Controller;
use super::hand::SAME_ZERO_MM;
use super::heard::{ControllerStatus, ReportedState};
use super::run::Run;
use annulus_core::control::{Ending, Trust};
use annulus_core::diagnostic::Diagnostic;

impl Controller {
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

    pub(super) fn completed(&mut self, mut status: ControllerStatus) -> ControllerStatus {
        let unit = self.unit_mm();
        let scaled = |place: Option<[f64; 3]>| place.map(|place| place.map(|value| value * unit));
        (status.machine_mm, status.work_mm, status.offset_mm) =
            (scaled(status.machine_mm), scaled(status.work_mm), scaled(status.offset_mm));
        status.feed_mm_per_min = status.feed_mm_per_min.map(|feed| feed * unit);
        if status.offset_mm.is_some() {
            self.zero_mm = status.offset_mm;
        }
        if let (None, Some(work), Some(zero)) = (status.machine_mm, status.work_mm, self.zero_mm) {
            status.machine_mm = Some(core::array::from_fn(|axis| work[axis] + zero[axis]));
        }
        if status.overrides.is_none() {
            status.overrides = self.status.as_ref().and_then(|before| before.overrides);
            status.accessories = self.status.as_ref().and_then(|before| before.accessories.clone());
        }
        status
    }

    pub(super) fn offset_in_force(&self) -> Option<f64> {
        let all = ["G92", "TLO"].into_iter().filter_map(|name| self.info.offsets.get(name)).flatten();
        all.copied()
            .filter(|mm| libm::fabs(*mm) > SAME_ZERO_MM / 10.0)
            .max_by(|a, b| libm::fabs(*a).total_cmp(&libm::fabs(*b)))
    }

    /// Work zero without the active tool length, machine coordinates, mm: a reset clears the tool length.
    pub fn job_zero_mm(&self) -> Option<[f64; 3]> {
        let length = self.info.offsets.get("TLO").and_then(|places| places.first()).copied().unwrap_or(0.0);
        self.zero_mm.map(|[x, y, z]| [x, y, z - length])
    }

    pub(super) fn zero_off_mm(&self) -> Option<[f64; 3]> {
        let (reported, listed) = self.zero_mm.zip(self.listed_zero_mm())?;
        let off: [f64; 3] = core::array::from_fn(|axis| reported[axis] - listed[axis]);
        off.iter().any(|off| libm::fabs(*off) > SAME_ZERO_MM).then_some(off)
    }

    pub(super) fn check_listed(&self) -> Option<Diagnostic> {
        let off = self.zero_off_mm()?;
        let told = |axis: usize| format!("{:.3}", off[axis]);
        let why = Diagnostic::error("grbl.zero_differs").with("x", told(0)).with("y", told(1));
        Some(why.with("z", told(2)))
    }

    /// True if the controller restarted since the report `before`. A controller with limit switches would be
    /// locked then. While a job moves, only the position is dropped, unless its path leads to zero: the job
    /// then ends by other checks.
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
            // Lines sent after a hold have not run.
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

    pub(super) fn greets_anew(&mut self) {
        self.lose_place();
        self.depth = self.depth.restarted();
        self.found(Diagnostic::error("grbl.reset_by_itself"));
        if self.run.take().is_some() {
            self.out.push(EngineAction::Ended(Ending::Alarm));
        }
        self.reset();
    }
}
