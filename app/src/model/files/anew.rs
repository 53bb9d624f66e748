//! New exports of the open board: replaces its files, compares old and new board, and can go back.
//!
//! ```text
//!   files with names that are open ─▶ read ─▶ planned as usual
//!                                       └──▶ compared by another worker ─▶ changes shown, job carried over
//!   back ─▶ files and job as before           another board ─▶ the new files, opened separately
//!   files that changed on disk ─▶ an offer ─▶ handled like opened files
//! ```
//!
//! The job, its edits and the import choices stay, because they refer to names and positions on the board.

use crate::engine::Stopped;
use crate::engine::messages::{Answer, Compared, Request, ToCompare, ToRead};
use crate::model::planning::{Brought, Wanted};
use crate::model::{BoardBefore, Document, Effect, JobEvent, Lane, Model, ToastAct, files, frame, job};
use crate::said::{Text, key};
use annulus_core::cam::work::Work;
use annulus_core::project::anew::{ExportedAnew, exported_anew, place_of};
use annulus_core::project::saved::SaidOfFiles;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

type Files = Vec<(String, Vec<u8>)>;

/// The displayed comparison with new exports.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NewExports {
    pub replaced: Vec<String>,
    pub added: Vec<String>,
    /// Names of files that no longer exist.
    pub gone: Vec<String>,
    /// The changes of the board; `None` until they are known.
    pub compared: Option<Arc<Compared>>,
    pub failed: bool,
}

#[derive(Clone, Debug, Default)]
pub struct Anew {
    pub shown: Option<Arc<NewExports>>,
    before: Option<BoardBefore>,
    brought: Files,
    asked: Option<(u32, Arc<Work>)>,
    /// The job was carried over to the changed board, which happens only once.
    carried: bool,
    /// Files that changed on disk.
    on_disk: Files,
    /// For files opened under new names: the name of the file that each one replaced.
    open_names: BTreeMap<String, String>,
    wanted: bool,
}

#[derive(Clone, Debug, PartialEq)]
pub enum AnewEvent {
    Choose,
    /// The user opened files as new exports of the board, under any names.
    Chosen {
        files: Vec<(String, Vec<u8>)>,
    },
    /// Files of the open board were written again on disk.
    OnDisk {
        files: Vec<(String, Vec<u8>)>,
    },
    Seen,
    Back,
    /// The files belong to another board: open them separately.
    Another,
}

impl Anew {
    pub(in crate::model) fn want(&mut self) {
        self.wanted = true;
    }

    pub(super) fn end(&mut self) {
        *self = Self { on_disk: std::mem::take(&mut self.on_disk), ..Self::default() };
    }

    pub(in crate::model) fn waits_for(&self, wanted: u32) -> bool {
        self.asked.as_ref().is_some_and(|(number, _)| *number == wanted)
    }
}

pub(in crate::model) fn update(model: &mut Model, event: AnewEvent) -> Vec<Effect> {
    match event {
        AnewEvent::Choose => vec![Effect::ChooseFiles { anew: true }],
        AnewEvent::Chosen { files } => chosen(model, files),
        AnewEvent::OnDisk { files } => on_disk(model, files),
        AnewEvent::Seen => {
            model.anew.shown = None;
            forget_where_seen(model);
            Vec::new()
        }
        AnewEvent::Back => back(model),
        AnewEvent::Another => another(model),
    }
}

/// The effect of `files` on the open board, if they are new exports of it with new contents.
pub(super) fn exports(model: &Model, files: &[(String, Vec<u8>)]) -> Option<ExportedAnew> {
    let open = model.board.document.as_ref()?;
    exported_anew(&open.files, files).filter(|anew| anew.files != open.files)
}

pub(super) fn read(model: &mut Model, brought: Brought) -> Vec<Effect> {
    let Some(open) = model.board.document.clone() else { return Vec::new() };
    let mut said = open.said.clone();
    let names = |name: &String| brought.anew.files.iter().any(|(other, _)| name.starts_with(other.as_str()));
    if said.used.as_ref().is_some_and(|used| !used.iter().any(names)) {
        // The choices refer to files that no longer exist.
        said = SaidOfFiles { used: None, board: None, ..said };
    }
    let files = brought.anew.files.clone();
    let anew = Some(Box::new(brought));
    let job = open.job.clone();
    files::read(model, Wanted { files, said, job, again: true, place: None, anew })
}

/// Opens files as new exports of the open board, under any names; a saved project is opened as another board.
fn chosen(model: &mut Model, files: Files) -> Vec<Effect> {
    let open = model.board.document.clone();
    let Some(open) = open.filter(|open| open.files != files && !files::is_project(&files)) else {
        return files::chosen(model, files);
    };
    // A file with a new name means that the files are the whole board.
    let parts = exports(model, &files).filter(|anew| anew.added.is_empty());
    let anew = parts.unwrap_or_else(|| whole(&open.files, &files));
    read(model, Brought { anew, files })
}

fn bytes_of<'a>(files: &'a [(String, Vec<u8>)], name: &str) -> Option<&'a [u8]> {
    files.iter().find(|(other, _)| other == name).map(|(_, bytes)| bytes.as_slice())
}

fn whole(open: &[(String, Vec<u8>)], files: &[(String, Vec<u8>)]) -> ExportedAnew {
    let mut anew = ExportedAnew { files: files.to_vec(), ..ExportedAnew::default() };
    for (name, bytes) in files {
        match bytes_of(open, name) {
            None => anew.added.push(name.clone()),
            Some(before) if before != bytes.as_slice() => anew.replaced.push(name.clone()),
            Some(_) => {}
        }
    }
    let gone = open.iter().map(|(name, _)| name).filter(|name| bytes_of(files, name).is_none());
    anew.gone = gone.cloned().collect();
    anew
}

/// Offers the files that changed on disk, with earlier changes that are not open yet.
fn on_disk(model: &mut Model, files: Files) -> Vec<Effect> {
    let known = &mut model.anew.on_disk;
    known.retain(|(name, _)| bytes_of(&files, name).is_none());
    known.extend(files);
    model.frame.toasts.retain(|toast| toast.act != Some(ToastAct::TakeAnew));
    let Some(Brought { anew, .. }) = as_on_disk(model) else { return Vec::new() };
    let text = Text::Key { key: key!("page.anew.on_disk"), args: vec![("names", anew.replaced.join(", "))] };
    frame::offer(model, text, ToastAct::TakeAnew);
    Vec::new()
}

/// The files of the open board as they are on disk; `None` if these are open.
fn as_on_disk(model: &Model) -> Option<Brought> {
    let open = model.board.document.as_ref()?;
    let mut files: Files = open.files.clone();
    for (name, bytes) in &model.anew.on_disk {
        let name = model.anew.open_names.get(name).unwrap_or(name);
        if let Some((_, now)) = files.iter_mut().find(|(other, _)| other == name) {
            now.clone_from(bytes);
        }
    }
    exports(model, &files).map(|anew| Brought { anew, files })
}

/// Opens the files that changed on disk if the user accepted; removes the offer if no change is left.
pub(in crate::model) fn follow(model: &mut Model) -> Vec<Effect> {
    if std::mem::take(&mut model.anew.wanted) {
        let brought = as_on_disk(model);
        model.anew.on_disk = Vec::new();
        return brought.map_or_else(Vec::new, |brought| read(model, brought));
    }
    if model.anew.on_disk.is_empty() {
        model.frame.toasts.retain(|toast| toast.act != Some(ToastAct::TakeAnew));
    }
    Vec::new()
}

/// True if the new files need a review: they have warnings or errors that the files before did not have.
pub(super) fn has_new_warnings(before: &Document, now: &Document) -> bool {
    let doubts = |document: &Document| -> BTreeSet<String> {
        let doubtful =
            document.diagnostics().filter(|one| one.severity > annulus_core::diagnostic::Severity::Note);
        doubtful.map(|one| one.code.clone()).collect()
    };
    !now.usable() || !doubts(now).is_subset(&doubts(before))
}

/// The new files are open: requests the comparison.
pub(super) fn taken_in(model: &mut Model, before: Option<BoardBefore>, brought: Brought) -> Vec<Effect> {
    let ExportedAnew { replaced, added, gone, .. } = brought.anew;
    let shown = Arc::new(NewExports { replaced, added, gone, ..NewExports::default() });
    let mut open_names = std::mem::take(&mut model.anew.open_names);
    if let Some(before) = &before {
        let open = &before.document.files;
        let other = |name: &String| Some((name.clone(), open[place_of(open, name)?].0.clone()));
        // Later changes on disk arrive under the names that the user opened.
        open_names.extend(brought.files.iter().filter_map(|(name, _)| other(name)));
    }
    model.anew.end();
    model.anew.open_names = open_names;
    if as_on_disk(model).is_none() {
        model.anew.on_disk = Vec::new();
    }
    model.anew = Anew {
        before,
        brought: brought.files,
        shown: Some(shown),
        on_disk: std::mem::take(&mut model.anew.on_disk),
        open_names: std::mem::take(&mut model.anew.open_names),
        ..Anew::default()
    };
    ask(model)
}

pub(super) fn ask(model: &mut Model) -> Vec<Effect> {
    let to_read = |document: &Document| ToRead {
        files: document.files.clone(),
        said: document.said.clone(),
        ..ToRead::default()
    };
    let before = model.anew.before.as_ref().map(|before| to_read(&before.document));
    let now = model.board.document.as_ref().map(|document| to_read(document));
    let (Some(before), Some(now), Some(work)) = (before, now, model.job.work.clone()) else {
        return Vec::new();
    };
    let number = model.next_request();
    let request = Request::Compare(Box::new(ToCompare { before, now, work: (*work).clone() }));
    model.anew.asked = Some((number, work));
    vec![Effect::Ask { lane: Lane::Beside, number, request: Box::new(request) }]
}

pub(in crate::model) fn answered(model: &mut Model, answer: Result<Answer, Stopped>) -> Vec<Effect> {
    let asked = model.anew.asked.take();
    let same_job =
        asked.zip(model.job.work.as_ref()).is_some_and(|((_, asked), now)| Arc::ptr_eq(&asked, now));
    let compared = match answer {
        // The job was edited meanwhile: compare again, so that the edits are carried over too.
        Ok(Answer::Compared(_)) if !same_job => return ask(model),
        Ok(Answer::Compared(compared)) => Some(*compared),
        _ => None,
    };
    let carried =
        compared.as_ref().and_then(|compared| compared.work.clone()).filter(|_| !model.anew.carried);
    model.anew.carried |= carried.is_some();
    if let Some(shown) = model.anew.shown.as_deref().cloned() {
        let failed = compared.is_none();
        model.anew.shown = Some(Arc::new(NewExports { compared: compared.map(Arc::new), failed, ..shown }));
    }
    forget_where_seen(model);
    match carried {
        Some(work) => job::update(model, JobEvent::Change { field: None, work: Box::new(work) }),
        None => Vec::new(),
    }
}

/// The board before is no longer needed once it is compared and the user closed the list of changes.
fn forget_where_seen(model: &mut Model) {
    if model.anew.shown.is_none() && model.anew.asked.is_none() {
        model.anew.before = None;
    }
}

fn back(model: &mut Model) -> Vec<Effect> {
    let before = model.anew.before.take();
    before.map_or_else(Vec::new, |before| files::reopen(model, &before))
}

fn another(model: &mut Model) -> Vec<Effect> {
    let brought = std::mem::take(&mut model.anew.brought);
    let Some(before) = model.anew.before.take() else { return Vec::new() };
    let mut effects = files::reopen(model, &before);
    effects.extend(files::read_chosen(model, brought));
    effects
}
