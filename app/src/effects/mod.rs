//! What the model wants done, done: workers, timers, files, the store. What comes of it comes back as events.
//!
//! ```text
//! update ─▶ Effect ─▶ worker │ timer │ download │ store ─▶ Event ─▶ update
//! ```
//!
//! Comes in: effects, one after the other. Goes out: events. Does not know the screens, and decides nothing.

mod files;
mod store;
mod worker;

use crate::link::browser;
use crate::model::{Clock, Effect};
use crate::page::{Surroundings, send};
use crate::widgets::save_bytes;
use leptos::prelude::set_timeout;
use std::time::Duration;
use worker::Workers;

/// What the page needs to run.
pub fn surroundings() -> Surroundings {
    files::listen();
    let workers = Workers::default();
    let clock = || Clock { page_ms: browser::now_ms(), wall_ms: browser::clock_ms() };
    Surroundings { run: Box::new(move |effect| run(&workers, effect)), clock }
}

fn run(workers: &Workers, effect: Effect) {
    match effect {
        Effect::Ask { lane, number, request } => workers.ask(lane, number, *request),
        Effect::CallOff => workers.call_off(),
        Effect::Wake { after_ms, event } => {
            set_timeout(move || send(*event), Duration::from_millis(u64::from(after_ms)));
        }
        Effect::Save { name, kind, bytes } => save_bytes(&name, kind, &bytes),
        Effect::ChooseFiles => files::choose(),
        Effect::ChooseDialect => files::choose_dialect(),
        Effect::Sample => files::sample(),
        Effect::LookInStore => store::look(),
        Effect::WriteStore { place, name, job, files, at_ms } => store::write(place, name, job, files, at_ms),
        Effect::TakeFromStore { place } => store::take(place),
        Effect::DropFromStore { place } => store::forget(place),
    }
}
