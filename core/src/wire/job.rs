//! Messages about a job: its pre-flight, its end, and what can be resumed.

use crate::control::Ending;
use crate::diagnostic::Diagnostic;
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

/// One row of the pre-flight.
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
    /// Something that Annulus can't check; there is nothing to tick.
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
