//! A ramp: a rise of speed with zero acceleration at both ends.
//!
//! ```text
//! a ^   ________            linear: Θ = 0, the acceleration jumps
//!   |  /        \           S-curve: the edge is straight, with constant jerk
//!   | /          \          power: the edge is an S; its jerk rises as tᵅ and falls mirrored
//!   +------------------> t
//!    |Θ|  hold  |Θ|
//! ```
//!
//! Maths: `docs/motion-profiles.md` B.3 (times), C.1 (S-curve), C.2–C.4 (power law, equivalent jerk). The
//! distance that a ramp loses relative to full speed mirrors the distance gained from rest, so the last edge
//! mirrors the first.

use super::{GREATEST, Limits, MotionLaw, wrong};
use crate::code;
use crate::diagnostic::Diagnostic;
use serde::{Deserialize, Serialize};

/// A rise of speed with zero acceleration at both ends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Ramp {
    pub shape: MotionLaw,
    pub rise_mm_per_s: f64,
    pub acceleration_mm_per_s2: f64,
    /// Highest jerk, mm/s³; 0 if the acceleration jumps.
    pub jerk_mm_per_s3: f64,
    /// Θ: rise time of the acceleration, s.
    pub jerk_time_s: f64,
    pub hold_s: f64,
}

impl Ramp {
    /// The fastest rise by `rise_mm_per_s` within acceleration and jerk of `limits`. An unusable rise or
    /// limit is refused and named. The speed of `limits` doesn't limit the rise.
    pub fn rising(shape: MotionLaw, rise_mm_per_s: f64, limits: Limits) -> Result<Self, Diagnostic> {
        shape.check(limits)?;
        if !(0.0..=GREATEST).contains(&rise_mm_per_s) {
            return Err(wrong(code!("motion.bad_rise"), rise_mm_per_s));
        }
        Ok(Self::within(shape, rise_mm_per_s, limits))
    }

    /// Like [`Self::rising`], for valid limits and rise.
    pub(in crate::motion) fn within(shape: MotionLaw, rise_mm_per_s: f64, limits: Limits) -> Self {
        let rise = rise_mm_per_s;
        if rise <= 0.0 {
            return Self { shape, ..Self::default() };
        }
        let (a, full_edge_s) = (limits.acceleration_mm_per_s2, shape.edge_s(limits));
        let reaches_a = rise >= a * full_edge_s;
        let j = shape.equivalent_jerk(limits);
        let acceleration = if reaches_a { a } else { libm::sqrt(rise * j) };
        Self {
            shape,
            rise_mm_per_s: rise,
            acceleration_mm_per_s2: acceleration,
            jerk_mm_per_s3: shape.peak_jerk(limits),
            jerk_time_s: if reaches_a { full_edge_s } else { acceleration / j },
            hold_s: if reaches_a { (rise / a - full_edge_s).max(0.0) } else { 0.0 },
        }
    }

    /// Length of the ramp with start speed `base_mm_per_s`.
    pub fn length_mm(&self, base_mm_per_s: f64) -> f64 {
        (base_mm_per_s + 0.5 * self.rise_mm_per_s) * self.duration_s()
    }

    pub fn duration_s(&self) -> f64 {
        2.0 * self.jerk_time_s + self.hold_s
    }

    /// Distance gained at `t` seconds of the ramp.
    #[inline]
    pub fn position_mm(&self, t: f64) -> f64 {
        let theta = self.jerk_time_s;
        if t <= theta {
            return self.edge_position_mm(t);
        }
        let held = t - theta;
        if held <= self.hold_s {
            let (v1, s1) = (self.edge_speed(theta), self.edge_position_mm(theta));
            return s1 + v1 * held + 0.5 * self.acceleration_mm_per_s2 * held * held;
        }
        let left = self.duration_s() - t;
        self.rise_mm_per_s * (0.5 * self.duration_s() - left) + self.edge_position_mm(left)
    }

    /// Speed gained at `t` seconds of the ramp, mm/s.
    pub fn speed(&self, t: f64) -> f64 {
        let theta = self.jerk_time_s;
        if t <= theta {
            return self.edge_speed(t);
        }
        let held = t - theta;
        if held <= self.hold_s {
            return self.edge_speed(theta) + self.acceleration_mm_per_s2 * held;
        }
        self.rise_mm_per_s - self.edge_speed((self.duration_s() - t).max(0.0))
    }

    /// Acceleration at `t` seconds of the ramp, mm/s².
    pub fn acceleration(&self, t: f64) -> f64 {
        let edge_s = t.min(self.duration_s() - t).max(0.0);
        if edge_s < self.jerk_time_s { self.edge_acceleration(edge_s) } else { self.acceleration_mm_per_s2 }
    }

    /// Jerk at `t` seconds of the ramp, mm/s³; 0 for the linear law, because its acceleration jumps.
    pub fn jerk(&self, t: f64) -> f64 {
        let left = self.duration_s() - t;
        if t < self.jerk_time_s {
            self.edge_jerk(t)
        } else if left < self.jerk_time_s {
            -self.edge_jerk(left.max(0.0))
        } else {
            0.0
        }
    }

    #[inline]
    pub(super) fn edge_position_mm(&self, x_s: f64) -> f64 {
        if self.shape.order() == 0.0 {
            return self.jerk_mm_per_s3 * x_s * x_s * x_s / 6.0;
        }
        self.power_edge(x_s).position_mm
    }

    #[inline]
    pub(super) fn edge_speed(&self, x_s: f64) -> f64 {
        if self.shape.order() == 0.0 {
            return 0.5 * self.jerk_mm_per_s3 * x_s * x_s;
        }
        self.power_edge(x_s).speed_mm_per_s
    }

    #[inline]
    fn edge(&self, x: f64) -> (f64, f64) {
        if self.shape.order() == 0.0 {
            return (self.edge_position_mm(x), self.edge_speed(x));
        }
        let point = self.power_edge(x);
        (point.position_mm, point.speed_mm_per_s)
    }

    fn edge_acceleration(&self, x: f64) -> f64 {
        if self.shape.order() == 0.0 {
            self.jerk_mm_per_s3 * x
        } else {
            self.power_edge(x).acceleration_mm_per_s2
        }
    }

    fn edge_jerk(&self, x: f64) -> f64 {
        if self.shape.order() == 0.0 { self.jerk_mm_per_s3 } else { self.power_edge(x).jerk_mm_per_s3 }
    }

    /// The power law's edge at `x_s`, 0 … Θ: rising to the middle, mirrored from there (C.3, phases 1 and 2).
    #[inline]
    pub(super) fn power_edge(&self, x_s: f64) -> Point {
        let (x_s, order, half_s) = (x_s.max(0.0), self.shape.order(), 0.5 * self.jerk_time_s);
        if half_s <= 0.0 {
            return Point::default();
        }
        let acceleration = self.acceleration_mm_per_s2;
        let a1 = 0.5 * acceleration;
        let v1 = a1 * half_s / (order + 2.0);
        let s1 = v1 * half_s / (order + 3.0);
        if x_s <= half_s {
            let u = x_s / half_s;
            let p = power(u, order);
            return Point {
                position_mm: s1 * (p * u * u * u),
                speed_mm_per_s: v1 * (p * u * u),
                acceleration_mm_per_s2: a1 * (p * u),
                jerk_mm_per_s3: self.jerk_mm_per_s3 * p,
            };
        }
        let (beyond, w) = (x_s - half_s, ((self.jerk_time_s - x_s) / half_s).max(0.0));
        let p = power(w, order);
        Point {
            position_mm: 2.0 * s1 + 0.5 * acceleration * beyond * beyond - s1 * (p * w * w * w),
            speed_mm_per_s: acceleration * beyond + v1 * (p * w * w),
            acceleration_mm_per_s2: acceleration - a1 * (p * w),
            jerk_mm_per_s3: self.jerk_mm_per_s3 * p,
        }
    }
}

/// Inverse: times at distances of a ramp with start speed `base`.
impl Ramp {
    /// Time in seconds at distance `y_mm`, from 0 to the whole length.
    pub fn time_at(&self, base_mm_per_s: f64, y_mm: f64) -> f64 {
        let (theta, hold) = (self.jerk_time_s, self.hold_s);
        let first = base_mm_per_s * theta + self.edge_position_mm(theta);
        if y_mm <= first {
            return self.edge_time(base_mm_per_s, y_mm.max(0.0));
        }
        let (v1, beyond) = (base_mm_per_s + self.edge_speed(theta), y_mm - first);
        if beyond <= v1 * hold + 0.5 * self.acceleration_mm_per_s2 * hold * hold {
            return theta + later(v1, self.acceleration_mm_per_s2, beyond);
        }
        let left_mm = (self.length_mm(base_mm_per_s) - y_mm).max(0.0);
        (self.duration_s() - self.left_on_last_edge(base_mm_per_s + self.rise_mm_per_s, left_mm)).max(0.0)
    }

    /// Time at distance `y_mm` on the first edge: base·x + e(x) = y. The left side is increasing and convex,
    /// so Newton steps approach the root from above. They start where one of the two terms alone would reach
    /// y.
    pub(super) fn edge_time(&self, base_mm_per_s: f64, y_mm: f64) -> f64 {
        let (theta, order) = (self.jerk_time_s, self.shape.order());
        if y_mm <= 0.0 || theta <= 0.0 {
            return 0.0;
        }
        let alone = if order > 0.0 {
            let (half_s, middle) = (0.5 * theta, self.power_edge(0.5 * theta));
            if y_mm <= middle.position_mm {
                half_s * libm::pow(y_mm / middle.position_mm, 1.0 / (order + 3.0))
            } else if base_mm_per_s > 0.0 {
                theta
            } else {
                half_s + later(middle.speed_mm_per_s, self.acceleration_mm_per_s2, y_mm - middle.position_mm)
            }
        } else {
            libm::cbrt(6.0 * y_mm / self.jerk_mm_per_s3)
        };
        if base_mm_per_s <= 0.0 && alone <= theta && (order == 0.0 || alone <= 0.5 * theta) {
            return alone;
        }
        let mut x = if base_mm_per_s > 0.0 { alone.min(y_mm / base_mm_per_s) } else { alone };
        for _ in 0..12 {
            let (way, speed) = self.edge(x);
            let next = (x - (base_mm_per_s * x + way - y_mm) / (base_mm_per_s + speed)).clamp(0.0, theta);
            if next == x {
                break;
            }
            x = next;
        }
        x
    }

    /// The time x to the end of the ramp, with end speed `top_mm_per_s` and remaining distance `y_mm`: top·x
    /// − e(x) = y. The left side is increasing and concave, and its slope is at least half of `top_mm_per_s`.
    /// So Newton steps from y/top stay below the root and square the error; stop when they no longer
    /// increase.
    pub(super) fn left_on_last_edge(&self, top_mm_per_s: f64, y_mm: f64) -> f64 {
        let mut x = y_mm / top_mm_per_s;
        for _ in 0..8 {
            let (way, speed) = self.edge(x);
            let next = x + (y_mm + way - top_mm_per_s * x) / (top_mm_per_s - speed);
            if next <= x {
                break;
            }
            x = next;
        }
        x.min(self.jerk_time_s)
    }
}

fn later(speed: f64, acceleration: f64, way: f64) -> f64 {
    2.0 * way / (speed + libm::sqrt(speed * speed + 2.0 * acceleration * way))
}

/// Distance, speed, acceleration and jerk at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Point {
    pub(super) position_mm: f64,
    pub(super) speed_mm_per_s: f64,
    pub(super) acceleration_mm_per_s2: f64,
    pub(super) jerk_mm_per_s3: f64,
}

/// uᵅ for u from 0 to 1, without a power function for common orders.
#[inline]
fn power(u: f64, order: f64) -> f64 {
    if order == 0.5 {
        libm::sqrt(u)
    } else if order == 1.0 {
        u
    } else if order == 2.0 {
        u * u
    } else {
        libm::pow(u, order)
    }
}
