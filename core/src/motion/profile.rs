//! The jerk-limited move from rest to rest, in closed form: the fastest one within speed, acceleration and jerk.
//!
//! ```text
//! v ^            ________________            V
//!   |          ,'                '.
//!   |         /                    \        Θ  jerk time: acceleration rises or falls
//!   |       ,'                      '.      H  hold: acceleration A is kept
//!   +------'--------------------------'---> t
//!    | Θ |H| Θ |    cruise       | Θ |H| Θ |
//!    |<-ramp-->|                 |<-ramp-->|
//! ```
//!
//! Comes in: length in mm, limits in mm/s, mm/s², mm/s³. Goes out: a [`Profile`], from which place, speed and
//! acceleration at any second follow, and the second at any place. Does not know axes or steps.
//!
//! The second ramp is the first one turned around, so only the first half is ever computed.

use crate::remark::{Remark, Weight};
use serde::{Deserialize, Serialize};

/// Shorter moves than this (a millionth of a nanometre) take no time: below it a power of the length could vanish.
const NOTHING_MM: f64 = 1e-12;

/// A move of one length, from rest to rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    /// Length of the path, mm.
    pub length_mm: f64,
    /// Greatest speed reached, mm/s.
    pub speed_mm_per_s: f64,
    /// Greatest acceleration reached, mm/s².
    pub acceleration_mm_per_s2: f64,
    /// Jerk while the acceleration changes, mm/s³.
    pub jerk_mm_per_s3: f64,
    /// Θ: how long the acceleration takes to rise, s.
    pub jerk_time_s: f64,
    /// H: how long the greatest acceleration is kept, s.
    pub hold_s: f64,
    /// How long the greatest speed is kept, s.
    pub cruise_s: f64,
}

/// The fastest move over `length_mm` within speed `v`, acceleration `a` and jerk `j` (mm and s).
///
/// Four cases: whether the speed is reached, and whether the acceleration is. They join without a gap, so it does
/// not matter on which side of a boundary a rounding error falls.
pub fn plan(length_mm: f64, v: f64, a: f64, j: f64) -> Result<Profile, Remark> {
    let usable = |limit: f64| limit.is_finite() && limit > 0.0;
    if !(usable(v) && usable(a) && usable(j) && length_mm.is_finite() && length_mm >= 0.0) {
        let remark = Remark::new(Weight::Loss, "motion.bad_limits").with("length", length_mm);
        return Err(remark.with("speed", v).with("acceleration", a).with("jerk", j));
    }
    if length_mm < NOTHING_MM {
        return Ok(Profile { length_mm, ..Profile::default() });
    }
    let full_jerk_time_s = a / j;
    let reaches_a = v >= a * full_jerk_time_s;
    let full_ramp_s = if reaches_a { v / a + full_jerk_time_s } else { 2.0 * libm::sqrt(v / j) };
    let (speed, acceleration, jerk_time_s, hold_s, cruise_s);
    if length_mm >= v * full_ramp_s {
        speed = v;
        cruise_s = (length_mm / v - full_ramp_s).max(0.0);
        acceleration = if reaches_a { a } else { libm::sqrt(v * j) };
        jerk_time_s = acceleration / j;
        hold_s = if reaches_a { (v / a - full_jerk_time_s).max(0.0) } else { 0.0 };
    } else {
        cruise_s = 0.0;
        if length_mm >= 2.0 * a * full_jerk_time_s * full_jerk_time_s {
            let root = libm::sqrt(full_jerk_time_s * full_jerk_time_s + 4.0 * length_mm / a);
            speed = 2.0 * length_mm / (full_jerk_time_s + root);
            acceleration = a;
            jerk_time_s = full_jerk_time_s;
            hold_s = (speed / a - full_jerk_time_s).max(0.0);
        } else {
            jerk_time_s = libm::cbrt(length_mm / (2.0 * j));
            acceleration = j * jerk_time_s;
            speed = acceleration * jerk_time_s;
            hold_s = 0.0;
        }
    }
    Ok(Profile {
        length_mm,
        speed_mm_per_s: speed,
        acceleration_mm_per_s2: acceleration,
        jerk_mm_per_s3: j,
        jerk_time_s,
        hold_s,
        cruise_s,
    })
}

impl Profile {
    /// How long the move takes.
    pub fn duration_s(&self) -> f64 {
        2.0 * self.ramp_s() + self.cruise_s
    }

    /// How long it takes to reach the greatest speed.
    pub fn ramp_s(&self) -> f64 {
        2.0 * self.jerk_time_s + self.hold_s
    }

    /// Place along the path at second `t`: exactly 0 before the start and exactly the length after the end.
    pub fn position_mm(&self, t: f64) -> f64 {
        let (ramp_s, duration_s) = (self.ramp_s(), self.duration_s());
        if t >= duration_s {
            self.length_mm
        } else if t <= 0.0 {
            0.0
        } else if t < ramp_s {
            self.ramp_position_mm(t)
        } else if t < ramp_s + self.cruise_s {
            self.speed_mm_per_s * (t - 0.5 * ramp_s)
        } else {
            self.length_mm - self.ramp_position_mm(duration_s - t)
        }
    }

    /// Speed at second `t`, mm/s.
    pub fn speed(&self, t: f64) -> f64 {
        let (ramp_s, duration_s) = (self.ramp_s(), self.duration_s());
        if t <= 0.0 || t >= duration_s {
            0.0
        } else if t < ramp_s {
            self.ramp_speed(t)
        } else if t < ramp_s + self.cruise_s {
            self.speed_mm_per_s
        } else {
            self.ramp_speed(duration_s - t)
        }
    }

    /// Acceleration at second `t`, mm/s²; negative while slowing down.
    pub fn acceleration(&self, t: f64) -> f64 {
        let (ramp_s, duration_s) = (self.ramp_s(), self.duration_s());
        if t <= 0.0 || t >= duration_s || (t >= ramp_s && t < ramp_s + self.cruise_s) {
            0.0
        } else if t < ramp_s {
            self.ramp_acceleration(t)
        } else {
            -self.ramp_acceleration(duration_s - t)
        }
    }

    /// The second at which the place `s_mm` is reached: 0 before the start, the duration after the end.
    pub fn time_at(&self, s_mm: f64) -> f64 {
        Inverse::of(self).time_at(s_mm)
    }

    /// Place on the first ramp, `t` from 0 to its end.
    fn ramp_position_mm(&self, t: f64) -> f64 {
        let (jerk, theta) = (self.jerk_mm_per_s3, self.jerk_time_s);
        if t <= theta {
            return jerk * t * t * t / 6.0;
        }
        let held = t - theta;
        if held <= self.hold_s {
            let (v1, s1) = (0.5 * jerk * theta * theta, jerk * theta * theta * theta / 6.0);
            return s1 + v1 * held + 0.5 * self.acceleration_mm_per_s2 * held * held;
        }
        let left = self.ramp_s() - t;
        self.speed_mm_per_s * (0.5 * self.ramp_s() - left) + jerk * left * left * left / 6.0
    }

    fn ramp_speed(&self, t: f64) -> f64 {
        let (jerk, theta) = (self.jerk_mm_per_s3, self.jerk_time_s);
        if t <= theta {
            return 0.5 * jerk * t * t;
        }
        let held = t - theta;
        if held <= self.hold_s {
            return 0.5 * jerk * theta * theta + self.acceleration_mm_per_s2 * held;
        }
        let left = self.ramp_s() - t;
        self.speed_mm_per_s - 0.5 * jerk * left * left
    }

    fn ramp_acceleration(&self, t: f64) -> f64 {
        let jerk = self.jerk_mm_per_s3;
        (jerk * t).min(self.acceleration_mm_per_s2).min(jerk * (self.ramp_s() - t).max(0.0))
    }
}

/// What the second at a place is computed from, worked out once for a move: the places where its phases meet.
#[derive(Clone, Copy, Debug)]
pub struct Inverse {
    length_mm: f64,
    duration_s: f64,
    /// Ends of the phases of the first ramp.
    s1_mm: f64,
    s2_mm: f64,
    s3_mm: f64,
    six_by_jerk: f64,
    jerk_time_s: f64,
    ramp_s: f64,
    v1: f64,
    acceleration: f64,
    speed: f64,
    jerk_by_six_speeds: f64,
}

impl Inverse {
    /// Of `profile`.
    pub fn of(profile: &Profile) -> Self {
        let (jerk, theta, hold) = (profile.jerk_mm_per_s3, profile.jerk_time_s, profile.hold_s);
        let v1 = 0.5 * jerk * theta * theta;
        let s1_mm = jerk * theta * theta * theta / 6.0;
        Self {
            length_mm: profile.length_mm,
            duration_s: profile.duration_s(),
            s1_mm,
            s2_mm: s1_mm + v1 * hold + 0.5 * profile.acceleration_mm_per_s2 * hold * hold,
            s3_mm: 0.5 * profile.speed_mm_per_s * profile.ramp_s(),
            six_by_jerk: 6.0 / jerk,
            jerk_time_s: theta,
            ramp_s: profile.ramp_s(),
            v1,
            acceleration: profile.acceleration_mm_per_s2,
            speed: profile.speed_mm_per_s,
            jerk_by_six_speeds: jerk / (6.0 * profile.speed_mm_per_s),
        }
    }

    /// The second at which the place `s_mm` is reached.
    #[inline]
    pub fn time_at(&self, s_mm: f64) -> f64 {
        if s_mm + s_mm > self.length_mm {
            let left_mm = self.length_mm - s_mm;
            return self.duration_s - if left_mm > 0.0 { self.first_half(left_mm) } else { 0.0 };
        }
        if s_mm > 0.0 { self.first_half(s_mm) } else { 0.0 }
    }

    #[inline]
    fn first_half(&self, s_mm: f64) -> f64 {
        if self.duration_s <= 0.0 {
            0.0
        } else if s_mm >= self.s3_mm {
            0.5 * self.ramp_s + s_mm / self.speed
        } else if s_mm <= self.s1_mm {
            libm::cbrt(self.six_by_jerk * s_mm)
        } else if s_mm <= self.s2_mm {
            let beyond = s_mm - self.s1_mm;
            let root = libm::sqrt(self.v1 * self.v1 + 2.0 * self.acceleration * beyond);
            self.jerk_time_s + 2.0 * beyond / (self.v1 + root)
        } else {
            self.ramp_s - self.left_in_third_phase((self.s3_mm - s_mm) / self.speed)
        }
    }

    /// The time x still needed to the end of the ramp: x − k·x³ = y with k = jerk/(6·speed).
    ///
    /// The left side rises and bends down in the whole phase, so Newton's steps from below stay below and at least
    /// square the error; from y + k·y³ four of them always suffice (the error starts under 7 % of the phase).
    #[inline]
    fn left_in_third_phase(&self, y: f64) -> f64 {
        let k = self.jerk_by_six_speeds;
        let mut x = y + k * y * y * y;
        for _ in 0..4 {
            x -= (x - k * x * x * x - y) / (1.0 - 3.0 * k * x * x);
        }
        x
    }
}
