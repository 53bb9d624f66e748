//! Blocks X and Y jogs while the tool is, or may be, in the board, unless the user insists.
//!
//! A trusted or counted position decides. If the position was lost while the tool may have been low, it
//! must first rise by the greatest possible depth.

use super::Owner;
use super::moves::Doing;
use annulus_core::control::{Event, Trust};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::Steps;

impl Owner {
    /// Steps of Z above which X and Y may move. A tool of unknown length must stay at the change height
    /// during a tool change.
    fn safe_steps(&self) -> i64 {
        if self.session.changes_by_hand() && !self.length_is_known() {
            return self.machine.change_steps(&self.machine.on_surface());
        }
        let process = &self.machine.process;
        self.machine.z.scale.steps(process.surface + process.safe_height)
    }

    /// Steps that the tool must rise before X and Y jog; `None` if it is high enough.
    pub(super) fn lift_first_steps(&self) -> Option<i64> {
        let counted = self.safe_steps() - self.machine.lowest(&self.position);
        let counted = if self.session.trust == Trust::Lost { 0 } else { counted };
        Some(counted.max(self.unseen_steps)).filter(|steps| *steps > 0)
    }

    /// The same distance in mm, rounded up.
    pub(super) fn lift_first_mm(&self) -> Option<f64> {
        let length = self.machine.z.scale.length(self.lift_first_steps()?);
        Some((length.mm() * 100.0).ceil() / 100.0)
    }

    /// Jogs, if the tool may move that way.
    pub(super) fn ask_jog(&mut self, axis: u8, distance_um: i32, anyway: bool) -> Result<(), Diagnostic> {
        self.sideways(axis, anyway)?;
        self.jog_steps(axis, distance_um)?;
        self.try_event(Event::Jog { axis, distance_um })
    }

    /// Returns an error if X and Y may not jog now.
    fn sideways(&self, axis: u8, anyway: bool) -> Result<(), Diagnostic> {
        match self.lift_first_mm().filter(|_| axis < 2 && !anyway) {
            Some(mm) => Err(Diagnostic::error("control.tip_low").with("mm", format!("{mm:.2}"))),
            None => Ok(()),
        }
    }

    /// The position was lost while the tool had to rise by `before` steps; `None` if it was high enough.
    pub(super) fn lost_low(&mut self, before: Option<i64>) {
        self.unseen_steps = self.unseen_steps.max(before.unwrap_or_default());
    }

    /// Assumes the tool at the lowest end of travel.
    pub(crate) fn may_be_low(&mut self) {
        self.unseen_steps = self.safe_steps() - self.machine.z.scale.steps(self.machine.z.min);
    }

    /// The current action ended without a report.
    pub(super) fn ended_unseen(&mut self) {
        let is_high = matches!(self.doing, Doing::Nothing | Doing::Park | Doing::Clamp { .. });
        if !is_high {
            self.may_be_low();
        }
    }

    /// The axes stopped; `before` is the previous stop position.
    pub(super) fn has_risen(&mut self, before: &Steps) {
        let rise = self.machine.lowest(&self.position) - self.machine.lowest(before);
        if self.unseen_steps > 0 {
            self.unseen_steps = (self.unseen_steps - rise).max(0);
        }
    }
}
