//! The segments of one row, by the machine's own moves (`motion::cycles`).
//!
//! Comes in: a machine, where it stands, where it goes. Goes out: segments, each from rest to rest; none where nothing is
//! to be done. Does not know rows.

use super::rules::bottom;
use crate::diagnostic::Diagnostic;
use crate::job::{Gate, Input, Mark, Otherwise, Stage, Switching};
use crate::machine::{Machine, Steps, StrokeEnd};
use crate::motion::{Timeline, cycles};
use crate::steps::{self, Segment, TICK_HZ};

fn segments(timeline: &Timeline, machine: &Machine) -> Vec<Segment> {
    timeline.moves.iter().map(|planned| steps::segment(planned, machine)).collect()
}

/// A time of rest, with something switched at its beginning.
fn rest(end: Steps, duration_ticks: u64, effect: Switching) -> Segment {
    let (stage, mark) = (Stage::Dwell, Mark::Prepare);
    Segment { leg: 0, mark, stage, duration_ticks, runs: Vec::new(), effect, gate: None, end }
}

/// X and Y in a straight line. An axis with play that goes down comes up through it at the end, as it does by hand: rows say
/// where the bit is to be, not its motor.
pub fn travel(machine: &Machine, from: Steps, to: Steps) -> Result<Vec<Segment>, Diagnostic> {
    let mut beyond = to;
    for axis in (0..2).filter(|axis| to[*axis] < from[*axis]) {
        beyond[axis] -= machine.axis(axis).scale.steps(machine.axis(axis).backlash);
    }
    let moves = [cycles::go_to(machine, from, beyond)?, cycles::go_to(machine, beyond, to)?];
    Ok(moves.iter().flat_map(|way| segments(way, machine)).collect())
}

/// Through the board: settle, down to just above it, then at feed to the lower sensor or, without one, by counted steps.
pub(super) fn down(machine: &Machine, from: Steps) -> Result<Vec<Segment>, Diagnostic> {
    let gate = (machine.stroke_end == StrokeEnd::Sensor).then(|| Gate {
        input: Input::ZBottom,
        deadline_us: libm::round(machine.longest_drilling_s * 1e6) as u32,
        otherwise: Otherwise::Alarm,
    });
    Ok(segments(&cycles::stroke(machine, from, bottom(machine), gate)?, machine))
}

/// Z up.
pub(super) fn up(machine: &Machine, from: Steps, z: i64) -> Result<Vec<Segment>, Diagnostic> {
    Ok(segments(&cycles::retract(machine, from, z)?, machine))
}

/// Another spindle speed, and the time to reach it.
pub(super) fn spindle(machine: &Machine, at: Steps, rpm: u32) -> Vec<Segment> {
    let spin_up = libm::ceil(machine.process.spin_up_ms * 1e-3 * TICK_HZ as f64) as u64;
    vec![rest(at, if rpm == 0 { 0 } else { spin_up }, Switching::Spindle { rpm })]
}

/// Rest.
pub(super) fn wait(at: Steps, ticks: u64) -> Vec<Segment> {
    if ticks == 0 { Vec::new() } else { vec![rest(at, ticks, Switching::None)] }
}
