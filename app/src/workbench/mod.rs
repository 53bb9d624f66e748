//! The job as a person makes it: operations in order, each with its values; undo over all of it.
//!
//! ```text
//! edit ─▶ History<Work> ─▶ worker: plan, prove, time ─▶ toolpaths, findings, seconds
//! ```
//!
//! Comes in: edits. Goes out: the job now. Knows no screens.

pub mod edit;
pub mod template;
