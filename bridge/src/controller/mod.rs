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
mod owner;
mod port;

pub(crate) use owner::Owner;
pub(crate) use port::{list, open};
