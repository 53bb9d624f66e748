//! Options of a job that change the lines sent, saved with its progress so that it resumes with the same
//! options.

use annulus_core::align::FoundHole;
use annulus_core::grbl::{ResetOnOpen, ToolMacro};
use serde::{Deserialize, Serialize};

/// The options of a job; each is empty if the user gave none. Work zero and tool setter are saved
/// separately.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct JobGiven {
    /// Seconds that the spindle needs to reach its speed.
    pub spin_up_s: Option<f64>,
    /// How far down to probe for the board after each tool change, mm.
    pub probe_mm: Option<f64>,
    /// Thickness of the touch plate, mm.
    pub plate_mm: Option<f64>,
    /// All tools protrude equally far.
    pub same_length: bool,
    /// Measured positions of its alignment holes.
    pub found: Vec<FoundHole>,
    /// The tool-change macro.
    pub changer: Option<ToolMacro>,
    /// Whether opening the port may reset the controller.
    pub reset_on_open: Option<ResetOnOpen>,
    /// The mill profile that the user chose.
    pub mill: Option<String>,
}
