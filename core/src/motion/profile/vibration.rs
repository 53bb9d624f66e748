//! Residual vibration of a machine after a move.
//!
//! ```text
//! ampli- ^ \
//! tude   |  \    ,-.           zeros at a whole number of periods in an edge,
//!        |   \  /   \  ,-.     in an edge and a hold, or between the two ramps
//!        |    \/     \/   \,
//!        +-------------------> frequency
//! ```
//!
//! Maths: `docs/motion-profiles.md` D.2. The amplitude is |∫a(t)·e^(−i2πft)dt|/(2πf). The acceleration is the
//! convolution of an edge's jerk with a box of edge plus hold, once up and once down, so its transform is a
//! product.

use super::{GREATEST, MotionLaw, Profile, wrong};
use crate::diagnostic::Diagnostic;
use core::f64::consts::PI;

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

/// Amplitude in mm of the vibration at `frequency_hz` (above 0) after the move.
pub fn residual_mm(profile: &Profile, frequency_hz: f64) -> Result<f64, Diagnostic> {
    if !(1e-9..=GREATEST).contains(&frequency_hz) {
        return Err(wrong("motion.bad_frequency", frequency_hz));
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
