//! A pause on a toolpath: motion slows and stops on the path. The tool is lifted off it if the settings or
//! the user ask for that. The plan is unchanged.

use super::Owner;
use super::moves::Doing;
use annulus_core::control::Event;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::Mark;
use annulus_core::machine::Output;

impl Owner {
    /// Returns `true` if the executor follows a toolpath.
    fn is_on_path(&self) -> bool {
        let mark =
            self.work.as_ref().and_then(|work| work.job.program.legs.get(work.leg)).map(|leg| leg.mark);
        self.doing == Doing::Leg && matches!(mark, Some(Mark::Toolpath(_)))
    }

    /// Holds motion along a toolpath.
    pub(super) fn hold(&mut self) {
        if !self.is_on_path() {
            return;
        }
        self.held = self.executor.shared.hold(self.task);
        if self.machine.process.lift_at_pause && self.lifts_off_path() {
            self.executor.shared.lift(self.task);
        }
    }

    /// Applies a pause that was requested before this task was given.
    pub(super) fn hold_if_pausing(&mut self) {
        if self.session.pauses() {
            self.hold();
        }
    }

    pub(super) fn goes_on(&mut self) {
        self.held = 0;
        self.executor.shared.go();
    }

    /// An adapter already has the path: it can hold on it, but not leave it.
    fn lifts_off_path(&self) -> bool {
        self.machine.output != Output::Adapter
    }

    /// Lifts the tool off the path on which it is held.
    pub(super) fn lift_off_path(&mut self) -> Result<(), Diagnostic> {
        if !self.lifts_off_path() {
            return Err(Diagnostic::error("control.no_lift_on_path"));
        }
        self.try_event(Event::Lift)
    }

    /// Checks whether motion has stopped on its path.
    pub(super) fn look_at_hold(&mut self) {
        let rests = self.held > 0 && self.executor.shared.glimpse().held == self.held;
        if rests && self.session.pauses() {
            self.happen(Event::Held);
        }
    }

    /// `Some` if paused on the path; `true` in it if the tool is lifted off.
    pub(super) fn pause_on_path(&self) -> Option<bool> {
        self.session.on_path.then(|| self.executor.shared.glimpse().lifted)
    }
}
