//! A controller at a serial port. The logic is in `host/src/grbl`; a thread here owns the port.
//!
//! ```text
//!  pages ─────────▶ hosted (a station in a thread) ─ bytes ──▶ port
//!  cli ─▶ client ─▶           │
//!                           ledger: completed sections, durable before they are reported
//! ```

mod client;
mod clock;
mod files;
mod hosted;
mod speed;

pub(crate) use crate::serial::list;
use annulus_core::error;
pub(crate) use client::Client;
pub(crate) use files::DiskFiles;
pub(crate) use hosted::{GrblHost, Site};

use crate::serial::{self, Port};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::grbl::{BITS_PER_S, ResetOnOpen};

/// Progress, tool wear and the last job of the controller, on disk.
pub(crate) type Ledger = annulus_host::grbl::Ledger<DiskFiles>;

/// Opens the port `name` at `bits_per_s`, or finds the speed at which the controller responds, and returns
/// it. `silent` is called for every speed without a response. `reset` decides whether opening may reset the
/// controller.
fn open(
    name: &str,
    bits_per_s: Option<u32>,
    reset: ResetOnOpen,
    silent: impl Fn(u32),
) -> Result<(Port, u32), Diagnostic> {
    let unopened = |error| error!("grbl.port_unopened", port = name, reason = error);
    let open = match reset {
        ResetOnOpen::Usual => serial::open,
        ResetOnOpen::Never => serial::open_sparing,
    };
    if let Some(bits_per_s) = bits_per_s {
        return Ok((open(name, bits_per_s).map_err(unopened)?, bits_per_s));
    }
    let mut port = open(name, BITS_PER_S[0]).map_err(unopened)?;
    let lost = |error| error!("grbl.port_lost", port = name, reason = error);
    let found = speed::find(&mut port, silent).map_err(lost)?;
    found.map(|bits_per_s| (port, bits_per_s)).ok_or_else(|| error!("grbl.no_answer"))
}
