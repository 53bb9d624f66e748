//! The job as the user edits it: a list of operations with their values, and undo.
//!
//! ```text
//! edit ─▶ History<Work> ─▶ worker: plan, prove, time ─▶ toolpaths, problems, seconds
//! ```

pub mod edit;
pub mod template;
