//! Segments of one row, from the machine's basic moves (`motion::cycles`).

use super::rules::bottom;
use crate::diagnostic::Diagnostic;
use crate::job::{Gate, Input, Mark, Otherwise, Stage, Switching};
use crate::machine::{Machine, Steps, StrokeEnd};
use crate::motion::{Timeline, cycles};
use crate::steps::{self, Segment, TICK_HZ};

pub(super) fn segments(timeline: &Timeline, machine: &Machine) -> Vec<Segment> {
    timeline.moves.iter().map(|planned| steps::segment(planned, machine)).collect()
}

/// A rest, with something switched at its start.
pub(super) fn rest(end: Steps, duration_ticks: u64, effect: Switching) -> Segment {
    let (stage, mark) = (Stage::Dwell, Mark::Prepare);
    Segment { leg: 0, mark, stage, duration_ticks, runs: Vec::new(), effect, gate: None, end }
}

/// X and Y in a straight line ([`cycles::travel`]).
pub fn travel(machine: &Machine, from: Steps, to: Steps) -> Result<Vec<Segment>, Diagnostic> {
    Ok(cycles::travel(machine, from, to)?.iter().flat_map(|way| segments(way, machine)).collect())
}

/// Through the board: settle, down to just above it, then at feed to the lower switch or, without one, by
/// counted steps.
pub(super) fn down(machine: &Machine, from: Steps) -> Result<Vec<Segment>, Diagnostic> {
    let gate = (machine.stroke_end == StrokeEnd::Sensor).then(|| Gate {
        input: Input::ZBottom,
        deadline_us: libm::round(machine.longest_drilling_s * 1e6) as u32,
        otherwise: Otherwise::Alarm,
    });
    let mut pieces = foot(machine, from, true);
    pieces.extend(segments(&cycles::stroke(machine, from, bottom(machine), gate)?, machine));
    Ok(pieces)
}

/// Moves the presser foot and waits for it; nothing without a foot.
pub(super) fn foot(machine: &Machine, at: Steps, down: bool) -> Vec<Segment> {
    let press = || rest(at, machine.foot.ticks(), Switching::Foot { down });
    machine.foot.on.then(press).into_iter().collect()
}

pub(super) fn up(machine: &Machine, from: Steps, z: i64) -> Result<Vec<Segment>, Diagnostic> {
    let mut pieces = segments(&cycles::retract(machine, from, z)?, machine);
    let mut above = from;
    cycles::together(machine, 2).for_each(|axis| above[axis] = z);
    pieces.extend(foot(machine, above, false));
    Ok(pieces)
}

/// All the way up, presser foot up and spindle off; then to the park position.
pub fn park(machine: &Machine, from: Steps) -> Result<Vec<Segment>, Diagnostic> {
    let mut above = from;
    machine.spindle_axes().for_each(|axis| above[axis] = from[axis].max(cycles::top(machine)));
    let mut to = above;
    to[..2].copy_from_slice(&cycles::park_place(machine));
    let mut pieces = segments(&cycles::go_to(machine, from, above)?, machine);
    pieces.extend(foot(machine, above, false));
    pieces.push(rest(above, 0, Switching::Spindle { rpm: 0 }));
    pieces.extend(travel(machine, above, to)?);
    Ok(pieces)
}

/// Sets the spindle speed, and waits to reach it.
pub(super) fn spindle(machine: &Machine, at: Steps, rpm: u32) -> Vec<Segment> {
    let spin_up = libm::ceil(machine.process.spin_up_ms * 1e-3 * TICK_HZ as f64) as u64;
    vec![rest(at, if rpm == 0 { 0 } else { spin_up }, Switching::Spindle { rpm })]
}

pub(super) fn wait(at: Steps, ticks: u64) -> Vec<Segment> {
    if ticks == 0 { Vec::new() } else { vec![rest(at, ticks, Switching::None)] }
}
