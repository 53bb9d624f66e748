//! Saves the open project in this browser, so that a reload, a crash or a closed window loses nothing.
//!
//! ```text
//!  files, import choices ─ changed ─▶ packed in a worker ─┐
//!  job ─ changed ─ after at most half a second ───────────┴▶ store ─ next visit ─▶ offers: Restore · Discard
//!
//!  storage slots:   this project, held by this tab │ earlier ones │ those of other tabs, which write them
//! ```
//!
//! Only the board of the machine's job opens without a request of the user. A project that another tab holds
//! opens as a copy.

use super::{Document, Effect, Event, Lane, Model, ToastAct, frame};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Request, ToOpen};
use crate::said::{Text, key};
use annulus_core::cam::work::Work;
use annulus_core::project;
use annulus_core::project::saved::Project;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Delay from a change to saving it, in ms. Further changes do not extend the delay.
const REST_MS: u32 = 500;
/// How many projects are saved at most. One more replaces the oldest that no tab holds.
pub const PLACES: u32 = 12;

#[derive(Clone, Debug, PartialEq)]
pub struct Offer {
    pub place: u32,
    pub name: String,
    /// When it was saved last, ms since 1970.
    pub at_ms: f64,
    /// Open in another tab, which saves it.
    pub elsewhere: bool,
}

/// A project of this visit, and which part of it is in the store.
#[derive(Clone, Debug, Default)]
pub(super) struct KeptAs {
    project: u32,
    place: Option<u32>,
    /// The board whose files are saved there.
    files: Option<Arc<Document>>,
}

impl KeptAs {
    pub(super) fn same_project(&self, other: &Self) -> bool {
        self.project == other.project
    }

    fn has_files_of(&self, document: &Arc<Document>) -> bool {
        self.files.as_ref().is_some_and(|files| Arc::ptr_eq(files, document))
    }
}

#[derive(Clone, Debug)]
struct Record {
    document: Arc<Document>,
    name: String,
    job: String,
    kept: KeptAs,
}

#[derive(Clone, Debug, Default)]
enum Store {
    #[default]
    Rests,
    /// A worker packs the files; `number` is its request.
    Packing {
        number: u32,
        record: Record,
    },
    Writing {
        record: Record,
    },
}

impl Store {
    fn record(&self) -> Option<&Record> {
        match self {
            Self::Rests => None,
            Self::Packing { record, .. } | Self::Writing { record } => Some(record),
        }
    }
}

#[derive(Clone, Debug, Default)]
pub struct Keeping {
    /// Projects to restore, the latest first.
    pub offers: Vec<Offer>,
    /// Storage that the browser uses for the page, in bytes; `None` if it does not report that.
    pub bytes: Option<u64>,
    /// Why the open project cannot be saved: the key of a message.
    pub failed: Option<&'static str>,
    open: KeptAs,
    /// Counts the projects of this visit.
    projects: u32,
    held: BTreeSet<u32>,
    store: Store,
    /// The open project changed while the store was busy.
    again: bool,
    /// Projects that were closed while the store was busy, as they were then.
    parting: Vec<Record>,
    change: u32,
    /// Changes up to this one are saved or being saved.
    kept_change: u32,
    /// Board and job at the last check for changes.
    seen: (Option<Arc<Document>>, Option<Arc<Work>>),
    wanted: Option<Offer>,
    taking: BTreeSet<u32>,
    discarded: BTreeSet<u32>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum KeepEvent {
    Found {
        offers: Vec<Offer>,
    },
    Looked,
    /// List the saved projects, even if a board is open.
    Listed,
    Measured {
        /// Some browsers round the value.
        bytes: u64,
    },
    /// Delete all projects that no tab has open.
    DropAll,
    /// The delay after a change is over.
    Rested {
        change: u32,
    },
    /// The page is closing or hidden: the last chance to save.
    Leaving,
    Written {
        /// The slot; `None` if the write failed.
        place: Option<u32>,
        full: bool,
    },
    Restore {
        offer: Offer,
    },
    /// The contents of a slot.
    Taken {
        place: u32,
        files: Option<Vec<u8>>,
        job: Option<String>,
        /// This tab holds the slot now; else another tab does.
        own: bool,
    },
    /// Delete an offered project; can be undone for a while.
    Discard {
        offer: Offer,
    },
    Drop {
        place: u32,
    },
    Dropped,
}

impl Keeping {
    #[cfg(test)]
    pub(super) fn change(&self) -> u32 {
        self.change
    }

    pub(super) fn waits_for(&self, wanted: u32) -> bool {
        matches!(&self.store, Store::Packing { number, .. } if *number == wanted)
    }

    fn wants(&self, place: u32) -> bool {
        self.wanted.as_ref().is_some_and(|wanted| wanted.place == place)
    }

    fn records(&self) -> impl Iterator<Item = &Record> {
        self.store.record().into_iter().chain(&self.parting)
    }
}

/// The page was opened: list the saved projects.
pub(super) fn begun() -> Vec<Effect> {
    vec![Effect::LookInStore]
}

/// Starts the save delay if board or job changed, and releases slots that are no longer needed.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    let mut effects = let_go(model);
    let now = (model.board.document.as_ref(), model.job.work.as_ref());
    let seen = (model.keeping.seen.0.as_ref(), model.keeping.seen.1.as_ref());
    let same_document = now.0.map(Arc::as_ptr) == seen.0.map(Arc::as_ptr);
    let same_work = now.1.map(Arc::as_ptr) == seen.1.map(Arc::as_ptr);
    if !(same_document && same_work) {
        model.keeping.seen = (model.board.document.clone(), model.job.work.clone());
        effects.extend(rest(model));
    }
    effects
}

/// Needed are the slots of the open board, of the one to go back to, and of those being opened or written.
fn let_go(model: &mut Model) -> Vec<Effect> {
    let keeping = &model.keeping;
    let before = model.before.as_ref().and_then(|before| before.kept.place);
    let mut needed: BTreeSet<Option<u32>> = keeping.records().map(|record| record.kept.place).collect();
    let wanted = keeping.wanted.as_ref().map(|offer| offer.place);
    needed.extend([keeping.open.place, before, wanted, model.on_the_way.place()]);
    let is_needed = |place: &u32| needed.contains(&Some(*place));
    let (held, gone): (BTreeSet<u32>, BTreeSet<u32>) = keeping.held.iter().copied().partition(is_needed);
    model.keeping.held = held;
    gone.into_iter().map(|place| Effect::LetGoOfPlace { place }).collect()
}

fn rest(model: &mut Model) -> Vec<Effect> {
    model.keeping.change += 1;
    let event = Event::Keep(KeepEvent::Rested { change: model.keeping.change });
    vec![Effect::Wake { after_ms: REST_MS, event: Box::new(event) }]
}

pub(super) fn update(model: &mut Model, event: KeepEvent) -> Vec<Effect> {
    match event {
        KeepEvent::Found { offers } => found(model, offers),
        KeepEvent::Looked if model.board.document.is_none() => vec![Effect::LookInStore],
        KeepEvent::Listed => vec![Effect::LookInStore],
        KeepEvent::Measured { bytes } => {
            model.keeping.bytes = Some(bytes);
            Vec::new()
        }
        KeepEvent::DropAll => drop_all(model),
        // A failed save is tried again: the user may have freed storage meanwhile.
        KeepEvent::Looked if model.keeping.failed.is_some() => keep(model),
        KeepEvent::Rested { change } if change > model.keeping.kept_change => keep(model),
        KeepEvent::Leaving => left(model),
        KeepEvent::Looked | KeepEvent::Rested { .. } => Vec::new(),
        KeepEvent::Written { place, full } => written(model, place, full),
        KeepEvent::Restore { offer } => {
            model.keeping.wanted = Some(offer);
            take_wanted(model)
        }
        // `model::update` handles this one, because it opens files.
        KeepEvent::Taken { .. } => Vec::new(),
        // A project that is being restored cannot be discarded.
        KeepEvent::Discard { offer } if model.keeping.wants(offer.place) => Vec::new(),
        KeepEvent::Discard { offer } => discarded(model, &offer),
        KeepEvent::Drop { place } if model.keeping.discarded.remove(&place) => {
            vec![Effect::DropFromStore { place }]
        }
        KeepEvent::Drop { .. } => Vec::new(),
        KeepEvent::Dropped => vec![Effect::LookInStore],
    }
}

/// Offers every saved project except the open one and those discarded.
fn found(model: &mut Model, mut offers: Vec<Offer>) -> Vec<Effect> {
    let keeping = &model.keeping;
    let (open, discarded) = (keeping.open.place, &keeping.discarded);
    offers.retain(|offer| Some(offer.place) != open && !discarded.contains(&offer.place));
    offers.sort_by(|a, b| b.at_ms.total_cmp(&a.at_ms));
    model.keeping.offers = offers;
    Vec::new()
}

/// Removes an offer; the project is deleted only when the time to undo is over.
fn discarded(model: &mut Model, offer: &Offer) -> Vec<Effect> {
    let place = offer.place;
    model.keeping.offers.retain(|one| one.place != place);
    model.keeping.discarded.insert(place);
    let args = vec![("name", offer.name.clone())];
    let text = Text::Key { key: key!("page.kept.discarded"), args };
    let said = frame::toast(model, text, Some(ToastAct::TakeBackBoard { place }));
    let event = Box::new(Event::Keep(KeepEvent::Drop { place }));
    vec![said, Effect::Wake { after_ms: frame::TOAST_MS, event }]
}

/// Deletes every project that no tab has open, without undo. A project that is being restored stays.
fn drop_all(model: &mut Model) -> Vec<Effect> {
    let keeping = &mut model.keeping;
    let wanted = keeping.wanted.as_ref().map(|wanted| wanted.place);
    let stays = |offer: &Offer| offer.elsewhere || Some(offer.place) == wanted;
    let (stay, go): (Vec<Offer>, Vec<Offer>) =
        std::mem::take(&mut keeping.offers).into_iter().partition(stays);
    keeping.offers = stay;
    let gone = go.into_iter().map(|offer| Effect::DropFromStore { place: offer.place });
    gone.chain([frame::toast(model, Text::of(key!("page.data.deleted")), None)]).collect()
}

pub(super) fn taken_back(model: &mut Model, place: u32) -> Vec<Effect> {
    model.keeping.discarded.remove(&place);
    vec![Effect::LookInStore]
}

/// Reads the wanted project, but only once, and only when no write of its slot is pending.
fn take_wanted(model: &mut Model) -> Vec<Effect> {
    let keeping = &mut model.keeping;
    let Some(Offer { place, elsewhere, .. }) = keeping.wanted.clone() else { return Vec::new() };
    let is_written = keeping.records().all(|record| record.kept.place != Some(place));
    let is_new = is_written && keeping.taking.insert(place);
    is_new.then_some(Effect::TakeFromStore { place, is_free: !elsewhere }).into_iter().collect()
}

/// Another project is open: one from a slot that this tab holds, or one that is not saved yet.
pub(super) fn another(model: &mut Model, place: Option<u32>) {
    model.keeping.projects += 1;
    let project = model.keeping.projects;
    go_on(model, KeptAs { project, place, files: None });
}

/// Storage of the open project, for [`go_on`] when it is opened again.
pub(super) fn kept_as(model: &Model) -> KeptAs {
    model.keeping.open.clone()
}

/// A project is open that may have been open before.
pub(super) fn go_on(model: &mut Model, kept: KeptAs) {
    let keeping = &mut model.keeping;
    (keeping.failed, keeping.again) = (None, false);
    keeping.offers.retain(|offer| Some(offer.place) != kept.place);
    keeping.open = kept;
}

/// Another project replaces the open one: save its latest changes first.
pub(super) fn leaving(model: &mut Model) -> Vec<Effect> {
    let keeping = &model.keeping;
    let begun = keeping.open.place.is_some()
        || keeping.store.record().is_some_and(|record| record.kept.same_project(&keeping.open));
    // A project that was never saved is worth a slot only if the user edited it.
    if keeping.change <= keeping.kept_change || !begun && !model.job.edited() {
        return Vec::new();
    }
    let Some(record) = record(model) else { return Vec::new() };
    model.keeping.kept_change = model.keeping.change;
    if model.keeping.store.record().is_some() {
        model.keeping.parting.push(record);
        return Vec::new();
    }
    put(model, record)
}

/// The page is closing or hidden: leaves an unsaved job where writing takes no time.
fn left(model: &mut Model) -> Vec<Effect> {
    let keeping = &model.keeping;
    let is_new = keeping.change > keeping.kept_change;
    let document = model.board.document.as_ref();
    let place = keeping.open.place.filter(|_| document.is_some_and(|open| keeping.open.has_files_of(open)));
    let is_unwritten = is_new || keeping.store.record().is_some();
    let left = place.zip(model.job.work.as_ref()).filter(|_| is_unwritten);
    let at_ms = model.clock.wall_ms;
    let left = left.map(|(place, work)| Effect::LeaveInStore { place, job: project::write(work), at_ms });
    let mut effects: Vec<Effect> = left.into_iter().collect();
    if is_new {
        effects.extend(keep(model));
    }
    effects
}

pub(super) fn closed(model: &mut Model) -> Vec<Effect> {
    another(model, None);
    vec![Effect::LookInStore]
}

/// The project to open, and its slot if this tab holds it. The error is a toast: the project is gone.
pub(super) fn taken(
    model: &mut Model,
    place: u32,
    files: Option<Vec<u8>>,
    own: bool,
) -> Result<Option<(ToOpen, Option<u32>)>, Effect> {
    model.keeping.taking.remove(&place);
    if own {
        model.keeping.held.insert(place);
    }
    let wanted = model.keeping.wanted.take_if(|offer| offer.place == place);
    let Some(offer) = wanted else { return Ok(None) };
    match files {
        Some(bytes) => Ok(Some((ToOpen { name: offer.name, bytes }, own.then_some(place)))),
        None => Err(frame::toast(model, Text::of(key!("page.kept.gone")), None)),
    }
}

/// Reports that the project is open in another tab and that this tab works on a copy.
pub(super) fn say_elsewhere(model: &mut Model, name: &str) {
    let args = vec![("name", name.to_owned())];
    frame::say(model, Text::Key { key: key!("page.kept.copy"), args });
}

fn record(model: &Model) -> Option<Record> {
    let (document, work) = model.board.document.clone().zip(model.job.work.as_ref())?;
    let name = document.reading.board.name.clone();
    Some(Record { name, job: project::write(work), kept: kept_as(model), document })
}

/// Saves the open project; if the store is busy, once it is free.
fn keep(model: &mut Model) -> Vec<Effect> {
    if model.keeping.store.record().is_some() {
        model.keeping.again = true;
        return Vec::new();
    }
    let Some(record) = record(model) else { return Vec::new() };
    model.keeping.kept_change = model.keeping.change;
    put(model, record)
}

/// Writes a record to the store; packs its files first if they are not saved yet.
fn put(model: &mut Model, record: Record) -> Vec<Effect> {
    if record.kept.has_files_of(&record.document) {
        return write(model, record, None);
    }
    let (files, said) = (record.document.files.clone(), record.document.said.clone());
    let request = Box::new(Request::Save(Project { files, said, job: None }));
    let number = model.next_request();
    model.keeping.store = Store::Packing { number, record };
    vec![Effect::Ask { lane: Lane::Beside, number, request }]
}

fn write(model: &mut Model, record: Record, files: Option<Vec<u8>>) -> Vec<Effect> {
    let (place, name, job) = (record.kept.place, record.name.clone(), record.job.clone());
    model.keeping.store = Store::Writing { record };
    vec![Effect::WriteStore { place, name, job, files, at_ms: model.clock.wall_ms }]
}

pub(super) fn packed(model: &mut Model, answer: Result<Answer, Stopped>) -> Vec<Effect> {
    let Store::Packing { record, .. } = std::mem::take(&mut model.keeping.store) else {
        return Vec::new();
    };
    match answer {
        Ok(Answer::Saved(bytes)) => write(model, record, Some(bytes)),
        _ => {
            model.keeping.store = Store::Writing { record };
            written(model, None, false)
        }
    }
}

fn written(model: &mut Model, place: Option<u32>, full: bool) -> Vec<Effect> {
    let Store::Writing { record } = std::mem::take(&mut model.keeping.store) else {
        return Vec::new();
    };
    let mut effects = match place {
        Some(place) => {
            is_at(model, record, place);
            Vec::new()
        }
        None => failed(model, &record, full),
    };
    let next = go_on_writing(model);
    // No board is open and no write is pending: the project just saved is an offer now.
    if model.board.document.is_none() && next.is_empty() {
        effects.push(Effect::LookInStore);
    }
    effects.extend(next);
    effects
}

/// A record is saved: everything that refers to its project learns the slot.
fn is_at(model: &mut Model, record: Record, place: u32) {
    let Record { document, kept: KeptAs { project, .. }, .. } = record;
    let kept = KeptAs { project, place: Some(place), files: Some(document) };
    let keeping = &mut model.keeping;
    keeping.held.insert(place);
    if keeping.open.same_project(&kept) {
        keeping.failed = None;
        keeping.open = kept.clone();
    }
    for record in keeping.parting.iter_mut().filter(|record| record.kept.same_project(&kept)) {
        record.kept = kept.clone();
    }
    if let Some(before) = model.before.as_mut().filter(|before| before.kept.same_project(&kept)) {
        Arc::make_mut(before).kept = kept;
    }
}

/// A record could not be saved. The user sees each reason once; the next change or visit tries again.
fn failed(model: &mut Model, record: &Record, full: bool) -> Vec<Effect> {
    let why = if full { key!("page.kept.full") } else { key!("page.kept.failed") };
    let keeping = &mut model.keeping;
    if keeping.open.same_project(&record.kept) {
        // Nothing counts as saved, so that the next opportunity tries again.
        keeping.kept_change = 0;
        if keeping.failed.replace(why) == Some(why) {
            return Vec::new();
        }
    }
    vec![frame::toast(model, Text::of(why), None)]
}

/// The store is free: the next restore or write can start.
fn go_on_writing(model: &mut Model) -> Vec<Effect> {
    let mut effects = take_wanted(model);
    if !model.keeping.parting.is_empty() {
        let record = model.keeping.parting.remove(0);
        effects.extend(put(model, record));
    } else if std::mem::take(&mut model.keeping.again) {
        effects.extend(keep(model));
    }
    effects
}
