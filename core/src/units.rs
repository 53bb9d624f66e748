//! Lengths at rest are whole nanometres; in flight they are `f64` millimetres; at the pins they are whole steps, and
//! time is whole ticks. The conversions live here and nowhere else.
//!
//! Comes in: decimal millimetres and inches. Goes out: [`Length`]. Knows no files and no machines.

use serde::{Deserialize, Serialize};
use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// Nanometres in a millimetre.
pub const NM_PER_MM: i64 = 1_000_000;
/// Nanometres in an inch, exactly.
pub const NM_PER_INCH: i64 = 25_400_000;

/// Ticks of stream time in a second: a tick is 0.1 µs.
pub const TICK_HZ: u64 = 10_000_000;

/// A length, or a coordinate along one axis, in whole nanometres.
///
/// The range is ±9.2 · 10⁹ m; readers refuse anything beyond [`Length::LIMIT`], so sums of a few lengths cannot
/// overflow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Length(i64);

impl Length {
    /// No length.
    pub const ZERO: Self = Self(0);
    /// The largest coordinate any reader lets through: 10 m either way.
    pub const LIMIT: Self = Self(10_000 * NM_PER_MM);

    /// From whole nanometres.
    pub const fn from_nm(nm: i64) -> Self {
        Self(nm)
    }

    /// From whole micrometres.
    pub const fn from_um(um: i64) -> Self {
        Self(um * 1_000)
    }

    /// The nearest whole nanometre to `mm` millimetres, halves away from zero. Not-a-number gives zero and
    /// what does not fit saturates; readers check ranges before they convert.
    pub fn from_mm(mm: f64) -> Self {
        Self(libm::round(mm * NM_PER_MM as f64) as i64)
    }

    /// The nearest whole nanometre to `inch` inches, halves away from zero.
    pub fn from_inch(inch: f64) -> Self {
        Self(libm::round(inch * NM_PER_INCH as f64) as i64)
    }

    /// Whole nanometres.
    pub const fn nm(self) -> i64 {
        self.0
    }

    /// Millimetres.
    pub fn mm(self) -> f64 {
        self.0 as f64 / NM_PER_MM as f64
    }

    /// Without its sign.
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
