//! Files: chosen, read, looked over, read again with something else said of them.
//!
//! ```text
//! files ─┬─▶ a saved project: taken apart ─┐
//!        └─────────────────────────────────┴▶ read ─▶ Document ─┬─ review (forced by warning and error) ─┐
//!                                                               └─ all certain ──────────────────────┴▶ planned
//! ```
//!
//! Comes in: names and bytes, choices of the person. Goes out: the open board. What was open is replaced only when the files
//! could be read. Does not know how it is shown.

pub mod anew;

use super::planning::{self, Brought, OnTheWay, Wanted};
use super::{Document, Effect, JobEdit, Model, frame, keeping};
use crate::engine::Stopped;
use crate::engine::messages::{Reading, Request, Settings, ToOpen, ToRead};
use crate::keys::Tab;
use crate::said::Text;
use anew::Anew;
use annulus_core::project::saved::{self, NumberReading, Project, SaidOfFiles};
use annulus_core::units::Length;
use std::collections::BTreeSet;
use std::sync::Arc;

/// What was open before a review, its own or that of other files.
#[derive(Debug)]
pub struct BoardBefore {
    /// The board.
    pub document: Arc<Document>,
    /// Its job, with all that can be taken back.
    job: JobEdit,
    /// Errors of it that were seen, by code.
    accepted: BTreeSet<String>,
}

/// What happens to the files.
#[derive(Clone, Debug, PartialEq)]
pub enum FilesEvent {
    /// The person wants to choose files.
    Choose,
    /// The person wants the sample board.
    Sample,
    /// Files were chosen or dropped.
    Chosen {
        /// Names and bytes.
        files: Vec<(String, Vec<u8>)>,
    },
    /// The import review is wanted.
    Review,
    /// The review was gone through.
    Reviewed,
    /// The person wants none of it.
    Discarded,
    /// What was open before the review is wanted, as it was.
    Back,
    /// Of several boards, this one is meant.
    Board {
        /// Its name.
        name: String,
    },
    /// The numbers of drill files are to be read so.
    Numbers {
        /// How.
        numbers: NumberReading,
    },
    /// A file is taken into the board, or left out: the other of the two.
    FlipUse {
        /// Its row in what was read.
        row: u32,
    },
    /// A layer is something else.
    Role {
        /// The file.
        file: String,
        /// What it is.
        role: String,
        /// Where it lies.
        side: Option<String>,
    },
    /// Layers are moved to where they fit the copper, or are not.
    Aligned {
        /// They are.
        on: bool,
    },
    /// An error was seen, or was not: the other of the two.
    FlipAccepted {
        /// Its code.
        code: String,
    },
    /// This bit is in the spindle and goes first; none for ascending sizes.
    Loaded {
        /// Its diameter.
        bit: Option<Length>,
    },
}

/// Takes one event in.
pub(super) fn update(model: &mut Model, event: FilesEvent) -> Vec<Effect> {
    let board = &mut model.board;
    match event {
        FilesEvent::Choose => return vec![Effect::ChooseFiles { anew: false }],
        FilesEvent::Sample => return vec![Effect::Sample],
        FilesEvent::Chosen { files } => return chosen(model, files),
        FilesEvent::Review => {
            model.before = before(model);
            model.board.reviewing = true;
        }
        FilesEvent::Reviewed => {
            board.reviewing = false;
            model.before = None;
        }
        FilesEvent::Back => return back(model),
        FilesEvent::Discarded => {
            let mut effects = keeping::leaving(model);
            (model.board.document, model.board.reviewing) = (None, false);
            model.anew = Anew::default();
            model.before = None;
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

/// Files, new exports of the open board among them, or a saved project.
pub(super) fn chosen(model: &mut Model, files: Vec<(String, Vec<u8>)>) -> Vec<Effect> {
    match <[_; 1]>::try_from(files) {
        Ok([(name, bytes)]) if saved::looks_like_one(&bytes) || saved::is_called_one(&name) => {
            open_project(model, ToOpen { name, bytes }, None, None)
        }
        Ok([file]) => brought(model, vec![file]),
        Err(files) => brought(model, files),
    }
}

fn brought(model: &mut Model, files: Vec<(String, Vec<u8>)>) -> Vec<Effect> {
    match anew::exports(model, &files) {
        Some(exports) => anew::read(model, Brought { anew: exports, files }),
        None => read_chosen(model, files),
    }
}

/// Reads files by themselves.
pub(super) fn read_chosen(model: &mut Model, files: Vec<(String, Vec<u8>)>) -> Vec<Effect> {
    let again = model.board.document.as_ref().is_some_and(|open| open.files == files);
    read(model, Wanted { files, said: SaidOfFiles::default(), job: None, again, place: None, anew: None })
}

/// Opens a saved project, with `job` in place of its own where there is one; `place` is where it was kept.
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

/// The project was taken apart.
pub(super) fn opened(
    model: &mut Model,
    project: Project,
    job: Option<String>,
    place: Option<u32>,
) -> Vec<Effect> {
    let Project { files, said, job: own } = project;
    read(model, Wanted { files, said, job: job.or(own), again: false, place, anew: None })
}

/// Reads the open files again with something else said of them.
fn say(model: &mut Model, change: impl FnOnce(&mut SaidOfFiles)) -> Vec<Effect> {
    let Some(document) = model.board.document.clone() else { return Vec::new() };
    let mut said = document.said.clone();
    change(&mut said);
    let (files, job) = (document.files.clone(), document.job.clone());
    read(model, Wanted { files, said, job, again: true, place: None, anew: None })
}

/// What is open, to be gone back to; while it is under review, what was open before that.
fn before(model: &Model) -> Option<Arc<BoardBefore>> {
    if model.board.reviewing {
        return model.before.clone();
    }
    let (document, accepted) = (model.board.document.clone()?, model.board.accepted.clone());
    Some(Arc::new(BoardBefore { document, job: model.job.clone(), accepted }))
}

/// Opens what was open before the review.
fn back(model: &mut Model) -> Vec<Effect> {
    let Some(before) = model.before.take() else { return Vec::new() };
    let mut effects = keeping::leaving(model);
    effects.extend(planning::called_off(model));
    effects.push(keeping::another(model, None));
    planning::clear(model);
    let board = &mut model.board;
    (board.document, board.accepted, board.reviewing) =
        (Some(before.document.clone()), before.accepted.clone(), false);
    model.job = before.job.clone();
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
    let name = |row: &u32| document.reading.files.get(*row as usize).map(|file| file.name.clone());
    let used = used.iter().filter_map(name).collect();
    say(model, |said| said.used = Some(used))
}

/// Reads files into a board.
pub(super) fn read(model: &mut Model, wanted: Wanted) -> Vec<Effect> {
    let mut effects = if wanted.again { Vec::new() } else { keeping::leaving(model) };
    effects.extend(planning::called_off(model));
    let number = model.next_request();
    let request = Request::Read(ToRead {
        board_key: number,
        files: wanted.files.clone(),
        said: wanted.said.clone(),
        job: wanted.job.clone(),
        machine: Some(Settings::of(&model.machine)),
    });
    model.on_the_way = OnTheWay::Reading { number, wanted: Box::new(wanted) };
    effects.push(Effect::ask(number, request));
    effects
}

/// Files that were open already keep the person's job and the screen.
pub(super) fn was_read(model: &mut Model, wanted: Wanted, reading: Reading) -> Vec<Effect> {
    let Wanted { files, said, job, again, place, anew } = wanted;
    let replaced = anew.as_ref().and_then(|_| anew::replaced(model));
    let open = model.board.document.clone();
    let other = open.as_ref().is_some_and(|open| open.said.board != said.board);
    let document = Document::new(files, said, job, reading);
    let doubtful = document.doubtful();
    planning::clear(model);
    model.board.accepted = BTreeSet::new();
    if anew.is_some() {
        model.board.reviewing = open.is_some_and(|open| anew::has_new_warnings(&open, &document));
        model.frame.tab = Tab::Board;
    } else if !again {
        model.before = before(model).filter(|_| doubtful);
        model.board.reviewing = doubtful;
        model.frame.tab = Tab::Board;
    }
    if !again || other || !model.job.edited() {
        model.job.open(document.reading.work.clone());
    }
    model.board.just_opened = !doubtful && !again;
    model.board.document = Some(Arc::new(document));
    layers(model);
    match anew {
        Some(brought) => anew::taken_in(model, replaced, *brought),
        None if again => anew::ask(model),
        None => {
            model.anew = Anew::default();
            vec![keeping::another(model, place)]
        }
    }
}

/// The layers panel follows what was read.
pub(super) fn layers(model: &mut Model) {
    model.frame.layers = frame::layers_of(model.board.document.as_deref(), &model.frame.layers);
}

/// Why files could not be opened is said, sentence by sentence.
pub(super) fn refused(model: &mut Model, stopped: Stopped) -> Vec<Effect> {
    let Stopped::Refused(why) = stopped else { return Vec::new() };
    why.into_iter().map(|diagnostic| frame::toast(model, Text::Found(diagnostic), None)).collect()
}
