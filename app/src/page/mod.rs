//! The running page: the one model, the way in for events, and the model as signals.
//!
//! ```text
//! send(Event) ─▶ update ─▶ effects run ─▶ signals set        in this order: what is asked of the machine goes out first
//! ```
//!
//! Comes in: events of screens and effects. Goes out: signals that screens read, effects to whoever was named at the beginning.
//! Does not know how effects are run nor what screens look like. The one static of the page that holds state is here.

mod board;
mod drawing;
mod frame;
mod job;
mod lab;
pub mod link;
mod play;
mod slots;

pub use board::{OpenBoard, open_board};
pub use drawing::{Drawing, open_drawing};
pub use frame::{Frame, frame, key_of, written};
pub use job::{OpenJob, open_job};

pub use lab::{Lab, open_lab};
pub use play::{Play, play};

use crate::model::{Clocks, Effect, Event, Model, update};
use link::Link;
use slots::Slots;
use std::cell::{Cell, OnceCell, RefCell};
use std::collections::VecDeque;

/// The signals of the page. Copies are the same.
#[derive(Clone, Copy)]
struct Signals {
    board: OpenBoard,
    job: OpenJob,
    frame: Frame,
    link: Link,
    play: Play,
    lab: Lab,
    drawing: Drawing,
}

/// What the page needs of its surroundings.
pub struct Surroundings {
    /// Runs an effect.
    pub run: Box<dyn Fn(Effect)>,
    /// What the clocks say.
    pub clock: fn() -> Clocks,
}

struct Page {
    model: RefCell<Model>,
    waiting: RefCell<VecDeque<Event>>,
    busy: Cell<bool>,
    slots: Slots,
    signals: Signals,
    around: Surroundings,
}

thread_local! {
    static PAGE: OnceCell<Page> = const { OnceCell::new() };
}

/// Makes the page, in its root. Called once.
pub fn begin(around: Surroundings) {
    let model = Model::default();
    let mut slots = Slots::new();
    let signals = Signals {
        board: board::signals(&mut slots),
        job: job::signals(&mut slots),
        frame: frame::signals(&mut slots),
        link: link::signals(&mut slots),
        play: play::signals(&mut slots),
        lab: lab::signals(&mut slots),
        drawing: drawing::signals(&mut slots),
    };
    let (model, waiting, busy) = (RefCell::new(model), RefCell::default(), Cell::new(false));
    PAGE.with(|page| drop(page.set(Page { model, waiting, busy, slots, signals, around })));
    send(Event::Begun);
}

/// Takes an event in. One that comes while another is taken in waits for its turn.
pub fn send(event: impl Into<Event>) {
    let event = event.into();
    PAGE.with(|page| {
        if let Some(page) = page.get() {
            page.take_in(event);
        }
    });
}

fn signals() -> Signals {
    PAGE.with(|page| page.get().expect("the page is made before the first screen").signals)
}

/// The language; the one of the tables before there is a page.
pub fn language() -> Option<leptos::prelude::ReadSignal<String>> {
    PAGE.with(|page| page.get().map(|page| page.signals.frame.language))
}

impl Page {
    fn take_in(&self, event: Event) {
        self.waiting.borrow_mut().push_back(event);
        if self.busy.replace(true) {
            return;
        }
        loop {
            while let Some(event) = self.next() {
                for effect in self.step(event) {
                    (self.around.run)(effect);
                }
            }
            self.slots.show(&self.model.borrow());
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
