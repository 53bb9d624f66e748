//! Rows of the settings table, section by section.
//!
//! The locale tables hold the descriptions; `settings` checks the values.

use super::field::{
    ADVANCED, BUILT, FILE, Flags, Group, NONE, PROBING, SEVERAL, STEPS, STREAM, Setting, YES_NO, fields,
    number, words,
};
use super::spindles::{listed, set_listed};
use super::tools::{MOST_RPM, rack_of, rack_value};
use super::value::Value;
use super::value::ValueKind::{Number, Numbers, Text, Tools, Whole, Wholes};
use super::{DriveKind, HomeEnd, Law, Machine, Output, ScaleUnit, StrokeEnd, ToolChange};
use crate::units::Length;

const BOTH: Flags = STREAM.and(BUILT);

/// Highest spindle speed, rpm.
const RPM: f64 = MOST_RPM as f64;

words!(Law: "linear" => Law::Linear, "s_curve" => Law::SCurve, "automatic" => Law::Automatic,
    "power" => Law::Power);
words!(ScaleUnit: "mm" => ScaleUnit::Millimetre, "inch" => ScaleUnit::Inch);
words!(HomeEnd: "min" => HomeEnd::Min, "max" => HomeEnd::Max);
words!(Output: "virtual" => Output::Virtual, "card" => Output::Card, "parallel" => Output::Parallel,
    "adapter" => Output::Adapter);
words!(DriveKind: "planned" => DriveKind::Planned, "table" => DriveKind::Table);
words!(StrokeEnd: "counted" => StrokeEnd::Counted, "sensor" => StrokeEnd::Sensor);
words!(ToolChange: "manual" => ToolChange::Manual, "magazine" => ToolChange::Magazine,
    "unattended" => ToolChange::Unattended);

macro_rules! axis {
    ($name:literal, $axis:ident) => {
        fields! { Machine;
            (concat!($name, ".scale"), "steps", Number(0.01, 1e5), BOTH;
                |m| Some(Value::Number(m.$axis.scale.micro_steps as f64 / 1e6)),
                |m, v| m.$axis.scale.micro_steps = libm::round(number(v) * 1e6) as i64)
            (concat!($name, ".scale_per"), "", ScaleUnit::KIND, BOTH.and(ADVANCED), $axis.scale.per)
            (concat!($name, ".gear_up"), "", Whole(1.0, 100_000.0), BOTH.and(ADVANCED), $axis.scale.gear_up)
            (concat!($name, ".gear_down"), "", Whole(1.0, 100_000.0), BOTH.and(ADVANCED),
                $axis.scale.gear_down)
            (concat!($name, ".min"), "mm", Number(-2000.0, 2000.0), BUILT, $axis.min)
            (concat!($name, ".max"), "mm", Number(-2000.0, 2000.0), BUILT, $axis.max)
            (concat!($name, ".max_speed"), "mm/s", Number(0.01, 5000.0), BOTH, $axis.max_speed_mm_per_s)
            (concat!($name, ".max_acceleration"), "mm/s²", Number(0.1, 200_000.0), BOTH,
                $axis.max_acceleration_mm_per_s2)
            (concat!($name, ".max_jerk"), "mm/s³", Number(1.0, 1e8), BOTH.and(ADVANCED),
                $axis.max_jerk_mm_per_s3)
            (concat!($name, ".home_end"), "", HomeEnd::KIND, BUILT, $axis.home)
            (concat!($name, ".home_speed"), "mm/s", Number(0.01, 500.0), BUILT, $axis.home_speed_mm_per_s)
            (concat!($name, ".home_search"), "mm", Number(0.1, 4000.0), BUILT.and(ADVANCED),
                $axis.home_search)
            (concat!($name, ".home_offset"), "mm", Number(0.0, 100.0), BUILT.and(ADVANCED), $axis.home_offset)
            (concat!($name, ".index"), "", YES_NO, BUILT.and(ADVANCED), $axis.index)
            (concat!($name, ".index_within"), "mm", Number(0.01, 100.0), BUILT.and(ADVANCED),
                $axis.index_within)
            (concat!($name, ".backlash"), "mm", Number(0.0, 2.0), BOTH, $axis.backlash)
            (concat!($name, ".phases"), "", Wholes(0.0, 255.0), BUILT.and(ADVANCED), $axis.phases.columns)
        }
    };
}

const X: &[Setting] = axis!("x", x);
const Y: &[Setting] = axis!("y", y);
const Z: &[Setting] = axis!("z", z);

const MACHINE: &[Setting] = fields! { Machine;
    ("machine.name", "", Text(60), NONE, name)
    ("machine.description", "", Text(400), NONE, description)
    ("machine.output", "", Output::KIND, FILE.and(STEPS), output)
    ("machine.card_address", "", Whole(0.0, 65_535.0), FILE.and(ADVANCED).and(STEPS), card_address)
    ("machine.spindles", "", Whole(1.0, 6.0), BOTH, spindles)
};

const DRIVE: &[Setting] = fields! { Machine;
    ("drive.kind", "", DriveKind::KIND, BOTH, drive)
    ("drive.interrupt_frequency", "Hz", Whole(10.0, 20_000.0), BOTH.and(ADVANCED), interrupt_hz)
    ("drive.period", "", Wholes(1.0, 10_000.0), BOTH.and(ADVANCED), dynamics.period)
    ("drive.enter", "", Wholes(0.0, 1_000_000.0), BOTH.and(ADVANCED), dynamics.enter)
    ("drive.leave", "", Wholes(0.0, 1_000_000.0), BOTH.and(ADVANCED), dynamics.leave)
    ("drive.max_step_rate", "Hz", Whole(10.0, 1_000_000.0), BOTH, max_step_hz)
    ("drive.direction_setup", "µs", Whole(0.0, 10_000.0), BOTH.and(ADVANCED), direction_setup_us)
    ("drive.pulse_width", "µs", Number(0.0, 10_000.0), BOTH.and(ADVANCED), pulse_width_us)
};

const MOTION: &[Setting] = fields! { Machine;
    ("motion.plane", "", Law::KIND, STREAM, motion.plane)
    ("motion.down", "", Law::KIND, STREAM, motion.down)
    ("motion.up", "", Law::KIND, STREAM, motion.up)
    ("motion.order", "", Number(0.01, 2.0), STREAM.and(ADVANCED), motion.order)
    ("motion.down_speed", "mm/s", Number(0.01, 5000.0), STREAM, down.max_speed_mm_per_s)
    ("motion.down_acceleration", "mm/s²", Number(0.1, 200_000.0), STREAM, down.max_acceleration_mm_per_s2)
    ("motion.down_jerk", "mm/s³", Number(1.0, 1e8), STREAM.and(ADVANCED), down.max_jerk_mm_per_s3)
    ("motion.reserve", "", Number(0.0, 0.5), STREAM.and(ADVANCED), motion.reserve)
    ("motion.corner", "mm", Number(0.0, 1.0), STREAM.and(ADVANCED), motion.corner_mm)
};

const OVERLAP: &[Setting] = fields! { Machine;
    ("overlap.on", "", YES_NO, STREAM, overlap.on)
    ("overlap.clear", "mm", Number(0.0, 100.0), STREAM, overlap.clear_mm)
    ("overlap.latency", "ms", Number(0.0, 100.0), STREAM.and(ADVANCED), overlap.latency_ms)
    ("overlap.margin", "ms", Number(0.0, 1000.0), STREAM.and(ADVANCED), overlap.margin_ms)
    ("overlap.dwell_top", "ms", Number(0.0, 1000.0), STREAM.and(ADVANCED), overlap.dwell_top_ms)
};

const STROKE: &[Setting] = fields! { Machine;
    ("stroke.end", "", StrokeEnd::KIND, BOTH.and(ADVANCED), stroke_end)
    ("stroke.longest_drilling", "s", Number(0.1, 600.0), STREAM.and(ADVANCED), longest_drilling_s)
    ("stroke.settle", "ms", Number(0.0, 5000.0), STREAM, settle_ms)
    ("stroke.safe_height", "mm", Number(0.1, 100.0), STREAM, process.safe_height)
    ("stroke.feed_height", "mm", Number(0.0, 100.0), STREAM, process.feed_height)
    ("stroke.board_thickness", "mm", Number(0.1, 20.0), BOTH, process.board_thickness)
    ("stroke.breakthrough", "mm", Number(0.0, 10.0), BOTH, process.breakthrough)
    ("stroke.contact_tolerance", "mm", Number(0.0, 5.0), BUILT.and(PROBING).and(STEPS), process.contact_tolerance)
    ("stroke.touch_speed", "mm/s", Number(0.2, 10.0), PROBING.and(STEPS), process.touch_mm_per_s)
    ("stroke.lift_at_pause", "", YES_NO, NONE, process.lift_at_pause)
    ("stroke.feed", "mm/s", Number(0.01, 500.0), STREAM, process.feed_mm_per_s)
    ("stroke.dwell_bottom", "ms", Number(0.0, 10_000.0), STREAM.and(ADVANCED), process.dwell_bottom_ms)
    ("stroke.surface", "mm", Number(-500.0, 0.0), BUILT.and(PROBING), process.surface)
};

const SPINDLE: &[Setting] = fields! { Machine;
    ("spindle.enabled", "", Wholes(0.0, 1.0), SEVERAL;
        |m| Some(Value::Numbers((0..m.spindles).map(|z| f64::from(m.enabled >> z & 1)).collect())),
        set_enabled)
    ("spindle.deeper", "mm", Numbers(-20.0, 20.0), STREAM.and(SEVERAL).and(ADVANCED);
        |m| Some(listed(m, |own| own.deeper.mm())),
        |m, v| set_listed(m, v, |own, mm| own.deeper = Length::from_mm(mm)))
    ("spindle.longer", "mm", Numbers(-100.0, 100.0), BUILT.and(SEVERAL).and(ADVANCED);
        |m| Some(listed(m, |own| own.longer.mm())),
        |m, v| set_listed(m, v, |own, mm| own.longer = Length::from_mm(mm)))
    ("spindle.margin", "ms", Numbers(0.0, 1000.0), STREAM.and(SEVERAL).and(ADVANCED);
        |m| Some(listed(m, |own| own.margin_ms)), |m, v| set_listed(m, v, |own, ms| own.margin_ms = ms))
    ("spindle.speed", "rpm", Whole(0.0, RPM), STREAM, process.spindle_rpm)
    ("spindle.max_speed", "rpm", Whole(0.0, RPM), NONE, process.max_rpm)
    ("spindle.spin_up", "ms", Number(0.0, 60_000.0), STREAM, process.spin_up_ms)
};

fn set_enabled(machine: &mut Machine, value: &Value) {
    let Value::Numbers(numbers) = value else { return };
    let off = numbers.iter().take(8).enumerate().filter(|(_, on)| **on == 0.0);
    machine.enabled = off.fold(u8::MAX, |set, (z, _)| set & !(1 << z));
}

const RACK: &[Setting] = fields! { Machine;
    ("rack.tools", "", Tools, NONE;
        |m| Some(rack_value(&m.rack)), |m, v| m.rack = rack_of(v).unwrap_or_default())
    ("rack.tolerance", "mm", Number(0.0, 1.0), NONE, rack_tolerance)
    ("rack.change", "", ToolChange::KIND, NONE, tool_change)
};

/// A `[table]` of the machine file.
#[derive(Clone, Copy, Debug)]
pub struct Section {
    pub name: &'static str,
    pub group: Group,
    pub rows: &'static [Setting],
    /// True if the machine has what the section describes.
    has: fn(&Machine) -> bool,
    /// Only for machines whose steps Annulus makes.
    makes_steps: bool,
}

impl Section {
    const fn new(name: &'static str, group: Group, rows: &'static [Setting]) -> Self {
        Self { name, group, rows, has: |_| true, makes_steps: false }
    }

    const fn only_with(self, has: fn(&Machine) -> bool) -> Self {
        Self { has, ..self }
    }

    const fn of_steps(self) -> Self {
        Self { makes_steps: true, ..self }
    }

    /// True if `machine` has what the section describes. `plans` is true for a controller that plans its own
    /// motion.
    pub fn is_used(&self, machine: &Machine, plans: bool) -> bool {
        (self.has)(machine) && !(plans && self.makes_steps)
    }
}

/// All sections, in the order of the machine file and of the fingerprint.
pub const SECTIONS: &[Section] = &[
    Section::new("machine", Group::Machine, MACHINE),
    Section::new("card", Group::Wiring, super::card::ROWS).only_with(|m| m.output == Output::Card).of_steps(),
    Section::new("parallel", Group::Wiring, super::parallel::ROWS)
        .only_with(|m| m.output == Output::Parallel)
        .of_steps(),
    Section::new("adapter", Group::Wiring, super::adapter::ROWS)
        .only_with(|m| m.output == Output::Adapter)
        .of_steps(),
    Section::new("converter", Group::Spindle, super::converter::ROWS)
        .only_with(|m| m.converter.is_there())
        .of_steps(),
    Section::new("x", Group::Machine, X),
    Section::new("y", Group::Machine, Y),
    Section::new("z", Group::Machine, Z),
    Section::new("drive", Group::Motion, DRIVE).of_steps(),
    Section::new("motion", Group::Motion, MOTION),
    Section::new("overlap", Group::Motion, OVERLAP).only_with(|m| m.overlap.on).of_steps(),
    Section::new("stroke", Group::Motion, STROKE),
    Section::new("spindle", Group::Spindle, SPINDLE),
    Section::new("rack", Group::Tools, RACK),
    Section::new("magazine", Group::Tools, super::magazine::ROWS).only_with(Machine::has_magazine).of_steps(),
    Section::new("foot", Group::Spindle, super::foot::ROWS).only_with(|m| m.foot.on).of_steps(),
    Section::new("park", Group::Machine, super::park::ROWS),
    Section::new("change", Group::Tools, super::change::ROWS),
];
