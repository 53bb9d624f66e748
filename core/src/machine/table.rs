//! Rows of the settings table, section by section, with getters and setters.
//!
//! The locale tables hold the descriptions; `settings` checks the values.

use super::spindles::{listed, set_listed};
use super::tools::{MOST_RPM, rack_of, rack_value};
use super::value::{Setting, Value, ValueKind, number, text};
use super::{DriveKind, HomeEnd, Law, Output, ScaleUnit, StrokeEnd, ToolChange};
use crate::units::Length;

fn numbers(value: &Value) -> &[f64] {
    if let Value::Numbers(numbers) = value { numbers } else { &[] }
}

macro_rules! row {
    ($key:expr, $unit:literal, $kind:expr, $shapes:literal, $get:expr, $set:expr) => {
        Setting { key: $key, unit: $unit, kind: $kind, shapes_stream: $shapes, get: $get, set: $set }
    };
}
macro_rules! plain {
    ($key:expr, $unit:literal, $kind:expr, $shapes:literal, $($field:ident).+) => {
        row!($key, $unit, $kind, $shapes, |m| Value::Number(m.$($field).+), |m, v| m.$($field).+ = number(v))
    };
}
macro_rules! whole {
    ($key:expr, $unit:literal, $kind:expr, $shapes:literal, $($field:ident).+) => {
        row!($key, $unit, $kind, $shapes,
            |m| Value::Number(f64::from(m.$($field).+)), |m, v| m.$($field).+ = number(v) as u32)
    };
}
macro_rules! length {
    ($key:expr, $kind:expr, $shapes:literal, $($field:ident).+) => {
        row!($key, "mm", $kind, $shapes,
            |m| Value::Number(m.$($field).+.mm()), |m, v| m.$($field).+ = Length::from_mm(number(v)))
    };
}
macro_rules! words {
    ($key:expr, $shapes:literal, $($field:ident).+, $($word:literal => $variant:path),+) => {
        row!($key, "", ValueKind::Choice(&[$($word),+]), $shapes,
            |m| Value::Text(match m.$($field).+ { $($variant => $word),+ }.to_owned()),
            |m, v| m.$($field).+ = match text(v) { $($word => $variant,)+ _ => m.$($field).+ })
    };
}
macro_rules! wholes {
    ($key:expr, $low:literal, $high:literal, $($field:ident).+) => {
        row!($key, "", ValueKind::Wholes($low, $high), true,
            |m| Value::Numbers(m.$($field).+.iter().map(|n| f64::from(*n)).collect()),
            |m, v| m.$($field).+ = numbers(v).iter().map(|n| *n as u32).collect())
    };
}
macro_rules! law {
    ($key:expr, $($field:ident).+) => {
        words!($key, true, $($field).+, "linear" => Law::Linear, "s_curve" => Law::SCurve,
            "automatic" => Law::Automatic, "power" => Law::Power)
    };
}
macro_rules! axis {
    ($axis:ident) => {
        &[
            row!(concat!(stringify!($axis), ".scale"), "steps", ValueKind::Number(0.01, 1e5), true,
                |m| Value::Number(m.$axis.scale.micro_steps as f64 / 1e6),
                |m, v| m.$axis.scale.micro_steps = libm::round(number(v) * 1e6) as i64),
            words!(concat!(stringify!($axis), ".scale_per"), true, $axis.scale.per,
                "mm" => ScaleUnit::Millimetre, "inch" => ScaleUnit::Inch),
            whole!(concat!(stringify!($axis), ".gear_up"), "", ValueKind::Whole(1.0, 100_000.0), true,
                $axis.scale.gear_up),
            whole!(concat!(stringify!($axis), ".gear_down"), "", ValueKind::Whole(1.0, 100_000.0), true,
                $axis.scale.gear_down),
            length!(concat!(stringify!($axis), ".min"), ValueKind::Number(-2000.0, 2000.0), false, $axis.min),
            length!(concat!(stringify!($axis), ".max"), ValueKind::Number(-2000.0, 2000.0), false, $axis.max),
            plain!(concat!(stringify!($axis), ".max_speed"), "mm/s", ValueKind::Number(0.01, 5000.0), true,
                $axis.max_speed_mm_per_s),
            plain!(concat!(stringify!($axis), ".max_acceleration"), "mm/s²", ValueKind::Number(0.1, 200_000.0), true,
                $axis.max_acceleration_mm_per_s2),
            plain!(concat!(stringify!($axis), ".max_jerk"), "mm/s³", ValueKind::Number(1.0, 1e8), true,
                $axis.max_jerk_mm_per_s3),
            words!(concat!(stringify!($axis), ".home_end"), false, $axis.home,
                "min" => HomeEnd::Min, "max" => HomeEnd::Max),
            plain!(concat!(stringify!($axis), ".home_speed"), "mm/s", ValueKind::Number(0.01, 500.0), false,
                $axis.home_speed_mm_per_s),
            length!(concat!(stringify!($axis), ".home_search"), ValueKind::Number(0.1, 4000.0), false, $axis.home_search),
            length!(concat!(stringify!($axis), ".home_offset"), ValueKind::Number(0.0, 100.0), false, $axis.home_offset),
            row!(concat!(stringify!($axis), ".index"), "", ValueKind::Choice(&["no", "yes"]), false,
                |m| Value::Text(if m.$axis.index { "yes" } else { "no" }.to_owned()),
                |m, v| m.$axis.index = text(v) == "yes"),
            length!(concat!(stringify!($axis), ".index_within"), ValueKind::Number(0.01, 100.0), false, $axis.index_within),
            length!(concat!(stringify!($axis), ".backlash"), ValueKind::Number(0.0, 2.0), true, $axis.backlash),
            row!(concat!(stringify!($axis), ".phases"), "", ValueKind::Wholes(0.0, 255.0), false,
                |m| Value::Numbers(m.$axis.phases.columns.iter().map(|byte| f64::from(*byte)).collect()),
                |m, v| m.$axis.phases.columns = numbers(v).iter().map(|byte| *byte as u8).collect()),
        ]
    };
}

/// All sections; each is a `[table]` of the machine file.
pub const SECTIONS: &[(&str, &[Setting])] = &[
    (
        "machine",
        &[
            row!("machine.name", "", ValueKind::Text(60), false, |m| Value::Text(m.name.clone()), |m, v| m
                .name =
                text(v).to_owned()),
            row!(
                "machine.description",
                "",
                ValueKind::Text(400),
                false,
                |m| Value::Text(m.description.clone()),
                |m, v| m.description = text(v).to_owned()
            ),
            words!("machine.output", false, output, 
                "virtual" => Output::Virtual, "card" => Output::Card, "parallel" => Output::Parallel,
                "adapter" => Output::Adapter),
            whole!("machine.card_address", "", ValueKind::Whole(0.0, 65_535.0), false, card_address),
            whole!("machine.spindles", "", ValueKind::Whole(1.0, 6.0), true, spindles),
        ],
    ),
    ("card", super::card::ROWS),
    ("parallel", super::parallel::ROWS),
    ("adapter", super::adapter::ROWS),
    ("converter", super::converter::ROWS),
    ("x", axis!(x)),
    ("y", axis!(y)),
    ("z", axis!(z)),
    (
        "drive",
        &[
            words!("drive.kind", true, drive, "planned" => DriveKind::Planned, "table" => DriveKind::Table),
            whole!("drive.interrupt_frequency", "Hz", ValueKind::Whole(10.0, 20_000.0), true, interrupt_hz),
            wholes!("drive.period", 1.0, 10_000.0, dynamics.period),
            wholes!("drive.enter", 0.0, 1_000_000.0, dynamics.enter),
            wholes!("drive.leave", 0.0, 1_000_000.0, dynamics.leave),
            whole!("drive.max_step_rate", "Hz", ValueKind::Whole(10.0, 1_000_000.0), true, max_step_hz),
            whole!("drive.direction_setup", "µs", ValueKind::Whole(0.0, 10_000.0), true, direction_setup_us),
            plain!("drive.pulse_width", "µs", ValueKind::Number(0.0, 10_000.0), true, pulse_width_us),
        ],
    ),
    (
        "motion",
        &[
            law!("motion.plane", motion.plane),
            law!("motion.down", motion.down),
            law!("motion.up", motion.up),
            plain!("motion.order", "", ValueKind::Number(0.01, 2.0), true, motion.order),
            plain!(
                "motion.down_speed",
                "mm/s",
                ValueKind::Number(0.01, 5000.0),
                true,
                down.max_speed_mm_per_s
            ),
            plain!(
                "motion.down_acceleration",
                "mm/s²",
                ValueKind::Number(0.1, 200_000.0),
                true,
                down.max_acceleration_mm_per_s2
            ),
            plain!("motion.down_jerk", "mm/s³", ValueKind::Number(1.0, 1e8), true, down.max_jerk_mm_per_s3),
            plain!("motion.reserve", "", ValueKind::Number(0.0, 0.5), true, motion.reserve),
            plain!("motion.corner", "mm", ValueKind::Number(0.0, 1.0), true, motion.corner_mm),
        ],
    ),
    (
        "overlap",
        &[
            row!(
                "overlap.on",
                "",
                ValueKind::Choice(&["no", "yes"]),
                true,
                |m| Value::Text(if m.overlap.on { "yes" } else { "no" }.to_owned()),
                |m, v| m.overlap.on = text(v) == "yes"
            ),
            plain!("overlap.clear", "mm", ValueKind::Number(0.0, 100.0), true, overlap.clear_mm),
            plain!("overlap.latency", "ms", ValueKind::Number(0.0, 100.0), true, overlap.latency_ms),
            plain!("overlap.margin", "ms", ValueKind::Number(0.0, 1000.0), true, overlap.margin_ms),
            plain!("overlap.dwell_top", "ms", ValueKind::Number(0.0, 1000.0), true, overlap.dwell_top_ms),
        ],
    ),
    (
        "stroke",
        &[
            words!("stroke.end", true, stroke_end, "counted" => StrokeEnd::Counted, "sensor" => StrokeEnd::Sensor),
            plain!("stroke.longest_drilling", "s", ValueKind::Number(0.1, 600.0), true, longest_drilling_s),
            plain!("stroke.settle", "ms", ValueKind::Number(0.0, 5000.0), true, settle_ms),
            length!("stroke.safe_height", ValueKind::Number(0.1, 100.0), true, process.safe_height),
            length!("stroke.feed_height", ValueKind::Number(0.0, 100.0), true, process.feed_height),
            length!("stroke.board_thickness", ValueKind::Number(0.1, 20.0), true, process.board_thickness),
            length!("stroke.breakthrough", ValueKind::Number(0.0, 10.0), true, process.breakthrough),
            length!(
                "stroke.contact_tolerance",
                ValueKind::Number(0.0, 5.0),
                false,
                process.contact_tolerance
            ),
            plain!("stroke.touch_speed", "mm/s", ValueKind::Number(0.2, 10.0), false, process.touch_mm_per_s),
            row!(
                "stroke.lift_at_pause",
                "",
                ValueKind::Choice(&["no", "yes"]),
                false,
                |m| Value::Text(if m.process.lift_at_pause { "yes" } else { "no" }.to_owned()),
                |m, v| m.process.lift_at_pause = text(v) == "yes"
            ),
            plain!("stroke.feed", "mm/s", ValueKind::Number(0.01, 500.0), true, process.feed_mm_per_s),
            plain!(
                "stroke.dwell_bottom",
                "ms",
                ValueKind::Number(0.0, 10_000.0),
                true,
                process.dwell_bottom_ms
            ),
            length!("stroke.surface", ValueKind::Number(-500.0, 0.0), false, process.surface),
        ],
    ),
    (
        "spindle",
        &[
            row!(
                "spindle.enabled",
                "",
                ValueKind::Wholes(0.0, 1.0),
                false,
                |m| Value::Numbers((0..m.spindles).map(|z| f64::from(m.enabled >> z & 1)).collect()),
                |m, v| {
                    let off = numbers(v).iter().take(8).enumerate().filter(|(_, on)| **on == 0.0);
                    m.enabled = off.fold(u8::MAX, |set, (z, _)| set & !(1 << z));
                }
            ),
            row!(
                "spindle.deeper",
                "mm",
                ValueKind::Numbers(-20.0, 20.0),
                true,
                |m| listed(m, |own| own.deeper.mm()),
                |m, v| set_listed(m, v, |own, mm| own.deeper = Length::from_mm(mm))
            ),
            row!(
                "spindle.longer",
                "mm",
                ValueKind::Numbers(-100.0, 100.0),
                false,
                |m| listed(m, |own| own.longer.mm()),
                |m, v| set_listed(m, v, |own, mm| own.longer = Length::from_mm(mm))
            ),
            row!(
                "spindle.margin",
                "ms",
                ValueKind::Numbers(0.0, 1000.0),
                true,
                |m| listed(m, |own| own.margin_ms),
                |m, v| set_listed(m, v, |own, ms| own.margin_ms = ms)
            ),
            whole!("spindle.speed", "rpm", ValueKind::Whole(0.0, MOST_RPM as f64), true, process.spindle_rpm),
            whole!(
                "spindle.max_speed",
                "rpm",
                ValueKind::Whole(0.0, MOST_RPM as f64),
                false,
                process.max_rpm
            ),
            plain!("spindle.spin_up", "ms", ValueKind::Number(0.0, 60_000.0), true, process.spin_up_ms),
        ],
    ),
    (
        "rack",
        &[
            row!("rack.tools", "", ValueKind::Tools, false, |m| rack_value(&m.rack), |m, v| m.rack =
                rack_of(v).unwrap_or_default()),
            length!("rack.tolerance", ValueKind::Number(0.0, 1.0), false, rack_tolerance),
            words!("rack.change", false, tool_change,
                "manual" => ToolChange::Manual, "magazine" => ToolChange::Magazine,
                "unattended" => ToolChange::Unattended),
        ],
    ),
    ("magazine", super::magazine::ROWS),
    ("foot", super::foot::ROWS),
    ("park", super::park::ROWS),
    ("change", super::change::ROWS),
];
