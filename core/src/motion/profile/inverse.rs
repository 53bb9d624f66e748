//! Time at a position; the step generator calls this millions of times per second.
//!
//! ```text
//! s ^        s3 ,-'          the first half of a move has four phases, each with its own closed inverse:
//!   |       s2,'|            edge: a root          hold: a square root
//!   |   s1 ,-'| |            mirrored edge: a few Newton steps      cruise: a division
//!   +---'---|-|-|---> t      the second half mirrors the first
//! ```

use super::Profile;
use super::ramp::Ramp;

/// Precomputed values of a move for its inverse: positions of the phase boundaries.
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
    /// The edges of the power law are not cubic.
    power: bool,
    ramp: Ramp,
}

impl Inverse {
    pub fn of(profile: &Profile) -> Self {
        let ramp = profile.ramp();
        let (jerk, theta, hold) = (ramp.jerk_mm_per_s3, ramp.jerk_time_s, ramp.hold_s);
        let (v1, s1_mm) = (ramp.edge_speed(theta), ramp.edge_position_mm(theta));
        Self {
            length_mm: profile.length_mm,
            duration_s: profile.duration_s(),
            s1_mm,
            s2_mm: s1_mm + v1 * hold + 0.5 * profile.acceleration_mm_per_s2 * hold * hold,
            s3_mm: 0.5 * profile.speed_mm_per_s * profile.ramp_s(),
            six_by_jerk: if jerk > 0.0 { 6.0 / jerk } else { 0.0 },
            jerk_time_s: theta,
            ramp_s: profile.ramp_s(),
            v1,
            acceleration: profile.acceleration_mm_per_s2,
            speed: profile.speed_mm_per_s,
            jerk_by_six_speeds: jerk / (6.0 * profile.speed_mm_per_s),
            power: ramp.shape.order() > 0.0,
            ramp,
        }
    }

    /// Range of positions with constant speed, mm; start after end if there is none.
    pub fn cruise_mm(&self) -> (f64, f64) {
        (self.s3_mm, self.length_mm - self.s3_mm)
    }

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
            if self.power { self.ramp.edge_time(0.0, s_mm) } else { libm::cbrt(self.six_by_jerk * s_mm) }
        } else if s_mm <= self.s2_mm {
            let beyond = s_mm - self.s1_mm;
            let root = libm::sqrt(self.v1 * self.v1 + 2.0 * self.acceleration * beyond);
            self.jerk_time_s + 2.0 * beyond / (self.v1 + root)
        } else if self.power {
            self.ramp_s - self.ramp.left_on_last_edge(self.speed, self.s3_mm - s_mm)
        } else {
            self.ramp_s - self.left_in_third_phase((self.s3_mm - s_mm) / self.speed)
        }
    }

    /// The time x to the end of the ramp: x − k·x³ = y with k = jerk/(6·speed).
    ///
    /// The left side is increasing and concave in the whole phase, so Newton steps from below stay below and
    /// at least square the error. From y + k·y³, four steps always suffice (the initial error is under 7 % of
    /// the phase).
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
