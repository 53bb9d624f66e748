//! How views read the model: a selector names a part, whose signal is made at first use and set only when the
//! part changes.
//!
//! ```text
//! read(|m| m.frame.tab)          a small value, now; the caller runs again when it changes
//! watch(|m| &m.link.armed)      a signal, compared by value, cloned only when the part changes
//! shared(|m| &m.board.plan)      a signal of a large part, compared by its handle
//! computed(|m| m.board_name())   a signal of a value that is computed after every event: it must be cheap
//! memo(|| …)                     a value computed from signals, and only when these change
//! peek(|m| …)                    a value, without following its changes
//! ```

use super::{PAGE, Page};
use crate::model::Model;
use leptos::prelude::*;
use std::any::{Any, TypeId};
use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;
use std::sync::Arc;

/// Sets a signal if its part of the model changed.
type Update = Rc<dyn Fn(&Model)>;

/// A large part of the model, compared by its handle.
pub trait Handle: Clone + Send + Sync + 'static {
    fn is(&self, other: &Self) -> bool;
}

impl<T: ?Sized + Send + Sync + 'static> Handle for Arc<T> {
    fn is(&self, other: &Self) -> bool {
        Self::ptr_eq(self, other)
    }
}

impl<H: Handle> Handle for Option<H> {
    fn is(&self, other: &Self) -> bool {
        match (self, other) {
            (Some(one), Some(other)) => one.is(other),
            (one, other) => one.is_none() && other.is_none(),
        }
    }
}

pub(super) struct Selectors {
    /// Owns the signals, which outlive the view that reads them first.
    owner: Owner,
    /// The signal or memo of each selector, by the address of its function and the signal's type.
    made: RefCell<HashMap<(usize, TypeId), Box<dyn Any>>>,
    updates: RefCell<Vec<Update>>,
}

impl Selectors {
    pub(super) fn new() -> Self {
        Self { owner: Owner::new(), made: RefCell::default(), updates: RefCell::default() }
    }

    pub(super) fn show(&self, model: &Model) {
        let mut index = 0;
        loop {
            // Setting a signal may make further ones.
            let update = self.updates.borrow().get(index).cloned();
            let Some(update) = update else { return };
            update(model);
            index += 1;
        }
    }

    fn once<S: Copy + 'static>(&self, selector: usize, make: impl FnOnce() -> S) -> S {
        let key = (selector, TypeId::of::<S>());
        let known = self.made.borrow().get(&key).and_then(|made| made.downcast_ref().copied());
        known.unwrap_or_else(|| {
            let made = self.owner.with(make);
            self.made.borrow_mut().insert(key, Box::new(made));
            made
        })
    }
}

fn with_page<T>(act: impl FnOnce(&Page) -> T) -> T {
    PAGE.with(|page| act(page.get().expect("the page is made before the first screen")))
}

fn signal_of<T: Clone + Send + Sync + 'static>(
    selector: usize,
    get: impl Fn(&Model) -> T + 'static,
    is_same: impl Fn(&Model, &T) -> bool + 'static,
) -> ReadSignal<T> {
    with_page(|page| {
        page.selectors.once(selector, || {
            let (shown, set) = signal(get(&page.model.borrow()));
            page.selectors.updates.borrow_mut().push(Rc::new(move |model| {
                if !shown.with_untracked(|shown| is_same(model, shown)) {
                    set.set(get(model));
                }
            }));
            shown
        })
    })
}

pub fn read<T: Copy + PartialEq + Send + Sync + 'static>(get: fn(&Model) -> T) -> T {
    computed(get).get()
}

pub fn watch<T: Clone + PartialEq + Send + Sync + 'static>(get: fn(&Model) -> &T) -> ReadSignal<T> {
    signal_of(get as usize, move |model| get(model).clone(), move |model, shown| get(model) == shown)
}

pub fn shared<T: Handle>(get: fn(&Model) -> &T) -> ReadSignal<T> {
    signal_of(get as usize, move |model| get(model).clone(), move |model, shown| get(model).is(shown))
}

pub fn computed<T: Clone + PartialEq + Send + Sync + 'static>(get: fn(&Model) -> T) -> ReadSignal<T> {
    signal_of(get as usize, get, move |model, shown| get(model) == *shown)
}

pub fn memo<T: PartialEq + Send + Sync + 'static>(make: fn() -> T) -> Memo<T> {
    with_page(|page| page.selectors.once(make as usize, || Memo::new(move |_| make())))
}

pub fn peek<T>(get: impl FnOnce(&Model) -> T) -> T {
    with_page(|page| get(&page.model.borrow()))
}
