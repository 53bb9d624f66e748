//! Arming, as the owner does it: how the drill stands goes out, a job that was checked for that comes back.
//!
//! Comes in: asks for the context, prepared jobs. Goes out: verdicts. Does not know how a job is checked.

use super::{Owner, diagnostic, zero_of};
use crate::prepare::{Context, Prepared};
use annulus_core::control::Event;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::wire::Tell;
use std::sync::Arc;

impl Owner {
    /// How the drill stands, for a job to be prepared.
    pub fn context(&self) -> Context {
        let offer = self.interrupted.as_ref().filter(|_| self.work.is_none());
        Context {
            machine: self.machine.clone(),
            zero: self.session.zero(),
            state: self.session.state,
            trust: self.session.trust,
            safe_hz: self.timing.as_ref().map(|timing| timing.safe_hz),
            offer: offer.map(|(job, progress)| (job.key.clone(), progress.done, zero_of(job, &self.machine))),
        }
    }

    /// Takes a job that was prepared, and says what was found.
    pub fn arm(&mut self, prepared: Prepared) -> Result<Vec<Tell>, Diagnostic> {
        if self.context() != prepared.context {
            return Err(diagnostic("control.changed_meanwhile"));
        }
        let tell = prepared.tell();
        let event = match prepared.refusal() {
            None => Event::Armed { job: prepared.key.clone(), digest: prepared.digest.clone() },
            Some(_) => Event::Disarmed { position_lost: false },
        };
        self.try_event(event)?;
        self.prepared = Some(Arc::new(prepared));
        self.tell(tell.clone());
        Ok(vec![tell])
    }
}
