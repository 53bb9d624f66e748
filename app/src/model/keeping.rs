//! The open project kept in this browser, so that a reload, a crash or a closed window loses nothing (N24).
//!
//! ```text
//!  files, what was said ─ changed ─▶ packed in a worker ─┐
//!  job ─ changed ─ half a second later at most ──────────┴▶ the store ─ next visit ─▶ offers: Restore · Discard
//!
//!  a place each:   this project, held by this tab │ earlier ones │ those of other tabs, which write there themselves
//! ```
//!
//! Comes in: the open board and its job, as they change; what the store says. Goes out: what to write, and the offers. Nothing
//! is opened unless the person says so; a project that another tab holds is opened as a copy. Does not know the store.

use super::{Document, Effect, Event, Lane, Model, export, frame};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Request, ToOpen};
use crate::said::{Text, key};
use annulus_core::cam::work::Work;
use annulus_core::project;
use std::sync::Arc;

/// Changes are kept after so long, whether more of them follow or not, in ms.
const REST_MS: u32 = 500;
/// How many projects are kept at most; a further one takes the place of the one that was kept longest ago and that no tab holds.
pub const PLACES: u32 = 12;

/// A project that was open before.
#[derive(Clone, Debug, PartialEq)]
pub struct Offer {
    /// Where it is kept.
    pub place: u32,
    /// The name of its board.
    pub name: String,
    /// When it was kept last, in ms since 1970.
    pub at_ms: f64,
    /// It is open in another tab, which keeps it.
    pub elsewhere: bool,
}

/// A record that is being written.
#[derive(Clone, Debug, PartialEq)]
struct Record {
    document: Arc<Document>,
    name: String,
    job: String,
    /// Of which project of this visit, and where that is kept.
    project: u32,
    place: Option<u32>,
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
    /// What there is to restore, the latest first.
    pub offers: Vec<Offer>,
    /// The open project cannot be kept, and why: the key of a sentence.
    pub failed: Option<&'static str>,
    /// Where the open project is kept; none until it has a place.
    place: Option<u32>,
    /// Counts the projects of this visit.
    project: u32,
    /// The board whose files are in the store.
    kept: Option<Arc<Document>>,
    store: Store,
    /// Counts changes.
    change: u32,
    /// Changes up to this one are kept, or on their way.
    kept_change: u32,
    /// What was seen last.
    seen: (Option<Arc<Document>>, Option<Arc<Work>>),
    /// What is being restored.
    wanted: Option<Offer>,
}

/// What happens to it.
#[derive(Clone, Debug, PartialEq)]
pub enum KeepEvent {
    /// This was in the store.
    Found {
        /// In no order.
        offers: Vec<Offer>,
    },
    /// The page is looked at again.
    Looked,
    /// A change is half a second old.
    Rested {
        /// Which.
        change: u32,
    },
    /// The page is left: what is not kept yet is now or never.
    Leaving,
    /// The store has written, or has not.
    Written {
        /// Where; none where it could not.
        place: Option<u32>,
        /// There is no room for it.
        full: bool,
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
        /// This tab holds the place now; else another one does.
        own: bool,
    },
    /// What is on offer is to be forgotten.
    Discard {
        /// Which.
        offer: Offer,
    },
    /// It is forgotten.
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
        KeepEvent::Looked if model.board.document.is_none() => vec![Effect::LookInStore],
        KeepEvent::Rested { change } if change > model.keeping.kept_change => keep(model),
        KeepEvent::Leaving => left(model),
        KeepEvent::Looked | KeepEvent::Rested { .. } => Vec::new(),
        KeepEvent::Written { place, full } => written(model, place, full),
        KeepEvent::Restore { offer } => {
            let place = offer.place;
            model.keeping.wanted = Some(offer);
            vec![Effect::TakeFromStore { place }]
        }
        // What was taken is opened where files are.
        KeepEvent::Taken { .. } => Vec::new(),
        KeepEvent::Discard { offer } => vec![Effect::DropFromStore { place: offer.place }],
        KeepEvent::Dropped => vec![Effect::LookInStore],
    }
}

/// Offers what was kept but the project that is open.
fn found(model: &mut Model, mut offers: Vec<Offer>) -> Vec<Effect> {
    offers.retain(|offer| Some(offer.place) != model.keeping.place);
    offers.sort_by(|a, b| b.at_ms.total_cmp(&a.at_ms));
    model.keeping.offers = offers;
    Vec::new()
}

/// Another project is open: that of a place which this tab holds, or one that has none yet.
pub(super) fn another(model: &mut Model, place: Option<u32>) -> Effect {
    let keeping = &mut model.keeping;
    keeping.project += 1;
    (keeping.place, keeping.kept, keeping.failed) = (place, None, None);
    keeping.offers.retain(|offer| Some(offer.place) != place);
    Effect::HoldPlace { place }
}

/// Another project is coming: what is not kept yet of this one is.
pub(super) fn leaving(model: &mut Model) -> Vec<Effect> {
    let open = model.board.document.as_ref();
    let has_place = open.zip(model.keeping.kept.as_ref()).is_some_and(|(open, kept)| Arc::ptr_eq(open, kept));
    if has_place && model.keeping.change > model.keeping.kept_change { keep(model) } else { Vec::new() }
}

/// The page is left, or hidden: the job that is not in the store yet is put where that takes no time.
fn left(model: &mut Model) -> Vec<Effect> {
    let keeping = &model.keeping;
    let is_new = keeping.change > keeping.kept_change;
    let open = model.board.document.as_ref().zip(keeping.kept.as_ref());
    let place = keeping.place.filter(|_| open.is_some_and(|(open, kept)| Arc::ptr_eq(open, kept)));
    let left = place.zip(model.job.work.as_ref()).filter(|_| is_new || keeping.store != Store::Rests);
    let at_ms = model.clock.wall_ms;
    let left = left.map(|(place, work)| Effect::LeaveInStore { place, job: project::write(work), at_ms });
    let mut effects: Vec<Effect> = left.into_iter().collect();
    if is_new {
        effects.extend(keep(model));
    }
    effects
}

/// The project is closed; it is on offer with the others.
pub(super) fn closed(model: &mut Model) -> Vec<Effect> {
    vec![another(model, None), Effect::LookInStore]
}

/// What is to be opened, and from which place that this tab holds; what says that it is gone.
pub(super) fn taken(
    model: &mut Model,
    place: u32,
    files: Option<Vec<u8>>,
    own: bool,
) -> Result<Option<(ToOpen, Option<u32>)>, Effect> {
    let wanted = model.keeping.wanted.take().filter(|offer| offer.place == place);
    let Some(offer) = wanted else { return Ok(None) };
    match files {
        Some(bytes) => Ok(Some((ToOpen { name: offer.name, bytes }, own.then_some(place)))),
        None => Err(frame::toast(model, Text::of(key!("page.kept.gone")), None)),
    }
}

/// That the project which was wanted is open in another tab, and that this one works on a copy.
pub(super) fn say_elsewhere(model: &mut Model, name: &str) {
    let args = vec![("name", name.to_owned())];
    frame::say(model, Text::Key { key: key!("page.kept.copy"), args });
}

/// Keeps what is open, again where it changed while the store was busy.
fn keep(model: &mut Model) -> Vec<Effect> {
    if let Store::Packing { again, .. } | Store::Writing { again, .. } = &mut model.keeping.store {
        *again = true;
        return Vec::new();
    }
    let (document, work) = (model.board.document.clone(), model.job.work.clone());
    let (Some(document), Some(work)) = (document, work) else { return Vec::new() };
    model.keeping.kept_change = model.keeping.change;
    let name = document.reading.board.name.clone();
    let (project, place) = (model.keeping.project, model.keeping.place);
    let record = Record { name, job: project::write(&work), project, place, document };
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
            written(model, None, false)
        }
    }
}

fn written(model: &mut Model, place: Option<u32>, full: bool) -> Vec<Effect> {
    let Store::Writing { record, again } = std::mem::take(&mut model.keeping.store) else {
        return Vec::new();
    };
    let mut effects = Vec::new();
    if record.project != model.keeping.project {
        // What was written belongs to a project that is closed: its place is not held any more.
        effects.push(Effect::HoldPlace { place: model.keeping.place });
    } else if let Some(place) = place {
        model.keeping.kept = Some(record.document);
        (model.keeping.place, model.keeping.failed) = (Some(place), None);
    } else {
        let why = if full { key!("page.kept.full") } else { key!("page.kept.failed") };
        if model.keeping.failed.replace(why) != Some(why) {
            effects.push(frame::toast(model, Text::of(why), None));
        }
    }
    if again {
        effects.extend(keep(model));
    }
    effects
}
