//! The executor: what owns pins and clock, fed with tasks. Either a thread of the bridge, or a process of its own.
//!
//! ```text
//! owner ── ring of orders ──▶ thread ──▶ virtual drill          owner ── frames ──▶ process ─ thread ──▶ I/O card
//!   ▲                           │  ▲                              ▲                   │         │
//!   │                           │  └── stop up to task n,         │                   │   pipe ends: ramp down,
//!   ├── reports: every task,    │      legs durable up to n       ├── the same ◀──────┘   forcing and spindle off
//!   │   once, at rest           │                                 └── glimpses, 50 a second
//!   └── latest place: lossy, never waited for
//! ```
//!
//! Owner and process watch each other: the process comes to rest by itself when the owner says nothing for 300 ms; an owner
//! whose process died, or says nothing for 500 ms, switches the outputs off itself.
//!
//! Comes in: tasks of segments. Goes out: calls on pins, one report a task. Does not know jobs; of the journal it knows one
//! number: how many legs are durable. The tip does not go down before every earlier leg is.

pub(crate) mod child;
pub(crate) mod clock;
mod frames;
mod grant;
pub(crate) mod process;
pub(crate) mod realtime;
mod record;
mod thread;

use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::{Bit, Gate, Input};
use annulus_core::machine::{Machine, Output, Steps};
use annulus_core::pins::{AxisSet, Clock, Pins};
use annulus_core::steps::{Segment, Stage};
use frames::Down;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicU8, AtomicU32, AtomicU64, Ordering};
use std::sync::mpsc::{Sender, SyncSender};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Instant;

/// Something to move.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct Task {
    /// Grows from task to task.
    pub(crate) id: u64,
    /// Each begins and ends at rest.
    pub(crate) segments: Vec<Segment>,
    /// It ends with the tip in the board, and another task follows at once.
    pub(crate) follows: bool,
    /// Legs that must be durable before the tip goes down.
    pub(crate) needs_durable: u32,
    /// Machine steps of Z to which the tip may be lifted when nobody is left to say so; none where the position is not
    /// trusted.
    pub(crate) lift_to: Option<i64>,
    /// It goes only as long as it is granted again and again ([`Shared::grant`]).
    pub(crate) granted: bool,
}

/// How a task ended, at rest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Report {
    /// Which.
    pub(crate) id: u64,
    /// How many segments it played to their end.
    pub(crate) completed: usize,
    /// Why no more.
    pub(crate) ended: Ended,
    /// Where it rests, machine steps.
    pub(crate) position: Steps,
    /// Axes that came there from above.
    pub(crate) down: AxisSet,
    /// The inputs then.
    pub(crate) inputs: u32,
    /// Stream time it took, in ticks.
    pub(crate) ticks: u64,
}

/// Why a task ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Ended {
    /// All of it was played.
    Completed,
    /// A gate's input turned on here.
    Gated(Steps),
    /// A gate's input did not turn on.
    Unmet(Gate),
    /// A sensor that must not be reached turned on.
    Guarded(Input),
    /// A step came so many ticks too late for its motor.
    Late(u64),
    /// Not begun: the tip was down in the board, this task did not come in time, and the tip was lifted.
    Starved,
    /// As ordered.
    Stopped,
}

/// The latest place, for people to look at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Glimpse {
    /// Steps counted.
    pub(crate) position: Steps,
    /// Inputs, one bit each.
    pub(crate) inputs: u32,
    /// Spindle speed.
    pub(crate) rpm: u32,
    /// What is being done; none at rest.
    pub(crate) stage: Option<Stage>,
    /// Where it goes, in the segment's own coordinates.
    pub(crate) end: Steps,
}

/// What an executor tells its owner.
#[derive(Clone, Debug)]
pub(crate) enum Heard {
    /// A task ended, at rest.
    Report(Report),
    /// The executor is no more; what it was doing was not reported.
    Gone(Diagnostic),
}

/// What owner, journal and executor share without waiting for each other.
#[derive(Default)]
pub(crate) struct Shared {
    stop_upto: AtomicU64,
    durable: AtomicU32,
    /// Percent that the feed is below the planned one.
    slower: AtomicU8,
    glimpse: Mutex<Glimpse>,
    /// Until when a move by hand may go.
    grant: grant::Grant,
    /// The way to an executor that is another process.
    courier: Mutex<Option<Sender<Down>>>,
}

impl Shared {
    /// Every task up to `id` comes to rest.
    pub(crate) fn stop(&self, id: u64) {
        self.stop_upto.fetch_max(id, Ordering::SeqCst);
        self.send(Down::Stop(id));
    }

    /// So many legs are on the disk.
    pub(crate) fn set_durable(&self, legs: u32) {
        self.durable.store(legs, Ordering::SeqCst);
        self.send(Down::Durable(legs));
    }

    /// Everything goes at so many percent of the planned feed.
    pub(crate) fn set_feed_override(&self, percent: u8) {
        self.slower.store(100 - percent.min(100), Ordering::SeqCst);
        self.send(Down::FeedOverride(percent));
    }

    /// Percent of the planned feed.
    pub(crate) fn feed_override(&self) -> u8 {
        100 - self.slower.load(Ordering::Relaxed)
    }

    /// A move by hand may go for a moment from now on.
    pub(crate) fn grant(&self) {
        self.grant.give(Instant::now());
        self.send(Down::Grant);
    }

    /// Nobody watches what moves by hand any more.
    pub(crate) fn revoke(&self) {
        self.grant.revoke();
        self.send(Down::Revoke);
    }

    /// The latest place.
    pub(crate) fn glimpse(&self) -> Glimpse {
        self.glimpse.lock().map(|glimpse| *glimpse).unwrap_or_default()
    }

    fn set_glimpse(&self, latest: Glimpse) {
        if let Ok(mut glimpse) = self.glimpse.lock() {
            *glimpse = latest;
        }
    }

    fn set_courier(&self, courier: Option<Sender<Down>>) {
        if let Ok(mut place) = self.courier.lock() {
            *place = courier;
        }
    }

    /// Tells an executor in another process, if there is one. Never waits.
    fn send(&self, frame: Down) {
        if let Ok(courier) = self.courier.lock()
            && let Some(courier) = &*courier
        {
            let _ = courier.send(frame);
        }
    }
}

/// The owner's end.
pub(crate) struct Executor {
    seat: Seat,
    pub(crate) shared: Arc<Shared>,
}

/// Where it sits.
enum Seat {
    Thread(SyncSender<thread::Message>, Option<JoinHandle<()>>),
    Process(process::Process),
}

impl Executor {
    /// A thread of this process, `speed` times as fast as life, on a computer that is so `late` with every step, in ticks, where
    /// that is to be judged. `hear` is called from it once a task.
    pub(crate) fn start(
        machine: &Machine,
        pins: Box<dyn Pins + Send>,
        (speed, late): (f64, Option<u64>),
        shared: Arc<Shared>,
        hear: impl Fn(Heard) + Send + 'static,
    ) -> std::io::Result<Self> {
        let clock = clock::LumpClock::new(speed);
        let report = move |report| hear(Heard::Report(report));
        let (clock, output): (Box<dyn Clock + Send>, _) = match late {
            // Judged as where time is real.
            Some(ticks) => (Box::new(clock::LateClock { clock, ticks }), Output::Card),
            None => (Box::new(clock), machine.output),
        };
        let judged = Machine { output, ..machine.clone() };
        let (ring, thread) = thread::start(&judged, pins, clock, Arc::clone(&shared), || {}, report)?;
        Ok(Self { seat: Seat::Thread(ring, Some(thread)), shared })
    }

    /// A process of its own.
    pub(crate) fn of(process: process::Process, shared: Arc<Shared>) -> Self {
        Self { seat: Seat::Process(process), shared }
    }

    /// Gives it something to move. The ring never fills: one task at a time is given.
    pub(crate) fn give(&self, task: Task) {
        self.send(thread::Message::Task(task));
    }

    /// The count of `axis` is off by `steps`.
    pub(crate) fn correct(&self, axis: usize, steps: i64) {
        self.send(thread::Message::Correct(axis, steps));
    }

    /// Sets the spindle's speed at rest.
    pub(crate) fn spindle(&self, rpm: u32) {
        self.send(thread::Message::Spindle(rpm));
    }

    /// Spindle off at rest. Where nobody is left to do it, everything off at once.
    pub(crate) fn spindle_off(&self) -> Result<(), Diagnostic> {
        match &self.seat {
            Seat::Process(process) if process.is_gone() => process.make_safe(),
            _ => {
                self.spindle(0);
                Ok(())
            }
        }
    }

    /// Switches an output, by its place among the machine's names, at rest.
    pub(crate) fn output(&self, place: u8, on: bool) {
        self.send(thread::Message::Output(place, on));
    }

    /// A new bit of this kind is in the spindles.
    pub(crate) fn bit(&self, bit: Bit) {
        self.send(thread::Message::Bit(bit));
    }

    /// Whether it died: nothing that is given will be reported.
    pub(crate) fn is_gone(&self) -> bool {
        match &self.seat {
            Seat::Thread(_, thread) => thread.as_ref().is_none_or(JoinHandle::is_finished),
            Seat::Process(process) => process.is_gone(),
        }
    }

    /// Comes to rest, makes the outputs safe and lets go of them.
    pub(crate) fn finish(&mut self) {
        match &mut self.seat {
            Seat::Thread(ring, thread) => {
                let _ = ring.send(thread::Message::Finish);
                if let Some(thread) = thread.take() {
                    let _ = thread.join();
                }
            }
            // Once only: by the second time the courier may be another executor's.
            Seat::Process(process) if process.is_open() => {
                self.shared.set_courier(None);
                process.finish();
            }
            Seat::Process(_) => {}
        }
    }

    fn send(&self, message: thread::Message) {
        match &self.seat {
            Seat::Thread(ring, _) => drop(ring.send(message)),
            Seat::Process(_) => self.shared.send(Down::Order(message)),
        }
    }
}

impl Drop for Executor {
    fn drop(&mut self) {
        self.finish();
    }
}
