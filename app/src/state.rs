//! What the page knows: where one is, what is open, what is planned. Signals for what is looked at; the heavy things
//! behind an `Arc`.
//!
//! Comes in: nothing. Goes out: one [`State`], made at the root, the same everywhere. Knows no layout.

use crate::document;
use crate::format::Unit;
use crate::i18n::say;
use crate::keys::Tab;
use crate::layers::Look;
use crate::link;
use crate::screens::machine::preflight::Preflight;
use annulus_core::job::Program;
use annulus_core::machine::{self, Machine};
use annulus_core::wire::program;
use leptos::prelude::*;
use std::cell::Cell;
use std::collections::BTreeSet;
use std::sync::Arc;

/// A program with its bytes and the digest of its steps as this page computed them.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// What to do.
    pub program: Program,
    /// The same as bytes.
    pub bytes: Vec<u8>,
    /// SHA-256 of the bytes.
    pub key: String,
    /// SHA-256 of the step stream.
    pub stream_digest: String,
}

/// Long work in the worker.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Task {
    /// Key of its word.
    pub word: &'static str,
    /// How far, from 0 to 1.
    pub share: f64,
}

/// Colours of the page.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Theme {
    /// As the system says.
    #[default]
    Auto,
    /// Bright.
    Light,
    /// Dim.
    Dark,
    /// Black and white with full contrast.
    Contrast,
}

/// Everything the page knows.
#[derive(Clone, Copy)]
pub struct State {
    /// The screen.
    pub tab: RwSignal<Tab>,
    /// Unit of lengths on show.
    pub unit: RwSignal<Unit>,
    /// Colours.
    pub theme: RwSignal<Theme>,
    /// The machine that is planned for: the bridge's, else the virtual drill.
    pub machine: Memo<Arc<Machine>>,
    /// The planned job.
    pub job: RwSignal<Option<Arc<Job>>>,
    /// The job the machine has, where that is another one.
    pub fetched: RwSignal<Option<Arc<Job>>>,
    /// The job that the Machine screen shows.
    pub shown_job: Memo<Option<Arc<Job>>>,
    /// Long work.
    pub task: RwSignal<Option<Task>>,
    /// The hole chosen in picture or table.
    pub selected: RwSignal<Option<u32>>,
    /// Show the ways as in the file instead of the planned ones.
    pub show_before: RwSignal<bool>,
    /// Show the ways from cut to cut.
    pub show_travel: RwSignal<bool>,
    /// How each layer is seen.
    pub layers: RwSignal<Vec<Look>>,
    /// The board is looked at from below.
    pub flipped: RwSignal<bool>,
    /// Where the pointer is, work coordinates in mm.
    pub cursor_mm: RwSignal<Option<[f64; 2]>>,
    /// CSS pixels in a millimetre.
    pub zoom: RwSignal<f64>,
    /// Key of the word for what draws.
    pub backend: RwSignal<Option<&'static str>>,
    /// The pre-flight on show.
    pub preflight: RwSignal<Option<Preflight>>,
    /// Warnings of it that were ticked, by code.
    pub ticked: RwSignal<BTreeSet<String>>,
}

thread_local! {
    static STATE: Cell<Option<State>> = const { Cell::new(None) };
}

/// What the page knows. Made by [`begin`].
pub fn state() -> State {
    STATE.get().expect("the state is made before the first screen")
}

/// Makes it, in the root of the page, after the link.
pub fn begin() {
    let line = link::link();
    let job = RwSignal::new(None::<Arc<Job>>);
    let fetched = RwSignal::new(None::<Arc<Job>>);
    let running =
        Memo::new(move |_| line.status.with(|status| status.as_ref().and_then(|status| status.job.clone())));
    let shown_job = Memo::new(move |_| {
        let planned = job.get();
        let Some(key) = running.get() else { return planned };
        planned.filter(|job| job.key == key).or_else(|| fetched.get().filter(|job| job.key == key))
    });
    STATE.set(Some(State {
        tab: RwSignal::new(Tab::default()),
        unit: RwSignal::new(Unit::default()),
        theme: RwSignal::new(Theme::default()),
        machine: Memo::new(move |_| Arc::new(described(line))),
        job,
        fetched,
        shown_job,
        task: RwSignal::new(None),
        selected: RwSignal::new(None),
        show_before: RwSignal::new(false),
        show_travel: RwSignal::new(true),
        layers: RwSignal::new(Vec::new()),
        flipped: RwSignal::new(false),
        cursor_mm: RwSignal::new(None),
        zoom: RwSignal::new(0.0),
        backend: RwSignal::new(None),
        preflight: RwSignal::new(None),
        ticked: RwSignal::new(BTreeSet::new()),
    }));
    Effect::new(move |_| {
        if let Some(key) = running.get() {
            leptos::task::spawn_local(async move { drop(job_by_key(&key).await) });
        }
    });
}

/// The machine as the bridge describes it; what this page does not know of it stays as in the virtual drill.
fn described(line: link::Link) -> Machine {
    let preset = machine::virtual_drill();
    line.settings.with(|settings| machine::apply(&preset, settings)).unwrap_or(preset)
}

/// The job `key`: the planned one, or fetched from the bridge when this page was opened later.
pub async fn job_by_key(key: &str) -> Option<Arc<Job>> {
    let known = |job: &Option<Arc<Job>>| job.clone().filter(|job| job.key == key);
    let state = state();
    if let Some(job) = state.job.with_untracked(known).or_else(|| state.fetched.with_untracked(known)) {
        return Some(job);
    }
    let bytes = match link::fetch(key).await {
        Ok(bytes) => bytes,
        Err(why) => {
            link::link().refused.set(Some(why));
            return None;
        }
    };
    let program = program::decode(&bytes).ok()?;
    let stream_digest = document::digest(bytes.clone()).await.unwrap_or_default();
    let job = Arc::new(Job { program, key: key.to_owned(), bytes, stream_digest });
    state.fetched.set(Some(job.clone()));
    Some(job)
}

impl State {
    /// The word for the unit on show.
    pub fn unit_word(self) -> String {
        match self.unit.get() {
            Unit::Millimetre => say!("page.unit.mm"),
            Unit::Inch => say!("page.unit.inch"),
        }
    }
}
