//! A controller of the GRBL family and who attends it: shared by the bridge (a thread with a serial port) and the page (a worker that
//! is handed the bytes of Web Serial).
//!
//! ```text
//! page ── text ──▶ line ── asks ──▶ station ── Event ──▶ attended (the engine of core) ── bytes ──▶ port
//!   ◀── frames ────┘                   │  order: the program in its words, section by section and leg by leg
//!                                      └─ ledger: what is done, in two halves, durable before it is told
//! ```
//!
//! Comes in: frames of `wire`, programs, bytes of a port, the time. Goes out: frames, bytes. Does not know browsers, ports or threads.

mod asks;
mod attended;
mod before;
mod checked;
mod expected;
mod given;
mod host;
mod job_tools;
mod ledger;
mod lengths;
mod level;
mod order;
mod station;
mod status;
mod surface;
#[cfg(test)]
mod tests;
mod tools;

pub use attended::{Attended, AttendedJob, ControllerGlimpse, Due, Told};
pub use expected::unlike_mill;
pub use given::JobGiven;
pub use host::{HELD_AFTER, Host, HostNews};
pub use job_tools::{JobTools, SectionWear};
pub use station::Station;
