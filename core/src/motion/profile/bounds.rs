//! Measures of a move of one length: the law that suits it, lower bounds on its time, a reference (the
//! snap-limited move), and the residual vibration of the machine after it.
//!
//! ```text
//! ampli- ^ \
//! tude   |  \    ,-.           zeros at a whole number of periods in an edge,
//!        |   \  /   \  ,-.     in an edge and a hold, or between the two ramps
//!        |    \/     \/   \,
//!        +-------------------> frequency
//! ```
//!
//! Maths: `docs/motion-profiles.md` B.1–B.2 (choice of the law; Ma and You, thresholds and peak speeds
//! reconstructed there), D.1 (bounds; reference after Lambrechts et al., Trajectory planning and
//! feedforward design for electromechanical motion systems, 2005) and D.2 (vibration).

use super::{GREATEST, LEAST_LIMIT, Limits, MotionLaw, Profile, wrong};
use crate::code;
use crate::diagnostic::Diagnostic;
use core::f64::consts::PI;
use serde::{Deserialize, Serialize};

/// Bisections for the reference's speed: more than the digits of an `f64`.
const HALVINGS: u32 = 120;

fn check(length_mm: f64, limits: Limits, snap_mm_per_s4: Option<f64>) -> Result<(), Diagnostic> {
    if !(0.0..=GREATEST).contains(&length_mm) {
        return Err(wrong(code!("motion.bad_length"), length_mm));
    }
    let bad_snap = snap_mm_per_s4.filter(|snap| !(LEAST_LIMIT..=GREATEST).contains(snap));
    bad_snap.map_or(Ok(()), |snap| Err(wrong(code!("motion.bad_snap"), snap)))?;
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

/// Five-point Gauss quadrature: positions and weights in −1 … 1.
const GAUSS: [(f64, f64); 5] = [
    (-0.906_179_845_938_664, 0.236_926_885_056_189_1),
    (-0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.0, 0.568_888_888_888_888_9),
    (0.538_469_310_105_683_1, 0.478_628_670_499_366_5),
    (0.906_179_845_938_664, 0.236_926_885_056_189_1),
];

/// Most periods in an edge; with more, the amplitude is negligible.
const MOST_SWINGS: f64 = 1e4;

/// Amplitude in mm of the vibration at `frequency_hz` (above 0) after the move: |∫a(t)·e^(−i2πft)dt|/(2πf).
/// The acceleration is the convolution of an edge's jerk with a box of edge plus hold, once up and once down,
/// so its transform is a product.
pub fn residual_mm(profile: &Profile, frequency_hz: f64) -> Result<f64, Diagnostic> {
    if !(1e-9..=GREATEST).contains(&frequency_hz) {
        return Err(wrong(code!("motion.bad_frequency"), frequency_hz));
    }
    let sinc = |x: f64| if x.abs() < 1e-9 { 1.0 } else { libm::sin(PI * x) / (PI * x) };
    let swings = frequency_hz * profile.jerk_time_s;
    let edge = match profile.shape {
        MotionLaw::Linear => 1.0,
        MotionLaw::SCurve => sinc(swings),
        MotionLaw::Power(order) => power_edge(order, PI * swings.min(MOST_SWINGS)),
    };
    let hold = sinc(frequency_hz * (profile.jerk_time_s + profile.hold_s));
    let pair = libm::sin(PI * frequency_hz * (profile.ramp_s() + profile.cruise_s)) / (PI * frequency_hz);
    Ok((profile.speed_mm_per_s * edge * hold * pair).abs())
}

/// Transform of the power law's jerk over an edge, normalised to 1 at frequency 0: (1 + α)·∫ uᵅ·cos(φ(1 − u))
/// du over 0 … 1. Substitutes u = x³, so that the power is smooth at 0.
fn power_edge(order: f64, phi: f64) -> f64 {
    let panels = 32 + libm::ceil(phi) as u32;
    let half = 0.5 / f64::from(panels);
    let mut sum = 0.0;
    for panel in 0..panels {
        let middle = (2.0 * f64::from(panel) + 1.0) * half;
        for (place, weight) in GAUSS {
            let x = middle + half * place;
            let u = x * x * x;
            sum += weight * half * 3.0 * x * x * libm::pow(u, order) * libm::cos(phi * (1.0 - u));
        }
    }
    (1.0 + order) * sum
}

#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// L_T: the shortest length at which the linear law reaches the speed, mm.
    pub linear_from_mm: f64,
    /// L_S: the shortest length at which the S-curve reaches the speed, mm.
    pub s_curve_from_mm: f64,
    /// True if the S-curve reaches the full acceleration on the way to the speed.
    pub reaches_acceleration: bool,
    /// 1: both reach the speed. 2: only linear does. 3: neither.
    pub case: u8,
    pub choice: MotionLaw,
    /// The choice exactly as in the source, which never uses an S-curve without full acceleration.
    pub choice_strict: MotionLaw,
    /// Highest speed of the linear law over this length, mm/s.
    pub linear_peak_mm_per_s: f64,
    /// Highest speed of the S-curve over this length, mm/s.
    pub s_curve_peak_mm_per_s: f64,
}

/// Chooses between linear and S-curve for a move over `length_mm`. An unusable length or limit is refused and
/// named.
///
/// ```text
/// length  0 ───────── L_T ─────────── L_S ──────────▶
///           case 3         case 2          case 1
///           neither law    only linear     both laws reach the
///           reaches the    reaches the     speed: S-curve, the
///           speed: linear  speed           smoother one
/// ```
pub fn choose(length_mm: f64, limits: Limits) -> Result<Choice, Diagnostic> {
    if !(0.0..=GREATEST).contains(&length_mm) {
        return Err(wrong(code!("motion.bad_length"), length_mm));
    }
    MotionLaw::SCurve.check(limits)?;
    let Limits { speed_mm_per_s: v, acceleration_mm_per_s2: a, jerk_mm_per_s3: j } = limits;
    let theta = a / j;
    let reaches_acceleration = v >= a * theta;
    let linear_from_mm = v * v / a;
    let s_curve_from_mm =
        if reaches_acceleration { linear_from_mm + v * a / j } else { 2.0 * v * libm::sqrt(v / j) };
    let (linear_reaches, s_reaches) = (length_mm >= linear_from_mm, length_mm >= s_curve_from_mm);
    let law = |s_curve: bool| if s_curve { MotionLaw::SCurve } else { MotionLaw::Linear };
    let s_curve_peak = if s_reaches {
        v
    } else if length_mm >= 2.0 * a * theta * theta {
        2.0 * length_mm / (theta + libm::sqrt(theta * theta + 4.0 * length_mm / a))
    } else {
        libm::cbrt(0.25 * j * length_mm * length_mm)
    };
    Ok(Choice {
        linear_from_mm,
        s_curve_from_mm,
        reaches_acceleration,
        case: if s_reaches { 1 } else { 3 - u8::from(linear_reaches) },
        choice: law(s_reaches),
        choice_strict: law(s_reaches && reaches_acceleration),
        linear_peak_mm_per_s: if linear_reaches { v } else { libm::sqrt(a * length_mm) },
        s_curve_peak_mm_per_s: s_curve_peak,
    })
}
