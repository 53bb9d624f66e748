//! The open board: read in the worker, planned in the worker, again whenever something it depends on changes.
//!
//! ```text
//! files ─▶ read ─▶ Document ─┬─ review (forced by doubt and loss) ─┐
//!                            └───── all certain ──────────────────┴▶ plan ─▶ time ─▶ Job, Timed
//!            order, bit loaded, accepted losses, machine ───────────▶ ┘
//! ```
//!
//! Comes in: names and bytes, choices of the person. Goes out: signals. Does not know how it is shown.

use crate::engine::messages::{
    Exported, Laid, LayerRow, Planned, Proved, Reading, Settings, Timed, ToExport, ToOpen, ToPlan, ToProve,
    ToRead, ToTime,
};
use crate::engine::{Engine, Stopped};
use crate::i18n::{key, say};
use crate::state::{Job, Task, state};
use crate::view::Mesh;
use crate::widgets::toast;
use crate::workbench::bench;
use annulus_core::job::Program;
use annulus_core::project;
use annulus_core::project::saved::{self, Project, Said};
use annulus_core::remark::{Remark, Weight};
use annulus_core::units::Length;
use annulus_core::wire::program;
use leptos::prelude::*;
use std::cell::{Cell, RefCell};
use std::collections::BTreeSet;
use std::sync::Arc;

/// Files and what was read from them.
#[derive(Clone, Debug, PartialEq)]
pub struct Document {
    /// Names and bytes as they were given.
    pub files: Vec<(String, Vec<u8>)>,
    /// What the person says of them.
    pub said: Said,
    /// The job file that came with them, in a saved project.
    pub job: Option<String>,
    /// What came of it.
    pub reading: Reading,
    /// The triangles of each of its layers.
    pub meshes: Vec<Arc<Mesh>>,
    /// The same of each board to choose from.
    pub boards: Vec<Arc<Mesh>>,
}

impl Document {
    /// Every finding, file by file, then those about the board.
    pub fn remarks(&self) -> impl Iterator<Item = &Remark> {
        self.reading.files.iter().flat_map(|file| &file.remarks).chain(self.board_remarks())
    }

    /// Findings about the board that no file has said already.
    pub fn board_remarks(&self) -> impl Iterator<Item = &Remark> {
        let said = |remark: &Remark| self.reading.files.iter().any(|file| file.remarks.contains(remark));
        self.reading.remarks.iter().filter(move |remark| !said(remark))
    }

    /// Codes of what is missing from the board.
    pub fn losses(&self) -> BTreeSet<String> {
        self.remarks()
            .filter(|remark| remark.weight == Weight::Loss)
            .map(|remark| remark.code.clone())
            .collect()
    }

    /// Whether a person has to look before anything is planned.
    pub fn doubtful(&self) -> bool {
        self.remarks().any(|remark| remark.weight > Weight::Note)
    }
}

/// The board as it lies for a plan: copied, turned over.
#[derive(Clone, Debug, PartialEq)]
pub struct LaidBoard {
    /// Tells it from other ways to lie.
    pub key: String,
    /// The board without copper, its box, its layers without their triangles.
    pub laid: Laid,
    /// The triangles of each of its layers.
    pub meshes: Vec<Arc<Mesh>>,
}

/// The open board and all that follows from it.
#[derive(Clone, Copy)]
pub struct Desk {
    /// The board.
    pub document: RwSignal<Option<Arc<Document>>>,
    /// Its import review is on show.
    pub reviewing: RwSignal<bool>,
    /// Losses that were seen, by code.
    pub accepted: RwSignal<BTreeSet<String>>,
    /// The bit in the spindle, if it is to go first.
    pub loaded: RwSignal<Option<Length>>,
    /// The plan.
    pub plan: RwSignal<Option<Arc<Planned>>>,
    /// The plan in time.
    pub timed: RwSignal<Option<Arc<Timed>>>,
    /// The board as it lies for the plan.
    pub laid: RwSignal<Option<Arc<LaidBoard>>>,
    /// What the plan does.
    pub program: RwSignal<Option<Arc<Program>>>,
    /// What the proof says of the plan.
    pub proved: RwSignal<Option<Arc<Proved>>>,
    /// Why there is no plan.
    pub refused: RwSignal<Vec<Remark>>,
    /// What files and plan have to say that is more than a note, the first hundred.
    pub problems: Memo<Vec<Remark>>,
}

thread_local! {
    static DESK: Cell<Option<Desk>> = const { Cell::new(None) };
    static ENGINE: Engine = Engine::new();
    /// Counts the wishes, so that a late answer to an old one is dropped.
    static WISH: Cell<u32> = const { Cell::new(0) };
    /// The files were just opened; whether all went well is known when they are planned.
    static JUST_OPENED: Cell<bool> = const { Cell::new(false) };
    /// A plan is in work.
    static PLANNING: Cell<bool> = const { Cell::new(false) };
    /// The plan that is wanted next.
    static WAITING: RefCell<Option<ToPlan>> = const { RefCell::new(None) };
}

/// The open board. Made by [`begin`].
pub fn desk() -> Desk {
    DESK.get().expect("the desk is made before the first screen")
}

/// The most problems shown at once.
const MOST_PROBLEMS: usize = 100;

/// Makes it in the root of the page, after the state.
pub fn begin() {
    let document = RwSignal::new(None::<Arc<Document>>);
    let plan = RwSignal::new(None::<Arc<Planned>>);
    let refused = RwSignal::new(Vec::<Remark>::new());
    let problems = Memo::new(move |_| {
        let mut remarks = refused.get();
        plan.with(|plan| remarks.extend(plan.iter().flat_map(|plan| plan.remarks.iter().cloned())));
        document.with(|document| {
            remarks.extend(document.iter().flat_map(|document| document.remarks().cloned()));
        });
        remarks.retain(|remark| remark.weight > Weight::Note);
        remarks.truncate(MOST_PROBLEMS);
        remarks
    });
    let desk = Desk {
        document,
        reviewing: RwSignal::new(false),
        accepted: RwSignal::new(BTreeSet::new()),
        laid: RwSignal::new(None),
        program: RwSignal::new(None),
        proved: RwSignal::new(None),
        loaded: RwSignal::new(None),
        plan,
        timed: RwSignal::new(None),
        refused,
        problems,
    };
    DESK.set(Some(desk));
    Effect::new(move |_| {
        if let Some(wanted) = to_plan(desk).filter(|_| !desk.reviewing.get()) {
            bench().stale.set(true);
            leptos::task::spawn_local(make_plan(desk, wanted));
        }
    });
}

/// What there is to plan: the open board, its job, and what goes with them.
fn to_plan(desk: Desk) -> Option<ToPlan> {
    let (document, work) = desk.document.get().zip(bench().work.get())?;
    Some(ToPlan {
        board_key: document.reading.board_key,
        machine: Settings::of(&state().machine.get()),
        work: (*work).clone(),
        loaded: desk.loaded.get(),
        accept: desk.accepted.get().into_iter().collect(),
        laid: None,
    })
}

fn next_wish() -> u32 {
    WISH.set(WISH.get() + 1);
    WISH.get()
}

fn engine() -> Engine {
    ENGINE.with(Clone::clone)
}

/// Opens files, or a saved project. What was open is replaced only when they could be read.
pub async fn open(files: Vec<(String, Vec<u8>)>) {
    let project = match files.as_slice() {
        [(name, bytes)] if saved::looks_like_one(bytes) => {
            Some(ToOpen { name: name.clone(), bytes: bytes.clone() })
        }
        _ => None,
    };
    let Some(project) = project else {
        let open = desk().document.get_untracked();
        let again = open.is_some_and(|open| open.files == files);
        return read(files, Said::default(), None, again).await;
    };
    reopen(project, None).await;
}

/// Opens a saved project, with `job` in place of its own where there is one. Whether it could be taken apart and nobody wanted
/// something else meanwhile.
pub async fn reopen(project: ToOpen, job: Option<String>) -> bool {
    let wish = next_wish();
    engine().cancel();
    match engine().open(project).await {
        Ok(Project { files, said, job: own }) if wish == WISH.get() => {
            read(files, said, job.or(own), false).await;
            return true;
        }
        Err(Stopped::Refused(why)) => why.iter().for_each(|remark| toast(crate::i18n::message(remark), None)),
        _ => {}
    }
    false
}

/// The open board, what was said of its files and its job as the bytes of a project; none without a board.
pub async fn saved() -> Option<Result<Vec<u8>, Vec<Remark>>> {
    let document = desk().document.get_untracked()?;
    let job = bench().work.get_untracked().map(|work| project::write(&work));
    let project = Project { files: document.files.clone(), said: document.said.clone(), job };
    match Engine::new().save(project).await {
        Ok(bytes) => Some(Ok(bytes)),
        Err(Stopped::Refused(why)) => Some(Err(why)),
        Err(Stopped::Cancelled) => None,
    }
}

/// Reads the open files again with something else said of them.
pub async fn say(change: impl FnOnce(&mut Said)) {
    if let Some(document) = desk().document.get_untracked() {
        let mut said = document.said.clone();
        change(&mut said);
        read(document.files.clone(), said, document.job.clone(), true).await;
    }
}

/// Reads `files`; where they are open already (`again`), the person's job and the screen stay.
async fn read(files: Vec<(String, Vec<u8>)>, said: Said, job: Option<String>, again: bool) {
    let desk = desk();
    let wish = next_wish();
    engine().cancel();
    state().task.set(Some(Task { word: key!("page.task.reading"), share: 0.0 }));
    let wanted = ToRead {
        board_key: wish,
        files: files.clone(),
        said: said.clone(),
        job: job.clone(),
        machine: Some(Settings::of(&state().machine.get_untracked())),
    };
    let answer = engine().read(wanted).await;
    if wish != WISH.get() {
        return;
    }
    state().task.set(None);
    match answer {
        Ok(reading) => {
            let other = desk
                .document
                .with_untracked(|open| open.as_ref().is_some_and(|open| open.said.board != said.board));
            let document = document_of(files, said, job, reading);
            desk.accepted.set(BTreeSet::new());
            clear_plan(desk);
            let empty = document.reading.board.holes.is_empty() && document.meshes.is_empty();
            let doubtful = document.doubtful() || empty;
            if !again {
                desk.reviewing.set(doubtful);
            }
            if !again || other || !bench().edited() {
                bench().open(document.reading.work.clone());
            }
            JUST_OPENED.set(!doubtful && !again);
            desk.document.set(Some(Arc::new(document)));
            if !again {
                state().tab.set(crate::keys::Tab::Board);
            }
        }
        Err(Stopped::Refused(why)) => {
            for remark in why {
                toast(crate::i18n::message(&remark), None);
            }
        }
        Err(Stopped::Cancelled) => {}
    }
}

fn take_meshes(layers: &mut [LayerRow]) -> Vec<Arc<Mesh>> {
    layers.iter_mut().map(|layer| Arc::new(std::mem::take(&mut layer.mesh))).collect()
}

fn document_of(
    files: Vec<(String, Vec<u8>)>,
    said: Said,
    job: Option<String>,
    mut reading: Reading,
) -> Document {
    let meshes = take_meshes(&mut reading.layers);
    let boards = reading.boards.iter_mut().map(|board| Arc::new(std::mem::take(&mut board.mesh))).collect();
    Document { files, said, job, reading, meshes, boards }
}

fn show_review() {
    desk().reviewing.set(true);
}

fn clear_plan(desk: Desk) {
    desk.plan.set(None);
    desk.laid.set(None);
    desk.program.set(None);
    desk.proved.set(None);
    desk.timed.set(None);
    desk.refused.set(Vec::new());
    state().job.set(None);
    state().selected.set(None);
}

/// Plans `wanted` when what is in work is done; of several that wait, only the last.
async fn make_plan(desk: Desk, wanted: ToPlan) {
    if PLANNING.get() {
        WAITING.with_borrow_mut(|waiting| *waiting = Some(wanted));
        return;
    }
    next_wish();
    PLANNING.set(true);
    let mut next = Some(wanted);
    while let Some(wanted) = next {
        plan_and_time(desk, wanted).await;
        next = WAITING.take();
    }
    PLANNING.set(false);
}

/// Asks; a worker that does not have the board is given the files first.
async fn with_board<T, F: Future<Output = Result<T, Stopped>>>(
    wanted: &ToPlan,
    ask: impl Fn() -> F,
) -> Result<T, Stopped> {
    match ask().await {
        Err(Stopped::Refused(why)) if why.iter().any(|remark| remark.code == "engine.board_gone") => {
            let document = desk().document.get_untracked().ok_or(Stopped::Cancelled)?;
            let again = ToRead {
                board_key: wanted.board_key,
                files: document.files.clone(),
                said: document.said.clone(),
                job: None,
                machine: Some(wanted.machine.clone()),
            };
            engine().read(again).await?;
            ask().await
        }
        answer => answer,
    }
}

/// Writes all sides of the job as `wanted` makes it of what there is to plan.
pub async fn export(wanted: impl FnOnce(ToPlan) -> ToExport) -> Result<Exported, Stopped> {
    let wanted = wanted(untrack(|| to_plan(desk())).ok_or(Stopped::Cancelled)?);
    let progress = |share| state().task.set(Some(Task { word: key!("page.task.writing"), share }));
    let answer = with_board(&wanted.plan, || async { engine().export(wanted.clone(), progress).await }).await;
    state().task.set(None);
    answer
}

async fn plan_and_time(desk: Desk, wanted: ToPlan) {
    let wish = WISH.get();
    let known = desk.laid.with_untracked(|laid| laid.as_ref().map(|laid| laid.key.clone()));
    let wanted = ToPlan { laid: known, ..wanted };
    let machine = wanted.machine.clone();
    let (board_key, work) = (wanted.board_key, wanted.work.clone());
    let progress = move |share| {
        if wish == WISH.get() {
            state().task.set(Some(Task { word: key!("page.task.planning"), share }));
        }
    };
    progress(0.0);
    let answer = with_board(&wanted, || async { engine().plan(wanted.clone(), progress).await }).await;
    if wish != WISH.get() {
        return;
    }
    let just_opened = JUST_OPENED.replace(false);
    let planned = match answer {
        Ok(planned) => Arc::new(planned),
        Err(stopped) => {
            state().task.set(None);
            clear_plan(desk);
            bench().stale.set(false);
            if let Stopped::Refused(why) = stopped {
                desk.refused.set(why);
            }
            return;
        }
    };
    desk.refused.set(Vec::new());
    if let Some(laid) = &planned.laid {
        let (mut laid, key) = (laid.clone(), planned.laid_key.clone());
        let meshes = take_meshes(&mut laid.layers);
        desk.laid.set(Some(Arc::new(LaidBoard { key, laid, meshes })));
    }
    desk.plan.set(Some(planned.clone()));
    if just_opened && desk.problems.with_untracked(Vec::is_empty) {
        toast(say!("page.open.certain"), Some((say!("page.open.review"), show_review)));
    }
    desk.program.set(program::decode(&planned.program).ok().map(Arc::new));
    if overtaken(wish) {
        return;
    }
    state().task.set(Some(Task { word: key!("page.task.proving"), share: 0.7 }));
    let program = planned.program.clone();
    let proved = engine().prove(ToProve { board_key, program, work }).await;
    if overtaken(wish) {
        return;
    }
    bench().marked.set(None);
    desk.proved.set(proved.ok().map(Arc::new));
    state().task.set(Some(Task { word: key!("page.task.timing"), share: 0.9 }));
    let timed = engine().time(ToTime { program: planned.program.clone(), machine }).await;
    if overtaken(wish) {
        return;
    }
    state().task.set(None);
    match timed {
        Ok(timed) => finish(desk, &planned, timed),
        Err(Stopped::Refused(why)) => desk.refused.set(why),
        Err(Stopped::Cancelled) => {}
    }
}

/// Nobody waits for the rest: it was called off, or another job is wanted meanwhile.
fn overtaken(wish: u32) -> bool {
    wish != WISH.get() || WAITING.with_borrow(Option::is_some)
}

fn finish(desk: Desk, planned: &Planned, timed: Timed) {
    let Ok(program) = program::decode(&planned.program) else { return };
    let (bytes, key) = (planned.program.clone(), planned.key.clone());
    state().job.set(Some(Arc::new(Job { program, bytes, key, stream_digest: timed.stream_digest.clone() })));
    desk.timed.set(Some(Arc::new(timed)));
    bench().stale.set(false);
}

/// Calls off what the worker does.
pub fn cancel() {
    next_wish();
    WAITING.take();
    engine().cancel();
    state().task.set(None);
}

/// The digest of the steps of a program that was not planned here, computed in the worker.
pub async fn digest(program: Vec<u8>) -> Option<String> {
    let machine = Settings::of(&state().machine.get_untracked());
    Engine::new().time(ToTime { program, machine }).await.ok().map(|timed| timed.stream_digest)
}

impl Desk {
    /// Losses of the files that nobody has seen yet.
    pub fn losses_unseen(self) -> bool {
        let accepted = self.accepted.get();
        self.document.with(|document| {
            document
                .as_ref()
                .is_some_and(|document| document.losses().iter().any(|code| !accepted.contains(code)))
        })
    }

    /// Losses of files or plan that nobody has seen yet; planning waits for that.
    pub fn waits_for_person(self) -> bool {
        let unseen = |remark: &Remark| {
            remark.weight == Weight::Loss && self.accepted.with(|accepted| !accepted.contains(&remark.code))
        };
        self.problems.with(|problems| problems.iter().any(unseen))
    }

    /// Says that a loss was seen, or takes it back.
    pub fn flip_accepted(self, code: &str) {
        self.accepted.update(|accepted| {
            if !accepted.remove(code) {
                accepted.insert(code.to_owned());
            }
        });
    }
}
