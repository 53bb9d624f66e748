//! What no single field of a machine can tell: ranges inside out, heights out of reach, drives asked for too much, tables
//! whose rows do not belong together.
//!
//! Comes in: a machine. Goes out: remarks naming the field. What tables do is found by `dynamics` and `phases`.

use super::{DriveKind, Machine, StrokeEnd, card, dynamics, phases};
use crate::remark::{Remark, Weight};

/// The most outputs with a name.
const MOST_OUTPUTS: usize = 16;

/// What no single field can tell: ranges inside out, heights out of reach, drives asked for too much.
pub fn validate(machine: &Machine) -> Vec<Remark> {
    let mut remarks = Vec::new();
    let mut refuse = |code: &str, key: &str, value: f64, bound: f64| {
        remarks.push(refuse(code, key, value, bound));
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
    remarks.extend(outputs(machine));
    remarks.extend(drives(machine));
    remarks.extend(strokes(machine));
    remarks.extend(card::validate(machine));
    remarks
}

/// Names of outputs: a letter, then letters, digits or `_`; each once; `spindle` is taken.
fn outputs(machine: &Machine) -> Option<Remark> {
    let names = machine.card.names();
    let good = |name: &str| {
        name.starts_with(|c: char| c.is_ascii_alphabetic())
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
            && name.len() <= 32
            && name != "spindle"
    };
    let twice = |at: usize| names[..at].contains(&names[at]);
    let bad = (0..names.len()).find(|at| !good(&names[*at]) || twice(*at) || *at >= MOST_OUTPUTS)?;
    let remark = Remark::new(Weight::Loss, "machine.output_name").with("key", "card.output_names");
    Some(remark.with("name", &names[bad]).with("most", MOST_OUTPUTS))
}

/// Tables and pulses.
fn drives(machine: &Machine) -> Vec<Remark> {
    let mut remarks = Vec::new();
    remarks.extend(dynamics::check(&machine.dynamics).err().unwrap_or_default());
    for (name, axis) in [("x", &machine.x), ("y", &machine.y), ("z", &machine.z)] {
        remarks.extend(phases::check(&format!("{name}.phases"), &axis.phases).err().unwrap_or_default());
    }
    let period_us = 1e6 / f64::from(machine.max_step_hz);
    if 2.0 * machine.pulse_width_us > period_us {
        remarks.push(refuse(
            "machine.pulse_too_long",
            "drive.pulse_width",
            machine.pulse_width_us,
            period_us,
        ));
    }
    let fastest = f64::from(machine.max_step_hz) / machine.z.scale.steps_per_mm();
    if machine.down.max_speed_mm_per_s > fastest {
        let asked = machine.down.max_speed_mm_per_s;
        remarks.push(refuse("machine.faster_than_drive", "motion.down_speed", asked, fastest));
    }
    remarks
}

/// Heights and feeds.
fn strokes(machine: &Machine) -> Vec<Remark> {
    let mut remarks = Vec::new();
    let mut refuse = |code: &str, key: &str, value: f64, bound: f64| {
        remarks.push(refuse(code, key, value, bound));
    };
    let (process, overlap) = (&machine.process, &machine.overlap);
    let top = process.surface + process.safe_height;
    if top > machine.z.max {
        refuse("machine.safe_height_out_of_reach", "stroke.safe_height", top.mm(), machine.z.max.mm());
    }
    let bottom = process.surface - process.board_thickness - process.breakthrough;
    if bottom < machine.z.min {
        refuse("machine.stroke_out_of_reach", "stroke.surface", bottom.mm(), machine.z.min.mm());
    }
    let fastest = machine.z.max_speed_mm_per_s.min(machine.down.max_speed_mm_per_s);
    if process.feed_mm_per_s > fastest {
        refuse("machine.feed_too_fast", "stroke.feed", process.feed_mm_per_s, fastest);
    }
    let safe_mm = process.safe_height.mm();
    if process.feed_height > process.safe_height {
        refuse("machine.feed_height_too_high", "stroke.feed_height", process.feed_height.mm(), safe_mm);
    }
    if overlap.on && overlap.clear_mm >= safe_mm {
        refuse("machine.clear_too_high", "overlap.clear", overlap.clear_mm, safe_mm);
    }
    if overlap.on && (machine.stroke_end == StrokeEnd::Sensor || machine.drive == DriveKind::Table) {
        let key = if machine.drive == DriveKind::Table { "drive.kind" } else { "stroke.end" };
        refuse("machine.overlap_without_count", key, 1.0, 0.0);
    }
    remarks
}

fn refuse(code: &str, key: &str, value: f64, bound: f64) -> Remark {
    Remark::new(Weight::Loss, code).with("key", key).with("value", value).with("bound", bound)
}
