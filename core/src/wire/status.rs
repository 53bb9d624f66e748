//! Messages about the state of the machine, its magazine and height map, the check mode, and what the
//! virtual drill recorded about its board.

use crate::control::{Alarm, State, Trust};
use crate::diagnostic::Diagnostic;
use crate::grbl::{ResetOnOpen, SetterStep, ToolLengths};
use crate::job::Input;
use crate::level::ProbeGrid;
use crate::machine::ToolWear;
use crate::magazine::{ChangeStep, ToolStock};
use crate::pins::{ShortTouches, SpindleState};
use crate::steps::{Stage, Steps};
use crate::units::Length;
use crate::warning;
use serde::{Deserialize, Serialize};

/// Which page has control.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Control {
    pub yours: bool,
    pub taken: bool,
    pub viewers: u32,
}

/// The machine is a GRBL-family controller, with these numbered settings. Controllers plan their own motion, so
/// their [`super::ArmedJob`] has no digest.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ControllerReport {
    /// `GRBL`, `grblHAL` or `FluidNC`.
    pub flavour: String,
    pub version: String,
    /// Settings by number, as `$$` lists them.
    pub values: Vec<(u16, f64)>,
    /// Machine model that the user chose ([`crate::machine::mill`]).
    #[serde(default)]
    pub mill: Option<String>,
    #[serde(default)]
    pub lengths: ToolLengths,
    /// Whether opening the port may reset the controller.
    #[serde(default)]
    pub reset_on_open: ResetOnOpen,
    /// G-code lines of the automatic tool changer; empty if the user changes tools.
    #[serde(default)]
    pub changer: Vec<String>,
}

impl ControllerReport {
    /// True if homing is on (`$22`).
    pub fn homes(&self) -> bool {
        self.values.iter().any(|(number, value)| *number == 22 && *value != 0.0)
    }
}

/// One loss of steps of a motor of the virtual drill.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SlipReport {
    /// 0 X, 1 Y, 2 Z.
    pub axis: u8,
    pub place_mm: f64,
    pub lost: u64,
    /// Cause: a key of `page.slip`.
    pub cause: String,
}

/// Differences between the board and its program, as the virtual drill recorded them. All zero if there are
/// none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct DrilledReport {
    pub missing: u32,
    pub doubled: u32,
    /// Holes at positions where the program has none.
    pub shifted: u32,
    pub broken: u32,
    /// Steps that motors lost.
    pub slipped_steps: u64,
}

/// Legs of the last run without a hole in the board, as the virtual drill recorded them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MissingReport {
    /// SHA-256 of the program's bytes.
    pub job: String,
    /// Half-open ranges of legs: first leg, and one past the last.
    pub legs: Vec<(u32, u32)>,
}

/// The firmware of the USB step adapter doesn't belong to this version of Annulus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct OtherFirmware {
    /// Firmware in the adapter: CRC-32C of its sources.
    pub found: u32,
    /// Firmware that belongs to this version.
    pub wanted: u32,
}

impl OtherFirmware {
    pub fn warning(self) -> Diagnostic {
        let number = |firmware: u32| format!("{firmware:08x}");
        let why = warning!("firmware.other", found = number(self.found), ..);
        why.with("wanted", number(self.wanted))
    }
}

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ToolsReport {
    /// Wear of each tool since it was new; a tool without an entry is unused.
    pub wear: Vec<ToolWear>,
    /// Number of the tool that the running job has in the spindle.
    pub in_spindle: Option<u32>,
    /// Number of the requested tool. If its life is over, this is another tool of its kind.
    pub wanted: Option<u32>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LengthKnown {
    /// Unknown: the tool must not cut.
    No,
    /// Zero of Z was set with this tool, or the user declared it as long as the previous tool.
    Measured,
    Equal,
}

/// State of a manual tool change on a machine that Annulus drives itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChangeReport {
    /// Requested tool: index into the program's bits.
    pub bit: u32,
    pub is_up: bool,
    /// X and Y are at the change position.
    pub is_at_place: bool,
    pub length: LengthKnown,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Status {
    pub state: State,
    pub trust: Trust,
    /// Machine position in steps.
    pub steps: Steps,
    /// Machine position in mm: X, Y, Z.
    pub machine_mm: [f64; 3],
    /// Work position in mm: X, Y from the work zero, Z from the board's surface.
    pub work_mm: [f64; 3],
    /// Position of the work zero, machine mm; none if it isn't set.
    pub zero_mm: Option<[f64; 2]>,
    /// Z zero is missing: no job starts until the user sets it.
    #[serde(default)]
    pub needs_z_zero: bool,
    pub target_mm: Option<[f64; 2]>,
    /// Bottom of stroke, work mm.
    pub lower_dead_point_mm: Option<f64>,
    /// SHA-256 of the running job.
    pub job: Option<String>,
    pub job_name: Option<String>,
    pub leg: Option<u32>,
    /// Current hole: index into the board's holes.
    pub hole: Option<u32>,
    pub holes_done: u32,
    pub holes_total: u32,
    /// Current toolpath: index into the job's toolpaths.
    #[serde(default)]
    pub toolpath: Option<u32>,
    #[serde(default)]
    pub toolpaths_done: u32,
    #[serde(default)]
    pub toolpaths_total: u32,
    pub stage: Option<Stage>,
    /// Step of a tool measurement during a tool change.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measuring: Option<SetterStep>,
    /// Current line of the tool changer's macro, from 1, and the number of lines.
    #[serde(default)]
    pub changing: Option<[u32; 2]>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub change: Option<ChangeReport>,
    pub command: Option<String>,
    /// Tool in the spindle: index into the program's bits.
    pub bit: Option<u32>,
    /// Diameter of the tool, mm.
    pub bit_mm: Option<f64>,
    /// Spindle speed commanded, rpm.
    pub spindle_rpm: u32,
    /// State that the spindle itself reports.
    #[serde(default)]
    pub spindle: SpindleState,
    /// Percent of the planned feed.
    #[serde(default = "full_override")]
    pub feed_override_percent: u8,
    /// Percent of the programmed spindle speed; none without this override.
    #[serde(default)]
    pub spindle_override_percent: Option<u8>,
    /// Percent of the fastest rapid; none without this override.
    #[serde(default)]
    pub rapid_override_percent: Option<u8>,
    /// Bit set of the active inputs ([`crate::job::Input::bit`]).
    pub inputs: u32,
    /// Touches of each of [`Input::OF_AXES`] that were shorter than its filter; none if nothing filters and
    /// counts them.
    #[serde(default)]
    pub touches: Option<[ShortTouches; Input::OF_AXES.len()]>,
    /// How far Z must rise before X and Y jog without confirmation, mm; none if the tip isn't in the board.
    #[serde(default)]
    pub lift_first_mm: Option<f64>,
    /// True if the tool was lifted off the toolpath on which the job is paused. None if the job isn't paused
    /// on a toolpath, and on controllers that plan their own motion.
    #[serde(default)]
    pub paused_on_path: Option<bool>,
    /// Firmware of the USB step adapter, if it doesn't belong to this version.
    #[serde(default)]
    pub other_firmware: Option<OtherFirmware>,
    /// Phase bytes sent to the drivers of X, Y, Z.
    pub phases: [u8; 3],
    /// Losses of steps of the virtual drill since it was created.
    #[serde(default)]
    pub slips: Vec<SlipReport>,
    /// Differences between the board of the last run and its program, as the virtual drill recorded them.
    /// None until a run ended.
    #[serde(default)]
    pub drilled: Option<DrilledReport>,
    /// Missing legs of the last run, if they are known.
    #[serde(default)]
    pub missing: Option<MissingReport>,
    /// Holes drilled again after a resume, by order of drilling from 1. At most one by design; not an error.
    #[serde(default)]
    pub drilled_twice: Vec<u32>,
    pub elapsed_s: f64,
    pub left_s: f64,
    /// Completed share of the job's planned time, 0 to 1, in whole legs: toolpaths and holes.
    #[serde(default)]
    pub done_share: f64,
    /// Current alarm, until acknowledged.
    pub alarm: Option<Alarm>,
}

fn full_override() -> u8 {
    100
}

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
    pub why: Option<Diagnostic>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HeightMapReport {
    /// Grid of the points; none without a height map.
    pub grid: Option<ProbeGrid>,
    /// Height of each point over the work zero; none if it isn't probed yet.
    pub heights: Vec<Option<Length>>,
    /// Key of the job ([`crate::level::key_of`]).
    pub job: String,
    /// Time of the measurement, seconds since 1970.
    pub measured_s: u64,
    /// A measurement is running.
    pub goes: bool,
    /// Next point to probe.
    pub next: Option<u32>,
    /// Touches done, and the number expected.
    pub done: u32,
    pub of: u32,
    /// Why the map doesn't fit the current state of the machine.
    pub refused: Option<Diagnostic>,
}

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct MagazineReport {
    pub stock: ToolStock,
    /// A tool change is running; `stock` holds its step.
    pub changes: bool,
    /// Step with which a stopped change resumes. None if the user must check the tool first, or if no change
    /// stopped.
    pub goes_on_with: Option<ChangeStep>,
}
