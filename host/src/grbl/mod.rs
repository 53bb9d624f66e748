//! The host of a GRBL controller. The bridge runs it in a thread with a serial port, the page in a worker
//! that receives the bytes of Web Serial.
//!
//! ```text
//! pages ── Message ──▶ station ── Event ──▶ attended (the engine of core) ── bytes ──▶ port
//!   ◀──── Tell ────────┘│   │  order: the program as G-code, section by section and leg by leg
//! command ─ EngineAsk ─▶┤   └─ ledger: progress in two halves, durable before it is reported
//!   ◀──── Told ─────────┘
//! ```

mod asks;
mod attended;
mod before;
mod checked;
mod command;
mod expected;
mod given;
mod host;
mod job_tools;
mod ledger;
mod lengths;
mod level;
mod order;
mod page;
mod station;
mod status;
mod surface;
#[cfg(test)]
mod tests;
mod tools;

pub use asks::unfit;
pub use attended::{Attended, AttendedJob, ControllerGlimpse, Due, Told};
pub use expected::unlike_mill;
pub use given::JobGiven;
pub use job_tools::{JobTools, SectionWear};
pub use ledger::{Ledger, first_entry};
pub use lengths::reset_on_open;
pub use order::{Draft, Written, gcode_of};
pub use page::PageStation;
pub use station::{Named, Setup, Station};
