//! Files: opened, read, reviewed, and read again with other import choices.
//!
//! ```text
//! files ─┬─▶ a saved project: unpacked ─┐
//!        └──────────────────────────────┴▶ read ─▶ Document ─┬─ warnings, errors ─▶ review ─┐
//!                                                            └─ no doubts ──────────────────┴▶ planned
//! ```
//!
//! The open board is replaced only if the new files could be read.

pub mod anew;

use super::keeping::{self, KeptAs};
use super::planning::{self, Brought, OnTheWay, Wanted};
use super::{Document, Effect, JobEdit, Model, OpenBoard, Toast, ToastAct, frame};
use crate::engine::Stopped;
use crate::engine::messages::{Reading, Request, Settings, ToOpen, ToRead};
use crate::keys::Tab;
use crate::said::{Text, key};
use anew::Anew;
use annulus_core::project::saved::{self, NumberReading, Project, SaidOfFiles};
use annulus_core::units::Length;
use std::collections::BTreeSet;
use std::sync::Arc;

/// The state of a board before a review, other files or new exports, to go back to.
#[derive(Clone, Debug)]
pub struct BoardBefore {
    pub document: Arc<Document>,
    job: JobEdit,
    accepted: BTreeSet<String>,
    reviewing: bool,
    pub(super) kept: KeptAs,
}

#[derive(Clone, Debug, PartialEq)]
pub enum FilesEvent {
    Choose,
    /// The browser reads this many files for the page, before it sends [`FilesEvent::Chosen`]; 0 at the end.
    Coming {
        files: usize,
    },
    Sample,
    Link {
        address: String,
    },
    Chosen {
        files: Vec<(String, Vec<u8>)>,
    },
    Review,
    /// A linked file was downloaded; a board opened meanwhile stays open.
    Fetched {
        files: Vec<(String, Vec<u8>)>,
    },
    Reviewed,
    /// Close the board.
    Discarded,
    Back,
    Board {
        name: String,
    },
    Numbers {
        numbers: NumberReading,
    },
    FlipUse {
        /// Index in the reading's list of files.
        row: u32,
    },
    Role {
        file: String,
        role: String,
        side: Option<String>,
    },
    /// Turn alignment of the layers to the copper on or off.
    Aligned {
        on: bool,
    },
    FlipAccepted {
        code: String,
    },
    /// The tool in the spindle, which is used first; `None` for ascending sizes.
    Loaded {
        bit: Option<Length>,
    },
}

pub(super) fn update(model: &mut Model, event: FilesEvent) -> Vec<Effect> {
    let board = &mut model.board;
    match event {
        FilesEvent::Choose => return vec![Effect::ChooseFiles { anew: false }],
        FilesEvent::Coming { files } => model.coming = files,
        FilesEvent::Sample => return vec![Effect::Sample],
        FilesEvent::Link { address } => return vec![Effect::FollowLink { address }],
        FilesEvent::Chosen { files } => return chosen(model, files),
        FilesEvent::Fetched { .. } if board.document.is_some() => {
            return vec![frame::toast(model, Text::of(key!("page.link_to.late")), None)];
        }
        FilesEvent::Fetched { files } => return chosen(model, files),
        FilesEvent::Review => {
            let open = open_now(model);
            model.board.reviewing = open.is_some();
            model.before = before_review(model, open);
        }
        FilesEvent::Reviewed => {
            board.reviewing = false;
            model.before = None;
        }
        FilesEvent::Back => {
            return model.before.take().map_or_else(Vec::new, |before| reopen(model, &before));
        }
        FilesEvent::Discarded => {
            let mut effects = keeping::leaving(model);
            (model.board.document, model.board.reviewing) = (None, false);
            (model.anew, model.before) = (Anew::default(), None);
            layers(model);
            effects.extend(keeping::closed(model));
            return effects;
        }
        FilesEvent::Board { name } => {
            return say(model, |said| (said.board, said.used) = (Some(name), None));
        }
        FilesEvent::Numbers { numbers } => return say(model, |said| said.numbers = numbers),
        FilesEvent::FlipUse { row } => return flip_use(model, row),
        FilesEvent::Role { file, role, side } => {
            return say(model, |said| {
                said.roles.retain(|(name, ..)| *name != file);
                said.roles.push((file, role, side));
            });
        }
        FilesEvent::Aligned { on } => return say(model, |said| said.aligned = on),
        FilesEvent::FlipAccepted { code } => {
            if !board.accepted.remove(&code) {
                board.accepted.insert(code);
            }
        }
        FilesEvent::Loaded { bit } => board.loaded = bit,
    }
    Vec::new()
}

/// Files that are being read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loading {
    pub files: usize,
    /// Progress from 0 to 1.
    pub share: f64,
}

impl Model {
    /// The files that are being read, from the drop on.
    pub fn loading(&self) -> Option<Loading> {
        match &self.on_the_way {
            OnTheWay::Reading { wanted, share, .. } => {
                Some(Loading { files: wanted.files.len(), share: *share })
            }
            // A saved project is one file.
            OnTheWay::Opening { .. } => Some(Loading { files: 1, share: 0.0 }),
            OnTheWay::Nothing | OnTheWay::Planning { .. } if self.coming > 0 => {
                Some(Loading { files: self.coming, share: 0.0 })
            }
            OnTheWay::Nothing | OnTheWay::Planning { .. } => None,
        }
    }
}

fn is_project(files: &[(String, Vec<u8>)]) -> bool {
    matches!(files, [(name, bytes)] if saved::looks_like_one(bytes) || saved::is_called_one(name))
}

/// Opens files: a saved project, new exports of the open board, or another board.
pub(super) fn chosen(model: &mut Model, mut files: Vec<(String, Vec<u8>)>) -> Vec<Effect> {
    if is_project(&files)
        && let Some((name, bytes)) = files.pop()
    {
        return open_project(model, ToOpen { name, bytes }, None, None);
    }
    match anew::exports(model, &files) {
        Some(exports) => anew::read(model, Brought { anew: exports, files }),
        None => read_chosen(model, files),
    }
}

pub(super) fn read_chosen(model: &mut Model, files: Vec<(String, Vec<u8>)>) -> Vec<Effect> {
    // Opening the same files again keeps the user's job.
    let again = model.board.document.as_ref().is_some_and(|open| open.files == files);
    read(model, Wanted { files, said: SaidOfFiles::default(), job: None, again, place: None, anew: None })
}

/// Opens a saved project; `job` replaces its own job, `place` is its storage slot.
pub(super) fn open_project(
    model: &mut Model,
    project: ToOpen,
    job: Option<String>,
    place: Option<u32>,
) -> Vec<Effect> {
    let mut effects = planning::called_off(model);
    let number = model.next_request();
    model.on_the_way = OnTheWay::Opening { number, job, place };
    effects.push(Effect::ask(number, Request::Open(project)));
    effects
}

/// The project was unpacked: reads its files.
pub(super) fn opened(
    model: &mut Model,
    project: Project,
    job: Option<String>,
    place: Option<u32>,
) -> Vec<Effect> {
    let Project { files, said, job: own } = project;
    read(model, Wanted { files, said, job: job.or(own), again: false, place, anew: None })
}

/// Reads the open files again with changed import choices.
fn say(model: &mut Model, change: impl FnOnce(&mut SaidOfFiles)) -> Vec<Effect> {
    let Some(document) = model.board.document.clone() else { return Vec::new() };
    let mut said = document.said.clone();
    change(&mut said);
    let (files, job) = (document.files.clone(), document.job.clone());
    read(model, Wanted { files, said, job, again: true, place: None, anew: None })
}

fn open_now(model: &Model) -> Option<BoardBefore> {
    let OpenBoard { document, accepted, reviewing, .. } = &model.board;
    Some(BoardBefore {
        document: document.clone()?,
        job: model.job.clone(),
        accepted: accepted.clone(),
        reviewing: *reviewing,
        kept: keeping::kept_as(model),
    })
}

/// The board to go back to from a review: the open one, or during a review the one before it.
fn before_review(model: &Model, open: Option<BoardBefore>) -> Option<Arc<BoardBefore>> {
    match open {
        Some(open) if open.reviewing => model.before.clone(),
        open => open.map(Arc::new),
    }
}

/// Restores a board; its project continues in its storage slot.
fn reopen(model: &mut Model, before: &BoardBefore) -> Vec<Effect> {
    let mut effects = Vec::new();
    if !before.kept.same_project(&keeping::kept_as(model)) {
        effects.extend(keeping::leaving(model));
        keeping::go_on(model, before.kept.clone());
    }
    effects.extend(planning::called_off(model));
    planning::clear(model);
    let board = &mut model.board;
    (board.document, board.accepted, board.reviewing) =
        (Some(before.document.clone()), before.accepted.clone(), before.reviewing);
    model.job = before.job.clone();
    model.before.take_if(|_| !before.reviewing);
    model.anew.end();
    layers(model);
    effects
}

fn flip_use(model: &mut Model, row: u32) -> Vec<Effect> {
    let Some(document) = model.board.document.clone() else { return Vec::new() };
    let mut used: Vec<u32> = document.reading.used.clone();
    match used.iter().position(|one| *one == row) {
        Some(at) => drop(used.remove(at)),
        None => used.push(row),
    }
    let name = |row: &u32| document.reading.files.get(*row as usize).map(|file| file.read.name.clone());
    let used = used.iter().filter_map(name).collect();
    say(model, |said| said.used = Some(used))
}

pub(super) fn read(model: &mut Model, wanted: Wanted) -> Vec<Effect> {
    let mut effects = planning::called_off(model);
    let number = model.next_request();
    let request = Request::Read(ToRead {
        board_key: number,
        files: wanted.files.clone(),
        said: wanted.said.clone(),
        job: wanted.job.clone(),
        machine: Some(Settings::of(&model.machine)),
    });
    model.on_the_way = OnTheWay::Reading { number, wanted: Box::new(wanted), share: 0.0 };
    effects.push(Effect::ask(number, request));
    effects
}

/// The files were read. If they were open before, the user's job and the screen stay.
pub(super) fn was_read(model: &mut Model, wanted: Wanted, reading: Reading) -> Vec<Effect> {
    let Wanted { files, said, job, again, place, anew } = wanted;
    let open = open_now(model);
    let mut effects = if again { Vec::new() } else { keeping::leaving(model) };
    let before = open.as_ref().map(|open| open.document.clone());
    let other_board = anew.is_none() && before.is_some_and(|before| before.said.board != said.board);
    let document = Document::new(files, said, job, reading);
    if !again || anew.is_some() {
        let known = open.as_ref().filter(|open| anew.is_some() && !open.reviewing);
        let known = known.is_some_and(|open| !anew::has_new_warnings(&open.document, &document));
        let reviewing = document.doubtful() && !known;
        let drawn = !again && model.draw.is_making();
        model.before = before_review(model, open.clone()).filter(|_| reviewing || drawn);
        model.board.reviewing = reviewing;
        effects.extend(offer_before(model));
        // Stay on the screen if the address named a part of the board. Also stay on the Machine screen if the
        // board was opened for the machine's job, or restored from there.
        let at_machine = model.job_board.is_at(place) || place.is_some() && model.frame.tab == Tab::Machine;
        if model.frame.named.is_none() && !at_machine {
            model.frame.tab = Tab::Board;
        }
    }
    planning::clear(model);
    if !again || other_board || !model.job.edited() {
        model.job.open(document.reading.work.clone());
    }
    model.board.accepted = BTreeSet::new();
    model.board.just_opened = !document.doubtful() && !again;
    model.board.document = Some(Arc::new(document));
    layers(model);
    match anew {
        Some(brought) => effects.extend(anew::taken_in(model, open, *brought)),
        None if again => effects.extend(anew::ask(model)),
        None => {
            model.anew = Anew::default();
            keeping::another(model, place);
        }
    }
    effects
}

/// Offers the board that was open before, unless a review does.
fn offer_before(model: &mut Model) -> Option<Effect> {
    model.frame.toasts.retain(|toast| toast.act != Some(ToastAct::BoardBefore));
    let before = model.before.as_ref().filter(|_| !model.board.reviewing)?;
    let args = vec![("name", before.document.reading.board.name.clone())];
    let text = Text::Key { key: key!("page.draw.in_place_of"), args };
    Some(frame::toast(model, text, Some(ToastAct::BoardBefore)))
}

/// The board before and the toast that offers it disappear together; during a review there is no toast.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    let offers = |toast: &Toast| toast.act == Some(ToastAct::BoardBefore);
    if model.board.reviewing || model.before.is_none() {
        model.frame.toasts.retain(|toast| !offers(toast));
    } else if !model.frame.toasts.iter().any(offers) {
        model.before = None;
    }
    Vec::new()
}

pub(super) fn layers(model: &mut Model) {
    model.frame.layers = frame::layers_of(model.board.document.as_deref(), &model.frame.layers);
}

/// Reports why files could not be opened.
pub(super) fn refused(model: &mut Model, stopped: Stopped) -> Vec<Effect> {
    let Stopped::Refused(why) = stopped else { return Vec::new() };
    why.into_iter().map(|diagnostic| frame::toast(model, Text::Found(diagnostic), None)).collect()
}
