//! Description of a machine: axes, limits, spindle, tools, process. Page, file, manual and tests use one
//! table of its settings.
//!
//! Machine coordinates: X to the right, Y away from the user, Z up. Z = 0 is the top switch, so working
//! heights are negative.

mod adapter;
mod area;
mod card;
mod change;
mod converter;
mod drive;
pub mod dynamics;
pub(crate) mod field;
mod foot;
mod magazine;
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
mod value;
mod wiring;

pub use adapter::{AdapterOutputs, AdapterWiring};
pub use area::WorkArea;
pub use card::Card;
pub use change::{ChangeAt, ChangeSetter, HandChange, Lengths};
pub use converter::Converter;
pub use drive::{DownLimits, DriveKind, Dynamics, Law, MotionLaws, Overlap, PhaseTable};
pub use field::{Field, Group, OF_MACHINE, Setting};
pub use foot::Foot;
pub use magazine::{MOST_PLACES, Magazine};
pub use parallel::Parallel;
pub use park::{Park, ParkAt};
pub use presets::{
    MILL_KEY, MILLS, MillProfile, MotionPlanner, VIRTUAL, VIRTUAL_NAME, catalogue, hobby_3018, lab, mill,
    played, preset, preset_name, preset_words, presets, six_spindles, virtual_drill,
};
pub use settings::{
    apply, differences, is_adapter_wiring, is_in_file_only, read, setting, settings, without_hardware,
};
pub use spindles::OwnStroke;
pub use step_dir::{StepDir, WIRED_AXES};
pub use table::{SECTIONS, Section};
pub use table_speeds::warnings;
pub use tools::{MOST_RPM, RackTool, TOOL_FIELDS, TOOL_FORMS, ToolWear, rack_of, tool_of};
pub(crate) use tools::{set_angle, set_tip, tip_and_angle};
pub use validate::validate;
pub use value::{Value, ValueKind};
pub use wiring::Wiring;

use crate::diagnostic::Diagnostic;
use crate::job::{Cutter, Input};
use crate::units::{Length, NM_PER_INCH, NM_PER_MM};
use sha2::{Digest, Sha256};

/// Greatest number of axes: X, Y, Z1 … Z6.
pub const AXES: usize = 8;

/// Step counts of all axes: X, Y, Z1 … Z6.
pub type Steps = [i64; AXES];

/// A signal that isn't wired.
pub const UNWIRED: i8 = -1;

#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    pub name: String,
    pub description: String,
    /// Driver of the pins.
    pub output: Output,
    pub card_address: u32,
    pub card: Card,
    pub parallel: Parallel,
    pub adapter: AdapterWiring,
    pub converter: Converter,
    pub x: Axis,
    pub y: Axis,
    /// Limits of Z for all spindles; `down` limits the plunge.
    pub z: Axis,
    /// Number of spindles on Z, 1 … 6. They move together.
    pub spindles: u32,
    /// Bit set of the spindles that drill: bit 0 is Z1.
    pub enabled: u8,
    /// Differences between the spindles.
    pub own: [OwnStroke; AXES - 2],
    /// Source of the step times.
    pub drive: DriveKind,
    pub interrupt_hz: u32,
    pub dynamics: Dynamics,
    /// Highest pulse rate of any drive, and of the motors of table-driven axes; steps per second.
    pub max_step_hz: u32,
    /// Least time from a change of direction to the next step, in µs.
    pub direction_setup_us: u32,
    /// Least length of a pulse, and of the pause after it, in µs.
    pub pulse_width_us: f64,
    pub motion: MotionLaws,
    /// Limits of Z on its way down.
    pub down: DownLimits,
    pub overlap: Overlap,
    /// Time at rest before the tip may enter the board, in ms.
    pub settle_ms: f64,
    /// How a plunge ends.
    pub stroke_end: StrokeEnd,
    /// Longest time of one plunge, in s.
    pub longest_drilling_s: f64,
    pub tool_change: ToolChange,
    pub magazine: Magazine,
    pub foot: Foot,
    pub park: Park,
    pub change: HandChange,
    /// The user's tools.
    pub rack: Vec<RackTool>,
    /// Greatest difference between a hole and the tool used for it.
    pub rack_tolerance: Length,
    pub process: Process,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    Virtual,
    Card,
    Parallel,
    Adapter,
}

/// Finds the errors of a section of a machine.
type Check = fn(&Machine) -> Vec<Diagnostic>;

/// Sections that describe wiring, with their checks. Only the machine file changes them.
const WIRED: [(&str, Check); 4] = [
    ("card", card::validate),
    ("parallel", parallel::validate),
    ("adapter", adapter::validate),
    ("converter", converter::validate),
];

impl Output {
    /// Its name in JSON and its name for people, on the command line.
    pub const fn names(self) -> [&'static str; 2] {
        match self {
            Self::Virtual => ["virtual_drill", "Virtual drill"],
            Self::Card => ["card", "Card"],
            Self::Parallel => ["parallel", "Parallel port"],
            Self::Adapter => ["adapter", "USB step adapter"],
        }
    }

    /// The setting that names its outputs for work commands, and how many it may name.
    const fn naming(self) -> (&'static str, usize) {
        match self {
            Self::Virtual | Self::Card => ("card.output_names", 16),
            Self::Parallel => ("parallel.output_names", 16),
            Self::Adapter => ("adapter.output_name", 1),
        }
    }
}

/// How a plunge ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StrokeEnd {
    /// After the counted steps.
    Counted,
    /// When the lower switch turns on (laboratory drill).
    Sensor,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToolChange {
    Manual,
    Magazine,
    /// Continues without asking (virtual drill, tests).
    Unattended,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    pub scale: Scale,
    /// Lowest position, machine coordinates.
    pub min: Length,
    pub max: Length,
    pub max_speed_mm_per_s: f64,
    pub max_acceleration_mm_per_s2: f64,
    pub max_jerk_mm_per_s3: f64,
    /// End to which the axis homes.
    pub home: HomeEnd,
    pub home_speed_mm_per_s: f64,
    pub home_search: Length,
    /// Distance from the switch edge to the rest position after homing.
    pub home_offset: Length,
    /// Homing ends at the index pulse of the motor, not at the edge of the limit switch.
    pub index: bool,
    /// Travel per turn of the motor: from one index pulse to the next.
    pub index_within: Length,
    /// Backlash: travel of the motor after a change of direction before the axis follows.
    pub backlash: Length,
    /// Bits of the motor's phases, step by step.
    pub phases: PhaseTable,
}

/// The limit switch for homing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HomeEnd {
    Min,
    Max,
}

/// Steps per length as an exact ratio, so that conversions never drift.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    /// Millionths of a step …
    pub micro_steps: i64,
    /// … per this many nanometres: one millimetre or one inch.
    pub per: ScaleUnit,
    /// Numerator of the electronic gear: motor steps.
    pub gear_up: u32,
    /// Denominator of the electronic gear: steps counted by the scale.
    pub gear_down: u32,
}

/// Length unit of a scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScaleUnit {
    Millimetre,
    Inch,
}

impl Scale {
    /// `steps` per millimetre, rounded to a millionth of a step.
    pub fn per_mm(steps: f64) -> Self {
        Self {
            micro_steps: libm::round(steps * 1e6) as i64,
            per: ScaleUnit::Millimetre,
            gear_up: 1,
            gear_down: 1,
        }
    }

    pub fn per_inch(steps: f64) -> Self {
        Self { micro_steps: libm::round(steps * 1e6) as i64, per: ScaleUnit::Inch, gear_up: 1, gear_down: 1 }
    }

    const fn per_nm(self) -> i64 {
        match self.per {
            ScaleUnit::Millimetre => NM_PER_MM,
            ScaleUnit::Inch => NM_PER_INCH,
        }
    }

    /// Nearest step to the absolute coordinate `at`, halves away from zero. Convert absolute coordinates and
    /// subtract afterwards, so that errors don't add up.
    pub fn steps(self, at: Length) -> i64 {
        let (up, down) = self.gear();
        let numerator = i128::from(at.nm()) * i128::from(self.micro_steps) * up;
        let denominator = i128::from(self.per_nm()) * 1_000_000 * down;
        let half = denominator / 2;
        let rounded = if numerator >= 0 { numerator + half } else { numerator - half } / denominator;
        rounded.clamp(i128::from(i64::MIN), i128::from(i64::MAX)) as i64
    }

    /// Coordinate of step `steps`, to the nearest nanometre, halves away from zero.
    pub fn length(self, steps: i64) -> Length {
        let (up, down) = self.gear();
        let numerator = i128::from(steps) * i128::from(self.per_nm()) * 1_000_000 * down;
        let denominator = i128::from(self.micro_steps.max(1)) * up;
        let half = denominator / 2;
        let rounded = if numerator >= 0 { numerator + half } else { numerator - half } / denominator;
        Length::from_nm(rounded.clamp(i128::from(i64::MIN), i128::from(i64::MAX)) as i64)
    }

    /// Steps per millimetre, for speeds.
    pub fn steps_per_mm(self) -> f64 {
        let gear = f64::from(self.gear_up.max(1)) / f64::from(self.gear_down.max(1));
        self.micro_steps as f64 / 1e6 / (self.per_nm() as f64 / NM_PER_MM as f64) * gear
    }

    fn gear(self) -> (i128, i128) {
        (i128::from(self.gear_up.max(1)), i128::from(self.gear_down.max(1)))
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct Process {
    /// Height of rapids over the board's surface.
    pub safe_height: Length,
    /// Height over the surface at which the feed starts.
    pub feed_height: Length,
    pub board_thickness: Length,
    /// Depth of the tip below the board.
    pub breakthrough: Length,
    /// Greatest depth below the surface without contact, before the bit counts as broken; 0 disables the
    /// check.
    pub contact_tolerance: Length,
    pub touch_mm_per_s: f64,
    /// A pause lifts the tool off its toolpath.
    pub lift_at_pause: bool,
    pub feed_mm_per_s: f64,
    /// Dwell at the bottom of stroke, in ms.
    pub dwell_bottom_ms: f64,
    /// Default spindle speed of jobs, rpm; [`Process::usual_rpm`] limits it.
    pub spindle_rpm: u32,
    /// Highest spindle speed, rpm; 0 if unknown.
    pub max_rpm: u32,
    pub spin_up_ms: f64,
    /// Height of the board's surface in machine coordinates (Z = 0 at the top switch).
    pub surface: Length,
}

/// Default of `contact_tolerance` on machines with a wired contact sensor.
pub const CONTACT_TOLERANCE: Length = Length::from_um(100);

impl Process {
    /// Default spindle speed of jobs, rpm: `spindle.speed`, limited by `spindle.max_speed`.
    pub fn usual_rpm(&self) -> u32 {
        if self.max_rpm > 0 { self.spindle_rpm.min(self.max_rpm) } else { self.spindle_rpm }
    }
}

pub fn index_input(axis: usize) -> Input {
    match axis {
        0 => Input::XIndex,
        1 => Input::YIndex,
        _ => Input::ZIndex,
    }
}

/// Display name of an axis of a stream.
pub fn axis_name(axis: usize) -> String {
    match axis {
        0 => "X".to_owned(),
        1 => "Y".to_owned(),
        2 => "Z".to_owned(),
        more => format!("Z{}", more - 1),
    }
}

impl Machine {
    /// The axis with index `axis` of a stream: 0 is X, 1 is Y, from 2 on the spindles.
    pub fn axis(&self, axis: usize) -> &Axis {
        match axis {
            0 => &self.x,
            1 => &self.y,
            _ => &self.z,
        }
    }

    /// Deceleration for unplanned stops, mm/s². Not for table-driven axes.
    pub fn braking_mm_per_s2(&self, axis: usize) -> f64 {
        let own = self.axis(axis).max_acceleration_mm_per_s2;
        if axis < 2 { own } else { own.min(self.down.max_acceleration_mm_per_s2) }
    }

    /// Bit set of the spindles: bit 0 is Z1.
    pub fn installed(&self) -> u8 {
        u8::MAX >> (u8::BITS - self.spindles.clamp(1, AXES as u32 - 2))
    }

    /// True if a sensor reports that a tip touches the board. Then XY waits until no tip touches; without a
    /// sensor, XY waits only as long as planned.
    pub fn senses_contact(&self) -> bool {
        self.tells(Input::Contact)
    }

    /// True if a card or a parallel port has a wire for the contact sensor, so that a broken bit is noticed
    /// at its hole. The virtual drill compares its board with the program instead.
    pub fn has_contact_wire(&self) -> bool {
        matches!(self.output, Output::Card | Output::Parallel) && self.tells(Input::Contact)
    }

    /// True if broken bits are noticed while drilling.
    pub fn notices_broken_bits(&self) -> bool {
        self.output == Output::Virtual
            || self.has_contact_wire() && self.process.contact_tolerance > Length::ZERO
    }

    /// Diameters of the drills in the tool list.
    pub fn drills(&self) -> Vec<Length> {
        let drills = self.rack.iter().filter(|tool| tool.cutter == Cutter::Drill);
        drills.map(|tool| tool.diameter).collect()
    }

    /// SHA-256 of everything that affects a step stream, hexadecimal. Name, description and output don't, so
    /// that a program for a real machine also runs on the virtual drill. Empty lists don't either.
    pub fn fingerprint(&self) -> String {
        let mut hash = Sha256::new();
        for setting in settings().filter(|setting| setting.shapes_stream()) {
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

    /// Names of the outputs that work commands may switch, by index.
    pub fn output_names(&self) -> Vec<String> {
        if self.output == Output::Adapter {
            return self.adapter.output_name.split_whitespace().map(str::to_owned).collect();
        }
        let mut names = self.wiring().names();
        if self.output == Output::Virtual {
            // All outputs of the virtual drill are connected.
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

    pub fn output_place(&self, name: &str) -> Option<u8> {
        self.output_names().iter().position(|own| own == name).and_then(|place| u8::try_from(place).ok())
    }

    /// True if `input` has a source: always on the virtual drill, else if it is wired.
    pub fn tells(&self, input: Input) -> bool {
        match self.output {
            Output::Virtual => true,
            Output::Card | Output::Parallel => self.wiring().sensor(input) != UNWIRED,
            Output::Adapter => self.adapter.sensor(input).is_some(),
        }
    }

    /// Bit set of the inputs with a source.
    pub fn told_inputs(&self) -> u32 {
        Input::ALL.into_iter().filter(|input| self.tells(*input)).fold(0, |told, input| told | input.bit())
    }

    /// The active wiring: parallel port or card.
    pub fn wiring(&self) -> &Wiring {
        match self.output {
            Output::Parallel => &self.parallel.wiring,
            Output::Virtual | Output::Card | Output::Adapter => &self.card.wiring,
        }
    }

    /// Inputs that the machine needs: home switches, index pulses for homing, and the lower switch if it ends
    /// a plunge.
    pub(super) fn needed_inputs(&self) -> impl Iterator<Item = Input> {
        let ends = [0, 1, 2].map(|axis| self.home_input(axis));
        let pulses = (0..3).filter(|axis| self.axis(*axis).index).map(index_input);
        ends.into_iter().chain(pulses).chain((self.stroke_end == StrokeEnd::Sensor).then_some(Input::ZBottom))
    }

    /// The home switch of `axis`.
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
