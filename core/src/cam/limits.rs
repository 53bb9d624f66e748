//! Feeds and speeds bounded by what the machine does.
//!
//! ```text
//!   along the board   no faster than the slower of X and Y        isolate.feed = 400 on a small router: 16.7 mm/s, and a note
//!   down              no faster than Z, nor than Z on its way down
//!   spindle           no faster than spindle.max_speed
//!   a drill           goes down and turns as the rack says of it, where it does
//! ```
//!
//! Comes in: an operation, a machine, a bit. Goes out: the operation as it can be, and what was bounded. Does not know controllers.

use super::work::{Operation, OperationKind};
use crate::diagnostic::Diagnostic;
use crate::job::{Bit, Cutter};
use crate::machine::Machine;

/// The greatest feed along the board, mm/s.
fn plane(machine: &Machine) -> f64 {
    machine.x.max_speed_mm_per_s.min(machine.y.max_speed_mm_per_s)
}

/// The greatest feed down, mm/s.
fn down(machine: &Machine) -> f64 {
    machine.z.max_speed_mm_per_s.min(machine.down.max_speed_mm_per_s)
}

/// The greatest speed of the spindle, rpm; what the machine has as its usual speed it can turn. None where nobody said.
fn spindle(machine: &Machine) -> Option<u32> {
    let process = &machine.process;
    (process.max_rpm > 0).then(|| process.max_rpm.max(process.spindle_rpm))
}

/// The operation as `bit` does it: a drill of which the rack says how it goes down, or turns, does so, whatever the operation says
/// for all of them; all within what the machine can do.
pub(super) fn with_bit(operation: &Operation, bit: &Bit, machine: &Machine) -> Operation {
    let mut own = operation.clone();
    let drill = machine.rack.iter().find(|tool| bit.cutter == Cutter::Drill && tool.is(bit));
    if let Some(tool) = drill {
        if tool.down_mm_per_s > 0.0 {
            own.plunge_mm_per_s = tool.down_mm_per_s;
        }
        if tool.spindle_rpm > 0 {
            own.spindle_rpm = tool.spindle_rpm;
        }
    }
    within(&own, machine)
}

/// The operation with feeds and speed that the machine can do.
fn within(operation: &Operation, machine: &Machine) -> Operation {
    Operation {
        feed_mm_per_s: operation.feed_mm_per_s.min(plane(machine)),
        plunge_mm_per_s: operation.plunge_mm_per_s.min(down(machine)),
        spindle_rpm: spindle(machine).map_or(operation.spindle_rpm, |most| operation.spindle_rpm.min(most)),
        ..operation.clone()
    }
}

/// A note for every value of the operation that is bounded.
pub(super) fn bounded(operation: &Operation, machine: &Machine) -> Vec<Diagnostic> {
    let note = |code: &str, wanted: String, most: String| {
        Diagnostic::note(code).with("wanted", wanted).with("most", most)
    };
    let feed = |code: &str, wanted: f64, most: f64| {
        (wanted > most).then(|| note(code, format!("{wanted:.1}"), format!("{most:.1}")))
    };
    let mills = !matches!(operation.action, OperationKind::Drill(_));
    let along = feed("cam.feed_bounded", operation.feed_mm_per_s, plane(machine)).filter(|_| mills);
    let down = feed("cam.plunge_bounded", operation.plunge_mm_per_s, down(machine));
    let turning = spindle(machine).filter(|most| operation.spindle_rpm > *most);
    let turning =
        turning.map(|most| note("cam.speed_bounded", operation.spindle_rpm.to_string(), most.to_string()));
    [along, down, turning].into_iter().flatten().collect()
}
