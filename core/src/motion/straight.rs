//! Straight moves of the axes. Backlash is removed first, and the first pulse waits until the direction is set.

use super::limits::{line, steps};
use super::profile::Stroke;
use super::timeline::{AxisMove, Motion};
use crate::diagnostic::Diagnostic;
use crate::job::Stage;
use crate::machine::{AXES, DriveKind, Machine, Steps};
use crate::units::TICK_HZ;

/// Rest at the end of every move, so that pulses with 1 µs tolerance never meet those of the next move.
pub(super) const REST_TICKS: u64 = 20;

/// Parts of a straight line of the motors: first the backlash of X and Y that reverse, then all axes
/// together. Table-driven axes move separately.
pub(super) fn lines(
    machine: &Machine,
    stage: Stage,
    from: Steps,
    to: Steps,
    speed_mm_per_s: f64,
    turned: [bool; AXES],
) -> Result<Vec<AxisMove>, Diagnostic> {
    if machine.drive == DriveKind::Table {
        return (0..AXES)
            .filter(|axis| from[*axis] != to[*axis])
            .map(|axis| {
                let mut alone = from;
                alone[axis] = to[axis];
                let motion = Motion::TableSteps(steps(machine, axis, to[axis] - from[axis], speed_mm_per_s)?);
                Ok(AxisMove { stage, start_tick: 0, from, to: alone, motion })
            })
            .collect();
    }
    let mut taken = from;
    for axis in 0..2 {
        let way = to[axis] - from[axis];
        if way != 0 && (way < 0) != turned[axis] {
            taken[axis] += way.signum() * play_steps(machine, axis).min(way.abs());
        }
    }
    let mut parts: Vec<AxisMove> = Vec::new();
    for (from, to) in [(from, taken), (taken, to)] {
        if from != to {
            let start_s = parts.last().map_or(0.0, AxisMove::end_s);
            let profile = line(machine, &from, &to, speed_mm_per_s)?;
            let stroke = Stroke::One(profile);
            let start_tick = start_tick(machine, start_s, &stroke, &from, &to);
            parts.push(AxisMove { stage, start_tick, from, to, motion: Motion::Line(stroke) });
        }
    }
    Ok(parts)
}

/// Earliest start tick of a line requested at `wanted_s`. Every axis must have its direction set up before
/// its first step, and pulses must keep their least interval. The first step of an axis is after half a step
/// of travel.
pub(super) fn start_tick(machine: &Machine, wanted_s: f64, stroke: &Stroke, from: &Steps, to: &Steps) -> u64 {
    let most = (0..AXES).map(|axis| (to[axis] - from[axis]).unsigned_abs()).max().unwrap_or(0);
    let first_step_s = stroke.time_at(0.5 * stroke.length_mm() / most.max(1) as f64);
    let direction_s = f64::from(machine.direction_setup_us) * 1e-6;
    let pulse_s = 1.0 / f64::from(machine.max_step_hz.max(1));
    let needed_s = direction_s.max(pulse_s) + REST_TICKS as f64 / TICK_HZ as f64;
    libm::ceil((wanted_s + (needed_s - first_step_s).max(0.0)) * TICK_HZ as f64) as u64
}

/// Backlash of `axis` in motor steps.
pub(super) fn play_steps(machine: &Machine, axis: usize) -> i64 {
    let axis = machine.axis(axis);
    axis.scale.steps(axis.backlash)
}
