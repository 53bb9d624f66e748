//! Parking: tools up, spindle off, head away from the board so that it can be loaded or unloaded.

use super::Owner;
use super::moves::Doing;
use super::work::Work;
use annulus_core::control::{Ending, Event};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::queue;

impl Owner {
    pub(crate) fn park(&mut self) -> Result<(), Diagnostic> {
        let moves = if self.session.in_change {
            self.to_change_position()?
        } else {
            queue::park(&self.machine, self.position)?
        };
        let segments = self.in_time(moves)?;
        self.give(Doing::Park, segments);
        Ok(())
    }

    /// After a job the head parks automatically only if the settings say so, the job was completed, and
    /// STOP was not pressed.
    pub(super) fn parks_after(&mut self, work: &Work, ending: Ending) {
        if ending == Ending::Done && self.machine.park.after_job && !work.was_stopped {
            self.pending.push_back(Event::Park);
        }
    }

    /// STOP also cancels the parking after the job.
    pub(super) fn parks_no_more(&mut self) {
        if let Some(work) = &mut self.work {
            work.was_stopped = true;
        }
    }
}
