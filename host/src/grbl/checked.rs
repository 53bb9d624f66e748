//! Checks a job in GRBL's check mode (`$C`): the controller reads every line, and nothing moves.

use super::order::Order;
use super::station::Station;
use crate::files::Files;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::grbl::{CheckNews, EngineAsk, EnginePhase};
use annulus_core::wire::{CheckModeReport, Tell};
use std::sync::Arc;

impl<F: Files> Station<F> {
    /// Starts the check of `job`. If the job is armed, the check uses its lines.
    pub(super) fn check(&mut self, job: &str) -> Result<(), Diagnostic> {
        if self.work.is_some() {
            return Err(error!("control.busy"));
        }
        // Writing the job takes seconds, in which STOP would wait.
        if self.attended.controller().phase != EnginePhase::Ready {
            return Err(error!("grbl.not_now"));
        }
        let armed = self.armed.as_ref().map(|armed| &armed.order).filter(|order| order.key == job);
        let routine = match armed {
            Some(order) => Arc::clone(&order.routine),
            None => {
                let bytes = self.job(job).ok_or_else(|| error!("control.no_such_job"))?;
                Order::written(job, bytes, &self.machine)?.routine
            }
        };
        self.engine_asked(EngineAsk::Check { routine, written: Arc::default() })?;
        self.hand.until = None;
        self.checked = CheckModeReport { job: job.to_owned(), goes: true, ..CheckModeReport::default() };
        self.tell_checked();
        Ok(())
    }

    pub(super) fn was_read(&mut self, news: &CheckNews) {
        let report = &mut self.checked;
        match news {
            CheckNews::Read { done, of } => (report.done, report.of) = (*done, *of),
            CheckNews::Refused { why } => {
                report.refused += 1;
                report.lines.push(why.clone());
            }
            CheckNews::Over { done, of, refused, why } => {
                (report.done, report.of, report.refused) = (*done, *of, *refused);
                (report.goes, report.why) = (false, why.clone());
            }
        }
        self.tell_checked();
    }

    fn tell_checked(&mut self) {
        let tell = Tell::Checked(Box::new(self.checked.clone()));
        self.tell(tell);
    }
}
