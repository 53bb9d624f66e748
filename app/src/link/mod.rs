//! The line to the bridge: what it last said, as signals, and how to ask it for something.
//!
//! ```text
//!            ask(Ask) ─▶ socket ─▶ bridge
//! signals ◀─ heard(Tell) ◀─ socket ◀─ bridge      (and every 250 ms: ping, age, STOP heard?)
//! ```
//!
//! Comes in: messages of `wire`. Goes out: signals for the screens. Does not know what they show.

pub mod browser;
mod heard;
mod jobs;
mod jog;
mod session;
mod socket;
mod stop;

pub use crate::health::{Freshness, Ousted};
use crate::lab::log::{Event, Log};
pub use jobs::{fetch, upload};
pub use jog::{hold, jog, let_go};
pub use socket::{ask, reconnect_now};
pub use stop::stop;

use annulus_core::control::{Ending, State, Timing};
use annulus_core::machine::Value;
use annulus_core::queue::RowResult;
use annulus_core::remark::Remark;
use annulus_core::wire::{Outputs, PreflightRow, QueuePhase, Status};
use leptos::prelude::*;
use std::cell::Cell;
use std::sync::Arc;

/// How far the connection is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Phase {
    /// No session: the page was opened without the link that the bridge prints.
    #[default]
    Unpaired,
    /// On the way.
    Connecting,
    /// Hello accepted.
    Open,
    /// Was open, is being tried again.
    Lost,
}

/// Who may move the machine.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Control {
    /// This page.
    pub yours: bool,
    /// Some page.
    pub taken: bool,
    /// Pages that watch.
    pub viewers: u32,
}

/// The bridge's verdict on a job.
#[derive(Clone, Debug, PartialEq)]
pub struct Armed {
    /// SHA-256 of the program's bytes.
    pub job: String,
    /// Digest of the step stream as the bridge computed it.
    pub stream_digest: String,
    /// Row by row.
    pub checks: Vec<PreflightRow>,
}

/// A job that can be taken up.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Interrupted {
    /// Which.
    pub job: String,
    /// Its name.
    pub name: String,
    /// Where to go on.
    pub next_leg: u32,
    /// Holes done for certain.
    pub holes_done: u32,
    /// Holes in all.
    pub holes_total: u32,
}

/// How the last job ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ended {
    /// Which.
    pub job: String,
    /// Why.
    pub ending: Ending,
    /// Holes drilled.
    pub holes_done: u32,
    /// It was stopped, and STOP was pressed in this page.
    pub by_you: bool,
}

/// Everything the bridge said, each part a signal. Made once at the root; copies are the same line.
#[derive(Clone, Copy)]
pub struct Link {
    /// How far the connection is.
    pub phase: RwSignal<Phase>,
    /// Whether a machine was connected since the page was opened.
    pub ever: RwSignal<bool>,
    /// How things stand.
    pub status: RwSignal<Option<Arc<Status>>>,
    /// How old that is.
    pub freshness: RwSignal<Freshness>,
    /// Who may move the machine.
    pub control: RwSignal<Control>,
    /// The machine's settings.
    pub settings: RwSignal<Arc<Vec<(String, Value)>>>,
    /// Their fingerprint.
    pub fingerprint: RwSignal<String>,
    /// The last verdict on a job.
    pub armed: RwSignal<Option<Armed>>,
    /// A job to be taken up.
    pub interrupted: RwSignal<Option<Interrupted>>,
    /// How the last one ended.
    pub ended: RwSignal<Option<Ended>>,
    /// What the bridge's clock is worth; none where the drill is virtual.
    pub timing: RwSignal<Option<Arc<Timing>>>,
    /// Why the last wish was refused.
    pub refused: RwSignal<Option<Remark>>,
    /// Why this page lost control.
    pub ousted: RwSignal<Option<Ousted>>,
    /// There and back, ms.
    pub delay_ms: RwSignal<Option<f64>>,
    /// STOP was pressed and nobody said that it was heard.
    pub stop_unconfirmed: RwSignal<bool>,
    /// What happened so far.
    pub log: RwSignal<Log>,
    /// The queue of work commands that the machine has.
    pub queue: RwSignal<Queue>,
    /// The outputs and their lock.
    pub outputs: RwSignal<Outputs>,
}

/// The machine's queue of work commands.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Queue {
    /// Its text; empty where there is none.
    pub text: String,
    /// What it is doing.
    pub phase: QueuePhase,
    /// The row in work or next.
    pub row: Option<usize>,
    /// Results, one a row.
    pub results: Vec<RowResult>,
    /// Why it failed.
    pub why: Option<Remark>,
}

thread_local! {
    static LINK: Cell<Option<Link>> = const { Cell::new(None) };
}

/// The line. Made by [`begin`]; there is one for the life of the page.
pub fn link() -> Link {
    LINK.get().expect("the line is made before the first screen")
}

/// Makes the line in the root of the page, and connects if the bridge opened this page.
pub fn begin() {
    LINK.set(Some(Link {
        phase: RwSignal::new(Phase::Unpaired),
        ever: RwSignal::new(false),
        status: RwSignal::new(None),
        freshness: RwSignal::new(Freshness::Fresh),
        control: RwSignal::new(Control::default()),
        settings: RwSignal::new(Arc::default()),
        fingerprint: RwSignal::new(String::new()),
        armed: RwSignal::new(None),
        interrupted: RwSignal::new(None),
        ended: RwSignal::new(None),
        timing: RwSignal::new(None),
        refused: RwSignal::new(None),
        ousted: RwSignal::new(None),
        delay_ms: RwSignal::new(None),
        stop_unconfirmed: RwSignal::new(false),
        log: RwSignal::new(Log::default()),
        queue: RwSignal::new(Queue::default()),
        outputs: RwSignal::new(Outputs::default()),
    }));
    socket::begin();
}

/// Writes `event` into the log.
fn noted(event: Event) {
    link().log.update(|log| log.add(browser::clock_ms(), event));
}

impl Link {
    /// What the machine is doing, if one is there.
    pub fn state(self) -> Option<State> {
        self.status.with(|status| status.as_ref().map(|status| status.state))
    }

    /// Whether anything moves or is about to.
    pub fn busy(self) -> bool {
        !matches!(self.state(), None | Some(State::Ready | State::NotHomed | State::Alarm))
    }

    /// Whether this page may ask for motion now.
    pub fn may_act(self) -> bool {
        self.phase.get() == Phase::Open
            && self.control.get().yours
            && self.freshness.get() == Freshness::Fresh
    }
}
