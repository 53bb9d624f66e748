//! Runs a queue of commands: turns its actions into tasks, and reports into its results.
//!
//! ```text
//! Ask::Queue ─▶ read, check ─▶ Lab.run ── go ─▶ actions ─▶ tasks, outputs, corrections ─▶ executor
//!                                 ▲                                                          │
//!                                 └────────────────── report of one task ◀───────────────────┘
//! ```

use super::Owner;
use super::moves::Doing;
use crate::executor::{Ended, Report};
use annulus_core::control::{Event, State, Trust};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::motion::cycles;
use annulus_core::pins::Outcome;
use annulus_core::queue::{self, Harm, Mode, Queue, QueueAction, QueueRun, Rest, RowResult, Standing, check};
use annulus_core::wire::{QueuePhase, QueueStatus, Tell};
use std::time::Duration;

/// Shortest time between two reports while rows run.
const PACE: Duration = Duration::from_millis(40);

pub(crate) struct Lab {
    text: String,
    queue: Queue,
    total: u32,
    run: QueueRun,
    begun: bool,
    mode: Mode,
    phase: QueuePhase,
    why: Option<Diagnostic>,
    told: Vec<RowResult>,
    told_at: Duration,
}

impl Owner {
    fn standing(&self) -> Standing {
        let homed = [self.session.trust == Trust::Trusted; 3];
        let (position, zero) = (self.position, self.session.zero());
        Standing { position, zero, homed, rpm: 0, foot_down: self.foot_may_be_down() }
    }

    /// Reads and checks `text`; replaces the previous queue.
    pub(crate) fn queue_load(&mut self, text: String) -> Result<Vec<Tell>, Diagnostic> {
        if self.session.queue {
            return Err(error!("control.busy"));
        }
        let first = |whys: Vec<Diagnostic>| whys.into_iter().next().unwrap_or_else(|| error!("queue.empty"));
        let queue = queue::read("", &text).map_err(first)?;
        let standing = self.standing();
        let checked = check(&queue, &self.machine, &self.machine.output_names(), &standing)?;
        let run = QueueRun::new(queue.clone(), self.machine.output_names(), standing);
        self.lab = Some(Lab {
            text,
            total: checked.rows,
            run,
            begun: false,
            mode: Mode::Step,
            phase: QueuePhase::Ready,
            why: None,
            told: vec![RowResult::default(); queue.rows().len()],
            told_at: self.now(),
            queue,
        });
        self.queue_greeting().into_iter().for_each(|tell| self.tell(tell));
        Ok(Vec::new())
    }

    pub(crate) fn queue_run(&mut self, mode: Mode) -> Result<(), Diagnostic> {
        let standing = self.standing();
        if self.touching.is_some() {
            return Err(error!("control.busy"));
        }
        let Some(lab) = &mut self.lab else { return Err(error!("control.no_queue")) };
        if self.session.queue && self.session.state == State::Pausing {
            lab.mode = mode;
            self.try_event(Event::Resume)?;
            if let Some(lab) = &mut self.lab {
                lab.run.proceed(mode);
            }
            return Ok(());
        }
        if !self.session.queue {
            if lab.begun {
                return Err(error!("control.queue_over"));
            }
            // The position may have changed since the queue was loaded: check again.
            let outputs = self.machine.output_names();
            lab.total = check(&lab.queue, &self.machine, &outputs, &standing)?.rows;
            lab.run = QueueRun::new(lab.queue.clone(), outputs, standing);
        }
        lab.mode = mode;
        self.try_event(Event::Queue)
    }

    pub(crate) fn queue_go(&mut self) {
        let Some(lab) = &mut self.lab else { return };
        lab.begun = true;
        (lab.phase, lab.why) = (QueuePhase::Running, None);
        let actions = lab.run.go(&self.machine, lab.mode);
        self.queue_act(actions);
    }

    pub(crate) fn queue_hold(&mut self) {
        if let Some(lab) = &mut self.lab {
            lab.run.hold();
        }
    }

    pub(crate) fn queue_clear(&mut self) -> Result<(), Diagnostic> {
        if self.session.queue {
            return Err(error!("control.busy"));
        }
        self.lab = None;
        self.queue_greeting().into_iter().for_each(|tell| self.tell(tell));
        Ok(())
    }

    pub(crate) fn queue_reported(&mut self, report: &Report) {
        let told = self.told_to_core(report);
        let Some(lab) = &mut self.lab else { return };
        let drilled = lab.run.drills() && matches!(told.outcome, Outcome::Completed | Outcome::Gated(_));
        let actions = lab.run.reported(&self.machine, &told);
        if drilled {
            self.count_stroke();
        }
        self.queue_act(actions);
    }

    pub(crate) fn told_to_core(&self, report: &Report) -> queue::QueueReport {
        let outcome = match report.ended {
            // A stop and the report crossed: do not start the next row.
            _ if self.session.state == State::Stopping => Outcome::Stopped,
            Ended::Completed => Outcome::Completed,
            Ended::Gated(at) => Outcome::Gated(at),
            Ended::Unmet(gate) => Outcome::Unmet(gate),
            Ended::Guarded(input) => Outcome::Guarded(input),
            Ended::Missing(input) => Outcome::Missing(input),
            Ended::Early { at } => Outcome::Early { at },
            Ended::Late { ticks } => Outcome::Late { ticks },
            Ended::Spindle { trouble } => Outcome::Spindle { trouble },
            Ended::Stopped | Ended::Starved | Ended::RanDry => Outcome::Stopped,
        };
        let Report { position, inputs, ticks, .. } = *report;
        queue::QueueReport { outcome, position, inputs, ticks }
    }

    fn queue_act(&mut self, actions: Vec<QueueAction>) {
        for action in actions {
            match action {
                QueueAction::Output { place, on } => {
                    self.switched_by_hand(place);
                    self.executor.output(place, on);
                }
                QueueAction::Correct { axis, steps } => {
                    for axis in cycles::together(&self.machine, axis) {
                        self.executor.correct(axis, steps);
                        self.position[axis] += steps;
                    }
                }
                QueueAction::Play(segments) => {
                    self.queue_trust();
                    match self.in_time(segments) {
                        Ok(segments) => self.give(Doing::Queue, segments),
                        Err(why) => self.queue_rests(Rest::Failed { why, harm: Harm::None }),
                    }
                }
                QueueAction::Rest(rest) => {
                    self.queue_trust();
                    self.queue_rests(rest);
                }
            }
        }
        self.tell_queue(false);
    }

    /// Adjusts the trust in the position: lost while an axis homes, restored when all are homed.
    fn queue_trust(&mut self) {
        let Some(lab) = &self.lab else { return };
        let all = lab.run.standing().all_homed();
        if all != (self.session.trust == Trust::Trusted) && (all || lab.run.homes()) {
            self.pending.push_back(Event::Counted { all_homed: all });
        }
    }

    fn queue_rests(&mut self, rest: Rest) {
        let Some(lab) = &mut self.lab else { return };
        let event = match rest {
            Rest::Held => {
                lab.phase = QueuePhase::Held;
                Event::QueueHeld
            }
            Rest::Done => {
                lab.phase = QueuePhase::Done;
                Event::QueueDone
            }
            Rest::Stopped => {
                lab.phase = QueuePhase::Stopped;
                Event::Rested
            }
            Rest::Failed { why, harm } => {
                (lab.phase, lab.why) = (QueuePhase::Failed, Some(why.clone()));
                let left = match harm {
                    Harm::None => Trust::Trusted,
                    Harm::Suspect => Trust::Suspect,
                    Harm::Lost => Trust::Lost,
                };
                Event::Failed { alarm: why, left }
            }
        };
        self.pending.push_back(event);
    }

    /// The line was cut and the current row stopped on its way; the trust in the position is unchanged.
    pub(crate) fn queue_ran_dry(&mut self, why: Diagnostic) {
        let harm = if self.session.trust == Trust::Trusted { Harm::None } else { Harm::Lost };
        self.queue_rests(Rest::Failed { why, harm });
    }

    /// The session ended the queue; a held queue ends too.
    pub(crate) fn queue_over(&mut self) {
        let Some(lab) = &mut self.lab else { return };
        if lab.begun && !lab.run.ended() {
            let actions = lab.run.stopped();
            lab.phase = QueuePhase::Stopped;
            let switched =
                actions.into_iter().filter(|action| matches!(action, QueueAction::Output { .. })).collect();
            self.queue_act(switched);
        }
        self.tell_queue(true);
    }

    pub(crate) fn tell_queue(&mut self, now: bool) {
        let time = self.now();
        let Some(lab) = &mut self.lab else { return };
        let rests = lab.phase != QueuePhase::Running;
        if !(now || rests || time.saturating_sub(lab.told_at) >= PACE) {
            return;
        }
        let results = lab.run.results();
        let changed = (0..).zip(results).zip(&lab.told).filter(|((_, is), was)| is != was);
        let changed = changed.map(|((row, is), _)| (row, is.clone())).collect();
        lab.told = results.to_vec();
        lab.told_at = time;
        let status = lab.status(changed, false);
        self.tell(Tell::Queue(Box::new(status)));
    }

    /// The queue report for a newly connected page, and for all after a change.
    pub(crate) fn queue_greeting(&self) -> Vec<Tell> {
        let Some(lab) = &self.lab else {
            let status = QueueStatus { whole: true, ..QueueStatus::default() };
            return vec![Tell::QueueText { text: String::new() }, Tell::Queue(Box::new(status))];
        };
        let begun = (0..).zip(lab.run.results()).filter(|(_, result)| result.turns > 0);
        let results = begun.map(|(row, result)| (row, result.clone())).collect();
        vec![Tell::QueueText { text: lab.text.clone() }, Tell::Queue(Box::new(lab.status(results, true)))]
    }

    pub(crate) fn queue_command(&self) -> Option<String> {
        let lab = self.lab.as_ref().filter(|_| self.doing == Doing::Queue)?;
        let command = lab.queue.rows().get(lab.run.row()?)?.command.as_ref()?;
        Some(command.split().0.name.to_owned())
    }
}

impl Lab {
    fn status(&self, results: Vec<(u32, RowResult)>, whole: bool) -> QueueStatus {
        let row = self.run.row().and_then(|row| u32::try_from(row).ok());
        let (phase, passed, total) = (self.phase, self.run.passed(), self.total);
        QueueStatus { phase, row, passed, total, results, whole, why: self.why.clone() }
    }
}
