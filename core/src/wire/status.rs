//! How things stand with the machine, as the bridge tells it; and what the virtual drill found in its board.
//!
//! Goes out: messages. Does not know who makes them.

use crate::control::{Alarm, State, Trust};
use crate::controller::SetterStep;
use crate::diagnostic::Diagnostic;
use crate::job::Input;
use crate::machine::ToolWear;
use crate::pins::{ShortTouches, SpindleState};
use crate::steps::{Stage, Steps};
use serde::{Deserialize, Serialize};

/// A place where a motor of the virtual drill lost steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SlipReport {
    /// 0 X, 1 Y, 2 Z.
    pub axis: u8,
    /// Where the axis really was, machine mm.
    pub place_mm: f64,
    /// Steps lost there.
    pub lost: u64,
    /// Why: a key of `page.slip`.
    pub cause: String,
}

/// How a board differs from its program, by the virtual drill's own record. All zero where it does not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DrilledReport {
    /// Holes that are not there.
    pub missing: u32,
    /// Holes made again.
    pub doubled: u32,
    /// Holes where none should be.
    pub shifted: u32,
    /// Bits that broke.
    pub broken: u32,
    /// Steps that motors lost.
    pub slipped_steps: u64,
}

/// Legs of the last run whose holes are not in the board, by the virtual drill's own record.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MissingReport {
    /// SHA-256 of the program's bytes.
    pub job: String,
    /// The first leg and the one behind the last, run by run.
    pub legs: Vec<(u32, u32)>,
}

/// The firmware of a USB step adapter that is not the one of this program (N18).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct OtherFirmware {
    /// What the adapter has: CRC-32C of its sources.
    pub found: u32,
    /// What belongs to this program.
    pub wanted: u32,
}

impl OtherFirmware {
    /// The same as a sentence.
    pub fn warning(self) -> Diagnostic {
        let number = |firmware: u32| format!("{firmware:08x}");
        let why = Diagnostic::warning("firmware.other").with("found", number(self.found));
        why.with("wanted", number(self.wanted))
    }
}

/// What became of the tools of the rack (C3).
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ToolsReport {
    /// What each has done since it was new; one that is not here has done nothing.
    pub wear: Vec<ToolWear>,
    /// Number of the tool that the job in work has in the spindle.
    pub in_spindle: Option<u32>,
    /// Number of the one that is asked for; a new one of its kind where the life of that one is over.
    pub wanted: Option<u32>,
}

/// How things stand with the machine (A10).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// What it is doing.
    pub state: State,
    /// How well the position is known.
    pub trust: Trust,
    /// Machine position in steps.
    pub steps: Steps,
    /// Machine position in mm: X, Y, Z.
    pub machine_mm: [f64; 3],
    /// Work position in mm: X, Y from the work zero, Z from the board's surface.
    pub work_mm: [f64; 3],
    /// Where the work zero is, machine mm; none before it was set.
    pub zero_mm: Option<[f64; 2]>,
    /// Where the head is going in the plane, work mm.
    pub target_mm: Option<[f64; 2]>,
    /// Lowest point of the stroke, work mm.
    pub lower_dead_point_mm: Option<f64>,
    /// SHA-256 of the job in work.
    pub job: Option<String>,
    /// Its name.
    pub job_name: Option<String>,
    /// Leg in work.
    pub leg: Option<u32>,
    /// Hole in work (index into the board's holes).
    pub hole: Option<u32>,
    /// Holes drilled.
    pub holes_done: u32,
    /// Holes in all.
    pub holes_total: u32,
    /// Toolpath in work (index into the job's toolpaths).
    #[serde(default)]
    pub toolpath: Option<u32>,
    /// Toolpaths milled.
    #[serde(default)]
    pub toolpaths_done: u32,
    /// Toolpaths in all.
    #[serde(default)]
    pub toolpaths_total: u32,
    /// What is being done.
    pub stage: Option<Stage>,
    /// What of the measurement of a tool is being done, in the middle of its change.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measuring: Option<SetterStep>,
    /// The line of the tool changer that is in work, from 1, and how many there are.
    #[serde(default)]
    pub changing: Option<[u32; 2]>,
    /// The work command, by its name.
    pub command: Option<String>,
    /// Bit in the spindle: index into the program's bits.
    pub bit: Option<u32>,
    /// Its diameter in mm.
    pub bit_mm: Option<f64>,
    /// Spindle speed commanded, rpm.
    pub spindle_rpm: u32,
    /// What the spindle tells of itself.
    #[serde(default)]
    pub spindle: SpindleState,
    /// Percent of the planned feed.
    #[serde(default = "full_override")]
    pub feed_override_percent: u8,
    /// Percent of the programmed spindle speed, where the machine has such an override.
    #[serde(default)]
    pub spindle_override_percent: Option<u8>,
    /// Percent of the fastest in moves without cutting, where the machine has such an override.
    #[serde(default)]
    pub rapid_override_percent: Option<u8>,
    /// Inputs, one bit each ([`crate::job::Input::bit`]).
    pub inputs: u32,
    /// Touches of each of [`Input::OF_AXES`] that were shorter than its filter; none where nothing is filtered and counted.
    #[serde(default)]
    pub touches: Option<[ShortTouches; Input::OF_AXES.len()]>,
    /// The firmware of the USB step adapter, where it is another one than belongs to this program.
    #[serde(default)]
    pub other_firmware: Option<OtherFirmware>,
    /// Phase bytes put out to X, Y, Z.
    pub phases: [u8; 3],
    /// Where the virtual drill lost steps, since it was built.
    #[serde(default)]
    pub slips: Vec<SlipReport>,
    /// How the board of the last run differs from its program, by the virtual drill's own record; none before one ended.
    #[serde(default)]
    pub drilled: Option<DrilledReport>,
    /// What of it is missing, where that can be said.
    #[serde(default)]
    pub missing: Option<MissingReport>,
    /// Holes that the board of the last run had already when the job was taken up, and that were drilled again: by their order
    /// of drilling, the first is 1. By design one at most, and no fault.
    #[serde(default)]
    pub drilled_twice: Vec<u32>,
    /// Time since Start, s.
    pub elapsed_s: f64,
    /// Time left, s.
    pub left_s: f64,
    /// Share of the job's own time that is behind it, 0 to 1, by whole legs: toolpaths count as holes do.
    #[serde(default)]
    pub done_share: f64,
    /// What went wrong, until acknowledged.
    pub alarm: Option<Alarm>,
}

fn full_override() -> u8 {
    100
}
