//! New exports of the open board: its files replaced, what changed found out and shown, and the way back (N24).
//!
//! ```text
//!   files with names that are open ─▶ read ─▶ planned as ever
//!                                       └──▶ compared in a worker of its own ─▶ what changed: list, marks, job carried over
//!   back ─▶ files and job as they were          another board ─▶ the same files, opened by themselves
//!   files that changed on the disk ─▶ an offer ─▶ taken in like files that were brought
//! ```
//!
//! Comes in: files, answers, choices of the person. Goes out: requests; what is shown. Job, edits and what was said of files stay:
//! they go by names and places of the board. Does not know how files are read.

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

/// Names and bytes of files.
type Files = Vec<(String, Vec<u8>)>;

/// What is shown of new exports.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NewExports {
    /// Names of files that are others now.
    pub replaced: Vec<String>,
    /// Names of files that are new.
    pub added: Vec<String>,
    /// Names of files that are there no more.
    pub gone: Vec<String>,
    /// What changed on the board; none until that is found out.
    pub compared: Option<Arc<Compared>>,
    /// It could not be found out.
    pub failed: bool,
}

/// New exports of the open board.
#[derive(Clone, Debug, Default)]
pub struct Anew {
    /// What is shown of them.
    pub shown: Option<Arc<NewExports>>,
    /// The board as it was before.
    before: Option<BoardBefore>,
    /// The files as they were brought.
    brought: Files,
    /// The request that is waited for, and the job that went with it.
    asked: Option<(u32, Arc<Work>)>,
    /// The job went along with the board: it does so once.
    carried: bool,
    /// Files that changed on the disk.
    on_disk: Files,
    /// What the board calls files that were brought by other names: they took the places of those.
    open_names: BTreeMap<String, String>,
    /// The person wants these.
    wanted: bool,
}

/// What happens to new exports.
#[derive(Clone, Debug, PartialEq)]
pub enum AnewEvent {
    /// The person wants to choose them.
    Choose,
    /// They were chosen: whatever they are called, they are of the open board.
    Chosen {
        /// Names and bytes.
        files: Vec<(String, Vec<u8>)>,
    },
    /// Files that the open board came from were written anew.
    OnDisk {
        /// Names and bytes.
        files: Vec<(String, Vec<u8>)>,
    },
    /// The person has seen what changed.
    Seen,
    /// Files and job shall be as they were.
    Back,
    /// The files are not of this board: they are opened by themselves.
    Another,
}

impl Anew {
    /// What changed on the disk is wanted.
    pub(in crate::model) fn want(&mut self) {
        self.wanted = true;
    }

    /// There is nothing to compare any more.
    pub(super) fn end(&mut self) {
        *self = Self { on_disk: std::mem::take(&mut self.on_disk), ..Self::default() };
    }

    /// Whether this request is waited for.
    pub(in crate::model) fn waits_for(&self, wanted: u32) -> bool {
        self.asked.as_ref().is_some_and(|(number, _)| *number == wanted)
    }
}

/// Takes one event in.
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

/// What `files` are for the open board, where they are new exports of it and not what is open already.
pub(super) fn exports(model: &Model, files: &[(String, Vec<u8>)]) -> Option<ExportedAnew> {
    let open = model.board.document.as_ref()?;
    exported_anew(&open.files, files).filter(|anew| anew.files != open.files)
}

/// Reads the open board anew with what was brought.
pub(super) fn read(model: &mut Model, brought: Brought) -> Vec<Effect> {
    let Some(open) = model.board.document.clone() else { return Vec::new() };
    let mut said = open.said.clone();
    let names = |name: &String| brought.anew.files.iter().any(|(other, _)| name.starts_with(other.as_str()));
    if said.used.as_ref().is_some_and(|used| !used.iter().any(names)) {
        // What was said is of files that are there no more.
        said = SaidOfFiles { used: None, board: None, ..said };
    }
    let files = brought.anew.files.clone();
    let anew = Some(Box::new(brought));
    let job = open.job.clone();
    files::read(model, Wanted { files, said, job, again: true, place: None, anew })
}

/// Files of the open board, by whatever names; a saved project is a board of its own.
fn chosen(model: &mut Model, files: Files) -> Vec<Effect> {
    let open = model.board.document.clone();
    let Some(open) = open.filter(|open| open.files != files && !files::is_project(&files)) else {
        return files::chosen(model, files);
    };
    // Where one of them is called otherwise, they are all the files that there are.
    let parts = exports(model, &files).filter(|anew| anew.added.is_empty());
    let anew = parts.unwrap_or_else(|| whole(&open.files, &files));
    read(model, Brought { anew, files })
}

/// The bytes of the file called `name`.
fn bytes_of<'a>(files: &'a [(String, Vec<u8>)], name: &str) -> Option<&'a [u8]> {
    files.iter().find(|(other, _)| other == name).map(|(_, bytes)| bytes.as_slice())
}

/// All the files of the board are others.
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

/// Offers what changed on the disk, with what changed there before and is not open yet.
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

/// The files of the open board as they are on the disk; none where they are open so.
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

/// What changed on the disk is taken in, where the person wants it; where there is nothing to take in, it is not offered.
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

/// Whether a person has to look at the files: they have something to say that those before had not.
pub(super) fn has_new_warnings(before: &Document, now: &Document) -> bool {
    let doubts = |document: &Document| -> BTreeSet<String> {
        let doubtful =
            document.diagnostics().filter(|one| one.severity > annulus_core::diagnostic::Severity::Note);
        doubtful.map(|one| one.code.clone()).collect()
    };
    !now.usable() || !doubts(now).is_subset(&doubts(before))
}

/// The new files were read, and are open: what changed is found out.
pub(super) fn taken_in(model: &mut Model, before: Option<BoardBefore>, brought: Brought) -> Vec<Effect> {
    let ExportedAnew { replaced, added, gone, .. } = brought.anew;
    let shown = Arc::new(NewExports { replaced, added, gone, ..NewExports::default() });
    let mut open_names = std::mem::take(&mut model.anew.open_names);
    if let Some(before) = &before {
        let open = &before.document.files;
        let other = |name: &String| Some((name.clone(), open[place_of(open, name)?].0.clone()));
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

/// Asks what changed, where there is something to compare with.
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

/// It is known what changed, or not.
pub(in crate::model) fn answered(model: &mut Model, answer: Result<Answer, Stopped>) -> Vec<Effect> {
    let asked = model.anew.asked.take();
    let same_job =
        asked.zip(model.job.work.as_ref()).is_some_and(|((_, asked), now)| Arc::ptr_eq(&asked, now));
    let compared = match answer {
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

/// What was before is not needed any more once it is compared and what changed was seen.
fn forget_where_seen(model: &mut Model) {
    if model.anew.shown.is_none() && model.anew.asked.is_none() {
        model.anew.before = None;
    }
}

/// Files and job as they were.
fn back(model: &mut Model) -> Vec<Effect> {
    let before = model.anew.before.take();
    before.map_or_else(Vec::new, |before| files::reopen(model, &before))
}

/// Files and job as they were; what was brought is opened by itself.
fn another(model: &mut Model) -> Vec<Effect> {
    let brought = std::mem::take(&mut model.anew.brought);
    let Some(before) = model.anew.before.take() else { return Vec::new() };
    let mut effects = files::reopen(model, &before);
    effects.extend(files::read_chosen(model, brought));
    effects
}
