//! The drill: one owner of machine, job, journal and pins. Everything that can move goes through here.
//!
//! ```text
//! server, `run` ── ask ──▶ owner thread ── legs ──▶ executor thread ── steps ──▶ pins (virtual drill)
//!       ▲                  │  ▲   control: (session, event) → (session, actions)     │
//!       └──── watch ───────┘  └── leg done, stopped, alarm ◀─────────────────────────┘
//!                          └── legs begun and done ──▶ journal thread ── durable ──▶ lets the next stroke start
//! ```
//!
//! Comes in: asks and uploaded programs. Goes out: tells. Does not know sockets, sessions or leases.

use crate::cli::Refusal;
use annulus_core::machine::Machine;
use annulus_core::remark::Remark;
use annulus_core::wire::{Ask, Tell};
use std::path::Path;
use tokio::sync::broadcast;

/// A handle on the drill. Clones speak to the same drill; it shuts down with [`Drill::shutdown`].
#[derive(Clone)]
pub(crate) struct Drill {}

impl Drill {
    /// Opens the drill whose jobs, journal and drilled-board record live in `folder`. Nothing moves. `speed` is
    /// how many times faster than life the virtual drill runs.
    pub(crate) fn open(folder: &Path, machine: Machine, speed: f64) -> Result<Self, Refusal> {
        todo!("{folder:?} {machine:?} {speed}")
    }

    /// Keeps the program `bytes` under `key`, its SHA-256, if they are a program.
    pub(crate) fn upload(&self, key: &str, bytes: &[u8]) -> Result<(), Remark> {
        todo!("{key} {bytes:?}")
    }

    /// The bytes kept under `key`.
    pub(crate) fn job(&self, key: &str) -> Option<Vec<u8>> {
        todo!("{key}")
    }

    /// Does what is asked, or says why not. The answers are for the asker alone; changes that everybody should
    /// see come through [`Drill::watch`]. `Arm` takes as long as planning does: call it where waiting is allowed.
    /// Who may ask is the caller's business.
    pub(crate) fn ask(&self, ask: Ask) -> Result<Vec<Tell>, Remark> {
        todo!("{ask:?}")
    }

    /// Everything that happens: `Status` 10 times a second and after every change, `Armed`, `Ended`,
    /// `Interrupted`, `Machine`. A slow listener misses the oldest.
    pub(crate) fn watch(&self) -> broadcast::Receiver<Tell> {
        todo!()
    }

    /// What a newcomer must know: `Machine`, `Status`, and `Armed` and `Interrupted` where there are.
    pub(crate) fn greeting(&self) -> Vec<Tell> {
        todo!()
    }

    /// Comes to rest in a controlled way, makes the journal durable and ends the threads.
    pub(crate) fn shutdown(&self) {
        todo!()
    }
}
