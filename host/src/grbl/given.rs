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
    pub spin_up_s: Option<f64>,
    /// How far down to probe for the board after each tool change, mm.
    pub probe_mm: Option<f64>,
    /// Thickness of the touch plate, mm.
    pub plate_mm: Option<f64>,
    pub same_length: bool,
    pub found: Vec<FoundHole>,
    pub changer: Option<ToolMacro>,
    /// Whether opening the port may reset the controller.
    pub reset_on_open: Option<ResetOnOpen>,
    pub mill: Option<String>,
}
