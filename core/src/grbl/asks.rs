//! Commands to a controller, the events that it sends, and the actions that the engine requests.

use super::changer::Changer;
use super::heard::CompiledOptions;
use super::routine::Routine;
use super::setter::ToolSetter;
use super::settings::Values;
use super::written::WrittenLine;
use crate::control::Ending;
use crate::diagnostic::Diagnostic;
use crate::level::{ProbeGrid, Survey};
use crate::units::Length;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Real-time commands: single bytes that bypass the receive buffer.
pub mod realtime {
    pub const ASK: u8 = b'?';
    pub const HOLD: u8 = b'!';
    pub const RESUME: u8 = b'~';
    pub const RESET: u8 = 0x18;
    pub const JOG_CANCEL: u8 = 0x85;
}

/// Baud rates to try if none is set, in this order: most controllers use the first.
pub const BITS_PER_S: [u32; 10] =
    [115_200, 57_600, 9_600, 250_000, 230_400, 38_400, 19_200, 460_800, 921_600, 1_000_000];

/// Activity of the controller, as far as the engine started it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EnginePhase {
    #[default]
    Closed,
    Greeting,
    Ready,
    /// Locked after an alarm, or never homed.
    Locked,
    Homing,
    Jogging,
    Probing,
    Surveying,
    /// The controller reads a job in check mode; nothing moves.
    Checking,
    Running,
    /// Stopping within a job; still moving.
    Holding,
    Held,
    ToolChange,
    /// Measuring the tool on the tool setter, in the middle of a tool change.
    Measuring,
    Changing,
    /// Stopping to end a job; still moving.
    Stopping,
}

#[derive(Clone, Debug)]
pub enum EngineEvent {
    Opened,
    /// The port is open. Until the controller is identified, write nothing that may reset it.
    OpenedSparing,
    Closed,
    Bytes(Vec<u8>),
    /// Time passed; needed at least every 20 ms.
    Tick,
    /// As `Tick`, but the host was stalled: durations measured across this gap mean nothing.
    Late,
    Ask(EngineAsk),
}

#[derive(Clone, Debug)]
pub enum EngineAsk {
    Home,
    /// Unlock without homing: the position stays unknown.
    Unlock,
    /// Jog one axis by `um` µm.
    Jog {
        /// 0 to 2.
        axis: u8,
        um: i32,
        mm_per_min: f64,
        /// Jog X and Y even if the tip may be in the board.
        anyway: bool,
    },
    /// Raise Z fully, then move X and Y to the park position.
    Park {
        /// Distance from the low ends of X and Y, mm; `None`: where homing leaves them.
        from_low_mm: Option<[f64; 2]>,
    },
    JogCancel,
    /// Make the current position of these axes the work zero; for Z, at height `height_mm`.
    SetZero {
        axes: [bool; 3],
        /// Height of the tip over the board, mm.
        height_mm: f64,
    },
    /// Make this position the work zero, in machine coordinates, mm.
    ZeroAt {
        /// X, Y and Z; `None` leaves the zero of that axis.
        place_mm: [Option<f64>; 3],
    },
    /// Probe downwards until the probe meets the board or its plate.
    Probe {
        depth_mm: f64,
        mm_per_min: f64,
        /// Thickness of the plate, mm.
        plate_mm: f64,
        /// Lift afterwards, mm.
        up_mm: f64,
    },
    /// Probe along an axis until the probe meets the board's edge; the edge becomes the work zero of that
    /// axis.
    Edge {
        /// 0 X, 1 Y.
        axis: u8,
        /// Largest travel, mm, signed.
        reach_mm: f64,
        mm_per_min: f64,
        /// Half the tool diameter, mm.
        radius_mm: f64,
        /// Retreat from the edge afterwards, mm.
        back_mm: f64,
    },
    /// Probe the board at every point of a grid; results come as [`SurveyNews`].
    Survey(SurveyStart),
    Start(EngineStart),
    /// Feed hold; the job can be resumed.
    Hold,
    Resume,
    /// Stop for a new tool before this section of the running job, or before the next section that cuts.
    ToolBefore {
        /// Index into the routine's sections.
        section: usize,
    },
    /// The tool is in: continue, if the height of the board is known for this tool.
    ToolReady,
    /// The user reports another tool in the spindle: its length must be measured or touched off.
    NewBit,
    /// Stop and end the job. Nothing moves afterwards.
    Stop,
    /// End the job after the current section, over the next one, with the tip up.
    StopAfter,
    /// Set an override, in percent of the programmed value.
    Override {
        of: OverrideOf,
        percent: u8,
    },
    /// Read this job in check mode: every line, without a move.
    Check {
        routine: Arc<Routine>,
        /// Lines as in the files; if empty, lines as the job sends them.
        written: Arc<[WrittenLine]>,
    },
    Set {
        number: u16,
        value: f64,
    },
}

/// In the order of reports.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OverrideOf {
    /// Feed, 10 to 200 %.
    Feed,
    /// Rapids: 25, 50 or 100 %.
    Rapid,
    /// Spindle, 10 to 200 %.
    Spindle,
}

/// Parameters of probing a board for a height map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurveyStart {
    pub grid: ProbeGrid,
    /// Height over the highest probed point at which the tip travels, mm.
    pub clear_mm: f64,
    /// Most that the next point may be below the last one, mm.
    pub depth_mm: f64,
    pub mm_per_min: f64,
    pub over_mm_per_min: f64,
}

impl SurveyStart {
    pub fn usual(grid: ProbeGrid, clear_mm: f64, depth_mm: f64) -> Self {
        Self { grid, clear_mm, depth_mm, mm_per_min: 60.0, over_mm_per_min: 800.0 }
    }
}

#[derive(Clone, Debug)]
pub struct EngineStart {
    pub routine: Arc<Routine>,
    /// The first section to run.
    pub from: usize,
    /// Work zero when the job was interrupted, machine coordinates, mm. Meaningless if the machine doesn't
    /// home.
    pub zero_mm: Option<[f64; 3]>,
    /// The user states that all tools protrude equally, so no tool is touched off after a change.
    pub same_length: bool,
    /// Measures each tool before it cuts; `None`: each tool is touched off on the board.
    pub setter: Option<ToolSetter>,
    /// Changes tools automatically; `None`: the user changes them.
    pub changer: Option<Changer>,
    pub spin_up_s: f64,
    pub accepted: Vec<String>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum EngineAction {
    Write(Vec<u8>),
    /// Close the port: nothing responds.
    Close,
    Greeted,
    /// The work zero was written and read back correctly.
    ZeroSet,
    Progress {
        sections: usize,
    },
    ToolWanted {
        /// Index into the routine's tools.
        tool: u32,
    },
    ToolFetched {
        /// Index into the routine's tools.
        tool: u32,
    },
    Survey(SurveyNews),
    Check(CheckNews),
    Ended(Ending),
    /// A message for the user; an error stays until the next command.
    Found(Diagnostic),
}

#[derive(Clone, Debug, PartialEq)]
pub enum SurveyNews {
    Touched {
        index: usize,
        height: Length,
        done: usize,
        /// Probings expected, as known now.
        of: usize,
    },
    Over {
        /// `None` if probing was stopped or failed.
        survey: Option<Box<Survey>>,
    },
}

/// Progress and result of reading a job in check mode.
#[derive(Clone, Debug, PartialEq)]
pub enum CheckNews {
    Read {
        done: u32,
        of: u32,
    },
    Refused {
        why: Diagnostic,
    },
    /// The controller has left check mode or is gone.
    Over {
        done: u32,
        of: u32,
        /// Lines refused; not all of them were reported.
        refused: u32,
        /// Reason, if it ended early.
        why: Option<Diagnostic>,
    },
}

#[derive(Clone, Debug, Default, PartialEq)]
pub struct Info {
    pub banner: String,
    pub version: String,
    /// Rows of `$I` that only some firmwares have.
    pub about: BTreeMap<String, String>,
    pub options: CompiledOptions,
    pub values: Values,
    pub offsets: BTreeMap<String, Vec<f64>>,
    /// Lowest and highest position of X, Y and Z, mm, if the firmware reports them itself.
    pub said_ends_mm: [Option<[f64; 2]>; 3],
}

impl Info {
    /// The firmware: `GRBL`, `grblHAL` or `FluidNC`.
    pub fn flavour(&self) -> &'static str {
        let says = |text: &str| {
            let all = [&self.banner, &self.version].into_iter().chain(self.about.values());
            all.into_iter().any(|row| row.to_ascii_lowercase().contains(text))
        };
        match () {
            () if says("grblhal") => "grblHAL",
            () if says("fluidnc") => "FluidNC",
            () => "GRBL",
        }
    }
}
