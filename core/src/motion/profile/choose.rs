//! Automatic choice of the profile for a move of one length.
//!
//! ```text
//! length  0 ───────── L_T ─────────── L_S ──────────▶
//!           case 3         case 2          case 1
//!           neither law    only linear     both laws reach the
//!           reaches the    reaches the     speed: S-curve, the
//!           speed: linear  speed           smoother one
//! ```
//!
//! Maths: `docs/motion-profiles.md` B.1–B.2 (Ma and You; thresholds and peak speeds reconstructed there).

use super::{GREATEST, Limits, MotionLaw, wrong};
use crate::diagnostic::Diagnostic;
use serde::{Deserialize, Serialize};

/// The automatic choice and its inputs.
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
    /// The chosen law.
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
pub fn choose(length_mm: f64, limits: Limits) -> Result<Choice, Diagnostic> {
    if !(0.0..=GREATEST).contains(&length_mm) {
        return Err(wrong("motion.bad_length", length_mm));
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
