//! The executor owns pins and clock and plays tasks. Either a thread of the bridge, or a separate process.
//!
//! ```text
//! owner ── ring of orders ──▶ thread ──▶ virtual drill          owner ── frames ──▶ process ─ thread ──▶ I/O card
//!   ▲                           │  ▲                              ▲                   │         │
//!   │                           │  └── stop up to task n,         │                   │   pipe ends: ramp down,
//!   ├── reports: every task,    │      legs durable up to n       ├── the same ◀──────┘   forcing and spindle off
//!   │   once, when stopped      │                                 └── position, 50 per second
//!   └── position: lossy, never waited for
//! ```
//!
//! Owner and process watch each other. The process stops after 300 ms of silence of the owner. If the
//! process died or was silent for 500 ms, the owner switches the outputs off itself.

pub(crate) mod child;
pub(crate) mod clock;
mod frames;
pub(crate) mod process;
pub(crate) mod realtime;
mod record;
#[cfg(unix)]
mod rehearsal_clock;
mod thread;

use crate::spindle;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::machine::{Machine, Output};
use annulus_core::pins::{Clock, Pins};
use annulus_host::executor::{Instruction, Seat, Shared};
use std::sync::Arc;
use std::sync::mpsc::SyncSender;
use std::thread::JoinHandle;
use std::time::Duration;

pub(crate) use annulus_host::executor::Heard;

/// How long the other side may be silent; `usual` on a real machine. A simulated port whose simulator keeps
/// the time may run on a busy computer and gets longer.
fn patience(machine: &Machine, usual: Duration) -> Duration {
    #[cfg(unix)]
    if rehearsal_clock::is_requested(machine) {
        return usual * 5;
    }
    let _ = machine;
    usual
}

/// A thread of this process. Its channel never fills: only one task is pending.
struct Thread(SyncSender<Instruction>, Option<JoinHandle<()>>);

/// Starts a thread of this process at the time scale `speed`. `late` simulates a host that is late by this
/// many ticks at every step. `hear` is called from the thread, once per task.
pub(crate) fn start(
    machine: &Machine,
    pins: Box<dyn Pins + Send>,
    (speed, late): (f64, Option<u64>),
    shared: &Arc<Shared>,
    hear: impl Fn(Heard) + Send + 'static,
) -> Result<Box<dyn Seat>, Diagnostic> {
    if machine.converter.is_there() && speed != 1.0 {
        return Err(error!("spindle.in_life", speed = speed));
    }
    let told = Arc::clone(shared);
    let pins =
        spindle::with(machine, pins, move |state| told.change_glimpse(|glimpse| glimpse.spindle = state))?;
    let clock = clock::LumpClock::new(speed);
    let report = move |report| hear(Heard::Report(report));
    let (clock, output): (Box<dyn Clock + Send>, _) = match late {
        // Judge the lateness as on real hardware.
        Some(ticks) => (Box::new(clock::LateClock { clock, ticks }), Output::Card),
        None => (Box::new(clock), machine.output),
    };
    let judged = Machine { output, ..machine.clone() };
    let (ring, thread) = thread::start(&judged, pins, clock, Arc::clone(shared), || {}, report)
        .map_err(|error| error!("control.no_thread", reason = error))?;
    Ok(Box::new(Thread(ring, Some(thread))))
}

impl Seat for Thread {
    fn order(&self, message: Instruction) {
        let _ = self.0.send(message);
    }

    fn is_gone(&self) -> bool {
        self.1.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Its pins are those of the virtual drill: nothing stays on.
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
