//! Ticks of an axis, in steps of 1, 2 or 5 times a power of ten, and their texts.

#[derive(Clone, Debug, PartialEq)]
pub struct Ticks {
    pub step: f64,
    /// Values in ascending order, all within the axis.
    pub values: Vec<f64>,
    pub words: Vec<String>,
}

/// Ticks from `low` to `high`, about `most` of them and never more than twice as many. Invalid ranges (not
/// finite, empty or reversed) become 0 … 1.
pub fn ticks(low: f64, high: f64, most: usize) -> Ticks {
    let [low, high] = if usable(low, high) { [low, high] } else { [0.0, 1.0] };
    let most = most.clamp(1, 100);
    let (step, exponent) = round_step((high - low) / most as f64);
    // A small margin, so that rounding can't lose a tick at the end of the range.
    let (first, last) = ((low / step - 1e-9).ceil(), (high / step + 1e-9).floor());
    let count = ((last - first).max(0.0) as usize).min(2 * most);
    let values: Vec<f64> = (0..=count).map(|k| (first + k as f64) * step + 0.0).collect();
    let greatest = values.iter().fold(0.0_f64, |greatest, value| greatest.max(value.abs()));
    let powers = greatest >= 1e6 || exponent < -5;
    let words = values.iter().map(|value| word(*value, step, exponent, powers)).collect();
    Ticks { step, values, words }
}

pub(super) fn usable(low: f64, high: f64) -> bool {
    let size = low.abs().max(high.abs());
    low.is_finite()
        && high.is_finite()
        && high - low > 1e-12 * size
        && (1e-300..1e300).contains(&(high - low))
}

/// The smallest of 1, 2, 5 · 10ⁿ that is at least `rough`, and n.
fn round_step(rough: f64) -> (f64, i32) {
    let exponent = libm::floor(libm::log10(rough)) as i32;
    for (factor, up) in [(1.0, 0), (2.0, 0), (5.0, 0), (1.0, 1)] {
        let step = factor * power_of_ten(exponent + up);
        if step >= rough * (1.0 - 1e-9) {
            return (step, exponent + up);
        }
    }
    (power_of_ten(exponent + 1), exponent + 1)
}

/// 10ⁿ, correctly rounded by the parser.
fn power_of_ten(exponent: i32) -> f64 {
    format!("1e{exponent}").parse().unwrap_or(1.0)
}

/// `powers`: use powers of ten on the whole axis.
fn word(value: f64, step: f64, exponent: i32, powers: bool) -> String {
    if value.abs() < 0.5 * step {
        return "0".to_owned();
    }
    if powers {
        // Enough digits to distinguish neighbours.
        let digits = (libm::floor(libm::log10(value.abs())) as i32 - exponent).clamp(0, 15) as usize;
        return format!("{value:.digits$e}").replace('-', "−");
    }
    let decimals = (-exponent).max(0) as usize;
    format!("{value:.decimals$}").replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::Chance;

    #[test]
    fn tick_steps_are_round_and_labels_short() {
        let rows: [(f64, f64, usize, &[&str]); 10] = [
            (0.0, 1.0, 5, &["0", "0.2", "0.4", "0.6", "0.8", "1.0"]),
            (0.0, 0.16, 4, &["0", "0.05", "0.10", "0.15"]),
            (-10_000.0, 10_000.0, 4, &["−10000", "−5000", "0", "5000", "10000"]),
            (0.0, 1e6, 2, &["0", "5e5", "1.0e6"]),
            (-2e6, 2e6, 4, &["−2e6", "−1e6", "0", "1e6", "2e6"]),
            (0.0, 3e-7, 3, &["0", "1e−7", "2e−7", "3e−7"]),
            (99.0, 101.0, 2, &["99", "100", "101"]),
            (1e6, 1.00002e6, 2, &["1.00000e6", "1.00001e6", "1.00002e6"]),
            (3.0, 3.0, 2, &["0", "0.5", "1.0"]),
            (f64::NAN, 3.0, 1, &["0", "1"]),
        ];
        for (low, high, most, words) in rows {
            assert_eq!(ticks(low, high, most).words, words, "{low} … {high}");
        }
    }

    #[test]
    fn any_axis_has_a_bounded_number_of_ticks_inside_it() {
        let mut chance = Chance::new(11);
        for _ in 0..20_000 {
            let mut next = || f64::from_bits(chance.bits());
            let (low, high) = (next(), next());
            let most = 7;
            let found = ticks(low, high, most);
            assert!(found.values.len() <= 2 * most + 1 && !found.values.is_empty(), "{low} {high} {found:?}");
            if usable(low, high) {
                let room = 1e-6 * (high - low);
                assert!(found.values.iter().all(|v| *v >= low - room && *v <= high + room), "{low} {high}");
            }
        }
    }
}
