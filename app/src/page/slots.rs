//! How screens read the model: a signal for every part of it, set only when that part is another one.
//!
//! ```text
//! Model ─▶ slot: frame.tab ─▶ signal ─▶ whoever shows it
//!       ─▶ slot: board.plan ─▶ signal       (heavy things are compared by their handles)
//! ```
//!
//! Comes in: the model after every event. Goes out: signals that can be read and not written. Does not know what they mean.

use crate::model::Model;
use leptos::prelude::*;
use std::sync::Arc;

/// Sets one signal where its part of the model is another one.
type Slot = Box<dyn Fn(&Model)>;

/// All parts of the model that are shown.
pub(super) struct Slots {
    first: Model,
    slots: Vec<Slot>,
}

impl Slots {
    /// None yet; signals begin as the model does.
    pub(super) fn new() -> Self {
        Self { first: Model::default(), slots: Vec::new() }
    }

    /// A part that is made of the model, compared by its value.
    pub(super) fn made<T: Clone + PartialEq + Send + Sync + 'static>(
        &mut self,
        make: fn(&Model) -> T,
    ) -> ReadSignal<T> {
        let (shown, set) = signal(make(&self.first));
        self.slots.push(Box::new(move |model| {
            let now = make(model);
            if shown.with_untracked(|shown| *shown != now) {
                set.set(now);
            }
        }));
        shown
    }

    /// A part of the model, compared by its value; copied only when it is another one.
    pub(super) fn part<T: Clone + PartialEq + Send + Sync + 'static>(
        &mut self,
        get: fn(&Model) -> &T,
    ) -> ReadSignal<T> {
        let (shown, set) = signal(get(&self.first).clone());
        self.slots.push(Box::new(move |model| {
            let now = get(model);
            if shown.with_untracked(|shown| shown != now) {
                set.set(now.clone());
            }
        }));
        shown
    }

    /// Something heavy that may be there, compared by its handle.
    pub(super) fn handle<T: Send + Sync + 'static>(
        &mut self,
        get: fn(&Model) -> &Option<Arc<T>>,
    ) -> ReadSignal<Option<Arc<T>>> {
        let (shown, set) = signal(get(&self.first).clone());
        self.slots.push(Box::new(move |model| {
            let now = get(model);
            let same = shown
                .with_untracked(|shown| shown.as_ref().map(Arc::as_ptr) == now.as_ref().map(Arc::as_ptr));
            if !same {
                set.set(now.clone());
            }
        }));
        shown
    }

    /// Something heavy that is always there, compared by its handle.
    pub(super) fn kept<T: Send + Sync + 'static>(
        &mut self,
        get: fn(&Model) -> &Arc<T>,
    ) -> ReadSignal<Arc<T>> {
        let (shown, set) = signal(get(&self.first).clone());
        self.slots.push(Box::new(move |model| {
            let now = get(model);
            if !shown.with_untracked(|shown| Arc::ptr_eq(shown, now)) {
                set.set(now.clone());
            }
        }));
        shown
    }

    /// Shows `model`.
    pub(super) fn show(&self, model: &Model) {
        self.slots.iter().for_each(|slot| slot(model));
    }
}
