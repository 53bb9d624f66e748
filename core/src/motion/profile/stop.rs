//! Stopping distance of a moving axis, and the latest time for a stop.
//!
//! ```text
//! s ^ . . . . . . . . . . . . . surface
//!   | - - - - - - ,-' - - - - - gap
//!   |          ,'o  <- the latest time at which a stop still ends above the gap
//!   |       ,-'  |
//!   +----'-------+------------> t
//!               t_pnr
//! ```
//!
//! Maths: `docs/motion-profiles.md` C2.3.

use super::stroke::Stroke;
use super::{GREATEST, Limits, MotionLaw, wrong};
use crate::code;
use crate::diagnostic::Diagnostic;

/// Bisections for the point of no return: more than the digits of an `f64`.
const HALVINGS: u32 = 80;

/// Distance of the fastest stop from `speed_mm_per_s` (not negative) and `acceleration_mm_per_s2`, within
/// acceleration and jerk of `limits`. The linear law brakes at once with full acceleration.
///
/// If the braking already in progress stops the axis, the distance to that point.
pub fn stopping_mm(
    shape: MotionLaw,
    speed_mm_per_s: f64,
    acceleration_mm_per_s2: f64,
    limits: Limits,
) -> f64 {
    let (v, a) = (speed_mm_per_s, acceleration_mm_per_s2);
    if shape == MotionLaw::Linear {
        return 0.5 * v * v / limits.acceleration_mm_per_s2;
    }
    let j = limits.jerk_mm_per_s3;
    if a >= 0.0 {
        let t0 = a / j;
        let top = v + 0.5 * a * t0;
        return v * t0 + a * t0 * t0 / 3.0 + from_steady_mm(top, limits);
    }
    let braking = -a;
    let lost = 0.5 * braking * braking / j;
    if v >= lost {
        let before = v + lost;
        let gone = before * braking / j - braking * braking * braking / (6.0 * j * j);
        return (from_steady_mm(before, limits) - gone).max(0.0);
    }
    let t = 2.0 * v / (braking + libm::sqrt(braking * braking - 2.0 * j * v));
    t * (v - 0.5 * braking * t + j * t * t / 6.0)
}

/// Stopping distance from constant speed.
fn from_steady_mm(speed: f64, limits: Limits) -> f64 {
    let (a, j) = (limits.acceleration_mm_per_s2, limits.jerk_mm_per_s3);
    if speed >= a * (a / j) { 0.5 * speed * (speed / a + a / j) } else { speed * libm::sqrt(speed / j) }
}

/// The point of no return: the latest second of `stroke` at which a stop within `limits` ends at least
/// `gap_mm` before `surface_mm`, both measured along the stroke. Never later than contact with the surface.
///
/// Refuses unusable limits, and a gap that is negative or exceeds the distance to the surface.
pub fn point_of_no_return_s(
    stroke: &Stroke,
    surface_mm: f64,
    gap_mm: f64,
    limits: Limits,
) -> Result<f64, Diagnostic> {
    let shape = stroke.shape();
    shape.check(limits)?;
    if !(0.0..=GREATEST).contains(&surface_mm) {
        return Err(wrong(code!("motion.bad_length"), surface_mm));
    }
    if !(0.0..=surface_mm).contains(&gap_mm) {
        return Err(wrong(code!("motion.bad_gap"), gap_mm).with("height", surface_mm));
    }
    let ends_mm = |t: f64| {
        let stop_mm = stopping_mm(shape, stroke.speed(t), stroke.acceleration(t), limits);
        stroke.position_mm(t) + stop_mm
    };
    let (mut low, mut high) = (0.0, stroke.time_at(surface_mm));
    if ends_mm(high) <= surface_mm - gap_mm {
        return Ok(high);
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if ends_mm(middle) <= surface_mm - gap_mm {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(low)
}
