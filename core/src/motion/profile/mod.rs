//! Moves from rest to rest in closed form: the fastest within speed, acceleration and jerk, for one of three
//! laws of acceleration.
//!
//! ```text
//! v ^            ________________            V
//!   |          ,'                '.
//!   |         /                    \        Θ  edge: acceleration rises or falls (linear law: Θ = 0)
//!   |       ,'                      '.      H  hold: constant acceleration A
//!   +------'--------------------------'---> t
//!    | Θ |H| Θ |    cruise       | Θ |H| Θ |
//!    |<-ramp-->|                 |<-ramp-->|
//! ```
//!
//! The second ramp mirrors the first, so only the first half is computed.
//!
//! Maths: `docs/motion-profiles.md` B.1–B.3 (linear and S-curve; Ma and You) and C.1–C.4 (seven and eleven
//! phases; patent on PCB drilling control, its power law reconstructed there).

pub mod bounds;
mod inverse;
mod ramp;
mod span;
mod stop;
mod stroke;

use crate::code;
pub use bounds::{Choice, choose, residual_mm};
pub use inverse::Inverse;
pub use ramp::Ramp;
pub use span::Span;
pub use stop::{point_of_no_return_s, stopping_mm};
pub use stroke::{Stroke, TwoSpeeds, two_speeds};

use crate::diagnostic::Diagnostic;
use serde::{Deserialize, Serialize};

/// Shorter moves (a millionth of a nanometre) take no time, because a power of their length could underflow.
const NOTHING_MM: f64 = 1e-12;

/// Plausible range of limits and lengths; products of numbers outside could overflow.
const LEAST_LIMIT: f64 = 1e-9;
const GREATEST: f64 = 1e15;

/// Highest order of the power law. Towards 0 it becomes the S-curve.
pub const GREATEST_ORDER: f64 = 2.0;

/// Highest speed, acceleration and jerk of an axis or along a path (mm and s).
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Limits {
    pub speed_mm_per_s: f64,
    pub acceleration_mm_per_s2: f64,
    pub jerk_mm_per_s3: f64,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MotionLaw {
    /// The acceleration jumps; jerk is unlimited. Three phases.
    Linear,
    /// Constant jerk. Seven phases.
    #[default]
    SCurve,
    /// Jerk as a power α of time, 0 < α ≤ 2: continuous jerk. Eleven phases.
    Power(f64),
}

impl MotionLaw {
    /// α; 0 for the laws without a power.
    #[inline]
    pub fn order(self) -> f64 {
        if let Self::Power(order) = self { order } else { 0.0 }
    }

    /// The constant jerk with an edge of equal duration (C.4).
    fn equivalent_jerk(self, limits: Limits) -> f64 {
        if let Self::Power(order) = self {
            limits.jerk_mm_per_s3 / (1.0 + order)
        } else {
            limits.jerk_mm_per_s3
        }
    }

    /// Θ: time for the acceleration to reach its limit.
    fn edge_s(self, limits: Limits) -> f64 {
        if self == Self::Linear { 0.0 } else { limits.acceleration_mm_per_s2 / self.equivalent_jerk(limits) }
    }

    /// Highest jerk of an edge; 0 if the acceleration jumps.
    fn peak_jerk(self, limits: Limits) -> f64 {
        if self == Self::Linear { 0.0 } else { limits.jerk_mm_per_s3 }
    }

    /// Checks that this law works with `limits`; the diagnostic names the wrong one. The linear law ignores
    /// the jerk.
    pub fn check(self, limits: Limits) -> Result<(), Diagnostic> {
        if let Self::Power(order) = self
            && !(order > 0.0 && order <= GREATEST_ORDER)
        {
            return Err(wrong(code!("motion.bad_order"), order).with("greatest", GREATEST_ORDER));
        }
        let rows = [
            (code!("motion.bad_speed"), limits.speed_mm_per_s),
            (code!("motion.bad_acceleration"), limits.acceleration_mm_per_s2),
            (code!("motion.bad_jerk"), limits.jerk_mm_per_s3),
        ];
        let looked_at = if self == Self::Linear { 2 } else { 3 };
        let bad =
            rows.into_iter().take(looked_at).find(|(_, limit)| !(LEAST_LIMIT..=GREATEST).contains(limit));
        bad.map_or(Ok(()), |(code, limit)| Err(wrong(code, limit)))
    }
}

pub(super) fn wrong(code: &str, value: f64) -> Diagnostic {
    Diagnostic::error(code).with("value", value)
}

/// The limits that a move reaches.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Case {
    Both,
    /// Speed, but not acceleration.
    Speed,
    /// Acceleration, but not speed.
    Acceleration,
    /// Only jerk: a tiny move.
    #[default]
    Neither,
    /// Linear law with the full speed.
    Cruise,
    /// Linear law without the full speed.
    Triangle,
}

impl Case {
    /// Name in tables: `VA`, `V-`, `-A`, `--`; `cruise` and `triangle` for the linear law.
    pub fn name(self) -> &'static str {
        match self {
            Self::Both => "VA",
            Self::Speed => "V-",
            Self::Acceleration => "-A",
            Self::Neither => "--",
            Self::Cruise => "cruise",
            Self::Triangle => "triangle",
        }
    }
}

/// A move of one length, from rest to rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    /// Length of the path, mm.
    pub length_mm: f64,
    /// Law of its ramps.
    pub shape: MotionLaw,
    pub case: Case,
    pub speed_mm_per_s: f64,
    pub acceleration_mm_per_s2: f64,
    /// Highest jerk, mm/s³; 0 for the linear law, because its acceleration jumps.
    pub jerk_mm_per_s3: f64,
    /// Θ: rise time of the acceleration, s; 0 for the linear law.
    pub jerk_time_s: f64,
    /// H: time at the highest acceleration, s.
    pub hold_s: f64,
    pub cruise_s: f64,
}

/// The fastest move of this shape over `length_mm` within `limits` (mm and s). An unusable length, limit or
/// order is refused and named.
///
/// Four cases: the speed is reached or not, and the acceleration is reached or not. They join continuously,
/// so a rounding error at a boundary is harmless. The power law of order α is planned as an S-curve with jerk
/// J/(1 + α), which has edges of equal length (C.4).
pub fn plan(shape: MotionLaw, length_mm: f64, limits: Limits) -> Result<Profile, Diagnostic> {
    if !(0.0..=GREATEST).contains(&length_mm) {
        return Err(wrong(code!("motion.bad_length"), length_mm));
    }
    shape.check(limits)?;
    if length_mm < NOTHING_MM {
        return Ok(Profile { length_mm, shape, ..Profile::default() });
    }
    if shape == MotionLaw::Linear {
        return Ok(linear(length_mm, limits));
    }
    let (v, a, j) = (limits.speed_mm_per_s, limits.acceleration_mm_per_s2, shape.equivalent_jerk(limits));
    let full_jerk_time_s = a / j;
    let reaches_a = v >= a * full_jerk_time_s;
    let full_ramp_s = if reaches_a { v / a + full_jerk_time_s } else { 2.0 * libm::sqrt(v / j) };
    let (case, speed, acceleration, jerk_time_s, hold_s, cruise_s);
    if length_mm >= v * full_ramp_s {
        case = if reaches_a { Case::Both } else { Case::Speed };
        speed = v;
        cruise_s = (length_mm / v - full_ramp_s).max(0.0);
        acceleration = if reaches_a { a } else { libm::sqrt(v * j) };
        jerk_time_s = acceleration / j;
        hold_s = if reaches_a { (v / a - full_jerk_time_s).max(0.0) } else { 0.0 };
    } else {
        cruise_s = 0.0;
        if length_mm >= 2.0 * a * full_jerk_time_s * full_jerk_time_s {
            case = Case::Acceleration;
            let root = libm::sqrt(full_jerk_time_s * full_jerk_time_s + 4.0 * length_mm / a);
            speed = 2.0 * length_mm / (full_jerk_time_s + root);
            acceleration = a;
            jerk_time_s = full_jerk_time_s;
            hold_s = (speed / a - full_jerk_time_s).max(0.0);
        } else {
            case = Case::Neither;
            jerk_time_s = libm::cbrt(length_mm / (2.0 * j));
            acceleration = j * jerk_time_s;
            speed = acceleration * jerk_time_s;
            hold_s = 0.0;
        }
    }
    Ok(Profile {
        length_mm,
        shape,
        case,
        speed_mm_per_s: speed,
        acceleration_mm_per_s2: acceleration,
        jerk_mm_per_s3: limits.jerk_mm_per_s3,
        jerk_time_s,
        hold_s,
        cruise_s,
    })
}

/// The move with jumps of acceleration: three phases, or two if the speed isn't reached (B.1).
fn linear(length_mm: f64, limits: Limits) -> Profile {
    let (v, a) = (limits.speed_mm_per_s, limits.acceleration_mm_per_s2);
    let reaches_v = length_mm >= v * v / a;
    let speed = if reaches_v { v } else { libm::sqrt(a * length_mm) };
    Profile {
        length_mm,
        shape: MotionLaw::Linear,
        case: if reaches_v { Case::Cruise } else { Case::Triangle },
        speed_mm_per_s: speed,
        acceleration_mm_per_s2: a,
        hold_s: speed / a,
        cruise_s: if reaches_v { (length_mm / v - v / a).max(0.0) } else { 0.0 },
        ..Profile::default()
    }
}

impl Profile {
    pub fn duration_s(&self) -> f64 {
        2.0 * self.ramp_s() + self.cruise_s
    }

    pub fn ramp_s(&self) -> f64 {
        2.0 * self.jerk_time_s + self.hold_s
    }

    /// The first ramp; the last one mirrors it.
    #[inline]
    pub fn ramp(&self) -> Ramp {
        Ramp {
            shape: self.shape,
            rise_mm_per_s: self.speed_mm_per_s,
            acceleration_mm_per_s2: self.acceleration_mm_per_s2,
            jerk_mm_per_s3: self.jerk_mm_per_s3,
            jerk_time_s: self.jerk_time_s,
            hold_s: self.hold_s,
        }
    }

    /// Durations of the phases in seconds: 3 for the linear law, 7 for the S-curve, 11 for the power law (two
    /// per edge).
    pub fn phases(&self) -> Vec<f64> {
        let (theta, hold, cruise) = (self.jerk_time_s, self.hold_s, self.cruise_s);
        let half = 0.5 * theta;
        match self.shape {
            MotionLaw::Linear => vec![hold, cruise, hold],
            MotionLaw::SCurve => vec![theta, hold, theta, cruise, theta, hold, theta],
            MotionLaw::Power(_) => vec![half, half, hold, half, half, cruise, half, half, hold, half, half],
        }
    }

    /// Position along the path at second `t`: exactly 0 before the start, exactly the length after the end.
    pub fn position_mm(&self, t: f64) -> f64 {
        let (ramp_s, duration_s) = (self.ramp_s(), self.duration_s());
        if t >= duration_s {
            self.length_mm
        } else if t <= 0.0 {
            0.0
        } else if t < ramp_s {
            self.ramp().position_mm(t)
        } else if t < ramp_s + self.cruise_s {
            self.speed_mm_per_s * (t - 0.5 * ramp_s)
        } else {
            self.length_mm - self.ramp().position_mm(duration_s - t)
        }
    }

    /// Speed at second `t`, mm/s.
    pub fn speed(&self, t: f64) -> f64 {
        match self.part(t) {
            Part::Rest => 0.0,
            Part::Rise(t) | Part::Fall(t) => self.ramp().speed(t),
            Part::Cruise => self.speed_mm_per_s,
        }
    }

    /// Acceleration at second `t`, mm/s²; negative while braking.
    pub fn acceleration(&self, t: f64) -> f64 {
        match self.part(t) {
            Part::Rest | Part::Cruise => 0.0,
            Part::Rise(t) => self.ramp().acceleration(t),
            Part::Fall(left) => -self.ramp().acceleration(left),
        }
    }

    /// Jerk at second `t`, mm/s³; 0 for the linear law, because its acceleration jumps.
    pub fn jerk(&self, t: f64) -> f64 {
        match self.part(t) {
            Part::Rest | Part::Cruise => 0.0,
            Part::Rise(t) | Part::Fall(t) => self.ramp().jerk(t),
        }
    }

    /// Time in seconds at position `s_mm`: 0 before the start, the duration after the end.
    pub fn time_at(&self, s_mm: f64) -> f64 {
        Inverse::of(self).time_at(s_mm)
    }

    fn part(&self, t: f64) -> Part {
        let (ramp_s, duration_s) = (self.ramp_s(), self.duration_s());
        if !(t > 0.0 && t < duration_s) {
            Part::Rest
        } else if t < ramp_s {
            Part::Rise(t)
        } else if t < ramp_s + self.cruise_s {
            Part::Cruise
        } else {
            Part::Fall(duration_s - t)
        }
    }
}

/// A part of a move, with the seconds from its end at rest.
enum Part {
    Rest,
    Rise(f64),
    Cruise,
    Fall(f64),
}
