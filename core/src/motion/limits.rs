//! How fast a straight line may be taken: the limits of its axes, each seen along the line.
//!
//! ```text
//!   y ^    . to        an axis sees only its share of the path's speed:
//!     |  .'              share_x = |dx| / length
//!     |.'  from          path limit = min over axes of limit / share
//!     +-----------> x
//! ```
//!
//! Comes in: a machine, two places in steps. Goes out: a [`Profile`] along the line. Does not know why.

use super::profile::{self, Profile, Shape};
use crate::geometry::Point;
use crate::machine::{AXES, Axis, Machine, Steps};
use crate::remark::Remark;
use crate::units::TICK_HZ;

/// Greatest speed, acceleration and jerk of an axis or along a path (mm and s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// mm/s.
    pub speed: f64,
    /// mm/s².
    pub acceleration: f64,
    /// mm/s³.
    pub jerk: f64,
}

impl Limits {
    /// No limit at all.
    const NONE: Self = Self { speed: f64::INFINITY, acceleration: f64::INFINITY, jerk: f64::INFINITY };

    /// Of one axis. The speed is also held under the drive's pulse rate, taken down to a whole number of ticks
    /// between pulses.
    pub fn of_axis(machine: &Machine, axis: &Axis) -> Self {
        let ticks = TICK_HZ.div_ceil(u64::from(machine.max_step_hz.max(1)));
        let drive = TICK_HZ as f64 / ticks as f64 / axis.scale.steps_per_mm();
        Self {
            speed: axis.max_speed_mm_per_s.min(drive),
            acceleration: axis.max_acceleration_mm_per_s2,
            jerk: axis.max_jerk_mm_per_s3,
        }
    }

    /// These and also a lower speed.
    #[must_use]
    pub fn slowed(self, speed: f64) -> Self {
        Self { speed: self.speed.min(speed), ..self }
    }

    /// Both these, for an axis that has the given share of the path.
    fn with_share(self, axis: Self, share: f64) -> Self {
        Self {
            speed: self.speed.min(axis.speed / share),
            acceleration: self.acceleration.min(axis.acceleration / share),
            jerk: self.jerk.min(axis.jerk / share),
        }
    }

    /// The fastest move over `length_mm` within these limits.
    pub fn plan(self, length_mm: f64) -> Result<Profile, Remark> {
        profile::plan(Shape::SCurve, length_mm, self)
    }
}

/// Millimetres of one step, for every axis.
pub(super) fn mm_per_step(machine: &Machine) -> [f64; AXES] {
    std::array::from_fn(|axis| 1.0 / machine.axis(axis).scale.steps_per_mm())
}

/// Length of the straight line between two places.
fn length_mm(mm_per_step: &[f64; AXES], from: &Steps, to: &Steps) -> f64 {
    let squares = (0..AXES).map(|axis| {
        let mm = (to[axis] - from[axis]) as f64 * mm_per_step[axis];
        mm * mm
    });
    libm::sqrt(squares.sum())
}

/// The fastest straight line from rest at `from` to rest at `to`, not faster than `speed` along the path.
pub(super) fn line(machine: &Machine, from: &Steps, to: &Steps, speed: f64) -> Result<Profile, Remark> {
    let mm_per_step = mm_per_step(machine);
    let length_mm = length_mm(&mm_per_step, from, to);
    let mut limits = Limits::NONE.slowed(speed);
    for axis in (0..AXES).filter(|axis| from[*axis] != to[*axis]) {
        let share = (to[axis] - from[axis]).unsigned_abs() as f64 * mm_per_step[axis] / length_mm;
        limits = limits.with_share(Limits::of_axis(machine, machine.axis(axis)), share);
    }
    limits.plan(length_mm)
}

/// Time of a hop in the plane, X and Y moving together; infinite when the machine's limits are not usable.
pub fn hop_time_s(machine: &Machine, from: Point, to: Point) -> f64 {
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
    limits.plan(length_mm).map_or(f64::INFINITY, |profile| profile.duration_s())
}
