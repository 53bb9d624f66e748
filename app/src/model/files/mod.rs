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

/// A board as it was open, before a review, other files or new exports: to be gone back to.
#[derive(Clone, Debug)]
pub struct BoardBefore {
    /// The board.
    pub document: Arc<Document>,
    /// Its job, with all that can be taken back.
    job: JobEdit,
    /// Errors of it that were seen, by code.
    accepted: BTreeSet<String>,
    /// Its review was on show.
    reviewing: bool,
    /// How it is kept.
    pub(super) kept: KeptAs,
}

/// What happens to the files.
#[derive(Clone, Debug, PartialEq)]
pub enum FilesEvent {
    /// The person wants to choose files.
    Choose,
    /// The person wants the sample board.
    Sample,
    /// The board behind a link is wanted.
    Link {
        /// The link.
        address: String,
    },
    /// Files were chosen or dropped.
    Chosen {
        /// Names and bytes.
        files: Vec<(String, Vec<u8>)>,
    },
    /// The import review is wanted.
    Review,
    /// The file behind a link is here; whatever was opened meanwhile stays.
    Fetched {
        /// Name and bytes.
        files: Vec<(String, Vec<u8>)>,
    },
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

/// Whether `files` are a saved project.
fn is_project(files: &[(String, Vec<u8>)]) -> bool {
    matches!(files, [(name, bytes)] if saved::looks_like_one(bytes) || saved::is_called_one(name))
}

/// Files, new exports of the open board among them, or a saved project.
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

/// The board that is open, as it is.
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

/// What there is to go back to from a review: what was `open`, and where that is under review itself, what was before it.
fn before_review(model: &Model, open: Option<BoardBefore>) -> Option<Arc<BoardBefore>> {
    match open {
        Some(open) if open.reviewing => model.before.clone(),
        open => open.map(Arc::new),
    }
}

/// Opens a board as it was: the project goes on where it is kept.
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
    let name = |row: &u32| document.reading.files.get(*row as usize).map(|file| file.name.clone());
    let used = used.iter().filter_map(name).collect();
    say(model, |said| said.used = Some(used))
}

/// Reads files into a board.
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

/// Files that were open already keep the person's job and the screen.
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
        // Who came by an address that names something of the board finds that; who looks at the machine's job, or restores a board
        // beside the machine, goes on looking.
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

/// Offers what was open before, where no review does.
fn offer_before(model: &mut Model) -> Option<Effect> {
    model.frame.toasts.retain(|toast| toast.act != Some(ToastAct::BoardBefore));
    let before = model.before.as_ref().filter(|_| !model.board.reviewing)?;
    let args = vec![("name", before.document.reading.board.name.clone())];
    let text = Text::Key { key: key!("page.draw.in_place_of"), args };
    Some(frame::toast(model, text, Some(ToastAct::BoardBefore)))
}

/// What was open before is kept as long as a review or a short word offers it, and that as long as it is kept.
pub(super) fn follow(model: &mut Model) {
    let offers = |toast: &Toast| toast.act == Some(ToastAct::BoardBefore);
    if model.board.reviewing || model.before.is_none() {
        model.frame.toasts.retain(|toast| !offers(toast));
    } else if !model.frame.toasts.iter().any(offers) {
        model.before = None;
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
