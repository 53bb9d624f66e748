//! The job of the open board: its history, the selected operation, and which problems the user has read.

use super::{Effect, Model};
use crate::lab::undo::LabHistory;
use crate::workbench::edit;
use annulus_core::board::Face;
use annulus_core::cam::HoleOrder;
use annulus_core::cam::work::{Operation, Work};
use std::collections::BTreeSet;
use std::sync::Arc;

#[derive(Clone, Debug, Default)]
pub struct JobEdit {
    /// The job with undo and redo; `None` without a board.
    history: Option<LabHistory<Work>>,
    /// The current job; unchanged jobs keep their handle.
    pub work: Option<Arc<Work>>,
    /// Index of the selected operation.
    pub chosen: usize,
    /// The picture shows the toolpaths of the selected operation and dims the others.
    pub lit: bool,
    pub read: BTreeSet<String>,
    /// The problem marked in the view.
    pub marked: Option<usize>,
    /// Names of the problem groups that the user opened or closed.
    pub turned: BTreeSet<String>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum JobEvent {
    /// Replace the job. Consecutive changes of one field are one undo step.
    Change {
        field: Option<&'static str>,
        work: Box<Work>,
    },
    Undo {
        back: bool,
    },
    Turn {
        face: Face,
    },
    /// Select an operation and light up its toolpaths; for a lit one, show all toolpaths again.
    Choose {
        at: usize,
    },
    /// Move an operation in the list and select it.
    Move {
        from: usize,
        to: usize,
    },
    /// Move the selected operation up or down among those of its side.
    Shift {
        up: bool,
    },
    /// Add an operation after the selected one and select it.
    Add {
        word: String,
    },
    Remove,
    DrillOrder {
        order: HoleOrder,
    },
    Read {
        names: Vec<String>,
        on: bool,
    },
    /// Accept all errors of the displayed plan and mark all its problems as read.
    AllSeen,
    Mark {
        at: usize,
    },
    TurnGroup {
        name: String,
    },
}

impl JobEdit {
    pub(super) fn open(&mut self, work: Work) {
        let first = edit::of_face(&work, work.setup.face).first().copied().unwrap_or(0);
        *self = Self { history: Some(LabHistory::new(work)), chosen: first, ..Self::default() };
        self.renew();
    }

    pub fn edited(&self) -> bool {
        self.history.as_ref().is_some_and(LabHistory::can_undo)
    }

    pub fn can_undo(&self) -> (bool, bool) {
        self.history.as_ref().map_or((false, false), |history| (history.can_undo(), history.can_redo()))
    }

    pub fn operation(&self) -> Option<&Operation> {
        self.work.as_ref()?.operations.get(self.chosen)
    }

    /// Order of the first drill operation.
    pub fn drill_order(&self) -> Option<HoleOrder> {
        self.work.as_ref()?.operations.iter().find_map(|operation| Some(operation.action.drill()?.order))
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

    /// Updates the handle from the history and keeps the selection in range.
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

/// New index of the selected operation when it moves up or down.
fn shifted(job: &JobEdit, up: bool) -> Option<usize> {
    let work = job.work.as_ref()?;
    let places = edit::of_face(work, job.operation()?.face);
    let here = places.iter().position(|place| *place == job.chosen)?;
    let there = if up { here.checked_sub(1)? } else { here + 1 };
    places.get(there).copied()
}

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
            (job.chosen, job.lit) = (first.unwrap_or(0), false);
        }
        (JobEvent::Choose { at }, _) => {
            job.lit = job.chosen != at || !job.lit;
            job.chosen = at;
        }
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
            if let Some((next, at)) = edit::added(&work, &word, after) {
                job.change(None, next);
                job.chosen = at;
            }
        }
        (JobEvent::Remove, Some(work)) => {
            job.lit = false;
            job.change(None, edit::removed(&work, job.chosen));
        }
        (JobEvent::DrillOrder { order }, Some(work)) => {
            job.change(None, Work::clone(&work).drilled_in(order));
        }
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
    let codes: Vec<String> = board.left_out().map(|error| error.code.clone()).collect();
    board.accepted.extend(codes);
    if let Some(proved) = &board.proved {
        model.job.read.extend(proved.findings.iter().map(|finding| finding.id.clone()));
    }
}
