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
//! is opened unless the person says so, but the board of the machine's job; a project that another tab holds is opened as a copy.
//! Does not know the store.

use super::{Document, Effect, Event, Lane, Model, ToastAct, frame};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Request, ToOpen};
use crate::said::{Text, key};
use annulus_core::cam::work::Work;
use annulus_core::project;
use annulus_core::project::saved::Project;
use std::collections::BTreeSet;
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

/// A project of this visit, and what of it is in the store.
#[derive(Clone, Debug, Default)]
pub(super) struct KeptAs {
    /// Tells it from others of this visit.
    project: u32,
    /// Where it is kept; none until it has a place.
    place: Option<u32>,
    /// The board whose files are there.
    files: Option<Arc<Document>>,
}

impl KeptAs {
    /// Whether both are of one project.
    pub(super) fn same_project(&self, other: &Self) -> bool {
        self.project == other.project
    }

    fn has_files_of(&self, document: &Arc<Document>) -> bool {
        self.files.as_ref().is_some_and(|files| Arc::ptr_eq(files, document))
    }
}

/// A board and its job, on their way to the store.
#[derive(Clone, Debug)]
struct Record {
    document: Arc<Document>,
    name: String,
    job: String,
    kept: KeptAs,
}

/// What the store is doing.
#[derive(Clone, Debug, Default)]
enum Store {
    /// Nothing.
    #[default]
    Rests,
    /// The files are packed in a worker, by this request.
    Packing { number: u32, record: Record },
    /// The record is written.
    Writing { record: Record },
}

impl Store {
    fn record(&self) -> Option<&Record> {
        match self {
            Self::Rests => None,
            Self::Packing { record, .. } | Self::Writing { record } => Some(record),
        }
    }
}

/// What is kept in this browser.
#[derive(Clone, Debug, Default)]
pub struct Keeping {
    /// What there is to restore, the latest first.
    pub offers: Vec<Offer>,
    /// So many bytes the browser uses for the page; none where it does not tell.
    pub bytes: Option<u64>,
    /// The open project cannot be kept, and why: the key of a sentence.
    pub failed: Option<&'static str>,
    /// The open project.
    open: KeptAs,
    /// Counts the projects of this visit.
    projects: u32,
    /// Places that this tab holds.
    held: BTreeSet<u32>,
    store: Store,
    /// What is open changed while the store was busy.
    again: bool,
    /// Projects that were left while the store was busy, as they were then.
    parting: Vec<Record>,
    /// Counts changes.
    change: u32,
    /// Changes up to this one are kept, or on their way.
    kept_change: u32,
    /// What was seen last.
    seen: (Option<Arc<Document>>, Option<Arc<Work>>),
    /// What is being restored.
    wanted: Option<Offer>,
    /// Places that are being taken out of the store.
    taking: BTreeSet<u32>,
    /// Those that the person wants forgotten, as long as that can be taken back.
    discarded: BTreeSet<u32>,
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
    /// What is kept is to be listed, whatever is open.
    Listed,
    /// So much of this computer the browser uses for the page.
    Measured {
        /// In bytes, as the browser tells it: rounded, for some.
        bytes: u64,
    },
    /// All of it is to be forgotten but what is open, here or in another tab.
    DropAll,
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
    /// It is forgotten, unless that was taken back.
    Drop {
        /// Where.
        place: u32,
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

    /// Whether what is kept there is being restored.
    fn wants(&self, place: u32) -> bool {
        self.wanted.as_ref().is_some_and(|wanted| wanted.place == place)
    }

    /// What the store has to write, the first thing first.
    fn records(&self) -> impl Iterator<Item = &Record> {
        self.store.record().into_iter().chain(&self.parting)
    }
}

/// The page was opened: looks for what was kept.
pub(super) fn begun() -> Vec<Effect> {
    vec![Effect::LookInStore]
}

/// Waits for a rest where board or job is another one, and lets go of places that are not needed any more.
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

/// A place is held for what is open, what there is to go back to, what is being opened, and what is being written.
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
        KeepEvent::Listed => vec![Effect::LookInStore],
        KeepEvent::Measured { bytes } => {
            model.keeping.bytes = Some(bytes);
            Vec::new()
        }
        KeepEvent::DropAll => drop_all(model),
        // There may be room by now.
        KeepEvent::Looked if model.keeping.failed.is_some() => keep(model),
        KeepEvent::Rested { change } if change > model.keeping.kept_change => keep(model),
        KeepEvent::Leaving => left(model),
        KeepEvent::Looked | KeepEvent::Rested { .. } => Vec::new(),
        KeepEvent::Written { place, full } => written(model, place, full),
        KeepEvent::Restore { offer } => {
            model.keeping.wanted = Some(offer);
            take_wanted(model)
        }
        // What was taken is opened where files are.
        KeepEvent::Taken { .. } => Vec::new(),
        KeepEvent::Discard { offer } if model.keeping.wants(offer.place) => Vec::new(),
        KeepEvent::Discard { offer } => discarded(model, &offer),
        KeepEvent::Drop { place } if model.keeping.discarded.remove(&place) => {
            vec![Effect::DropFromStore { place }]
        }
        KeepEvent::Drop { .. } => Vec::new(),
        KeepEvent::Dropped => vec![Effect::LookInStore],
    }
}

/// Offers what was kept but the project that is open.
fn found(model: &mut Model, mut offers: Vec<Offer>) -> Vec<Effect> {
    let keeping = &model.keeping;
    let (open, discarded) = (keeping.open.place, &keeping.discarded);
    offers.retain(|offer| Some(offer.place) != open && !discarded.contains(&offer.place));
    offers.sort_by(|a, b| b.at_ms.total_cmp(&a.at_ms));
    model.keeping.offers = offers;
    Vec::new()
}

/// What is on offer is to be forgotten: it is not on offer any more, and can be taken back for a while.
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

/// All that no tab has open is forgotten, and cannot be taken back; what is being restored stays.
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

/// What was to be forgotten stays.
pub(super) fn taken_back(model: &mut Model, place: u32) -> Vec<Effect> {
    model.keeping.discarded.remove(&place);
    vec![Effect::LookInStore]
}

/// Takes what is to be restored out of the store, once, when all of it is in there.
fn take_wanted(model: &mut Model) -> Vec<Effect> {
    let keeping = &mut model.keeping;
    let Some(Offer { place, elsewhere, .. }) = keeping.wanted.clone() else { return Vec::new() };
    let is_written = keeping.records().all(|record| record.kept.place != Some(place));
    let is_new = is_written && keeping.taking.insert(place);
    is_new.then_some(Effect::TakeFromStore { place, is_free: !elsewhere }).into_iter().collect()
}

/// Another project is open: that of a place which this tab holds, or one that has none yet.
pub(super) fn another(model: &mut Model, place: Option<u32>) {
    model.keeping.projects += 1;
    let project = model.keeping.projects;
    go_on(model, KeptAs { project, place, files: None });
}

/// How the open project is kept, to go on with that where it is open again.
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

/// Another project comes in place of the open one: what is not kept yet of this one is.
pub(super) fn leaving(model: &mut Model) -> Vec<Effect> {
    let keeping = &model.keeping;
    let begun = keeping.open.place.is_some()
        || keeping.store.record().is_some_and(|record| record.kept.same_project(&keeping.open));
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

/// The page is left, or hidden: the job that is not in the store yet is put where that takes no time.
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

/// The project is closed; it is on offer with the others.
pub(super) fn closed(model: &mut Model) -> Vec<Effect> {
    another(model, None);
    vec![Effect::LookInStore]
}

/// What is to be opened, and from which place that this tab holds; what says that it is gone.
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

/// That the project which was wanted is open in another tab, and that this one works on a copy.
pub(super) fn say_elsewhere(model: &mut Model, name: &str) {
    let args = vec![("name", name.to_owned())];
    frame::say(model, Text::Key { key: key!("page.kept.copy"), args });
}

/// What is open, as it is to be kept.
fn record(model: &Model) -> Option<Record> {
    let (document, work) = model.board.document.clone().zip(model.job.work.as_ref())?;
    let name = document.reading.board.name.clone();
    Some(Record { name, job: project::write(work), kept: kept_as(model), document })
}

/// Keeps what is open, again where it changed while the store was busy.
fn keep(model: &mut Model) -> Vec<Effect> {
    if model.keeping.store.record().is_some() {
        model.keeping.again = true;
        return Vec::new();
    }
    let Some(record) = record(model) else { return Vec::new() };
    model.keeping.kept_change = model.keeping.change;
    put(model, record)
}

/// Puts a record in the store, its files first packed where they are not there yet.
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

/// The files are packed.
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
    // Nothing is open any more, and nothing on its way: what was just kept is on offer.
    if model.board.document.is_none() && next.is_empty() {
        effects.push(Effect::LookInStore);
    }
    effects.extend(next);
    effects
}

/// A record is in the store: whoever has to do with its project knows where.
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

/// A record could not be written: it is said, and tried again when there is an occasion.
fn failed(model: &mut Model, record: &Record, full: bool) -> Vec<Effect> {
    let why = if full { key!("page.kept.full") } else { key!("page.kept.failed") };
    let keeping = &mut model.keeping;
    if keeping.open.same_project(&record.kept) {
        keeping.kept_change = 0;
        if keeping.failed.replace(why) == Some(why) {
            return Vec::new();
        }
    }
    vec![frame::toast(model, Text::of(why), None)]
}

/// The store is free: what waits for that is written, or taken.
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
