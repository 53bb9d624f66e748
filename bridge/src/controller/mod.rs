//! A controller at a serial port: what attends it (`drill/src/controller`) with a thread that owns the port.
//!
//! ```text
//!  cli ── asks ──▶ owner (a thread) ── bytes ──▶ port
//!      ◀─ told ──          │
//!                        ledger: which sections are done, on the disk before anybody is told
//! ```
//!
//! Comes in: asks. Goes out: what the engine tells, with a glimpse of where it is. Does not know what a program says.

pub(crate) mod ledger;
pub(crate) mod maps;
mod owner;

pub(crate) use crate::serial::list;
pub(crate) use owner::Owner;

use crate::serial::{self, Port};
use annulus_core::diagnostic::Diagnostic;

/// Opens the port called `name`.
pub(crate) fn open(name: &str, baud: u32) -> Result<Port, Diagnostic> {
    serial::open(name, baud)
        .map_err(|error| Diagnostic::error("grbl.port_unopened").with("port", name).with("reason", error))
}
