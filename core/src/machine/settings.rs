//! The one table of machine settings (A11, C2): key, unit, range, meaning, how to get and set. The file, the page, the
//! manual and the tests all read it. The sentence for each key is `setting.<key with dots as underscores>` in the
//! locale tables.
//!
//! Comes in: keys and values. Goes out: a [`Machine`] or remarks naming the field. Does not know any file format.

use super::{HomeEnd, Machine, Output, ScaleUnit, StrokeEnd, ToolChange};
use crate::remark::{Remark, Weight};
use crate::units::Length;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A setting's value as people write it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// A number in the setting's unit.
    Number(f64),
    /// A word or a line of text.
    Text(String),
    /// Several numbers in the setting's unit.
    Numbers(Vec<f64>),
}

impl fmt::Display for Value {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(out, "{number}"),
            Self::Text(text) => out.write_str(text),
            Self::Numbers(numbers) => {
                let words: Vec<_> = numbers.iter().map(f64::to_string).collect();
                out.write_str(&words.join(" "))
            }
        }
    }
}

/// What a value may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Text of at most so many characters.
    Text(usize),
    /// A number from … to ….
    Number(f64, f64),
    /// A whole number from … to ….
    Whole(f64, f64),
    /// One of these words.
    Choice(&'static [&'static str]),
    /// A list of numbers, each from … to …, at most 64 of them.
    Numbers(f64, f64),
}

/// Settings that decide which hardware is touched: only the machine's file changes them, never a page.
pub const IN_FILE_ONLY: [&str; 2] = ["machine.output", "machine.card_address"];

/// One row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Section and name, for example `x.max_speed`.
    pub key: &'static str,
    /// Unit of the numbers, empty for words.
    pub unit: &'static str,
    /// What is allowed.
    pub kind: Kind,
    /// Whether the step stream depends on it, so that it belongs into the fingerprint.
    pub shapes_stream: bool,
    get: fn(&Machine) -> Value,
    set: fn(&mut Machine, &Value),
}

impl Setting {
    /// Its value in `machine`.
    pub fn value(&self, machine: &Machine) -> Value {
        (self.get)(machine)
    }

    /// Key of its sentence in the locale tables.
    pub fn sentence_key(&self) -> String {
        format!("setting.{}", self.key.replace('.', "_"))
    }

    /// Why `value` cannot be, if it cannot.
    fn refusal(&self, value: &Value) -> Option<Remark> {
        let remark = |what: &str| {
            let code = format!("machine.setting_{what}");
            Some(
                Remark::new(Weight::Loss, &code)
                    .with("key", self.key)
                    .with("value", value)
                    .with("unit", self.unit),
            )
        };
        let inside = |number: f64, low: f64, high: f64| number.is_finite() && (low..=high).contains(&number);
        let range = |low: f64, high: f64| remark("range").map(|r| r.with("low", low).with("high", high));
        match (self.kind, value) {
            (Kind::Text(longest), Value::Text(text)) => {
                if text.chars().count() > longest || text.chars().any(char::is_control) {
                    return remark("text").map(|r| r.with("longest", longest));
                }
                None
            }
            (Kind::Number(low, high), Value::Number(number)) => {
                if inside(*number, low, high) {
                    None
                } else {
                    range(low, high)
                }
            }
            (Kind::Whole(low, high), Value::Number(number)) => {
                if inside(*number, low, high) && libm::trunc(*number) == *number {
                    None
                } else {
                    range(low, high)
                }
            }
            (Kind::Choice(words), Value::Text(text)) => {
                if words.contains(&text.as_str()) {
                    return None;
                }
                remark("choice").map(|r| r.with("words", words.join(", ")))
            }
            (Kind::Numbers(low, high), Value::Numbers(numbers)) => {
                if numbers.len() <= 64 && numbers.iter().all(|n| inside(*n, low, high)) {
                    return None;
                }
                range(low, high)
            }
            _ => remark("kind"),
        }
    }
}

fn number(value: &Value) -> f64 {
    if let Value::Number(number) = value { *number } else { 0.0 }
}

fn text(value: &Value) -> &str {
    if let Value::Text(text) = value { text } else { "" }
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
        row!($key, "", Kind::Choice(&[$($word),+]), $shapes,
            |m| Value::Text(match m.$($field).+ { $($variant => $word),+ }.to_owned()),
            |m, v| m.$($field).+ = match text(v) { $($word => $variant,)+ _ => m.$($field).+ })
    };
}
macro_rules! axis {
    ($axis:ident) => {
        &[
            row!(concat!(stringify!($axis), ".scale"), "steps", Kind::Number(0.01, 1e5), true,
                |m| Value::Number(m.$axis.scale.micro_steps as f64 / 1e6),
                |m, v| m.$axis.scale.micro_steps = libm::round(number(v) * 1e6) as i64),
            words!(concat!(stringify!($axis), ".scale_per"), true, $axis.scale.per,
                "mm" => ScaleUnit::Millimetre, "inch" => ScaleUnit::Inch),
            length!(concat!(stringify!($axis), ".min"), Kind::Number(-2000.0, 2000.0), false, $axis.min),
            length!(concat!(stringify!($axis), ".max"), Kind::Number(-2000.0, 2000.0), false, $axis.max),
            plain!(concat!(stringify!($axis), ".max_speed"), "mm/s", Kind::Number(0.01, 5000.0), true,
                $axis.max_speed_mm_per_s),
            plain!(concat!(stringify!($axis), ".max_acceleration"), "mm/s²", Kind::Number(0.1, 200_000.0), true,
                $axis.max_acceleration_mm_per_s2),
            plain!(concat!(stringify!($axis), ".max_jerk"), "mm/s³", Kind::Number(1.0, 1e8), true,
                $axis.max_jerk_mm_per_s3),
            words!(concat!(stringify!($axis), ".home_end"), false, $axis.home,
                "min" => HomeEnd::Min, "max" => HomeEnd::Max),
            plain!(concat!(stringify!($axis), ".home_speed"), "mm/s", Kind::Number(0.01, 500.0), false,
                $axis.home_speed_mm_per_s),
            length!(concat!(stringify!($axis), ".home_search"), Kind::Number(0.1, 4000.0), false, $axis.home_search),
            length!(concat!(stringify!($axis), ".home_offset"), Kind::Number(0.0, 100.0), false, $axis.home_offset),
        ]
    };
}

/// The whole table, section by section: a section is a `[table]` of the machine file.
pub const SECTIONS: &[(&str, &[Setting])] = &[
    (
        "machine",
        &[
            row!("machine.name", "", Kind::Text(60), false, |m| Value::Text(m.name.clone()), |m, v| m.name =
                text(v).to_owned()),
            row!(
                "machine.description",
                "",
                Kind::Text(400),
                false,
                |m| Value::Text(m.description.clone()),
                |m, v| m.description = text(v).to_owned()
            ),
            words!("machine.output", false, output, "virtual" => Output::Virtual, "card" => Output::Card),
            whole!("machine.card_address", "", Kind::Whole(0.0, 65_535.0), false, card_address),
        ],
    ),
    ("x", axis!(x)),
    ("y", axis!(y)),
    ("z", axis!(z)),
    (
        "drive",
        &[
            whole!("drive.interrupt_frequency", "Hz", Kind::Whole(10.0, 20_000.0), false, interrupt_hz),
            whole!("drive.max_step_rate", "Hz", Kind::Whole(10.0, 1_000_000.0), true, max_step_hz),
            whole!("drive.direction_setup", "µs", Kind::Whole(0.0, 10_000.0), true, direction_setup_us),
        ],
    ),
    (
        "stroke",
        &[
            words!("stroke.end", true, stroke_end, "counted" => StrokeEnd::Counted, "sensor" => StrokeEnd::Sensor),
            plain!("stroke.longest_drilling", "s", Kind::Number(0.1, 600.0), true, longest_drilling_s),
            plain!("stroke.settle", "ms", Kind::Number(0.0, 5000.0), true, settle_ms),
            length!("stroke.safe_height", Kind::Number(0.1, 100.0), true, process.safe_height),
            length!("stroke.board_thickness", Kind::Number(0.1, 20.0), true, process.board_thickness),
            length!("stroke.breakthrough", Kind::Number(0.0, 10.0), true, process.breakthrough),
            plain!("stroke.feed", "mm/s", Kind::Number(0.01, 500.0), true, process.feed_mm_per_s),
            plain!("stroke.dwell_bottom", "ms", Kind::Number(0.0, 10_000.0), true, process.dwell_bottom_ms),
            length!("stroke.surface", Kind::Number(-500.0, 0.0), false, process.surface),
        ],
    ),
    (
        "spindle",
        &[
            whole!("spindle.speed", "rpm", Kind::Whole(0.0, 300_000.0), true, process.spindle_rpm),
            plain!("spindle.spin_up", "ms", Kind::Number(0.0, 60_000.0), true, process.spin_up_ms),
        ],
    ),
    (
        "rack",
        &[
            row!(
                "rack.bits",
                "mm",
                Kind::Numbers(0.05, 20.0),
                false,
                |m| Value::Numbers(m.rack.iter().map(|bit| bit.mm()).collect()),
                |m, v| if let Value::Numbers(bits) = v {
                    m.rack = bits.iter().map(|mm| Length::from_mm(*mm)).collect();
                }
            ),
            length!("rack.tolerance", Kind::Number(0.0, 1.0), false, rack_tolerance),
            words!("rack.change", false, tool_change,
                "manual" => ToolChange::Manual, "unattended" => ToolChange::Unattended),
        ],
    ),
];

/// Every setting in the order of the table.
pub fn settings() -> impl Iterator<Item = &'static Setting> {
    SECTIONS.iter().flat_map(|(_, rows)| rows.iter())
}

/// The setting called `key`.
pub fn setting(key: &str) -> Option<&'static Setting> {
    settings().find(|setting| setting.key == key)
}

/// All values of `machine`, in the order of the table.
pub fn read(machine: &Machine) -> Vec<(String, Value)> {
    settings().map(|setting| (setting.key.to_owned(), setting.value(machine))).collect()
}

/// `machine` with `changes` made, or every reason why not. Nothing is changed when anything is refused.
pub fn apply(machine: &Machine, changes: &[(String, Value)]) -> Result<Machine, Vec<Remark>> {
    let mut changed = machine.clone();
    let mut refusals = Vec::new();
    for (key, value) in changes {
        let Some(setting) = setting(key) else {
            refusals.push(Remark::new(Weight::Loss, "machine.setting_unknown").with("key", key));
            continue;
        };
        match setting.refusal(value) {
            Some(refusal) => refusals.push(refusal),
            None => (setting.set)(&mut changed, value),
        }
    }
    refusals.extend(validate(&changed));
    if refusals.is_empty() { Ok(changed) } else { Err(refusals) }
}

/// What no single field can tell: ranges inside out, heights out of reach, drives asked for too much.
pub fn validate(machine: &Machine) -> Vec<Remark> {
    let mut remarks = Vec::new();
    let mut refuse = |code: &str, key: &str, detail: f64, bound: f64| {
        let remark = Remark::new(Weight::Loss, code).with("key", key);
        remarks.push(remark.with("value", detail).with("bound", bound));
    };
    for (name, axis) in [("x", &machine.x), ("y", &machine.y), ("z", &machine.z)] {
        if axis.min >= axis.max {
            refuse("machine.range_inside_out", &format!("{name}.min"), axis.min.mm(), axis.max.mm());
        }
        if axis.home_offset > axis.max - axis.min {
            let travel = axis.max - axis.min;
            refuse(
                "machine.offset_beyond_travel",
                &format!("{name}.home_offset"),
                axis.home_offset.mm(),
                travel.mm(),
            );
        }
        let rate_hz = axis.max_speed_mm_per_s * axis.scale.steps_per_mm();
        if rate_hz > f64::from(machine.max_step_hz) {
            let fastest = f64::from(machine.max_step_hz) / axis.scale.steps_per_mm();
            refuse(
                "machine.faster_than_drive",
                &format!("{name}.max_speed"),
                axis.max_speed_mm_per_s,
                fastest,
            );
        }
    }
    let process = &machine.process;
    let top = process.surface + process.safe_height;
    if top > machine.z.max {
        refuse("machine.safe_height_out_of_reach", "stroke.safe_height", top.mm(), machine.z.max.mm());
    }
    let bottom = process.surface - process.board_thickness - process.breakthrough;
    if bottom < machine.z.min {
        refuse("machine.stroke_out_of_reach", "stroke.surface", bottom.mm(), machine.z.min.mm());
    }
    if process.feed_mm_per_s > machine.z.max_speed_mm_per_s {
        refuse("machine.feed_too_fast", "stroke.feed", process.feed_mm_per_s, machine.z.max_speed_mm_per_s);
    }
    remarks
}

#[cfg(test)]
mod tests {
    use super::super::{lab, virtual_drill};
    use super::*;

    #[test]
    fn every_setting_survives_a_round_trip_and_has_a_sentence() {
        for machine in [virtual_drill(), lab()] {
            assert_eq!(apply(&virtual_drill(), &read(&machine)).unwrap(), machine);
        }
        for setting in settings() {
            let key = setting.sentence_key();
            assert!(crate::locale::lookup("en", &key).is_some(), "no sentence {key}");
        }
    }

    #[test]
    fn a_bad_value_names_its_field_and_changes_nothing() {
        let rows: [(&str, Value, &str); 7] = [
            ("x.max_speed", Value::Number(f64::NAN), "machine.setting_range"),
            ("x.max_speed", Value::Number(0.0), "machine.setting_range"),
            ("x.max_speed", Value::Text("fast".into()), "machine.setting_kind"),
            ("x.home_end", Value::Text("left".into()), "machine.setting_choice"),
            ("x.min", Value::Number(900.0), "machine.range_inside_out"),
            ("stroke.feed", Value::Number(400.0), "machine.feed_too_fast"),
            ("x.colour", Value::Number(1.0), "machine.setting_unknown"),
        ];
        for (key, value, code) in rows {
            let refusals = apply(&virtual_drill(), &[(key.to_owned(), value)]).unwrap_err();
            assert_eq!(refusals[0].code, code);
            assert!(refusals[0].message("en").contains(key), "{}", refusals[0].message("en"));
        }
    }
}
