//! The job of the open board: what it is now and was before, which operation is chosen, what was read of its findings.
//!
//! Comes in: edits. Goes out: the next job; every edit can be taken back. Does not know how a job is shown.

use super::{Effect, Model};
use crate::lab::undo::LabHistory;
use crate::workbench::edit;
use annulus_core::board::Face;
use annulus_core::cam::HoleOrder;
use annulus_core::cam::work::{Operation, OperationKind, Work};
use std::collections::BTreeSet;
use std::sync::Arc;

/// The job of the open board.
#[derive(Clone, Debug, Default)]
pub struct JobEdit {
    /// The job with what it was before; none without a board.
    history: Option<LabHistory<Work>>,
    /// The job now: the same handle as long as it is the same job.
    pub work: Option<Arc<Work>>,
    /// Place of the chosen operation.
    pub chosen: usize,
    /// Findings that the person has read, by name.
    pub read: BTreeSet<String>,
    /// The finding that is marked in the picture.
    pub marked: Option<usize>,
    /// Groups of findings that the person opened or closed, by name.
    pub turned: BTreeSet<String>,
}

/// What changes the job.
#[derive(Clone, Debug, PartialEq)]
pub enum JobEvent {
    /// It becomes another job. Changes that follow each other from one field are one step back.
    Change {
        /// The field, if it came from one.
        field: Option<&'static str>,
        /// The job from now on.
        work: Box<Work>,
    },
    /// Back by a step, or on again.
    Undo {
        /// Back.
        back: bool,
    },
    /// The other side is up, or the same.
    Turn {
        /// Which.
        face: Face,
    },
    /// An operation is chosen.
    Choose {
        /// Its place.
        at: usize,
    },
    /// An operation is dragged to another place, and chosen.
    Move {
        /// From this place.
        from: usize,
        /// To that one.
        to: usize,
    },
    /// The chosen operation goes up or down among those of its side.
    Shift {
        /// Up.
        up: bool,
    },
    /// An operation is added behind the chosen one, and chosen.
    Add {
        /// The word of its kind.
        word: String,
    },
    /// The chosen operation is taken out.
    Remove,
    /// All drilling goes in this order.
    DrillOrder {
        /// Which.
        order: HoleOrder,
    },
    /// Findings were read, or are to be read again.
    Read {
        /// Their names.
        names: Vec<String>,
        /// They were read.
        on: bool,
    },
    /// Everything that the plan on show leaves out, and everything found in it, was seen.
    AllSeen,
    /// A finding is marked in the picture.
    Mark {
        /// Its place among the findings.
        at: usize,
    },
    /// A group of findings is opened or closed: the other of the two.
    TurnGroup {
        /// Its name.
        name: String,
    },
}

impl JobEdit {
    /// A new board: its usual job, nothing read, nothing to take back.
    pub(super) fn open(&mut self, work: Work) {
        let first = edit::of_face(&work, work.setup.face).first().copied().unwrap_or(0);
        *self = Self { history: Some(LabHistory::new(work)), chosen: first, ..Self::default() };
        self.renew();
    }

    /// Whether the person has changed anything.
    pub fn edited(&self) -> bool {
        self.history.as_ref().is_some_and(LabHistory::can_undo)
    }

    /// Whether there is a step back, and one on.
    pub fn can_undo(&self) -> (bool, bool) {
        self.history.as_ref().map_or((false, false), |history| (history.can_undo(), history.can_redo()))
    }

    /// The chosen operation.
    pub fn operation(&self) -> Option<&Operation> {
        self.work.as_ref()?.operations.get(self.chosen)
    }

    fn change(&mut self, field: Option<&str>, next: Work) {
        if let Some(history) = &mut self.history {
            history.change(field, next);
            self.renew();
        }
    }

    fn undo(&mut self, back: bool) {
        if let Some(history) = &mut self.history {
            if back {
                history.undo()
            } else {
                history.redo()
            };
            self.renew();
        }
    }

    /// The handle follows the history, and the choice stays among the operations.
    fn renew(&mut self) {
        let now = self.history.as_ref().map(LabHistory::now);
        if self.work.as_deref() != now {
            self.work = now.cloned().map(Arc::new);
        }
        let count = self.work.as_ref().map_or(0, |work| work.operations.len());
        if self.chosen >= count {
            self.chosen = count.saturating_sub(1);
        }
    }
}

/// Where the chosen operation goes when it goes up or down.
fn shifted(job: &JobEdit, up: bool) -> Option<usize> {
    let work = job.work.as_ref()?;
    let places = edit::of_face(work, job.operation()?.face);
    let here = places.iter().position(|place| *place == job.chosen)?;
    let there = if up { here.checked_sub(1)? } else { here + 1 };
    places.get(there).copied()
}

fn drilled_in(work: &Work, order: HoleOrder) -> Work {
    let mut work = work.clone();
    for operation in &mut work.operations {
        if let OperationKind::Drill(drill) = &mut operation.action {
            drill.order = order;
        }
    }
    work
}

/// Takes one event in.
pub(super) fn update(model: &mut Model, event: JobEvent) -> Vec<Effect> {
    let job = &mut model.job;
    let work = job.work.clone();
    match (event, work) {
        (JobEvent::Change { field, work }, Some(_)) => job.change(field, *work),
        (JobEvent::Undo { back }, _) => job.undo(back),
        (JobEvent::Turn { face }, Some(work)) => {
            let next = edit::turned(&work, face);
            let first = edit::of_face(&next, face).first().copied();
            job.change(None, next);
            job.chosen = first.unwrap_or(0);
        }
        (JobEvent::Choose { at }, _) => job.chosen = at,
        (JobEvent::Move { from, to }, Some(work)) => {
            job.change(None, edit::moved(&work, from, to));
            job.chosen = to;
        }
        (JobEvent::Shift { up }, Some(work)) => {
            if let Some(to) = shifted(job, up) {
                job.change(None, edit::moved(&work, job.chosen, to));
                job.chosen = to;
            }
        }
        (JobEvent::Add { word }, Some(work)) => {
            let after = (!work.operations.is_empty()).then_some(job.chosen);
            if let Some((next, at)) = edit::added(&work, &word, after, &model.machine) {
                job.change(None, next);
                job.chosen = at;
            }
        }
        (JobEvent::Remove, Some(work)) => job.change(None, edit::removed(&work, job.chosen)),
        (JobEvent::DrillOrder { order }, Some(work)) => job.change(None, drilled_in(&work, order)),
        (JobEvent::Read { names, on: true }, _) => job.read.extend(names),
        (JobEvent::Read { names, on: false }, _) => names.iter().for_each(|name| {
            job.read.remove(name);
        }),
        (JobEvent::AllSeen, _) => all_seen(model),
        (JobEvent::Mark { at }, _) => job.marked = Some(at),
        (JobEvent::TurnGroup { name }, _) => {
            if !job.turned.remove(&name) {
                job.turned.insert(name);
            }
        }
        (_, None) => {}
    }
    Vec::new()
}

fn all_seen(model: &mut Model) {
    let board = &mut model.board;
    let codes: Vec<String> =
        super::board::left_out(board.plan.as_deref()).map(|error| error.code.clone()).collect();
    board.accepted.extend(codes);
    if let Some(proved) = &board.proved {
        model.job.read.extend(proved.findings.iter().map(|finding| finding.id.clone()));
    }
}
