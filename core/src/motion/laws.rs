//! Laws of timelines, checked from closed forms alone: axis limits hold, every move starts where the previous
//! one ended, and there are no gaps in time.

use super::timeline::{AxisMove, Motion, Move, Timeline};
use super::{Limits, path};
use crate::code;
use crate::diagnostic::Diagnostic;
use crate::machine::{AXES, Machine, axis_name};
use crate::units::TICK_HZ;

const ROUNDING_SHARE: f64 = 1e-9;

/// All violations, at most one per move.
pub fn laws(timeline: &Timeline, machine: &Machine) -> Result<(), Vec<Diagnostic>> {
    let (mut at, mut now) = (timeline.start, 0);
    let mut broken = Vec::new();
    for (index, planned) in timeline.moves.iter().enumerate() {
        let diagnostic = |code: &str| Diagnostic::error(code).with("leg", planned.leg).with("move", index);
        if planned.from != at || planned.start_tick != now {
            broken.push(diagnostic(code!("motion.broken_chain")));
        } else if planned.parts.iter().any(|part| part.start_tick > planned.duration_ticks)
            || planned.parts.iter().any(|part| part.end_s() * TICK_HZ as f64 > planned.duration_ticks as f64)
        {
            broken.push(diagnostic(code!("motion.too_short")));
        } else if !chained(planned) {
            broken.push(diagnostic(code!("motion.broken_chain")));
        } else if let Some(why) = planned.parts.iter().find_map(|part| path_laws(machine, part).err()) {
            broken.push(why.with("leg", planned.leg).with("move", index));
        } else if let Some(axis) =
            (0..AXES).find(|axis| planned.parts.iter().any(|part| too_much(timeline, machine, part, *axis)))
        {
            broken.push(diagnostic(code!("motion.over_limit")).with("axis", axis_name(axis)));
        }
        (at, now) = (planned.to, planned.start_tick + planned.duration_ticks);
    }
    if broken.is_empty() { Ok(()) } else { Err(broken) }
}

/// True if the parts of every axis are consecutive in position and time.
fn chained(planned: &Move) -> bool {
    (0..AXES).all(|axis| {
        let (mut at, mut free_s) = (planned.from[axis], 0.0);
        for part in planned.parts.iter().filter(|part| part.moves(axis)) {
            if part.from[axis] != at || part.start_s() < free_s - 1e-9 {
                return false;
            }
            (at, free_s) = (part.to[axis], part.end_s());
        }
        at == planned.to[axis]
    })
}

fn path_laws(machine: &Machine, part: &AxisMove) -> Result<(), Diagnostic> {
    let Motion::Path(route) = &part.motion else { return Ok(()) };
    path::laws(&route.path, &Limits::of_path(machine), &path::PathRules::of(machine))
}

/// True if `axis` exceeds its limits. The highest speed, acceleration and jerk of a stroke are known in
/// closed form, and an axis has its share of each. Table-driven steps are only compared with the fastest
/// interrupts, because the motor must follow their jumps.
fn too_much(timeline: &Timeline, machine: &Machine, part: &AxisMove, axis: usize) -> bool {
    let way_mm = (part.to[axis] - part.from[axis]) as f64 * timeline.mm_per_step[axis];
    if way_mm == 0.0 {
        return false;
    }
    let settings = machine.axis(axis);
    let limits =
        if axis >= 2 && way_mm < 0.0 { Limits::of_down(machine) } else { Limits::of_axis(machine, settings) };
    match &part.motion {
        Motion::Path(_) => false,
        Motion::Line(stroke) => {
            let share = way_mm.abs() / stroke.length_mm();
            let over =
                |value: f64, limit: f64| value.is_nan() || value * share > limit * (1.0 + ROUNDING_SHARE);
            let (speed, acceleration, jerk) = stroke.peaks();
            over(speed, limits.speed_mm_per_s)
                || over(acceleration, limits.acceleration_mm_per_s2)
                || over(jerk, limits.jerk_mm_per_s3)
        }
        Motion::TableSteps(steps) => {
            let shortest = steps.stretches.iter().map(|some| some.interval).min().unwrap_or(1);
            let hz = TICK_HZ as f64 / (steps.interrupt_ticks * u64::from(shortest).max(1)) as f64;
            hz > f64::from(machine.pulse_hz()) * (1.0 + ROUNDING_SHARE)
        }
    }
}
