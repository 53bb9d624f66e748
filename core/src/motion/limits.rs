//! Straight lines of the axes: limits of an axis projected onto the line, and the moves. Backlash is removed
//! first, and the first pulse waits until the direction is set.
//!
//! ```text
//!   y ^    . to        an axis has only its share of the path's speed:
//!     |  .'              share_x = |dx| / length
//!     |.'  from          path limit = min over axes of limit / share
//!     +-----------> x
//! ```

use super::automaton;
use super::profile::{self, Limits, MotionLaw, Profile, Stroke};
use super::timeline::{AxisMove, Motion, TableSteps};
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::job::Stage;
use crate::machine::{AXES, Axis, DriveKind, Law, Machine, Steps};
use crate::units::TICK_HZ;

impl Limits {
    const NONE: Self = Self {
        speed_mm_per_s: f64::INFINITY,
        acceleration_mm_per_s2: f64::INFINITY,
        jerk_mm_per_s3: f64::INFINITY,
    };

    /// Limits of one axis. The drive's pulse rate also limits the speed, rounded down to a whole number of
    /// ticks between pulses.
    pub fn of_axis(machine: &Machine, axis: &Axis) -> Self {
        Self {
            speed_mm_per_s: axis.max_speed_mm_per_s,
            acceleration_mm_per_s2: axis.max_acceleration_mm_per_s2,
            jerk_mm_per_s3: axis.max_jerk_mm_per_s3,
        }
        .slowed(drive_speed(machine, axis))
    }

    pub fn of_down(machine: &Machine) -> Self {
        Self {
            speed_mm_per_s: machine.down.max_speed_mm_per_s,
            acceleration_mm_per_s2: machine.down.max_acceleration_mm_per_s2,
            jerk_mm_per_s3: machine.down.max_jerk_mm_per_s3,
        }
        .slowed(drive_speed(machine, &machine.z))
    }

    /// Limits of X, Y and Z along a milled path. Z may move in both directions there, so both limits apply.
    pub fn of_path(machine: &Machine) -> [Self; 3] {
        let [x, y, z] = [&machine.x, &machine.y, &machine.z].map(|axis| Self::of_axis(machine, axis));
        // A path goes up and down: both limits of Z apply.
        [x, y, z.with_share(Self::of_down(machine), 1.0)]
    }

    /// Reduces the speed limit.
    #[must_use]
    pub fn slowed(self, speed_mm_per_s: f64) -> Self {
        Self { speed_mm_per_s: self.speed_mm_per_s.min(speed_mm_per_s), ..self }
    }

    fn with_share(self, axis: Self, share: f64) -> Self {
        Self {
            speed_mm_per_s: self.speed_mm_per_s.min(axis.speed_mm_per_s / share),
            acceleration_mm_per_s2: self.acceleration_mm_per_s2.min(axis.acceleration_mm_per_s2 / share),
            jerk_mm_per_s3: self.jerk_mm_per_s3.min(axis.jerk_mm_per_s3 / share),
        }
    }
}

/// Highest speed that the drive of `axis` permits, mm/s.
fn drive_speed(machine: &Machine, axis: &Axis) -> f64 {
    // Whole ticks, rounded up: never faster than the limit.
    let ticks = TICK_HZ.div_ceil(u64::from(machine.max_step_hz.max(1)));
    TICK_HZ as f64 / ticks as f64 / axis.scale.steps_per_mm()
}

pub(super) fn shape(
    machine: &Machine,
    law: Law,
    length_mm: f64,
    limits: Limits,
) -> Result<MotionLaw, Diagnostic> {
    Ok(match law {
        Law::Linear => MotionLaw::Linear,
        Law::SCurve => MotionLaw::SCurve,
        Law::Power => MotionLaw::Power(machine.motion.order),
        Law::Automatic => profile::choose(length_mm, limits)?.choice,
    })
}

pub(super) fn mm_per_step(machine: &Machine) -> [f64; AXES] {
    std::array::from_fn(|axis| 1.0 / machine.axis(axis).scale.steps_per_mm())
}

/// Lengths of a straight line in mm: in XY, of the spindles, and in total. Spindles move alike and count
/// once.
fn lengths_mm(mm_per_step: &[f64; AXES], from: &Steps, to: &Steps) -> (f64, f64, f64) {
    let way = |axis: usize| (to[axis] - from[axis]).abs() as f64 * mm_per_step[axis];
    let plane = libm::sqrt(way(0) * way(0) + way(1) * way(1));
    let spindles = (2..AXES).map(way).fold(0.0, f64::max);
    let both = if spindles == 0.0 { plane } else { libm::sqrt(plane * plane + spindles * spindles) };
    (plane, spindles, both)
}

/// The fastest straight line from rest at `from` to rest at `to`, at most at `speed_mm_per_s` along the path.
/// Lines with XY follow the law of XY; lines of spindles alone follow the law of their direction.
pub(super) fn line(
    machine: &Machine,
    from: &Steps,
    to: &Steps,
    speed_mm_per_s: f64,
) -> Result<Profile, Diagnostic> {
    let mm_per_step = mm_per_step(machine);
    let (plane_mm, _, length_mm) = lengths_mm(&mm_per_step, from, to);
    let mut limits = Limits::NONE.slowed(speed_mm_per_s);
    for axis in (0..AXES).filter(|axis| from[*axis] != to[*axis]) {
        let share = (to[axis] - from[axis]).unsigned_abs() as f64 * mm_per_step[axis] / length_mm;
        let down = axis >= 2 && to[axis] < from[axis];
        let own = if down { Limits::of_down(machine) } else { Limits::of_axis(machine, machine.axis(axis)) };
        limits = limits.with_share(own, share);
    }
    let down = (2..AXES).any(|axis| to[axis] < from[axis]);
    let law = match (plane_mm > 0.0, down) {
        (true, _) => machine.motion.plane,
        (false, true) => machine.motion.down,
        (false, false) => machine.motion.up,
    };
    profile::plan(shape(machine, law, length_mm, limits)?, length_mm, limits)
}

/// Steps of a table-driven axis over `way` steps, at most at `speed_mm_per_s` and the axis's own speeds.
/// Motor limits are not applied: the table decides.
fn steps(machine: &Machine, axis: usize, way: i64, speed_mm_per_s: f64) -> Result<TableSteps, Diagnostic> {
    let down = axis >= 2 && way < 0;
    let own = machine.axis(axis);
    let down_speed = if down { machine.down.max_speed_mm_per_s } else { f64::INFINITY };
    let state = machine.fastest_state(own, speed_mm_per_s.min(own.max_speed_mm_per_s).min(down_speed));
    let table = automaton::capped(&machine.dynamics, state);
    let interrupt_ticks = TICK_HZ.div_ceil(u64::from(machine.interrupt_hz.max(1)));
    Ok(TableSteps { interrupt_ticks, stretches: automaton::stretches(&table, way.unsigned_abs())? })
}

/// Time of an XY rapid; infinite if the machine's limits are invalid.
pub fn rapid_time_s(machine: &Machine, from: Point, to: Point) -> f64 {
    if machine.drive == DriveKind::Table {
        let way = |axis: usize, from, to| {
            let scale = machine.axis(axis).scale;
            steps(machine, axis, scale.steps(to) - scale.steps(from), f64::INFINITY)
                .map_or(f64::INFINITY, |steps| steps.duration_ticks() as f64 / TICK_HZ as f64)
        };
        // Axes on a table start together and run on their own: the slower one decides.
        return way(0, from.x, to.x).max(way(1, from.y, to.y));
    }
    let length_mm = from.distance_mm(to);
    if length_mm <= 0.0 {
        return 0.0;
    }
    let mut limits = Limits::NONE;
    for (axis, way) in [(&machine.x, to.x - from.x), (&machine.y, to.y - from.y)] {
        if way.nm() != 0 {
            limits = limits.with_share(Limits::of_axis(machine, axis), way.abs().mm() / length_mm);
        }
    }
    let shape = shape(machine, machine.motion.plane, length_mm, limits);
    shape
        .and_then(|shape| profile::plan(shape, length_mm, limits))
        .map_or(f64::INFINITY, |profile| profile.duration_s())
}

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

pub(super) fn play_steps(machine: &Machine, axis: usize) -> i64 {
    let axis = machine.axis(axis);
    axis.scale.steps(axis.backlash)
}
