//! Units and their conversions, here and nowhere else. Saved lengths are whole nanometres, calculations use
//! `f64` millimetres, pins use whole steps, and time is in whole ticks.

use serde::{Deserialize, Serialize};
use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

pub const NM_PER_MM: i64 = 1_000_000;
/// Nanometres in an inch, exactly.
pub const NM_PER_INCH: i64 = 25_400_000;

/// Ticks of stream time in a second: a tick is 0.1 µs.
pub const TICK_HZ: u64 = 10_000_000;

/// A length, or a coordinate along one axis, in whole nanometres.
///
/// The range is ±9.2 · 10⁹ m. Readers refuse anything beyond [`Length::LIMIT`], so sums of a few lengths
/// can't overflow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Length(i64);

impl Length {
    pub const ZERO: Self = Self(0);
    /// Largest coordinate that readers accept: 10 m in either direction.
    pub const LIMIT: Self = Self(10_000 * NM_PER_MM);

    pub const fn from_nm(nm: i64) -> Self {
        Self(nm)
    }

    pub const fn from_um(um: i64) -> Self {
        Self(um * 1_000)
    }

    /// Rounds `mm` to whole nanometres, halves away from zero. NaN gives zero and overflow saturates, so
    /// readers check ranges before they convert.
    pub fn from_mm(mm: f64) -> Self {
        Self(libm::round(mm * NM_PER_MM as f64) as i64)
    }

    /// Rounds `inch` to whole nanometres, halves away from zero.
    pub fn from_inch(inch: f64) -> Self {
        Self(libm::round(inch * NM_PER_INCH as f64) as i64)
    }

    pub const fn nm(self) -> i64 {
        self.0
    }

    pub fn mm(self) -> f64 {
        self.0 as f64 / NM_PER_MM as f64
    }

    pub const fn abs(self) -> Self {
        Self(self.0.abs())
    }
}

impl Add for Length {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }
}
impl Sub for Length {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(self.0 - other.0)
    }
}
impl Neg for Length {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}
impl Mul<i64> for Length {
    type Output = Self;
    fn mul(self, factor: i64) -> Self {
        Self(self.0 * factor)
    }
}
impl AddAssign for Length {
    fn add_assign(&mut self, other: Self) {
        self.0 += other.0;
    }
}
impl SubAssign for Length {
    fn sub_assign(&mut self, other: Self) {
        self.0 -= other.0;
    }
}
