//! What comes of a job that a controller reads in its check mode.
//!
//! Goes out: messages. Does not know who makes them.

use crate::diagnostic::Diagnostic;
use serde::{Deserialize, Serialize};

/// How far a job was read without a move, and what of it was refused.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CheckModeReport {
    /// SHA-256 of the program's bytes.
    pub job: String,
    /// Lines that were read.
    pub done: u32,
    /// And how many there are.
    pub of: u32,
    /// It goes on.
    pub goes: bool,
    /// Lines that were refused; the first of them in `lines`.
    pub refused: u32,
    /// The first of the lines that were refused, each with its place in the controller's words of the job.
    pub lines: Vec<Diagnostic>,
    /// Why it did not come to its end.
    pub why: Option<Diagnostic>,
}
