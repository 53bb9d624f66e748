//! Messages about the Lab's queue and outputs.

use crate::diagnostic::Diagnostic;
use crate::queue::RowResult;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct QueueStatus {
    pub phase: QueuePhase,
    /// Current or next row, from 0; none at the end or without a queue.
    pub row: Option<u32>,
    /// Rows executed; a repeated row counts each time.
    pub passed: u32,
    /// Rows to execute in total, with repetitions.
    pub total: u32,
    /// Results that changed since the last status. If `whole`, the results of all rows that started.
    pub results: Vec<(u32, RowResult)>,
    /// `results` is complete: rows without a result are still waiting.
    pub whole: bool,
    /// Reason for failure; its location holds the row.
    pub why: Option<Diagnostic>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum QueuePhase {
    #[default]
    None,
    /// Checked; no row has run yet.
    Ready,
    Running,
    Held,
    /// The last row is complete.
    Done,
    Stopped,
    /// A row failed or was refused.
    Failed,
}

/// The outputs and their lock.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Outputs {
    /// Names: `spindle`, then those in the machine's settings, in order.
    pub names: Vec<String>,
    /// Bit set of the outputs that are on, in the order of `names`.
    pub on: u32,
    /// Seconds until the outputs lock; none while they are locked.
    pub left_s: Option<f64>,
}
