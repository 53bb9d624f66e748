//! Number formats.

/// Treatment of trailing zeros.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrailingZeros {
    /// `2.500`: all decimals.
    All,
    /// `2.5` and `2.0`: at least one decimal.
    One,
    /// `2.5` and `2.`: always a point.
    Point,
    /// `2.5` and `2`.
    None,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    /// Decimals, at most 6.
    pub decimals: u32,
    pub trailing: TrailingZeros,
    /// Minimum digits before the point: 0 writes `.5`, 3 writes `000.5`.
    pub leading: u32,
    /// Whether there is a point. Without it the number counts units of its last digit.
    pub point: bool,
    /// Whether numbers that are not negative have a `+`.
    pub plus: bool,
}

impl Format {
    /// Rounds `value` millionths to the last written digit, halves away from zero; the result in millionths.
    pub(crate) fn rounded(self, value: i64) -> i64 {
        let unit = 10_i64.pow(6 - self.decimals.min(6));
        let size = (i128::from(value).abs() + i128::from(unit) / 2) / i128::from(unit) * i128::from(unit);
        let size = i64::try_from(size).unwrap_or(i64::MAX);
        if value < 0 { -size } else { size }
    }

    /// `value` millionths as text; never `-0`.
    pub(crate) fn text(self, value: i64) -> String {
        let decimals = self.decimals.min(6);
        let unit = 10_i128.pow(6 - decimals);
        let size = (i128::from(value).abs() + unit / 2) / unit;
        let sign = match (value < 0 && size != 0, self.plus) {
            (true, _) => "-",
            (false, true) => "+",
            (false, false) => "",
        };
        let one = 10_i128.pow(decimals);
        let (whole, part) = (size / one, size % one);
        let whole = if whole == 0 && self.leading == 0 && decimals > 0 {
            String::new()
        } else {
            format!("{whole:0width$}", width = self.leading.min(12) as usize)
        };
        if decimals == 0 {
            return format!("{sign}{whole}");
        }
        let part = format!("{part:0width$}", width = decimals as usize);
        if !self.point {
            return format!("{sign}{whole}{part}");
        }
        let short = part.trim_end_matches('0');
        let text = match self.trailing {
            TrailingZeros::All => format!("{whole}.{part}"),
            TrailingZeros::One => format!("{whole}.{}", if short.is_empty() { "0" } else { short }),
            TrailingZeros::Point => format!("{whole}.{short}"),
            TrailingZeros::None if short.is_empty() => whole,
            TrailingZeros::None => format!("{whole}.{short}"),
        };
        // At least one digit, even if the format asks for none.
        let text = if text.chars().any(|c| c.is_ascii_digit()) { text } else { format!("0{text}") };
        format!("{sign}{text}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_follow_their_format() {
        let plain =
            Format { decimals: 3, trailing: TrailingZeros::All, leading: 1, point: true, plus: false };
        let rows = [
            (1_500_000, plain, "1.500"),
            (1_500_000, Format { trailing: TrailingZeros::None, ..plain }, "1.5"),
            (2_000_000, Format { trailing: TrailingZeros::One, ..plain }, "2.0"),
            (2_000_000, Format { trailing: TrailingZeros::Point, ..plain }, "2."),
            (2_000_000, Format { trailing: TrailingZeros::None, ..plain }, "2"),
            (2_000_000, Format { decimals: 0, ..plain }, "2"),
            (-400, plain, "0.000"),
            (-500, plain, "-0.001"),
            (499, plain, "0.000"),
            (500_000, Format { leading: 0, ..plain }, ".500"),
            (0, Format { leading: 0, trailing: TrailingZeros::None, ..plain }, "0"),
            (0, Format { leading: 0, trailing: TrailingZeros::Point, ..plain }, "0."),
            (-500_000, Format { leading: 3, plus: true, ..plain }, "-000.500"),
            (0, Format { plus: true, trailing: TrailingZeros::None, ..plain }, "+0"),
            (12_700_000, Format { point: false, leading: 3, ..plain }, "012700"),
            (-1_234_567, Format { decimals: 6, ..plain }, "-1.234567"),
            (-1_234_567, Format { decimals: 9, ..plain }, "-1.234567"),
            (i64::MIN, Format { decimals: 6, ..plain }, "-9223372036854.775808"),
        ];
        for (value, format, text) in rows {
            assert_eq!(format.text(value), text, "{value} {format:?}");
        }
        assert_eq!((plain.rounded(-1_500), plain.rounded(1_499), plain.rounded(-400)), (-2_000, 1_000, 0));
    }
}
