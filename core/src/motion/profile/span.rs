//! A stretch of a longer motion: a rise or a fall of speed, or constant speed.
//!
//! ```text
//! v ^      ______ high          a fall is a reversed rise: only rises are computed,
//!   |    ,'                     and both ends are exact
//!   |  ,' ramp
//!   |_'  low
//!   +------------> t
//! ```
//!
//! A rise may start with an acceleration, as after a corner. Then the span is the rest of a rise that started
//! earlier and slower, with its first seconds skipped. The start speed of that rise may even be negative.

use super::{Limits, MotionLaw, Ramp};
use serde::{Deserialize, Serialize};

/// Most Newton steps and bisections, and the relative precision of a time.
const MOST_STEPS: u32 = 60;
const NEAR_SHARE: f64 = 1e-15;

/// A rise, a fall or constant speed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Span {
    pub start_s: f64,
    pub start_mm: f64,
    pub duration_s: f64,
    pub length_mm: f64,
    /// Start speed of the rise, mm/s: the lower end speed if nothing is skipped.
    pub low_mm_per_s: f64,
    /// From there to the higher speed; no rise at constant speed.
    pub ramp: Ramp,
    /// Seconds skipped at the start of the rise; the acceleration at their end isn't zero.
    pub skip_s: f64,
    /// Skipped distance, mm.
    pub skip_mm: f64,
    /// True if the speed falls.
    pub falls: bool,
}

impl Span {
    /// From one speed to another as fast as acceleration and jerk of `limits` permit. Inputs must be valid.
    pub(in crate::motion) fn change(
        shape: MotionLaw,
        from_mm_per_s: f64,
        to_mm_per_s: f64,
        limits: Limits,
    ) -> Self {
        let low_mm_per_s = from_mm_per_s.min(to_mm_per_s);
        let ramp = Ramp::within(shape, (to_mm_per_s - from_mm_per_s).abs(), limits);
        Self {
            duration_s: ramp.duration_s(),
            length_mm: ramp.length_mm(low_mm_per_s),
            low_mm_per_s,
            ramp,
            falls: to_mm_per_s < from_mm_per_s,
            ..Self::default()
        }
    }

    /// From one speed to another with constant jerk. The lower end may start with the acceleration
    /// `pull_mm_per_s2` towards the higher one.
    pub(in crate::motion) fn pulled(
        from_mm_per_s: f64,
        to_mm_per_s: f64,
        pull_mm_per_s2: f64,
        limits: Limits,
    ) -> Self {
        let (low, rise) = (from_mm_per_s.min(to_mm_per_s), (to_mm_per_s - from_mm_per_s).abs());
        let pull_mm_per_s2 = pull_mm_per_s2
            .min(limits.acceleration_mm_per_s2)
            .min(libm::sqrt(2.0 * limits.jerk_mm_per_s3 * rise));
        if pull_mm_per_s2 <= 0.0 {
            return Self::change(MotionLaw::SCurve, from_mm_per_s, to_mm_per_s, limits);
        }
        let before = 0.5 * pull_mm_per_s2 * pull_mm_per_s2 / limits.jerk_mm_per_s3;
        let ramp = Ramp::within(MotionLaw::SCurve, rise + before, limits);
        let (low_mm_per_s, skip_s) =
            (low - before, (pull_mm_per_s2 / limits.jerk_mm_per_s3).min(ramp.jerk_time_s));
        let skip_mm = low_mm_per_s * skip_s + ramp.position_mm(skip_s);
        Self {
            duration_s: ramp.duration_s() - skip_s,
            length_mm: ramp.length_mm(low_mm_per_s) - skip_mm,
            low_mm_per_s,
            ramp,
            skip_s,
            skip_mm,
            falls: to_mm_per_s < from_mm_per_s,
            ..Self::default()
        }
    }

    pub(in crate::motion) fn end_speeds(&self) -> (f64, f64) {
        let (low, high) = (self.speed_at_rise(0.0), self.low_mm_per_s + self.ramp.rise_mm_per_s);
        if self.falls { (high, low) } else { (low, high) }
    }

    pub(in crate::motion) fn end_pulls(&self) -> (f64, f64) {
        let pull = self.ramp.jerk_mm_per_s3 * self.skip_s;
        if self.falls { (0.0, -pull) } else { (pull, 0.0) }
    }

    /// `length_mm` at a constant speed above 0.
    pub(in crate::motion) fn steady(speed_mm_per_s: f64, length_mm: f64) -> Self {
        Self {
            duration_s: length_mm / speed_mm_per_s,
            length_mm,
            low_mm_per_s: speed_mm_per_s,
            ..Self::default()
        }
    }

    #[must_use]
    pub(in crate::motion) fn after(self, before: &Self) -> Self {
        Self { start_s: before.end_s(), start_mm: before.end_mm(), ..self }
    }

    pub fn end_s(&self) -> f64 {
        self.start_s + self.duration_s
    }

    pub fn end_mm(&self) -> f64 {
        self.start_mm + self.length_mm
    }

    fn rise_s(&self, t: f64) -> f64 {
        let since = (t - self.start_s).clamp(0.0, self.duration_s);
        if self.falls { self.duration_s - since } else { since }
    }

    pub fn position_mm(&self, t: f64) -> f64 {
        let x = self.rise_s(t);
        let way = self.way_mm(x);
        if self.falls { self.end_mm() - way } else { self.start_mm + way }
    }

    /// Speed at second `t`, mm/s.
    pub fn speed(&self, t: f64) -> f64 {
        self.speed_at_rise(self.rise_s(t))
    }

    /// Speed at `x` seconds of the used part of the rise.
    fn speed_at_rise(&self, x: f64) -> f64 {
        self.low_mm_per_s + if self.is_steady() { 0.0 } else { self.ramp.speed(self.skip_s + x) }
    }

    /// Length of the first `x` seconds of the used part of the rise.
    fn way_mm(&self, x: f64) -> f64 {
        if self.is_steady() {
            return self.low_mm_per_s * x;
        }
        let since = self.skip_s + x;
        self.low_mm_per_s * since + self.ramp.position_mm(since) - self.skip_mm
    }

    /// Acceleration at second `t`, mm/s²; negative if the speed falls.
    pub fn acceleration(&self, t: f64) -> f64 {
        if self.is_steady() {
            return 0.0;
        }
        let rising = self.ramp.acceleration(self.skip_s + self.rise_s(t));
        if self.falls { -rising } else { rising }
    }

    /// Jerk at second `t`, mm/s³.
    pub fn jerk(&self, t: f64) -> f64 {
        if self.is_steady() { 0.0 } else { self.ramp.jerk(self.skip_s + self.rise_s(t)) }
    }

    /// Time in seconds at position `s_mm` of this stretch.
    pub fn time_at(&self, s_mm: f64) -> f64 {
        if self.length_mm <= 0.0 {
            return self.start_s;
        }
        let way = if self.falls { self.end_mm() - s_mm } else { s_mm - self.start_mm };
        let way = way.clamp(0.0, self.length_mm);
        let x = if self.is_steady() {
            way / self.low_mm_per_s
        } else if self.skip_s > 0.0 {
            self.pulled_time(way)
        } else {
            self.ramp.time_at(self.low_mm_per_s, way)
        };
        self.start_s + if self.falls { self.duration_s - x } else { x }
    }

    fn is_steady(&self) -> bool {
        self.ramp.rise_mm_per_s == 0.0
    }

    /// Time within the used part of the rise at distance `way`: Newton steps, replaced by bisections if they
    /// leave the bounds of the root. They start where the first edge alone would reach `way`.
    fn pulled_time(&self, way: f64) -> f64 {
        let (mut low, mut high) = (0.0, self.duration_s);
        let speed = self.speed_at_rise(0.0);
        let (jerk, pull) = (self.ramp.jerk_mm_per_s3, self.ramp.jerk_mm_per_s3 * self.skip_s);
        let mut x = libm::cbrt(6.0 * way / jerk).min(libm::sqrt(2.0 * way / pull)).min(high);
        if speed > 0.0 {
            x = x.min(way / speed);
        }
        for _ in 0..MOST_STEPS {
            let off = self.way_mm(x) - way;
            if off < 0.0 {
                low = x;
            } else {
                high = x;
            }
            let next = x - off / self.speed_at_rise(x);
            let next = if next > low && next < high { next } else { 0.5 * (low + high) };
            if (next - x).abs() <= NEAR_SHARE * high {
                return next;
            }
            x = next;
        }
        x
    }
}
