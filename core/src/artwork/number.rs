//! Coordinate numbers as written, and their lengths.
//!
//! ```text
//! as written      3.3, leading zeros omitted       3.3, trailing zeros omitted
//! 5080            5080 · 10⁻³ =    5.080          508.0   (the first digit is the hundreds)
//! 00508             508 · 10⁻³ =    0.508           5.080
//! ```

use super::{Digits, Units, Zeros};
use crate::units::{Length, NM_PER_INCH, NM_PER_MM};

/// More digits don't fit 64 bits and are rejected.
pub(super) const MOST_DIGITS: u8 = 18;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Decimal {
    /// All digits as an integer, with sign.
    pub(crate) mantissa: i64,
    pub(crate) digits: u8,
    pub(crate) decimals: u8,
    pub(crate) point: bool,
}

impl Decimal {
    /// The number as a length; none if it is beyond [`Length::LIMIT`].
    pub(crate) fn length(self, units: Units) -> Option<Length> {
        exact(self.mantissa, i32::from(self.decimals), units)
    }
}

/// Parses a number at the start of `bytes`: optional sign, digits, at most one point. Returns it with its
/// length in bytes; none without digits or with too many.
#[inline]
pub(crate) fn decimal(bytes: &[u8]) -> Option<(Decimal, usize)> {
    let mut index = 0;
    let mut negative = false;
    if let Some(&sign @ (b'-' | b'+')) = bytes.first() {
        negative = sign == b'-';
        index = 1;
    }
    let (mut mantissa, mut digits, mut decimals, mut point) = (0_i64, 0_u8, 0_u8, false);
    while let Some(&byte) = bytes.get(index) {
        let digit = byte.wrapping_sub(b'0');
        if digit < 10 {
            if digits == MOST_DIGITS {
                return None;
            }
            mantissa = mantissa * 10 + i64::from(digit);
            digits += 1;
            decimals += u8::from(point);
        } else if byte == b'.' && !point {
            point = true;
        } else {
            break;
        }
        index += 1;
    }
    let mantissa = if negative { -mantissa } else { mantissa };
    (digits > 0).then_some((Decimal { mantissa, digits, decimals, point }, index))
}

/// `mantissa · 10^-decimals` of `units`, rounded to the nearest nanometre, halves away from zero.
pub(super) fn exact(mantissa: i64, decimals: i32, units: Units) -> Option<Length> {
    let unit = i128::from(nm_per(units));
    let scaled = i128::from(mantissa) * unit;
    let nm = if decimals <= 0 {
        // Beyond this, only 0 stays within the limit of a length.
        if decimals < -12 && mantissa != 0 {
            return None;
        }
        scaled * 10_i128.pow(decimals.unsigned_abs().min(12))
    } else {
        let divisor = 10_i128.pow(decimals.unsigned_abs().min(30));
        // Rounds half away from zero, so the sign does not change the amount.
        let half = if scaled < 0 { -divisor / 2 } else { divisor / 2 };
        (scaled + half) / divisor
    };
    let length = Length::from_nm(i64::try_from(nm).ok()?);
    (length.abs() <= Length::LIMIT).then_some(length)
}

const fn nm_per(units: Units) -> i64 {
    match units {
        Units::Mm => NM_PER_MM,
        Units::Inch => NM_PER_INCH,
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Reading {
    pub(crate) units: Units,
    /// Digits before and after the implied point.
    pub(crate) digits: Digits,
    /// Omitted zeros. `Decimal`: numbers without a point are whole units.
    pub(crate) zeros: Zeros,
}

/// A [`Reading`] with a table of nanometres per last digit, for speed.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    reading: Reading,
    /// Nanometres per 10^-index units; 0 if that isn't an integer.
    nm: [i64; 8],
}

impl Scale {
    pub(super) fn new(reading: Reading) -> Self {
        let mut nm = [0; 8];
        let mut value = nm_per(reading.units);
        for slot in &mut nm {
            *slot = value;
            // 0 where a step is no whole number of nanometres; `exact` rounds those.
            value = if value % 10 == 0 { value / 10 } else { 0 };
        }
        Self { reading, nm }
    }

    /// The length of a coordinate; none if it is beyond [`Length::LIMIT`].
    #[inline]
    pub(super) fn length(&self, number: Decimal) -> Option<Length> {
        let decimals = if number.point {
            i32::from(number.decimals)
        } else {
            match self.reading.zeros {
                Zeros::Leading | Zeros::None => i32::from(self.reading.digits.decimal),
                Zeros::Trailing => i32::from(number.digits) - i32::from(self.reading.digits.integer),
                Zeros::Decimal => 0,
            }
        };
        if let Some(&step) = usize::try_from(decimals).ok().and_then(|index| self.nm.get(index))
            && step != 0
            && number.digits < 12
        {
            let length = Length::from_nm(number.mantissa.checked_mul(step)?);
            return (length.abs() <= Length::LIMIT).then_some(length);
        }
        exact(number.mantissa, decimals, self.reading.units)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mm(text: &str, units: Units, digits: (u8, u8), zeros: Zeros) -> f64 {
        let digits = Digits { integer: digits.0, decimal: digits.1 };
        let (number, used) = decimal(text.as_bytes()).unwrap();
        assert_eq!(used, text.len());
        Scale::new(Reading { units, digits, zeros }).length(number).unwrap().mm()
    }

    #[test]
    fn omitted_zeros_are_restored_on_the_right_side() {
        for (text, units, digits, zeros, want) in [
            ("5080", Units::Mm, (3, 3), Zeros::Leading, 5.08),
            ("00508", Units::Mm, (3, 3), Zeros::Trailing, 5.08),
            ("-00508", Units::Mm, (3, 3), Zeros::Trailing, -5.08),
            ("254", Units::Mm, (3, 3), Zeros::Trailing, 254.0),
            ("1", Units::Inch, (2, 4), Zeros::Trailing, 254.0),
            ("0", Units::Inch, (2, 4), Zeros::Trailing, 0.0),
            ("+006937", Units::Inch, (2, 4), Zeros::None, 17.61998),
            ("12.7", Units::Mm, (3, 3), Zeros::Leading, 12.7),
            (".5", Units::Inch, (2, 4), Zeros::Decimal, 12.7),
            ("3", Units::Inch, (2, 4), Zeros::Decimal, 76.2),
            ("00002365", Units::Mm, (4, 4), Zeros::Trailing, 0.2365),
            ("1234567", Units::Inch, (1, 6), Zeros::None, 31.358002),
        ] {
            assert_eq!(mm(text, units, digits, zeros), want, "{text}");
        }
    }

    #[test]
    fn impossible_numbers_are_rejected() {
        assert_eq!(decimal(b"9999999999999999999999"), None);
        assert_eq!(decimal(b"-"), None);
        assert_eq!(decimal(b"--5"), None);
        let (far, _) = decimal(b"999999999").unwrap();
        assert_eq!(far.length(Units::Mm), None);
    }
}
