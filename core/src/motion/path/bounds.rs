//! How fast a piece may be driven, how fast a corner, and how hard a path may be pulled where two curves meet.
//!
//! Comes in: curves, limits of X, Y and Z. Goes out: speeds in mm/s, accelerations in mm/s². Does not know how long anything takes.
//!
//! Maths. A piece is limited by its axes' shares of it. On an arc of radius r the pull to the centre v²/r and the
//! acceleration along it a add up at right angles: v²/r is kept to 0.9 of what the axes may do, a to what is then
//! left. In the same way jerk along (with v³/r²) and across (3va/r) the arc share the axes' jerk. Of a helix this holds
//! for what is seen from above; its height has its share, as on a line. The slower an arc is taken, the harder it may be sped
//! up on; one with a slow end is given the speed, of a few, at which it is done first.
//!
//! A corner that turns by φ is taken as if an arc touched both sides and passed the corner in the distance d: its radius
//! is R = d·cos(φ/2)/(1 − cos(φ/2)), from R/cos(φ/2) − R = d; the pull to its centre v²/R must stay within what the axes
//! may do in the direction of the change. (The corner is still driven sharp: d is how far the machine may give way.) So
//! no axis of acceleration A ever changes its speed in a corner by more than √(8·A·d). Many small corners are a curve:
//! in each of them no axis changes its speed by more than 0.6 of its acceleration does in the time of the shorter side.
//!
//! Runs end without acceleration, but for corners. There the axes change places anyway, and so they may keep some of their
//! pull: one that is braked into a corner and speeds up again behind it may do both with up to P = min(1, |Δ|)·A/|t₁ + t₂|
//! (t₁, t₂ the directions, Δ what they differ by; the least of all axes, and no more than the runs allow), so that no axis
//! gets another acceleration at once by more than A. Where the path turns back P is all that the runs allow, and no axis
//! feels anything: it goes on being pulled the same way.
//!
//! Where a line goes over into an arc without a corner, the pull to the centre comes or goes at once. There the line may be
//! braked or sped up with up to P = v²/r, too, which comes or goes with it, if no axis gets another acceleration by more
//! than A; the arc has none there.

use super::curve::{Curve, PathPoint};
use super::plan::PathRules;
use crate::motion::profile::Limits;

/// Share of the acceleration that may pull to the centre of an arc.
const ACROSS_SHARE: f64 = 0.9;

/// Shares of the jerk of an arc: what turning the pull may take; what it takes at least with the change of the acceleration,
/// which both point along the arc; and what is kept for that change in any case. The rest is for changing the pull.
const JERK_OF_TURNING_SHARE: f64 = 0.8;
const JERK_ALONG_SHARE: f64 = 0.8;
const JERK_OF_CHANGE_SHARE: f64 = 0.1;

/// Share of the acceleration with which many small corners may change the direction.
pub(super) const OF_CORNERS_SHARE: f64 = 0.6;

/// Parts of directions that differ by less than this are no corner, where a line goes over into an arc.
const SMOOTH_SINE: f64 = 1e-3;

/// Parts of directions that differ by less than this are the same.
const STRAIGHT_SINE: f64 = 1e-12;

/// How hard a path may be braked into a corner or a change of curves, and sped up behind it, mm/s².
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pulls {
    pub(super) before_mm_per_s2: f64,
    pub(super) after_mm_per_s2: f64,
}

/// The limits along a piece, an arc at the given share of its greatest speed.
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
    // As seen from above, then along the way.
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

/// How the direction changes from one curve to the next: nothing where it is less than rounding.
pub(super) fn turn(before: &Curve, after: &Curve) -> PathPoint {
    let (from, to) = (before.tangent(before.length_mm()), after.tangent(0.0));
    let change: PathPoint = core::array::from_fn(|axis| to[axis] - from[axis]);
    if change.iter().all(|part| part.abs() < STRAIGHT_SINE) { [0.0; 3] } else { change }
}

/// The greatest speed in a corner with the given change of direction and the shorter side.
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

/// How hard a path may be braked and sped up where two curves meet, at `speed_mm_per_s`.
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

/// P: how hard a path may be braked into the corner between two curves, and pulled out of it.
fn pull(before: &Curve, after: &Curve, axes: &[Limits; 3]) -> f64 {
    let change = turn(before, after);
    let size = libm::sqrt(change.iter().map(|part| part * part).sum()).min(1.0);
    let (from, to) = (before.tangent(before.length_mm()), after.tangent(0.0));
    let of_axis = |(axis, own): (usize, &Limits)| {
        size * own.acceleration_mm_per_s2 / (from[axis] + to[axis]).abs().max(f64::MIN_POSITIVE)
    };
    if size == 0.0 { 0.0 } else { axes.iter().enumerate().map(of_axis).fold(f64::INFINITY, f64::min) }
}
