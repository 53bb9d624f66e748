//! A stretch of a longer motion: a rise or a fall of speed, or a steady run.
//!
//! ```text
//! v ^      ______ high          a fall is a rise run backwards: only rises are ever computed,
//!   |    ,'                     and both ends come out exact
//!   |  ,' ramp
//!   |_'  low
//!   +------------> t
//! ```
//!
//! Comes in: speeds in mm/s, limits. Goes out: way, speed, acceleration and jerk at any second of the stretch, and the
//! second at any way. Does not know what lies before and behind it.

use super::{Limits, Ramp, Shape};
use serde::{Deserialize, Serialize};

/// A rise, a fall or a steady run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Span {
    /// Second at which it begins.
    pub start_s: f64,
    /// Place at which it begins, mm.
    pub start_mm: f64,
    /// How long it takes, s.
    pub duration_s: f64,
    /// How far it goes, mm.
    pub length_mm: f64,
    /// The lower of its two end speeds, mm/s.
    pub low_mm_per_s: f64,
    /// From the lower to the higher speed; no rise in a steady run.
    pub ramp: Ramp,
    /// Whether the speed falls.
    pub falls: bool,
}

impl Span {
    /// From one speed to another as fast as acceleration and jerk of `limits` allow. All of it is usable.
    pub(in crate::motion) fn change(shape: Shape, from: f64, to: f64, limits: Limits) -> Self {
        let low_mm_per_s = from.min(to);
        let ramp = Ramp::within(shape, (to - from).abs(), limits);
        Self {
            duration_s: ramp.duration_s(),
            length_mm: ramp.length_mm(low_mm_per_s),
            low_mm_per_s,
            ramp,
            falls: to < from,
            ..Self::default()
        }
    }

    /// `length_mm` at a steady speed greater than 0.
    pub(in crate::motion) fn steady(speed: f64, length_mm: f64) -> Self {
        Self { duration_s: length_mm / speed, length_mm, low_mm_per_s: speed, ..Self::default() }
    }

    /// The same beginning where and when `before` ends.
    #[must_use]
    pub(in crate::motion) fn after(self, before: &Self) -> Self {
        Self { start_s: before.end_s(), start_mm: before.end_mm(), ..self }
    }

    /// Second at which it ends.
    pub fn end_s(&self) -> f64 {
        self.start_s + self.duration_s
    }

    /// Place at which it ends.
    pub fn end_mm(&self) -> f64 {
        self.start_mm + self.length_mm
    }

    /// Second of the rise that belongs to second `t`.
    fn rise_s(&self, t: f64) -> f64 {
        let since = (t - self.start_s).clamp(0.0, self.duration_s);
        if self.falls { self.duration_s - since } else { since }
    }

    /// Place at second `t`, mm.
    pub fn position_mm(&self, t: f64) -> f64 {
        let x = self.rise_s(t);
        let way = self.low_mm_per_s * x + self.ramp_position_mm(x);
        if self.falls { self.end_mm() - way } else { self.start_mm + way }
    }

    /// Speed at second `t`, mm/s.
    pub fn speed(&self, t: f64) -> f64 {
        self.low_mm_per_s + if self.is_steady() { 0.0 } else { self.ramp.speed(self.rise_s(t)) }
    }

    /// Acceleration at second `t`, mm/s²; negative where the speed falls.
    pub fn acceleration(&self, t: f64) -> f64 {
        if self.is_steady() {
            return 0.0;
        }
        let rising = self.ramp.acceleration(self.rise_s(t));
        if self.falls { -rising } else { rising }
    }

    /// Jerk at second `t`, mm/s³.
    pub fn jerk(&self, t: f64) -> f64 {
        if self.is_steady() { 0.0 } else { self.ramp.jerk(self.rise_s(t)) }
    }

    /// The second at which the place `s_mm` of this stretch is reached.
    pub fn time_at(&self, s_mm: f64) -> f64 {
        if self.length_mm <= 0.0 {
            return self.start_s;
        }
        let way = if self.falls { self.end_mm() - s_mm } else { s_mm - self.start_mm };
        let way = way.clamp(0.0, self.length_mm);
        let x = if self.is_steady() {
            way / self.low_mm_per_s
        } else {
            self.ramp.time_at(self.low_mm_per_s, way)
        };
        self.start_s + if self.falls { self.duration_s - x } else { x }
    }

    fn is_steady(&self) -> bool {
        self.ramp.rise_mm_per_s == 0.0
    }

    fn ramp_position_mm(&self, x: f64) -> f64 {
        if self.is_steady() { 0.0 } else { self.ramp.position_mm(x) }
    }
}
