//! Pause and feed override of a running job. A pause on a toolpath slows and stops on the path; the tool is
//! lifted off it if the settings or the user ask for that. Up to 100 % of feed the executor slows stream
//! time. Above, the job is planned again at a higher feed and switched at the next stop.
//!
//! ```text
//! leg 11 ─────────▶│ leg 12 ─────────▶│ leg 13 at 150 %     in both plans a leg starts at the same position
//!     ▲ asked: 150 %   ▲ planned, checked   ▲ switched
//! ```

use super::Owner;
use super::moves::Doing;
use super::work::Work;
use crate::prepare::Prepared;
use annulus_core::control::Event;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::Mark;
use annulus_core::machine::Output;
use annulus_core::{code, error};
use std::sync::Arc;

impl Owner {
    fn is_on_path(&self) -> bool {
        let mark =
            self.work.as_ref().and_then(|work| work.job.program.legs.get(work.leg)).map(|leg| leg.mark);
        self.doing == Doing::Leg && matches!(mark, Some(Mark::Toolpath(_)))
    }

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

    pub(super) fn lift_off_path(&mut self) -> Result<(), Diagnostic> {
        if !self.lifts_off_path() {
            return Err(error!("control.no_lift_on_path"));
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

/// Range of the override, percent of the planned feed.
const RANGE: std::ops::RangeInclusive<u8> = 10..=200;

impl Owner {
    /// Sets the override. Above 100 % it takes effect with the new plan.
    pub(crate) fn feed_override(&mut self, percent: u8) -> Result<(), Diagnostic> {
        let refuse = |code| Err(Diagnostic::error(code).with("percent", percent));
        if !RANGE.contains(&percent) {
            return refuse(code!("control.bad_feed_override"));
        }
        if percent > 100 && self.work.is_none() {
            return refuse(code!("control.feed_override_needs_job"));
        }
        let mut slower = percent.min(100);
        if let Some(work) = &mut self.work {
            work.percent = percent;
            // Drop a plan, finished or under way, that no longer matches the request.
            work.anew.take_if(|anew| anew.feed_percent != percent.max(100));
            slower = work.slower();
        }
        self.executor.shared.set_feed_override(slower);
        Ok(())
    }

    /// Stores a new plan of the running job until the next stop.
    pub(crate) fn anew(&mut self, plan: Prepared) {
        let wanted =
            |work: &&mut Work| work.job.key == plan.key && work.percent.max(100) == plan.feed_percent;
        if let Some(work) = self.work.as_mut().filter(wanted) {
            work.anew = Some(Arc::new(plan));
        }
    }

    /// Percent of the job's original feed.
    pub(crate) fn feed_override_percent(&self) -> u8 {
        self.work.as_ref().map_or_else(|| self.executor.shared.feed_override(), |work| work.percent)
    }
}

impl Work {
    /// The latest plan, in force or pending, and the requested feed.
    pub(crate) fn wanted(&self) -> (Arc<Prepared>, u8) {
        (Arc::clone(self.anew.as_ref().unwrap_or(&self.job)), self.percent.max(100))
    }

    /// Percent at which stream time must pass, so that the current plan is no faster than requested.
    pub(crate) fn slower(&self) -> u8 {
        let slower = u32::from(self.percent) * 100 / u32::from(self.job.feed_percent.max(1));
        u8::try_from(slower.min(100)).unwrap_or(100)
    }

    /// Before a leg: switches to the pending plan if this leg starts at the same position in both. Returns
    /// `true` if it did.
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
