//! What the Lab edits, as plain data: phase tables, dynamics, experiments, work commands, and one history of it all.
//!
//! ```text
//! (Bench, edit) ─▶ Bench ─▶ History ─▶ screens/lab
//! ```
//!
//! Comes in: edits. Goes out: the next state. Knows no browser and moves no machine.

pub mod bench;
pub mod cycle;
pub mod io;
pub mod log;
pub mod motion;
pub mod phases;
pub mod queue;
pub mod rehearsal;
pub mod servo;
pub mod sheet;
pub mod trial;
pub mod undo;

pub use bench::Bench;
pub use sheet::Sheet;
pub use undo::History;
