//! A machine described: axes, limits, spindle, rack, process. Its settings are one table; page, file, manual and
//! tests read that table.
//!
//! Comes in: settings by key. Goes out: a [`Machine`], and its fingerprint. Does not know jobs.
//!
//! Machine coordinates: X to the right, Y away, Z up. Z = 0 is the top sensor, so working heights are negative.

mod adapter;
mod boards;
mod card;
mod converter;
mod drive;
pub mod dynamics;
mod foot;
mod magazine;
mod mills;
mod parallel;
mod park;
pub mod phases;
mod presets;
mod settings;
mod spindles;
mod step_dir;
mod table;
mod table_speeds;
mod tools;
mod validate;
mod wiring;

pub use adapter::{AdapterOutputs, AdapterWiring};
pub use card::Card;
pub use converter::Converter;
pub use drive::{DownLimits, DriveKind, Dynamics, Law, MotionLaws, Overlap, PhaseTable};
pub use foot::Foot;
pub use magazine::{MOST_PLACES, Magazine};
pub use mills::{MILL_KEY, MILLS, MillProfile, mill};
pub use parallel::Parallel;
pub use park::{Park, ParkAt};
pub use presets::{
    VIRTUAL_NAME, hobby_3018, lab, preset, preset_name, preset_words, presets, six_spindles, virtual_drill,
};
pub use settings::{
    Setting, Value, ValueKind, apply, is_adapter_wiring, is_in_file_only, read, setting, settings,
};
pub use spindles::OwnStroke;
pub use step_dir::{StepDir, WIRED_AXES};
pub use table::{MOST_RPM, SECTIONS};
pub use table_speeds::warnings;
pub use tools::{RackTool, TOOL_FIELDS, TOOL_FORMS, ToolField, ToolWear, rack_of, tool_of};
pub use validate::validate;
pub use wiring::{UNWIRED, Wiring};

use crate::job::{Cutter, Input};
use crate::units::{Length, NM_PER_INCH, NM_PER_MM};
use sha2::{Digest, Sha256};

/// How many axes there can be: X, Y, Z1 … Z6.
pub const AXES: usize = 8;

/// Step counts of all axes: X, Y, Z1 … Z6.
pub type Steps = [i64; AXES];

/// A machine as its owner configured it.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// Short name.
    pub name: String,
    /// What its owner wants to remember about it.
    pub description: String,
    /// Where the pulses go.
    pub output: Output,
    /// Base address of the I/O card.
    pub card_address: u32,
    /// The I/O card.
    pub card: Card,
    /// The parallel port.
    pub parallel: Parallel,
    /// How a USB step adapter is wired.
    pub adapter: AdapterWiring,
    /// The frequency converter of the spindle.
    pub converter: Converter,
    /// Left and right.
    pub x: Axis,
    /// Away and back.
    pub y: Axis,
    /// Up and down, of every spindle.
    pub z: Axis,
    /// How many spindles are on Z, 1 … 6. They work together.
    pub spindles: u32,
    /// Those of them that are to drill, one bit each: bit 0 is Z1.
    pub enabled: u8,
    /// What each of them does otherwise than all.
    pub own: [OwnStroke; AXES - 2],
    /// How step times come about.
    pub drive: DriveKind,
    /// Interrupt frequency of table-stepped drives, in Hz.
    pub interrupt_hz: u32,
    /// Their table of dynamics.
    pub dynamics: Dynamics,
    /// Fastest pulses any drive takes, and any motor of a table-stepped drive follows; steps per second.
    pub max_step_hz: u32,
    /// Time from a change of direction to the next step, in µs.
    pub direction_setup_us: u32,
    /// How long a pulse lasts at least, and the pause after it, in µs.
    pub pulse_width_us: f64,
    /// The laws of motion.
    pub motion: MotionLaws,
    /// Limits of Z on its way down.
    pub down: DownLimits,
    /// How Z and the plane move together.
    pub overlap: Overlap,
    /// Time at rest before the tip may enter the board, in ms.
    pub settle_ms: f64,
    /// How a stroke ends.
    pub stroke_end: StrokeEnd,
    /// Longest time one stroke down may take, in s.
    pub longest_drilling_s: f64,
    /// How bits are changed.
    pub tool_change: ToolChange,
    /// Where its tools lie, where it changes them itself.
    pub magazine: Magazine,
    /// The presser foot.
    pub foot: Foot,
    /// Where the head is parked.
    pub park: Park,
    /// The tools one owns.
    pub rack: Vec<RackTool>,
    /// How far a hole's size may be from the bit used for it.
    pub rack_tolerance: Length,
    /// Numbers of the process.
    pub process: Process,
}

/// Where pulses go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    /// The virtual drill.
    Virtual,
    /// A digital I/O card.
    Card,
    /// A PC parallel port.
    Parallel,
    /// A USB step adapter.
    Adapter,
}

/// How a stroke down ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StrokeEnd {
    /// After the counted steps.
    Counted,
    /// When the lower sensor turns on (the laboratory drill).
    Sensor,
}

/// How bits are changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToolChange {
    /// A person does it and says so.
    Manual,
    /// The machine does it, with a magazine.
    Magazine,
    /// The machine is told to go on without asking (virtual drill, tests).
    Unattended,
}

/// One axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Steps per length.
    pub scale: Scale,
    /// Lowest position, machine coordinates.
    pub min: Length,
    /// Highest position.
    pub max: Length,
    /// Greatest speed, mm/s.
    pub max_speed_mm_per_s: f64,
    /// Greatest acceleration, mm/s².
    pub max_acceleration_mm_per_s2: f64,
    /// Greatest jerk, mm/s³.
    pub max_jerk_mm_per_s3: f64,
    /// The end it homes to.
    pub home: HomeEnd,
    /// Speed towards the end sensor, mm/s.
    pub home_speed_mm_per_s: f64,
    /// Longest way to the end sensor.
    pub home_search: Length,
    /// Distance from the sensor's edge to the resting place after homing.
    pub home_offset: Length,
    /// Homing ends at the index pulse of its motor, not at the edge of the end sensor.
    pub index: bool,
    /// The way of a turn of its motor: from one index pulse to the next.
    pub index_within: Length,
    /// Play of the drive: way that the motor turns after a change of direction before the axis follows.
    pub backlash: Length,
    /// What the motor's phases get, step by step.
    pub phases: PhaseTable,
}

/// Which end sensor an axis homes to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HomeEnd {
    /// The low end.
    Min,
    /// The high end.
    Max,
}

/// Steps per length as an exact ratio, so that converting never drifts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    /// Millionths of a step …
    pub micro_steps: i64,
    /// … per this many nanometres: one millimetre or one inch.
    pub per: ScaleUnit,
    /// The electronic gear: so many steps for …
    pub gear_up: u32,
    /// … so many that the scale counts.
    pub gear_down: u32,
}

/// The length a scale counts steps over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScaleUnit {
    /// Steps per millimetre.
    Millimetre,
    /// Steps per inch.
    Inch,
}

impl Scale {
    /// `steps` per millimetre, to a millionth of a step.
    pub fn per_mm(steps: f64) -> Self {
        Self {
            micro_steps: libm::round(steps * 1e6) as i64,
            per: ScaleUnit::Millimetre,
            gear_up: 1,
            gear_down: 1,
        }
    }

    /// `steps` per inch.
    pub fn per_inch(steps: f64) -> Self {
        Self { micro_steps: libm::round(steps * 1e6) as i64, per: ScaleUnit::Inch, gear_up: 1, gear_down: 1 }
    }

    const fn per_nm(self) -> i64 {
        match self.per {
            ScaleUnit::Millimetre => NM_PER_MM,
            ScaleUnit::Inch => NM_PER_INCH,
        }
    }

    /// The step nearest to the absolute coordinate `at`, halves away from zero. Convert absolute coordinates and
    /// subtract afterwards: then errors never add up (A6).
    pub fn steps(self, at: Length) -> i64 {
        let (up, down) = self.gear();
        let numerator = i128::from(at.nm()) * i128::from(self.micro_steps) * up;
        let denominator = i128::from(self.per_nm()) * 1_000_000 * down;
        let half = denominator / 2;
        let rounded = if numerator >= 0 { numerator + half } else { numerator - half } / denominator;
        rounded.clamp(i128::from(i64::MIN), i128::from(i64::MAX)) as i64
    }

    /// The coordinate of step `steps`, to the nearest nanometre, halves away from zero.
    pub fn length(self, steps: i64) -> Length {
        let (up, down) = self.gear();
        let numerator = i128::from(steps) * i128::from(self.per_nm()) * 1_000_000 * down;
        let denominator = i128::from(self.micro_steps.max(1)) * up;
        let half = denominator / 2;
        let rounded = if numerator >= 0 { numerator + half } else { numerator - half } / denominator;
        Length::from_nm(rounded.clamp(i128::from(i64::MIN), i128::from(i64::MAX)) as i64)
    }

    /// Steps in a millimetre, for speeds.
    pub fn steps_per_mm(self) -> f64 {
        let gear = f64::from(self.gear_up.max(1)) / f64::from(self.gear_down.max(1));
        self.micro_steps as f64 / 1e6 / (self.per_nm() as f64 / NM_PER_MM as f64) * gear
    }

    /// The gear as whole numbers above 0.
    fn gear(self) -> (i128, i128) {
        (i128::from(self.gear_up.max(1)), i128::from(self.gear_down.max(1)))
    }
}

/// Numbers of the process, the same for every hole.
#[derive(Clone, Debug, PartialEq)]
pub struct Process {
    /// Height of rapid moves over the board's surface.
    pub safe_height: Length,
    /// Height over the surface from which on Z goes down at feed.
    pub feed_height: Length,
    /// Thickness of the board.
    pub board_thickness: Length,
    /// How far the tip goes below the board.
    pub breakthrough: Length,
    /// How far below the surface the tip may be at most before the contact tells of it; 0 where that is not looked at.
    pub contact_tolerance: Length,
    /// Speed of the tip where it is to touch the board or a plate, mm/s.
    pub touch_mm_per_s: f64,
    /// Speed down through the board, mm/s.
    pub feed_mm_per_s: f64,
    /// Pause at the bottom, in ms.
    pub dwell_bottom_ms: f64,
    /// Spindle speed, rpm.
    pub spindle_rpm: u32,
    /// The fastest that it turns, rpm; 0 where nobody said.
    pub max_rpm: u32,
    /// Time for the spindle to reach it, in ms.
    pub spin_up_ms: f64,
    /// Height of the board's surface in machine coordinates (Z = 0 at the top sensor).
    pub surface: Length,
}

/// The input that tells of the index pulse of `axis`.
pub fn index_input(axis: usize) -> Input {
    match axis {
        0 => Input::XIndex,
        1 => Input::YIndex,
        _ => Input::ZIndex,
    }
}

/// The name of an axis of a stream, as people say it.
pub fn axis_name(axis: usize) -> String {
    match axis {
        0 => "X".to_owned(),
        1 => "Y".to_owned(),
        2 => "Z".to_owned(),
        more => format!("Z{}", more - 1),
    }
}

impl Machine {
    /// The axis with index `axis` of a stream: 0 is X, 1 is Y, 2 … are the spindles.
    pub fn axis(&self, axis: usize) -> &Axis {
        match axis {
            0 => &self.x,
            1 => &self.y,
            _ => &self.z,
        }
    }

    /// How hard an axis brakes where nobody knows beforehand that it has to, mm/s²; not where it is driven by the table.
    pub fn braking_mm_per_s2(&self, axis: usize) -> f64 {
        let own = self.axis(axis).max_acceleration_mm_per_s2;
        if axis < 2 { own } else { own.min(self.down.max_acceleration_mm_per_s2) }
    }

    /// Its spindles, one bit each: bit 0 is Z1.
    pub fn installed(&self) -> u8 {
        u8::MAX >> (u8::BITS - self.spindles.clamp(1, AXES as u32 - 2))
    }

    /// Whether a sensor tells that a tip touches the board: then the plane goes on only once it says that none does, else by the time
    /// that tips take alone.
    pub fn senses_contact(&self) -> bool {
        match self.output {
            Output::Virtual => true,
            Output::Adapter => self.adapter.sensor(Input::Contact).is_some(),
            Output::Card | Output::Parallel => self.wiring().sensor(Input::Contact) != UNWIRED,
        }
    }

    /// Diameters of the drills of its rack.
    pub fn drills(&self) -> Vec<Length> {
        let drills = self.rack.iter().filter(|tool| tool.cutter == Cutter::Drill);
        drills.map(|tool| tool.diameter).collect()
    }

    /// SHA-256 in hexadecimal over everything that shapes a stream. Name, description and output do not: the
    /// same program runs on the virtual drill in place of a real machine. Nor do lists that say nothing.
    pub fn fingerprint(&self) -> String {
        let mut hash = Sha256::new();
        for setting in settings().filter(|setting| setting.shapes_stream) {
            let value = setting.value(self);
            if value == Value::Numbers(Vec::new()) {
                continue;
            }
            hash.update(setting.key.as_bytes());
            hash.update(b"=");
            hash.update(value.to_string().as_bytes());
            hash.update(b"\n");
        }
        hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
    }

    /// Names of the outputs that a work command may switch, by their place.
    pub fn output_names(&self) -> Vec<String> {
        if self.output == Output::Adapter {
            return self.adapter.output_name.split_whitespace().map(str::to_owned).collect();
        }
        let mut names = self.wiring().names();
        if self.output == Output::Virtual {
            // What the virtual drill has is wired.
            let foot = self.foot.on.then_some(&self.foot.output);
            let own = foot.into_iter().chain(self.has_magazine().then_some(&self.magazine.clamp));
            for own in own {
                if !names.contains(own) {
                    names.push(own.clone());
                }
            }
        }
        names
    }

    /// The place of the output called `name`.
    pub fn output_place(&self, name: &str) -> Option<u8> {
        self.output_names().iter().position(|own| own == name).and_then(|place| u8::try_from(place).ok())
    }

    /// Whether anybody tells of `input`: the virtual drill of each, everything else of what has a wire.
    pub fn tells(&self, input: Input) -> bool {
        match self.output {
            Output::Virtual => true,
            Output::Card | Output::Parallel => self.wiring().sensor(input) != UNWIRED,
            Output::Adapter => self.adapter.sensor(input).is_some(),
        }
    }

    /// The inputs that anybody tells of, one bit each.
    pub fn told_inputs(&self) -> u32 {
        Input::ALL.into_iter().filter(|input| self.tells(*input)).fold(0, |told, input| told | input.bit())
    }

    /// The wiring in force: that of the parallel port where one is driven, else that of the card.
    pub fn wiring(&self) -> &Wiring {
        match self.output {
            Output::Parallel => &self.parallel.wiring,
            Output::Virtual | Output::Card | Output::Adapter => &self.card.wiring,
        }
    }

    /// The inputs that it cannot do without: of the home ends, of index pulses that homing ends at, and of the end of a stroke where a
    /// sensor tells it.
    pub(super) fn needed_inputs(&self) -> impl Iterator<Item = Input> {
        let ends = [0, 1, 2].map(|axis| self.home_input(axis));
        let pulses = (0..3).filter(|axis| self.axis(*axis).index).map(index_input);
        ends.into_iter().chain(pulses).chain((self.stroke_end == StrokeEnd::Sensor).then_some(Input::ZBottom))
    }

    /// The input that tells that `axis` reached its home end.
    pub fn home_input(&self, axis: usize) -> Input {
        match (axis, self.axis(axis).home) {
            (0, HomeEnd::Min) => Input::XMin,
            (0, HomeEnd::Max) => Input::XMax,
            (1, HomeEnd::Min) => Input::YMin,
            (1, HomeEnd::Max) => Input::YMax,
            (_, HomeEnd::Min) => Input::ZBottom,
            (_, HomeEnd::Max) => Input::ZTop,
        }
    }
}
