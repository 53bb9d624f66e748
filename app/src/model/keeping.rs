//! The open project kept in this browser, so that a reload, a crash or a closed window loses nothing (N24).
//!
//! ```text
//!  files, what was said ─ changed ─▶ packed in a worker ─┐
//!  job ─ changed ─ rests half a second ──────────────────┴▶ the store ─ next visit ─▶ an offer: Restore · Discard
//!
//!  two places:   offered until the person answers │ written by this visit
//! ```
//!
//! Comes in: the open board and its job, as they change; what the store says. Goes out: what to write, and the offer. Nothing
//! is opened unless the person says so, and what is offered is not written over before. Does not know the store.

use super::{Document, Effect, Event, Lane, Model, export, frame};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Request, ToOpen};
use crate::said::{Text, key};
use annulus_core::cam::work::Work;
use annulus_core::project;
use std::sync::Arc;

/// Changes rest so long before they are kept, in ms.
const REST_MS: u32 = 500;
/// How many projects are kept at most: the one on offer and the one that is open.
pub const PLACES: u32 = 2;

/// A project that was open before.
#[derive(Clone, Debug, PartialEq)]
pub struct Offer {
    /// Where it is kept.
    pub place: u32,
    /// The name of its board.
    pub name: String,
    /// When it was kept last, in ms since 1970.
    pub at_ms: f64,
}

/// A record that is being written.
#[derive(Clone, Debug, PartialEq)]
struct Record {
    document: Arc<Document>,
    name: String,
    job: String,
    place: u32,
}

/// What the store is doing.
#[derive(Clone, Debug, Default, PartialEq)]
enum Store {
    /// Nothing.
    #[default]
    Rests,
    /// The files are packed in a worker, by this request.
    Packing { number: u32, record: Record, again: bool },
    /// The record is written.
    Writing { record: Record, again: bool },
}

/// What is kept in this browser.
#[derive(Clone, Debug, Default)]
pub struct Keeping {
    /// What there is to restore.
    pub offer: Option<Offer>,
    /// Where this visit writes; none until it is known what is there.
    place: Option<u32>,
    /// The board whose files are in the store.
    kept: Option<Arc<Document>>,
    store: Store,
    /// Counts changes; a rest of an older count is over.
    change: u32,
    /// What was seen last.
    seen: (Option<Arc<Document>>, Option<Arc<Work>>),
    /// What is being restored.
    wanted: Option<Offer>,
    /// That nothing can be kept was said.
    told: bool,
}

/// What happens to it.
#[derive(Clone, Debug, PartialEq)]
pub enum KeepEvent {
    /// This was in the store.
    Found {
        /// In no order.
        offers: Vec<Offer>,
    },
    /// What is open did not change for a while.
    Rested {
        /// Since this change.
        change: u32,
    },
    /// The store has written, or has not.
    Written {
        /// It has.
        done: bool,
    },
    /// What is on offer is to be opened.
    Restore {
        /// Which.
        offer: Offer,
    },
    /// What was kept at a place.
    Taken {
        /// Where.
        place: u32,
        /// The files, packed.
        files: Option<Vec<u8>>,
        /// The job as text.
        job: Option<String>,
    },
    /// What is on offer is to be forgotten.
    Discard {
        /// Which.
        offer: Offer,
    },
    /// It is forgotten; then an older one may be on offer.
    Dropped,
}

impl Keeping {
    #[cfg(test)]
    pub(super) fn change(&self) -> u32 {
        self.change
    }

    /// Whether this request is waited for.
    pub(super) fn waits_for(&self, wanted: u32) -> bool {
        matches!(&self.store, Store::Packing { number, .. } if *number == wanted)
    }
}

/// The page was opened: looks for what was kept.
pub(super) fn begun() -> Vec<Effect> {
    vec![Effect::LookInStore]
}

/// Waits for a rest where board or job is another one.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    let now = (model.board.document.as_ref(), model.job.work.as_ref());
    let seen = (model.keeping.seen.0.as_ref(), model.keeping.seen.1.as_ref());
    let same_document = now.0.map(Arc::as_ptr) == seen.0.map(Arc::as_ptr);
    let same_work = now.1.map(Arc::as_ptr) == seen.1.map(Arc::as_ptr);
    if same_document && same_work {
        return Vec::new();
    }
    model.keeping.seen = (model.board.document.clone(), model.job.work.clone());
    rest(model)
}

/// Keeps what is open once nothing has changed for a while.
fn rest(model: &mut Model) -> Vec<Effect> {
    model.keeping.change += 1;
    let event = Event::Keep(KeepEvent::Rested { change: model.keeping.change });
    vec![Effect::Wake { after_ms: REST_MS, event: Box::new(event) }]
}

/// Takes one event in.
pub(super) fn update(model: &mut Model, event: KeepEvent) -> Vec<Effect> {
    match event {
        KeepEvent::Found { offers } => found(model, offers),
        KeepEvent::Rested { change } if change == model.keeping.change => keep(model),
        KeepEvent::Rested { .. } => Vec::new(),
        KeepEvent::Written { done } => written(model, done),
        KeepEvent::Restore { offer } => {
            let place = offer.place;
            model.keeping.wanted = Some(offer);
            vec![Effect::TakeFromStore { place }]
        }
        // What was taken is opened where files are.
        KeepEvent::Taken { .. } => Vec::new(),
        KeepEvent::Discard { offer } => vec![Effect::DropFromStore { place: offer.place }],
        KeepEvent::Dropped => {
            model.keeping.offer = None;
            vec![Effect::LookInStore]
        }
    }
}

/// Offers the project that was kept last, and finds this visit a place beside it.
fn found(model: &mut Model, mut offers: Vec<Offer>) -> Vec<Effect> {
    offers.sort_by(|a, b| b.at_ms.total_cmp(&a.at_ms));
    let first = offers.into_iter().next();
    let place = first.as_ref().map_or(0, |offer| (offer.place + 1) % PLACES);
    model.keeping.offer = first;
    writes_to(model, place);
    rest(model)
}

/// What was kept at a place is open now.
pub(super) fn restored(model: &mut Model, place: u32) {
    model.keeping.offer = None;
    writes_to(model, place);
}

/// From now on this visit writes there; nothing of it is there yet.
fn writes_to(model: &mut Model, place: u32) {
    if model.keeping.place.replace(place) != Some(place) {
        model.keeping.kept = None;
    }
}

/// The project to be opened, where this place was to be restored; what says that it is gone.
pub(super) fn taken(model: &mut Model, place: u32, files: Option<Vec<u8>>) -> Result<Option<ToOpen>, Effect> {
    let wanted = model.keeping.wanted.take().filter(|offer| offer.place == place);
    let Some(offer) = wanted else { return Ok(None) };
    match files {
        Some(bytes) => Ok(Some(ToOpen { name: offer.name, bytes })),
        None => Err(frame::toast(model, Text::of(key!("page.kept.gone")), None)),
    }
}

/// Keeps what is open, again where it changed while the store was busy.
fn keep(model: &mut Model) -> Vec<Effect> {
    if let Store::Packing { again, .. } | Store::Writing { again, .. } = &mut model.keeping.store {
        *again = true;
        return Vec::new();
    }
    let (document, work) = (model.board.document.clone(), model.job.work.clone());
    let (Some(document), Some(work), Some(place)) = (document, work, model.keeping.place) else {
        return Vec::new();
    };
    let name = document.reading.board.name.clone();
    let record = Record { name, job: project::write(&work), place, document };
    let known = model.keeping.kept.as_ref().is_some_and(|kept| Arc::ptr_eq(kept, &record.document));
    if known {
        return write(model, record, None, false);
    }
    let Some(project) = export::project(model, false) else { return Vec::new() };
    let number = model.next_request();
    model.keeping.store = Store::Packing { number, record, again: false };
    vec![Effect::Ask { lane: Lane::Beside, number, request: Box::new(Request::Save(project)) }]
}

fn write(model: &mut Model, record: Record, files: Option<Vec<u8>>, again: bool) -> Vec<Effect> {
    let (place, name, job) = (record.place, record.name.clone(), record.job.clone());
    model.keeping.store = Store::Writing { record, again };
    vec![Effect::WriteStore { place, name, job, files, at_ms: model.clock.wall_ms }]
}

/// The files are packed.
pub(super) fn packed(model: &mut Model, answer: Result<Answer, Stopped>) -> Vec<Effect> {
    let Store::Packing { record, again, .. } = std::mem::take(&mut model.keeping.store) else {
        return Vec::new();
    };
    match answer {
        Ok(Answer::Saved(bytes)) => write(model, record, Some(bytes), again),
        _ => {
            model.keeping.store = Store::Writing { record, again };
            written(model, false)
        }
    }
}

fn written(model: &mut Model, done: bool) -> Vec<Effect> {
    let Store::Writing { record, again } = std::mem::take(&mut model.keeping.store) else {
        return Vec::new();
    };
    let mut effects = Vec::new();
    if done {
        model.keeping.kept = Some(record.document);
    } else if !std::mem::replace(&mut model.keeping.told, true) {
        effects.push(frame::toast(model, Text::of(key!("page.kept.failed")), None));
    }
    if again {
        effects.extend(keep(model));
    }
    effects
}
