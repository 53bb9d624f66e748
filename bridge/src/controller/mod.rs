//! A controller at a serial port: what attends it (`drill/src/controller`) with a thread that owns the port.
//!
//! ```text
//!  cli ── asks ──▶ owner (a thread) ── bytes ──▶ port
//!      ◀─ told ──          │
//!                        ledger: which sections are done, on the disk before anybody is told
//! ```
//!
//! Comes in: asks. Goes out: what the engine tells, with a glimpse of where it is. Does not know what a program says.

mod clock;
pub(crate) mod ledger;
pub(crate) mod maps;
mod owner;
mod speed;

pub(crate) use crate::serial::list;
pub(crate) use owner::Owner;

use crate::serial::{self, Port};
use annulus_core::controller::{BITS_PER_S, ResetOnOpen};
use annulus_core::diagnostic::Diagnostic;

/// Opens the port called `name` at so many bits in a second, or at the speed at which somebody answers; and says which. `silent` hears of
/// those at which nobody does. What that may do to the board `reset` says.
pub(crate) fn open(
    name: &str,
    bits_per_s: Option<u32>,
    reset: ResetOnOpen,
    silent: impl Fn(u32),
) -> Result<(Port, u32), Diagnostic> {
    let unopened = |error| Diagnostic::error("grbl.port_unopened").with("port", name).with("reason", error);
    let open = match reset {
        ResetOnOpen::Usual => serial::open,
        ResetOnOpen::Never => serial::open_sparing,
    };
    if let Some(bits_per_s) = bits_per_s {
        return Ok((open(name, bits_per_s).map_err(unopened)?, bits_per_s));
    }
    let mut port = open(name, BITS_PER_S[0]).map_err(unopened)?;
    let lost = |error| Diagnostic::error("grbl.port_lost").with("port", name).with("reason", error);
    let found = speed::find(&mut port, silent).map_err(lost)?;
    found.map(|bits_per_s| (port, bits_per_s)).ok_or_else(|| Diagnostic::error("grbl.no_answer"))
}
