//! The job of the open board as signals: what it is now, which operation is chosen, what was read of its findings.
//!
//! Comes in: edits. Goes out: signals. Does not know how a job is shown.

use super::edit;
use crate::lab::undo::History;
use crate::state::state;
use annulus_core::cam::Order;
use annulus_core::cam::work::{Action, Operation, Work};
use leptos::prelude::*;
use std::cell::Cell;
use std::collections::BTreeSet;
use std::sync::Arc;

/// The job of the open board.
#[derive(Clone, Copy)]
pub struct Bench {
    /// The job with what it was before; none without a board.
    pub history: RwSignal<Option<History<Work>>>,
    /// The job now.
    pub work: Memo<Option<Arc<Work>>>,
    /// Place of the chosen operation.
    pub chosen: RwSignal<usize>,
    /// The plan on show is that of an older job.
    pub stale: RwSignal<bool>,
    /// Findings that the person has read, by name.
    pub read: RwSignal<BTreeSet<String>>,
    /// The finding that is marked in the picture.
    pub marked: RwSignal<Option<usize>>,
    /// Groups of findings that the person opened or closed, by name.
    pub turned: RwSignal<BTreeSet<String>>,
}

thread_local! {
    static BENCH: Cell<Option<Bench>> = const { Cell::new(None) };
}

/// The job. Made by [`begin`].
pub fn bench() -> Bench {
    BENCH.get().expect("the bench is made before the first screen")
}

/// Makes it in the root of the page, before the desk.
pub fn begin() {
    let history = RwSignal::new(None::<History<Work>>);
    let work = Memo::new(move |_| {
        history.with(|history| history.as_ref().map(|history| Arc::new(history.now().clone())))
    });
    BENCH.set(Some(Bench {
        history,
        work,
        chosen: RwSignal::new(0),
        stale: RwSignal::new(false),
        read: RwSignal::new(BTreeSet::new()),
        marked: RwSignal::new(None),
        turned: RwSignal::new(BTreeSet::new()),
    }));
}

impl Bench {
    /// A new board: its usual job, nothing read, nothing to take back.
    pub fn open(self, work: Work) {
        let face = work.setup.face;
        let first = edit::of_face(&work, face).first().copied().unwrap_or(0);
        self.history.set(Some(History::new(work)));
        self.chosen.set(first);
        self.read.set(BTreeSet::new());
        self.turned.set(BTreeSet::new());
        self.marked.set(None);
    }

    /// Whether the person has changed anything.
    pub fn edited(self) -> bool {
        self.history.with_untracked(|history| history.as_ref().is_some_and(History::can_undo))
    }

    /// Goes on to what `act` makes of the job. Changes from one `field` are one step.
    pub fn change(self, field: Option<&str>, act: impl FnOnce(&Work) -> Work) {
        let changed = self.history.try_update(|history| {
            let Some(history) = history else { return };
            let next = act(history.now());
            history.change(field, next);
        });
        if changed.is_some() {
            self.keep_chosen();
        }
    }

    /// Back by a step, or on again.
    pub fn undo(self, back: bool) {
        self.history.update(|history| {
            if let Some(history) = history {
                if back {
                    history.undo()
                } else {
                    history.redo()
                };
            }
        });
        self.keep_chosen();
    }

    /// The chosen operation.
    pub fn operation(self) -> Option<Operation> {
        let at = self.chosen.get();
        self.work.with(|work| work.as_ref()?.operations.get(at).cloned())
    }

    /// Moves the chosen operation up or down among those of its side.
    pub fn shift(self, up: bool) {
        let at = self.chosen.get_untracked();
        let to = self.work.with_untracked(|work| {
            let work = work.as_ref()?;
            let places = edit::of_face(work, work.operations.get(at)?.face);
            let here = places.iter().position(|place| *place == at)?;
            let there = if up { here.checked_sub(1)? } else { here + 1 };
            places.get(there).copied()
        });
        if let Some(to) = to {
            self.change(None, |work| edit::moved(work, at, to));
            self.chosen.set(to);
        }
    }

    /// Adds an operation of the kind `word` behind the chosen one.
    pub fn add(self, word: &str) {
        let machine = state().machine.get_untracked();
        let after = self.work.with_untracked(|work| {
            let any = work.as_ref().is_some_and(|work| !work.operations.is_empty());
            any.then(|| self.chosen.get_untracked())
        });
        let Some(work) = self.work.get_untracked() else { return };
        if let Some((next, at)) = edit::added(&work, word, after, &machine) {
            self.change(None, |_| next);
            self.chosen.set(at);
        }
    }

    /// Takes the chosen operation out.
    pub fn remove(self) {
        let at = self.chosen.get_untracked();
        self.change(None, |work| edit::removed(work, at));
    }

    /// In which order the first drilling goes.
    pub fn drill_order(self) -> Option<Order> {
        self.work.with(|work| {
            work.as_ref()?.operations.iter().find_map(|operation| match &operation.action {
                Action::Drill(drill) => Some(drill.order),
                _ => None,
            })
        })
    }

    /// All drilling in this order.
    pub fn set_drill_order(self, order: Order) {
        self.change(None, |work| {
            let mut work = work.clone();
            for operation in &mut work.operations {
                if let Action::Drill(drill) = &mut operation.action {
                    drill.order = order;
                }
            }
            work
        });
    }

    fn keep_chosen(self) {
        let count = self.work.with_untracked(|work| work.as_ref().map_or(0, |work| work.operations.len()));
        if self.chosen.get_untracked() >= count {
            self.chosen.set(count.saturating_sub(1));
        }
    }
}
