//! Messages about a job (its pre-flight, its end, and what can be resumed), and about the queue and the
//! outputs of the Lab.

use crate::control::Ending;
use crate::diagnostic::Diagnostic;
use crate::queue::RowResult;
use serde::{Deserialize, Serialize};

/// Result of the pre-flight: whether the job may start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ArmedJob {
    /// SHA-256 of the program's bytes.
    pub job: String,
    /// SHA-256 of its step stream as the bridge computed it.
    pub stream_digest: String,
    /// The toolpath depth follows the saved height map, and `stream_digest` covers the adjusted steps.
    #[serde(default)]
    pub levelled: bool,
    /// Pre-flight, row by row.
    pub checks: Vec<PreflightRow>,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PreflightRow {
    /// Subject and result; the code names the row.
    pub finding: Diagnostic,
    pub verdict: RowVerdict,
}

/// Effect of a pre-flight row on Start.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RowVerdict {
    Pass,
    /// For information, about a risk that Annulus can't check. The user need not tick it.
    Note,
    /// The user must tick it.
    Warn,
    Fail,
}

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct JobEnd {
    pub job: String,
    pub ending: Ending,
    pub holes_done: u32,
    #[serde(default)]
    pub toolpaths_done: u32,
}

/// A job that was interrupted and can be resumed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct InterruptedJob {
    pub job: String,
    pub name: String,
    /// Leg from which to resume.
    pub next_leg: u32,
    /// Holes that are certainly complete.
    pub holes_done: u32,
    pub holes_total: u32,
    /// Toolpaths that are certainly complete.
    #[serde(default)]
    pub toolpaths_done: u32,
    #[serde(default)]
    pub toolpaths_total: u32,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct QueueStatus {
    pub phase: QueuePhase,
    /// Current or next row, from 0; none at the end or without a queue.
    pub row: Option<u32>,
    /// Rows executed; a repeated row counts each time.
    pub passed: u32,
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
    Done,
    Stopped,
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
