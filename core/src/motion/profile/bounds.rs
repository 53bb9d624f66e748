//! Lower bounds on move times, and a reference: the snap-limited move.
//!
//! Maths: `docs/motion-profiles.md` D.1 (bounds; reference after Lambrechts et al., Trajectory planning and
//! feedforward design for electromechanical motion systems, 2005).

use super::{GREATEST, LEAST_LIMIT, Limits, MotionLaw, wrong};
use crate::diagnostic::Diagnostic;

/// Bisections for the reference's speed: more than the digits of an `f64`.
const HALVINGS: u32 = 120;

fn check(length_mm: f64, limits: Limits, snap_mm_per_s4: Option<f64>) -> Result<(), Diagnostic> {
    if !(0.0..=GREATEST).contains(&length_mm) {
        return Err(wrong("motion.bad_length", length_mm));
    }
    let bad_snap = snap_mm_per_s4.filter(|snap| !(LEAST_LIMIT..=GREATEST).contains(snap));
    bad_snap.map_or(Ok(()), |snap| Err(wrong("motion.bad_snap", snap)))?;
    MotionLaw::SCurve.check(limits)
}

/// Lower bound, in seconds, for any move over `length_mm` from rest to rest within `limits`, and within
/// `snap_mm_per_s4` if given.
pub fn least_duration_s(
    length_mm: f64,
    limits: Limits,
    snap_mm_per_s4: Option<f64>,
) -> Result<f64, Diagnostic> {
    check(length_mm, limits, snap_mm_per_s4)?;
    let by_speed = length_mm / limits.speed_mm_per_s;
    let by_acceleration = 2.0 * libm::sqrt(length_mm / limits.acceleration_mm_per_s2);
    let by_jerk = libm::cbrt(32.0 * length_mm / limits.jerk_mm_per_s3);
    let by_snap = snap_mm_per_s4.map_or(0.0, |snap| libm::sqrt(libm::sqrt(384.0 * length_mm / snap)));
    Ok(by_speed.max(by_acceleration).max(by_jerk).max(by_snap))
}

/// Duration of the symmetric move of fifteen phases over `length_mm`, in seconds, with limited speed,
/// acceleration, jerk and `snap_mm_per_s4`. Optimal if it cruises; without cruise up to 7 % slower than the
/// optimum.
pub fn fifteen_phases_s(length_mm: f64, limits: Limits, snap_mm_per_s4: f64) -> Result<f64, Diagnostic> {
    check(length_mm, limits, Some(snap_mm_per_s4))?;
    let ramp_s = |speed: f64| snap_ramp_s(speed, limits, snap_mm_per_s4);
    let full_s = ramp_s(limits.speed_mm_per_s);
    if length_mm >= limits.speed_mm_per_s * full_s {
        return Ok(full_s + length_mm / limits.speed_mm_per_s);
    }
    let (mut low, mut high) = (0.0, limits.speed_mm_per_s);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if middle * ramp_s(middle) < length_mm {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(2.0 * ramp_s(high))
}

/// Seconds of a ramp to `speed` with limited snap.
fn snap_ramp_s(speed: f64, limits: Limits, snap: f64) -> f64 {
    let (j, a) = (limits.jerk_mm_per_s3, limits.acceleration_mm_per_s2);
    let edge_s = |a: f64| if a >= j * j / snap { a / j + j / snap } else { 2.0 * libm::sqrt(a / snap) };
    if speed >= a * edge_s(a) {
        return speed / a + edge_s(a);
    }
    let t = j / snap;
    let reached = if speed >= 2.0 * j * t * t {
        2.0 * speed / (t + libm::sqrt(t * t + 4.0 * speed / j))
    } else {
        libm::cbrt(0.25 * speed * speed * snap)
    };
    2.0 * edge_s(reached)
}
