//! What may be asked of a controller, what happens to it, and what the engine then wants done.
//!
//! Comes in: nothing. Goes out: the words that engine, bridge and page share. Does not know what becomes of them.

use super::changer::Changer;
use super::check::CheckNews;
use super::heard::CompiledOptions;
use super::overrides::OverrideOf;
use super::routine::Routine;
use super::setter::ToolSetter;
use super::settings::Values;
use crate::control::Ending;
use crate::diagnostic::Diagnostic;
use crate::level::{ProbeGrid, Survey};
use crate::units::Length;
use std::collections::BTreeMap;
use std::sync::Arc;

/// Real-time characters.
pub mod signs {
    /// Report.
    pub const ASK: u8 = b'?';
    /// Feed hold.
    pub const HOLD: u8 = b'!';
    /// Go on.
    pub const RESUME: u8 = b'~';
    /// Begin anew.
    pub const RESET: u8 = 0x18;
    /// Safety door.
    pub const DOOR: u8 = 0x84;
    /// Ends a jog.
    pub const JOG_CANCEL: u8 = 0x85;
}

/// Speeds of the line that are tried where nobody says which, in their order: most boards have the first.
pub const BITS_PER_S: [u32; 10] =
    [115_200, 57_600, 9_600, 250_000, 230_400, 38_400, 19_200, 460_800, 921_600, 1_000_000];

/// What the controller is doing, as far as the engine brought it there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EnginePhase {
    /// No link.
    Closed,
    /// Finding out who is there.
    Greeting,
    /// At rest.
    Ready,
    /// Locked after an alarm, or never homed.
    Locked,
    /// Looking for the end switches.
    Homing,
    /// A move by hand.
    Jogging,
    /// Looking for the board with the probe.
    Probing,
    /// Touching the board place by place.
    Surveying,
    /// The controller reads a job in check mode; nothing moves.
    Checking,
    /// A job.
    Running,
    /// Coming to rest in a job.
    Holding,
    /// At rest in a job.
    Held,
    /// A person changes the tool.
    ToolChange,
    /// The tool that is in is measured on the tool setter, in the middle of its change.
    Measuring,
    /// The machine changes the tool itself.
    Changing,
    /// Coming to rest to end a job.
    Stopping,
}

/// Something happened, or is asked.
#[derive(Clone, Debug)]
pub enum EngineEvent {
    /// The port is open.
    Opened,
    /// The port is open, and nothing that is written before the board said who it is may reset it.
    OpenedSparing,
    /// The port is gone.
    Closed,
    /// Bytes came.
    Bytes(Vec<u8>),
    /// Nothing but time; wanted at least every 20 ms.
    Tick,
    /// The same, and time was not told for a while: how long what is in work takes says nothing.
    Late,
    /// A person asks.
    Ask(EngineAsk),
}

/// What a person may ask.
#[derive(Clone, Debug)]
pub enum EngineAsk {
    /// Home.
    Home,
    /// Unlock without homing: the position stays unknown.
    Unlock,
    /// Move one axis, in µm, at so many mm/min.
    Jog {
        /// 0 to 2.
        axis: u8,
        /// How far.
        um: i32,
        /// How fast.
        mm_per_min: f64,
    },
    /// Z all the way up, then X and Y to where it is parked.
    Park {
        /// So far from the lowest ends of X and Y, mm; none for where homing leaves it.
        from_low_mm: Option<[f64; 2]>,
    },
    /// End the move by hand.
    JogCancel,
    /// The place of these axes becomes work zero; of Z, this height.
    SetZero {
        /// X, Y, Z.
        axes: [bool; 3],
        /// The height of the tip over the board, mm.
        height_mm: f64,
    },
    /// This place in machine coordinates becomes work zero, mm.
    ZeroAt {
        /// X, Y and Z; none of an axis whose zero stays.
        place_mm: [Option<f64>; 3],
    },
    /// Go down until the probe meets the board, at most so far; its plate is so thick.
    Probe {
        /// How far down at most, mm.
        depth_mm: f64,
        /// How fast, mm/min.
        mm_per_min: f64,
        /// Thickness of the plate, mm.
        plate_mm: f64,
        /// How far up afterwards, mm.
        up_mm: f64,
    },
    /// Go along an axis until the probe meets the board's edge, at most so far: the edge becomes work zero of the axis.
    Edge {
        /// 0 X, 1 Y.
        axis: u8,
        /// How far at most, mm, signed.
        reach_mm: f64,
        /// How fast, mm/min.
        mm_per_min: f64,
        /// Half the diameter of the tool, mm.
        radius_mm: f64,
        /// How far off the edge afterwards, mm.
        back_mm: f64,
    },
    /// Touch the board at every place of a grid; what comes of it is told.
    Survey(SurveyStart),
    /// Run a job from a section on.
    Start(EngineStart),
    /// Come to rest, to go on later.
    Hold,
    /// Go on.
    Resume,
    /// Before this section of the job in work is begun, or before the next that cuts, a person puts in a new tool.
    ToolBefore {
        /// Index into the routine's sections.
        section: usize,
    },
    /// The tool is in: go on, if the height of the board is known for it.
    ToolReady,
    /// The bit that is in is another one than it was, by a person's word: it has to be touched off.
    NewBit,
    /// Come to rest and end the job. Nothing moves afterwards.
    Stop,
    /// End the job once the section in work is done: over the next one, the tip up.
    StopAfter,
    /// So many percent of what the program says.
    Override {
        /// Of what.
        of: OverrideOf,
        /// Percent.
        percent: u8,
    },
    /// Read this job in check mode: every line of it, without a move.
    Check {
        /// The job.
        routine: Arc<Routine>,
    },
    /// A setting.
    Set {
        /// Its number.
        number: u16,
        /// Its value, in its own unit.
        value: f64,
    },
}

/// A board to be touched, for a height map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurveyStart {
    /// Where, work coordinates.
    pub grid: ProbeGrid,
    /// How far over the highest place touched the tip goes from place to place, mm.
    pub clear_mm: f64,
    /// How far below the last place the next one may lie, mm.
    pub depth_mm: f64,
    /// How fast down, mm/min.
    pub mm_per_min: f64,
    /// How fast from place to place, mm/min.
    pub over_mm_per_min: f64,
}

impl SurveyStart {
    /// As fast as it is usual.
    pub fn usual(grid: ProbeGrid, clear_mm: f64, depth_mm: f64) -> Self {
        Self { grid, clear_mm, depth_mm, mm_per_min: 60.0, over_mm_per_min: 800.0 }
    }
}

/// A job to be run.
#[derive(Clone, Debug)]
pub struct EngineStart {
    /// The job.
    pub routine: Arc<Routine>,
    /// The first section to run.
    pub from: usize,
    /// Where the work zero was when the job was interrupted, machine coordinates; of no meaning where nothing homes.
    pub zero_mm: Option<[f64; 3]>,
    /// All bits stand out equally far, by a person's word: none is touched off after it was put in.
    pub same_length: bool,
    /// Where each tool is measured before it cuts; none where each is touched off against the board.
    pub setter: Option<ToolSetter>,
    /// How the machine changes tools itself; none where a person does.
    pub changer: Option<Changer>,
    /// Seconds that the spindle takes to come up to speed.
    pub spin_up_s: f64,
    /// Findings that were seen, by code.
    pub accepted: Vec<String>,
}

/// A step of an override.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Override {
    /// Feed as programmed.
    FeedFull,
    /// Feed 10 % up.
    FeedUp,
    /// Feed 10 % down.
    FeedDown,
    /// Feed 1 % up.
    FeedUpOne,
    /// Feed 1 % down.
    FeedDownOne,
    /// Rapids at full speed.
    RapidFull,
    /// Rapids at half.
    RapidHalf,
    /// Rapids at a quarter.
    RapidQuarter,
    /// Spindle as programmed.
    SpindleFull,
    /// Spindle 10 % up.
    SpindleUp,
    /// Spindle 10 % down.
    SpindleDown,
    /// Spindle 1 % up.
    SpindleUpOne,
    /// Spindle 1 % down.
    SpindleDownOne,
}

impl Override {
    /// The one that brings rapids there.
    pub(super) fn rapid(percent: u16) -> Self {
        match percent {
            25 => Self::RapidQuarter,
            50 => Self::RapidHalf,
            _ => Self::RapidFull,
        }
    }

    /// How many percent it makes of so many; none where nobody knows.
    pub(super) fn leads_to(self, percent: Option<u16>) -> Option<u16> {
        let by = |step: i16| Some(percent?.saturating_add_signed(step).clamp(10, 200));
        match self {
            Self::FeedFull | Self::RapidFull | Self::SpindleFull => Some(100),
            Self::RapidHalf => Some(50),
            Self::RapidQuarter => Some(25),
            Self::FeedUp | Self::SpindleUp => by(10),
            Self::FeedDown | Self::SpindleDown => by(-10),
            Self::FeedUpOne | Self::SpindleUpOne => by(1),
            Self::FeedDownOne | Self::SpindleDownOne => by(-1),
        }
    }

    /// Its real-time character.
    pub(super) fn sign(self) -> u8 {
        match self {
            Self::FeedFull => 0x90,
            Self::FeedUp => 0x91,
            Self::FeedDown => 0x92,
            Self::FeedUpOne => 0x93,
            Self::FeedDownOne => 0x94,
            Self::RapidFull => 0x95,
            Self::RapidHalf => 0x96,
            Self::RapidQuarter => 0x97,
            Self::SpindleFull => 0x99,
            Self::SpindleUp => 0x9A,
            Self::SpindleDown => 0x9B,
            Self::SpindleUpOne => 0x9C,
            Self::SpindleDownOne => 0x9D,
        }
    }
}

/// What is to be done, or told.
#[derive(Clone, Debug, PartialEq)]
pub enum EngineAction {
    /// Write these bytes.
    Write(Vec<u8>),
    /// The port is to be closed: nobody answers.
    Close,
    /// Everything is known of who is there.
    Greeted,
    /// The work zero is where it was asked for: it was written and read again.
    ZeroSet,
    /// So many sections of the job are certainly done.
    Progress {
        /// How many.
        sections: usize,
    },
    /// A person is to put this tool in: index into the routine's tools.
    ToolWanted {
        /// Index into the routine's tools.
        tool: u32,
    },
    /// The machine has put this tool in itself.
    ToolFetched {
        /// Index into the routine's tools.
        tool: u32,
    },
    /// What came of a board that is touched.
    Survey(SurveyNews),
    /// What comes of a job that is read in check mode.
    Check(CheckNews),
    /// The job is over.
    Ended(Ending),
    /// Something to be said; an error stands until the next ask.
    Found(Diagnostic),
}

/// What comes of a board that is touched.
#[derive(Clone, Debug, PartialEq)]
pub enum SurveyNews {
    /// A place was touched.
    Touched {
        /// Its number in the grid.
        index: usize,
        /// Its height over the work zero.
        height: Length,
        /// Touches that are done.
        done: usize,
        /// And how many there will be, as far as is known.
        of: usize,
    },
    /// It is over; nothing comes of a survey that was stopped or that failed.
    Over {
        /// With all its heights.
        survey: Option<Box<Survey>>,
    },
}

/// Who is there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Info {
    /// How it greeted.
    pub banner: String,
    /// Its version.
    pub version: String,
    /// Rows of `$I` that only some have.
    pub about: BTreeMap<String, String>,
    /// Compiled options.
    pub options: CompiledOptions,
    /// Settings.
    pub values: Values,
    /// Stored places.
    pub offsets: BTreeMap<String, Vec<f64>>,
    /// The lowest and the highest place of X, Y and Z, where it says so itself, mm.
    pub said_ends_mm: [Option<[f64; 2]>; 3],
}

impl Info {
    /// What kind of firmware it is: `GRBL`, `grblHAL` or `FluidNC`.
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
