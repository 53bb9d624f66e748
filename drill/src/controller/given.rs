//! What a job was given by whoever began it, apart from where its zero is and how its tools are measured on a tool setter: kept with what is
//! done of it, so that it is taken up as it was begun.
//!
//! Comes in: plain data. Goes out: the same. Does not know flags, nor who sends what.

use annulus_core::align::FoundHole;
use annulus_core::controller::{ResetOnOpen, ToolMacro};
use serde::{Deserialize, Serialize};

/// What of it changes what is sent; nothing where nobody said anything.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct JobGiven {
    /// Seconds that the spindle takes to come up to speed.
    pub spin_up_s: Option<f64>,
    /// How far down the probe looks for the board after each change, mm.
    pub probe_mm: Option<f64>,
    /// Thickness of the plate under the probe, mm.
    pub plate_mm: Option<f64>,
    /// All bits stand out equally far.
    pub same_length: bool,
    /// Where its alignment holes were found.
    pub found: Vec<FoundHole>,
    /// The lines by which the machine changes tools itself.
    pub changer: Option<ToolMacro>,
    /// What opening the port may do to the board.
    pub reset_on_open: Option<ResetOnOpen>,
    /// The name of the mill that the controller was said to be.
    pub mill: Option<String>,
}
