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
//! Comes in: a machine and pins. Goes out: a seat for the owner ([`annulus_drill`] says what it is ordered). Does not know jobs.

pub(crate) mod child;
pub(crate) mod clock;
mod frames;
pub(crate) mod process;
pub(crate) mod realtime;
mod record;
mod thread;

use crate::spindle;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{Machine, Output};
use annulus_core::pins::{Clock, Pins};
use annulus_drill::executor::{Instruction, Seat, Shared};
use std::sync::Arc;
use std::sync::mpsc::SyncSender;
use std::thread::JoinHandle;

pub(crate) use annulus_drill::executor::Heard;

/// A thread of this process. The ring never fills: one task at a time is given.
struct Thread(SyncSender<Instruction>, Option<JoinHandle<()>>);

/// A thread of this process, `speed` times as fast as life, on a computer that is so `late` with every step, in ticks, where
/// that is to be judged. `hear` is called from it once a task.
pub(crate) fn start(
    machine: &Machine,
    pins: Box<dyn Pins + Send>,
    (speed, late): (f64, Option<u64>),
    shared: &Arc<Shared>,
    hear: impl Fn(Heard) + Send + 'static,
) -> Result<Box<dyn Seat>, Diagnostic> {
    if machine.converter.is_there() && speed != 1.0 {
        return Err(Diagnostic::error("spindle.in_life").with("speed", speed));
    }
    let told = Arc::clone(shared);
    let pins = spindle::with(machine, pins, move |state| told.set_spindle(state))?;
    let clock = clock::LumpClock::new(speed);
    let report = move |report| hear(Heard::Report(report));
    let (clock, output): (Box<dyn Clock + Send>, _) = match late {
        // Judged as where time is real.
        Some(ticks) => (Box::new(clock::LateClock { clock, ticks }), Output::Card),
        None => (Box::new(clock), machine.output),
    };
    let judged = Machine { output, ..machine.clone() };
    let (ring, thread) = thread::start(&judged, pins, clock, Arc::clone(shared), || {}, report)
        .map_err(|error| Diagnostic::error("control.no_thread").with("reason", error))?;
    Ok(Box::new(Thread(ring, Some(thread))))
}

impl Seat for Thread {
    fn order(&self, message: Instruction) {
        let _ = self.0.send(message);
    }

    fn is_gone(&self) -> bool {
        self.1.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// What it had is the virtual drill: nothing is left on.
    fn make_safe(&self) -> Result<(), Diagnostic> {
        Ok(())
    }

    fn finish(&mut self) {
        let _ = self.0.send(Instruction::Finish);
        if let Some(thread) = self.1.take() {
            let _ = thread.join();
        }
    }
}
