//! Message about a job in the check mode of a controller.

use crate::diagnostic::Diagnostic;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CheckModeReport {
    /// SHA-256 of the program's bytes.
    pub job: String,
    /// Lines read.
    pub done: u32,
    /// Lines in total.
    pub of: u32,
    pub goes: bool,
    /// Lines refused; `lines` holds only the first of them.
    pub refused: u32,
    /// The first refused lines, each with its location in the G-code of the job.
    pub lines: Vec<Diagnostic>,
    /// Why the check ended early.
    pub why: Option<Diagnostic>,
}
