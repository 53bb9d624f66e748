//! What the bridge tells about the Lab's queue and outputs.
//!
//! Goes out: plain data. Does not know how a queue runs.

use crate::diagnostic::Diagnostic;
use crate::queue::RowResult;
use serde::{Deserialize, Serialize};

/// How a queue stands.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct QueueStatus {
    /// What it is doing.
    pub phase: QueuePhase,
    /// The row in work or next, from 0; none at the end or without a queue.
    pub row: Option<u32>,
    /// Rows passed, each as often as it was done.
    pub passed: u32,
    /// Rows to be passed in all.
    pub total: u32,
    /// Results of rows that changed since the status before, or of all rows that were begun.
    pub results: Vec<(u32, RowResult)>,
    /// These are all results: rows that are not among them wait.
    pub whole: bool,
    /// Why it failed; its place has the row.
    pub why: Option<Diagnostic>,
}

/// What a queue is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum QueuePhase {
    /// There is none.
    #[default]
    None,
    /// Checked; nothing was done yet.
    Ready,
    /// Rows are being done.
    Running,
    /// Between two rows.
    Held,
    /// The last row is done.
    Done,
    /// STOP.
    Stopped,
    /// A row failed or was refused.
    Failed,
}

/// The outputs and their lock.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outputs {
    /// Names: `spindle`, then those of the machine's settings in the order of their places.
    pub names: Vec<String>,
    /// Which are on, one bit each in the order of `names`.
    pub on: u32,
    /// Seconds until they lock; none while they are locked.
    pub left_s: Option<f64>,
}
