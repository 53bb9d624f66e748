//! What the Lab edits, as plain data: phase tables, dynamics, experiments, work commands, and one history of it all.
//!
//! ```text
//! (LabEdits, edit) ─▶ LabEdits ─▶ History ─▶ screens/lab
//! ```
//!
//! Comes in: edits. Goes out: the next state. Knows no browser and moves no machine.

pub mod cycle;
pub mod edits;
pub mod io;
pub mod log;
pub mod motion;
pub mod panel;
pub mod phases;
pub mod queue;
pub mod rehearsal;
pub mod servo;
pub mod trial;
pub mod undo;

pub use edits::LabEdits;
pub use panel::LabPanel;
pub use undo::LabHistory;
