//! Parking (C7): the tips up, the spindle off, the head out of the way of a board that is laid on or taken off.
//!
//! Comes in: an ask, or the end of a job on a machine whose settings say so. Goes out: a task. Does not know the place: `core` does.

use super::Owner;
use super::moves::Doing;
use super::work::Work;
use annulus_core::control::{Ending, Event};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::queue;

impl Owner {
    /// Goes there.
    pub(crate) fn park(&mut self) -> Result<(), Diagnostic> {
        let segments = self.in_time(queue::park(&self.machine, self.position)?)?;
        self.give(Doing::Park, segments);
        Ok(())
    }

    /// A job is over. The head goes away by itself only where that was set, all of it is done, and nobody stopped it.
    pub(super) fn parks_after(&mut self, work: &Work, ending: Ending) {
        if ending == Ending::Done && self.machine.park.after_job && !work.was_stopped {
            self.pending.push_back(Event::Park);
        }
    }

    /// Somebody stops whatever moves.
    pub(super) fn parks_no_more(&mut self) {
        if let Some(work) = &mut self.work {
            work.was_stopped = true;
        }
    }
}
