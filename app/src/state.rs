//! The job that the machine has, and its pre-flight, as signals.
//!
//! Comes in: nothing. Goes out: one [`State`], made at the root, the same everywhere. Knows no layout.

use crate::engine::Engine;
use crate::engine::messages::{Settings, ToTime};
use crate::link;
use crate::model::Job;
use crate::page::open_board;
use crate::screens::machine::preflight::Preflight;
use annulus_core::wire::program;
use leptos::prelude::*;
use std::cell::Cell;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Everything the page knows.
#[derive(Clone, Copy)]
pub struct State {
    /// The job the machine has, where that is another one.
    pub fetched: RwSignal<Option<Arc<Job>>>,
    /// The job that the Machine screen shows.
    pub shown_job: Memo<Option<Arc<Job>>>,
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
    let fetched = RwSignal::new(None::<Arc<Job>>);
    let running =
        Memo::new(move |_| line.status.with(|status| status.as_ref().and_then(|status| status.job.clone())));
    let shown_job = Memo::new(move |_| {
        let planned = open_board().job.get();
        let Some(key) = running.get() else { return planned };
        planned.filter(|job| job.key == key).or_else(|| fetched.get().filter(|job| job.key == key))
    });
    STATE.set(Some(State {
        fetched,
        shown_job,
        preflight: RwSignal::new(None),
        ticked: RwSignal::new(BTreeSet::new()),
    }));
    Effect::new(move |_| {
        if let Some(key) = running.get() {
            leptos::task::spawn_local(async move { drop(job_by_key(&key).await) });
        }
    });
}

/// The digest of the steps of a program that was not planned here, computed in a worker.
pub async fn digest(program: Vec<u8>) -> Option<String> {
    let machine = Settings::of(&open_board().machine.get_untracked());
    Engine::new().digest(ToTime { program, machine }).await
}

/// The job `key`: the planned one, or fetched from the bridge when this page was opened later.
pub async fn job_by_key(key: &str) -> Option<Arc<Job>> {
    let known = |job: &Option<Arc<Job>>| job.clone().filter(|job| job.key == key);
    let state = state();
    if let Some(job) = open_board().job.with_untracked(known).or_else(|| state.fetched.with_untracked(known))
    {
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
    let stream_digest = digest(bytes.clone()).await.unwrap_or_default();
    let job = Arc::new(Job { program, key: key.to_owned(), bytes, stream_digest });
    state.fetched.set(Some(job.clone()));
    Some(job)
}
