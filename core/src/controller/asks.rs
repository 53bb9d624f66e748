//! What may be asked of a controller, what happens to it, and what the engine then wants done.
//!
//! Comes in: nothing. Goes out: the words that engine, bridge and page share. Does not know what becomes of them.

use super::heard::CompiledOptions;
use super::routine::Routine;
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
    /// A job.
    Running,
    /// Coming to rest in a job.
    Holding,
    /// At rest in a job.
    Held,
    /// A person changes the tool.
    ToolChange,
    /// Coming to rest to end a job.
    Stopping,
}

/// Something happened, or is asked.
#[derive(Clone, Debug)]
pub enum EngineEvent {
    /// The port is open.
    Opened,
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
    /// Change an override.
    Override(Override),
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
    /// Seconds that the spindle takes to come up to speed.
    pub spin_up_s: f64,
    /// Findings that were seen, by code.
    pub accepted: Vec<String>,
}

/// A step of an override.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Override {
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
}

impl Override {
    /// The steps that make the feed `percent` of the programmed one, 10 to 200.
    pub fn feed(percent: u8) -> impl Iterator<Item = Self> {
        let off = i32::from(percent.clamp(10, 200)) - 100;
        let (ten, one) =
            if off < 0 { (Self::FeedDown, Self::FeedDownOne) } else { (Self::FeedUp, Self::FeedUpOne) };
        let off = off.unsigned_abs() as usize;
        let tens = std::iter::repeat_n(ten, off / 10);
        std::iter::once(Self::FeedFull).chain(tens).chain(std::iter::repeat_n(one, off % 10))
    }

    /// Its real-time character.
    pub fn sign(self) -> u8 {
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
    /// What came of a board that is touched.
    Survey(SurveyNews),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_feed_is_reached_by_the_steps_that_controllers_have() {
        let rows = [
            (100, "90"),
            (110, "90 91"),
            (97, "90 94 94 94"),
            (75, "90 92 92 94 94 94 94 94"),
            (122, "90 91 91 93 93"),
        ];
        for (percent, expected) in rows {
            let signs: Vec<_> = Override::feed(percent).map(|step| format!("{:x}", step.sign())).collect();
            assert_eq!(signs.join(" "), expected, "{percent}");
        }
        assert_eq!((Override::feed(1).count(), Override::feed(255).count()), (10, 11));
    }
}
