//! Homing of the whole machine (Z up, then X, then Y), and parking: tools up, spindle off, head away from the
//! board so that it can be loaded or unloaded. `core` defines the stages, which become tasks here.

use super::Owner;
use super::moves::{Doing, segments};
use super::work::Work;
use crate::executor::Report;
use annulus_core::control::{Ending, Event, State, Trust};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::motion::cycles;
use annulus_core::queue::{self, Harm, Homing, HomingNext};

impl Owner {
    /// Starts homing. If the position was `counted`, a deviation raises an alarm.
    pub(crate) fn home(&mut self, counted: bool) -> Result<(), Diagnostic> {
        let mut axes = Vec::new();
        for (axis, timeline) in cycles::home(&self.machine)? {
            self.in_time(segments(&timeline, &self.machine))?;
            axes.push(axis);
        }
        let mut homing = Homing::new(&axes, [counted; 3]);
        let next = homing.begin(&self.machine)?;
        self.homing_goes_on(homing, next);
        Ok(())
    }

    pub(crate) fn homed(&mut self, mut homing: Homing, report: &Report) {
        if self.session.state == State::Stopping {
            return self.pending.push_back(Event::Rested);
        }
        let told = self.told_to_core(report);
        match homing.reported(&self.machine, &told, &mut self.position) {
            Ok(next) => self.homing_goes_on(homing, next),
            Err((why, Harm::None)) => {
                self.pending.push_back(Event::Homed);
                self.fails(why, Trust::Trusted);
            }
            Err((why, Harm::Suspect | Harm::Lost)) => {
                self.fails(why, Trust::Lost);
            }
        }
    }

    fn homing_goes_on(&mut self, homing: Homing, next: HomingNext) {
        match next {
            HomingNext::Homed => {
                self.settle_stock();
                self.pending.push_back(Event::Homed);
            }
            HomingNext::Play { segment, correction_steps: correction } => {
                for axis in cycles::together(&self.machine, homing.axis()) {
                    self.executor.correct(axis, correction);
                }
                self.give(Doing::Homing(homing), vec![segment]);
            }
        }
    }
}

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

    pub(super) fn parks_no_more(&mut self) {
        if let Some(work) = &mut self.work {
            work.was_stopped = true;
        }
    }
}
