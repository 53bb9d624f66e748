//! The Lab as plain data: phase tables, dynamics, experiments, work commands, and one undo history for all.
//!
//! ```text
//! (LabEdits, edit) ─▶ LabEdits ─▶ History ─▶ screens/lab
//! ```

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
