//! How fast a job goes: up to 100 % the executor lets stream time pass slower; above, the job is planned anew with higher feeds
//! and taken over at the next rest.
//!
//! ```text
//! leg 11 ─────────▶│ leg 12 ─────────▶│ leg 13 at 150 %     in both plans a leg begins at the same place
//!     ▲ asked: 150 %   ▲ planned, checked   ▲ taken over
//! ```
//!
//! Comes in: a percentage, and the plan made for it. Goes out: the plan in work. Does not know how a plan is made.

use super::Owner;
use super::work::Work;
use crate::prepare::Prepared;
use annulus_core::diagnostic::Diagnostic;
use std::sync::Arc;

/// Least and most that can be ordered, percent of what was planned.
const RANGE: std::ops::RangeInclusive<u8> = 10..=200;

impl Owner {
    /// How fast the job goes from now on. More than 100 % comes with its plan.
    pub(crate) fn feed_override(&mut self, percent: u8) -> Result<(), Diagnostic> {
        let refuse = |code| Err(Diagnostic::error(code).with("percent", percent));
        if !RANGE.contains(&percent) {
            return refuse("control.bad_feed_override");
        }
        if percent > 100 && self.work.is_none() {
            return refuse("control.feed_override_needs_job");
        }
        let mut slower = percent.min(100);
        if let Some(work) = &mut self.work {
            work.percent = percent;
            // A plan that is not wanted any more, made or on its way, is not taken over.
            work.anew.take_if(|anew| anew.feed_percent != percent.max(100));
            slower = work.slower();
        }
        self.executor.shared.set_feed_override(slower);
        Ok(())
    }

    /// Keeps a plan of the job in work until its next rest.
    pub(crate) fn anew(&mut self, plan: Prepared) {
        let wanted =
            |work: &&mut Work| work.job.key == plan.key && work.percent.max(100) == plan.feed_percent;
        if let Some(work) = self.work.as_mut().filter(wanted) {
            work.anew = Some(Arc::new(plan));
        }
    }

    /// Percent of what was planned at first.
    pub(crate) fn feed_override_percent(&self) -> u8 {
        self.work.as_ref().map_or_else(|| self.executor.shared.feed_override(), |work| work.percent)
    }
}

impl Work {
    /// The plan that was made last, in force or to come, and the feeds that are wanted.
    pub(crate) fn wanted(&self) -> (Arc<Prepared>, u8) {
        (Arc::clone(self.anew.as_ref().unwrap_or(&self.job)), self.percent.max(100))
    }

    /// How slowly stream time has to pass, percent, so that the plan in force goes no faster than is wanted.
    pub(crate) fn slower(&self) -> u8 {
        let slower = u32::from(self.percent) * 100 / u32::from(self.job.feed_percent.max(1));
        u8::try_from(slower.min(100)).unwrap_or(100)
    }

    /// Before a leg begins: the plan to come, where it has this leg begin as the plan in force does. Gives whether it is in
    /// force now.
    pub(crate) fn take_over(&mut self) -> bool {
        let same = |anew: &Arc<Prepared>| {
            anew.zero == self.job.zero
                && anew.stream.legs() == self.job.stream.legs()
                && anew.before_leg(self.leg) == self.job.before_leg(self.leg)
        };
        let Some(anew) = self.anew.take_if(|anew| same(anew)) else { return false };
        self.job = anew;
        self.unpack();
        true
    }
}
