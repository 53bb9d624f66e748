//! Speed limits of pieces and corners, and limits of acceleration where two curves meet.
//!
//! Maths. The axes' shares limit a piece. On an arc of radius r, the centripetal acceleration v²/r and the
//! tangential acceleration a add up at right angles. v²/r may use 0.9 of the axes' limit, a the rest.
//! Similarly, tangential jerk (with v³/r²) and radial jerk (3va/r) share the axes' jerk. For a helix this
//! applies to its projection onto XY; its height has its share, as on a line. A slower arc permits more
//! tangential acceleration. So an arc with a slow end gets the one of several speeds with the shortest time.
//!
//! A corner with angle φ is treated as an arc that touches both sides and passes the corner at distance d.
//! Its radius is R = d·cos(φ/2)/(1 − cos(φ/2)), from R/cos(φ/2) − R = d. The centripetal acceleration v²/R
//! must stay within the axes' limit in the direction of the change. (The actual path keeps the sharp corner:
//! d is the assumed compliance of the machine.) So the speed of an axis with acceleration A never jumps by
//! more than √(8·A·d). Many small corners approximate a curve: in each, the speed of an axis may jump by at
//! most 0.6·A times the duration of the shorter side.
//!
//! Runs end without acceleration, except at corners. There, the axes change their speeds anyway and may keep
//! some acceleration. A path that brakes into a corner and accelerates after it may do both with up to P =
//! min(1, |Δ|)·A/|t₁ + t₂|, with directions t₁, t₂ and their difference Δ. The least P of all axes counts,
//! within the limit of the runs. So the acceleration of no axis jumps by more than A. At a reversal, P is the
//! limit of the runs, and no axis sees a jump: its acceleration keeps its direction.
//!
//! At a smooth transition from a line to an arc, the centripetal acceleration starts or ends at once. There,
//! the line may also brake or accelerate with up to P = v²/r, if the acceleration of no axis jumps by more
//! than A. The arc has none there.

use super::curve::{Curve, PathPoint};
use crate::machine::Machine;
use crate::motion::profile::Limits;

/// Share of the acceleration for the centripetal part on an arc.
const ACROSS_SHARE: f64 = 0.9;

/// Shares of the jerk on an arc. Rotation of the centripetal acceleration may use the first. Together with
/// the change of tangential acceleration, which has the same direction, it may use the second; the third is
/// always reserved for that change. The rest is for changes of the centripetal part.
const JERK_OF_TURNING_SHARE: f64 = 0.8;
const JERK_ALONG_SHARE: f64 = 0.8;
const JERK_OF_CHANGE_SHARE: f64 = 0.1;

/// Share of the acceleration for direction changes at many small corners.
pub(super) const OF_CORNERS_SHARE: f64 = 0.6;

/// Direction components that differ by less are a smooth transition, if a line meets an arc.
const SMOOTH_SINE: f64 = 1e-3;

/// Direction components that differ by less are equal.
const STRAIGHT_SINE: f64 = 1e-12;

/// Greatest braking before, and acceleration after, a corner or a transition between curves, mm/s².
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pulls {
    pub(super) before_mm_per_s2: f64,
    pub(super) after_mm_per_s2: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathRules {
    /// Share of every axis's acceleration that the plan may use, 0 < share ≤ 1; the rest is for hold and
    /// override.
    pub share: f64,
    /// d: assumed deviation of the machine in a corner, mm.
    pub deviation_mm: f64,
    /// A longer path is split, with rests between, s.
    pub longest_s: f64,
}

/// Longest path, in seconds: a run can't encode pulses more than 429 s apart.
const LONGEST_PATH_S: f64 = 300.0;

impl PathRules {
    /// From the settings `motion.reserve` and `motion.corner` of `machine`.
    pub fn of(machine: &Machine) -> Self {
        let (share, deviation_mm) = (1.0 - machine.motion.reserve, machine.motion.corner_mm);
        Self { share, deviation_mm, longest_s: LONGEST_PATH_S }
    }
}

/// Limits along a piece; arcs at the given share of their highest speed.
pub(super) fn along(curve: &Curve, feed_mm_per_s: f64, axes: &[Limits; 3], slower_share: f64) -> Limits {
    let mut limits = Limits {
        speed_mm_per_s: feed_mm_per_s,
        acceleration_mm_per_s2: f64::INFINITY,
        jerk_mm_per_s3: f64::INFINITY,
    };
    for (axis, own) in axes.iter().enumerate() {
        let share = curve.greatest_share(axis);
        if share > 0.0 {
            limits.speed_mm_per_s = limits.speed_mm_per_s.min(own.speed_mm_per_s / share);
        }
        if share > 0.0 && (axis > 1 || matches!(curve, Curve::Line { .. })) {
            limits.acceleration_mm_per_s2 =
                limits.acceleration_mm_per_s2.min(own.acceleration_mm_per_s2 / share);
            limits.jerk_mm_per_s3 = limits.jerk_mm_per_s3.min(own.jerk_mm_per_s3 / share);
        }
    }
    let Curve::Arc { radius_mm, .. } = *curve else { return limits };
    // In the XY projection, then along the path.
    let level = curve.level_share();
    let (a, j) = (
        axes[0].acceleration_mm_per_s2.min(axes[1].acceleration_mm_per_s2),
        axes[0].jerk_mm_per_s3.min(axes[1].jerk_mm_per_s3),
    );
    let by_pull = libm::sqrt(ACROSS_SHARE * a * radius_mm);
    let by_turning = libm::cbrt(JERK_OF_TURNING_SHARE * j * radius_mm * radius_mm);
    let speed = slower_share * (limits.speed_mm_per_s * level).min(by_pull).min(by_turning);
    let pull = speed * speed / radius_mm;
    let left = libm::sqrt((a - pull) * (a + pull));
    let turning = pull * speed / (radius_mm * j);
    let along = JERK_ALONG_SHARE.max(turning + JERK_OF_CHANGE_SHARE);
    let across = libm::sqrt((1.0 - along) * (1.0 + along));
    let by_change = across * j * radius_mm / (3.0 * speed);
    Limits {
        speed_mm_per_s: speed / level,
        acceleration_mm_per_s2: limits.acceleration_mm_per_s2.min(left.min(by_change) / level),
        jerk_mm_per_s3: limits.jerk_mm_per_s3.min((along - turning) * j / level),
    }
}

/// Change of direction between two curves; zero if it is below rounding.
pub(super) fn turn(before: &Curve, after: &Curve) -> PathPoint {
    let (from, to) = (before.tangent(before.length_mm()), after.tangent(0.0));
    let change: PathPoint = core::array::from_fn(|axis| to[axis] - from[axis]);
    if change.iter().all(|part| part.abs() < STRAIGHT_SINE) { [0.0; 3] } else { change }
}

pub(super) fn corner(change: PathPoint, shorter_mm: f64, axes: &[Limits; 3], rules: &PathRules) -> f64 {
    let size = libm::sqrt(change.iter().map(|part| part * part).sum());
    if size == 0.0 {
        return f64::INFINITY;
    }
    let half_sine = (0.5 * size).min(1.0);
    let cosine = libm::sqrt((1.0 - half_sine) * (1.0 + half_sine));
    let radius_mm = rules.deviation_mm * cosine * (1.0 + cosine) / (half_sine * half_sine);
    let (mut pull, mut curve) = (f64::INFINITY, f64::INFINITY);
    for (part, axis) in change.iter().map(|part| part.abs()).zip(axes).filter(|(part, _)| *part > 0.0) {
        pull = pull.min(axis.acceleration_mm_per_s2 * size / part);
        curve = curve.min(OF_CORNERS_SHARE * axis.acceleration_mm_per_s2 * shorter_mm / part);
    }
    libm::sqrt((pull * radius_mm).min(curve))
}

/// Greatest braking and acceleration where two curves meet, at `speed_mm_per_s`.
pub(super) fn pulls(before: &Curve, after: &Curve, speed_mm_per_s: f64, axes: &[Limits; 3]) -> Pulls {
    let pull = pull(before, after, axes);
    let arcs = [before, after].map(|curve| matches!(curve, Curve::Arc { .. }));
    let change = turn(before, after);
    if arcs[0] == arcs[1] || change.iter().any(|part| part.abs() > SMOOTH_SINE) {
        return Pulls { before_mm_per_s2: pull, after_mm_per_s2: pull };
    }
    let (way, bend) = if arcs[0] {
        (after.tangent(0.0), before.curvature(before.length_mm()))
    } else {
        (before.tangent(before.length_mm()), after.curvature(0.0))
    };
    let across = speed_mm_per_s * speed_mm_per_s * libm::sqrt(bend.iter().map(|part| part * part).sum());
    let left = |(axis, own): (usize, &Limits)| {
        (own.acceleration_mm_per_s2 - speed_mm_per_s * speed_mm_per_s * bend[axis].abs())
            / way[axis].abs().max(f64::MIN_POSITIVE)
    };
    let of_line = axes.iter().enumerate().map(left).fold(across, f64::min).max(0.0);
    if arcs[0] {
        Pulls { before_mm_per_s2: 0.0, after_mm_per_s2: of_line }
    } else {
        Pulls { before_mm_per_s2: of_line, after_mm_per_s2: 0.0 }
    }
}

/// P: the greatest braking into, and acceleration out of, the corner between two curves.
fn pull(before: &Curve, after: &Curve, axes: &[Limits; 3]) -> f64 {
    let change = turn(before, after);
    let size = libm::sqrt(change.iter().map(|part| part * part).sum()).min(1.0);
    let (from, to) = (before.tangent(before.length_mm()), after.tangent(0.0));
    let of_axis = |(axis, own): (usize, &Limits)| {
        size * own.acceleration_mm_per_s2 / (from[axis] + to[axis]).abs().max(f64::MIN_POSITIVE)
    };
    if size == 0.0 { 0.0 } else { axes.iter().enumerate().map(of_axis).fold(f64::INFINITY, f64::min) }
}
