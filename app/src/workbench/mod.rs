//! The job as a person makes it: operations in order, each with its values; undo over all of it.
//!
//! ```text
//! edit ─▶ History<Work> ─▶ worker: plan, prove, time ─▶ ways, findings, seconds
//! ```
//!
//! Comes in: edits. Goes out: the job now. Knows no screens.

#[cfg(target_arch = "wasm32")]
mod bench;
pub mod edit;
pub mod template;

#[cfg(target_arch = "wasm32")]
pub use bench::{Bench, begin, bench};
