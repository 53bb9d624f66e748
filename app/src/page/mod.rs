//! The running page: its single model, the entry for events, and the model as signals.
//!
//! ```text
//! send(Event) ─▶ update ─▶ effects run ─▶ signals set    in this order: requests to the machine go out first
//! ```
//!
//! The only static with state is here.

pub mod board;
pub mod lab;
pub mod link;
mod select;

pub use select::{Handle, computed, memo, peek, read, shared, watch};

use crate::keys::{KeyAction, SHORTCUTS, Shortcut};
use crate::model::{Clocks, Effect, Event, Model, update};
use leptos::prelude::{ReadSignal, With};
use select::Selectors;
use std::cell::{Cell, OnceCell, RefCell};
use std::collections::VecDeque;

/// The page's environment.
pub struct Surroundings {
    pub run: Box<dyn Fn(Effect)>,
    pub clock: fn() -> Clocks,
}

struct Page {
    model: RefCell<Model>,
    waiting: RefCell<VecDeque<Event>>,
    busy: Cell<bool>,
    selectors: Selectors,
    around: Surroundings,
}

thread_local! {
    static PAGE: OnceCell<Page> = const { OnceCell::new() };
}

/// Creates the page. Called once.
pub fn begin(around: Surroundings) {
    let (model, waiting, busy) = (RefCell::default(), RefCell::default(), Cell::new(false));
    let page = Page { model, waiting, busy, selectors: Selectors::new(), around };
    PAGE.with(|known| drop(known.set(page)));
    send(Event::Begun);
}

/// Handles an event. An event sent during another one is handled afterwards.
pub fn send(event: impl Into<Event>) {
    let event = event.into();
    PAGE.with(|page| {
        if let Some(page) = page.get() {
            page.take_in(event);
        }
    });
}

/// The page's language; `None` before the page exists.
pub fn language() -> Option<ReadSignal<String>> {
    PAGE.with(|page| page.get().is_some()).then(|| watch(|m| &m.frame.language))
}

/// A shortcut's key as shown to the user, who may have changed it.
pub fn written(shortcut: &Shortcut) -> String {
    watch(|m| &m.frame.own_keys).with(|own| own.written(shortcut))
}

/// The key of the first shortcut with `action`; empty if there is none.
pub fn key_of(action: KeyAction) -> String {
    SHORTCUTS.iter().find(|shortcut| shortcut.action == action).map_or_else(String::new, written)
}

impl Page {
    fn take_in(&self, event: Event) {
        self.waiting.borrow_mut().push_back(event);
        // Sent during another event: the loop of the outer call handles this one.
        if self.busy.replace(true) {
            return;
        }
        loop {
            while let Some(event) = self.next() {
                for effect in self.step(event) {
                    (self.around.run)(effect);
                }
            }
            // Setting signals may send further events.
            self.selectors.show(&self.model.borrow());
            if self.waiting.borrow().is_empty() {
                break;
            }
        }
        self.busy.set(false);
    }

    fn next(&self) -> Option<Event> {
        self.waiting.borrow_mut().pop_front()
    }

    fn step(&self, event: Event) -> Vec<Effect> {
        let mut model = self.model.borrow_mut();
        update(&mut model, Event::Clock { clock: (self.around.clock)() });
        update(&mut model, event)
    }
}
