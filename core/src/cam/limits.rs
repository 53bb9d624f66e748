//! Limits feeds and speeds to the machine.
//!
//! ```text
//!   XY                no faster than the slower of X and Y        isolate.feed = 400: 16.7 mm/s, and a note
//!   down              no faster than Z, and than Z's limit downwards
//!   spindle           no faster than spindle.max_speed
//!   a drill           uses feed and speed of its entry in the tools, if given
//! ```

use super::usual::Speeds;
use super::work::{Operation, OperationKind};
use crate::diagnostic::Diagnostic;
use crate::job::{Bit, Cutter};
use crate::machine::Machine;

/// Highest feed in XY, mm/s.
fn plane(machine: &Machine) -> f64 {
    machine.x.max_speed_mm_per_s.min(machine.y.max_speed_mm_per_s)
}

/// Highest feed down, mm/s.
fn down(machine: &Machine) -> f64 {
    machine.z.max_speed_mm_per_s.min(machine.down.max_speed_mm_per_s)
}

/// Highest speed of the spindle, rpm; `None` if the machine doesn't state it.
fn spindle(machine: &Machine) -> Option<u32> {
    Some(machine.process.max_rpm).filter(|most| *most > 0)
}

/// The speeds of the operation with `bit`. Feed and speed given for a drill in the tools take precedence over
/// the operation's. All are limited to the machine.
pub(super) fn with_bit(operation: &Operation, bit: &Bit, machine: &Machine) -> Speeds {
    let mut own = operation.speeds(machine);
    let drill = machine.rack.iter().find(|tool| bit.cutter == Cutter::Drill && tool.is(bit));
    if let Some(tool) = drill {
        if tool.down_mm_per_s > 0.0 {
            own.plunge_mm_per_s = tool.down_mm_per_s;
        }
        if tool.spindle_rpm > 0 {
            own.spindle_rpm = tool.spindle_rpm;
        }
    }
    within(own, machine)
}

/// Limits speeds to the machine.
fn within(speeds: Speeds, machine: &Machine) -> Speeds {
    Speeds {
        feed_mm_per_s: speeds.feed_mm_per_s.min(plane(machine)),
        plunge_mm_per_s: speeds.plunge_mm_per_s.min(down(machine)),
        spindle_rpm: spindle(machine).map_or(speeds.spindle_rpm, |most| speeds.spindle_rpm.min(most)),
    }
}

/// A note for every speed that the user set and that is limited. Default speeds are already those of the
/// machine.
pub(super) fn bounded(operation: &Operation, machine: &Machine) -> Vec<Diagnostic> {
    let note = |code: &str, wanted: String, most: String| {
        Diagnostic::note(code).with("wanted", wanted).with("most", most)
    };
    let feed = |code: &str, wanted: Option<f64>, most: f64| {
        let wanted = wanted.filter(|wanted| *wanted > most)?;
        Some(note(code, format!("{wanted:.1}"), format!("{most:.1}")))
    };
    let mills = !matches!(operation.action, OperationKind::Drill(_));
    let along = feed("cam.feed_bounded", operation.feed_mm_per_s, plane(machine)).filter(|_| mills);
    let down = feed("cam.plunge_bounded", operation.plunge_mm_per_s, down(machine));
    let turning = spindle(machine).zip(operation.spindle_rpm).filter(|(most, wanted)| wanted > most);
    let turning =
        turning.map(|(most, wanted)| note("cam.speed_bounded", wanted.to_string(), most.to_string()));
    [along, down, turning].into_iter().flatten().collect()
}
