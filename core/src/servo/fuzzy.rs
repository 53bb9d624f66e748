//! Fuzzy inference: two inputs with seven levels each, a rule table, one output.
//!
//! ```text
//!  NB   NM   NS   ZO   PS   PM   PB          membership of each level: unit triangles
//!  ‾\  /\  /\  /\  /\  /\  /‾               that add up to 1 everywhere, so product and
//!    \/  \/  \/  \/  \/  \/                 weighted mean are bilinear interpolation
//!  −3 −2   −1   0   1   2   3               in the table of rules
//! ```

/// Levels of each input: NB NM NS ZO PS PM PB.
pub const LEVELS: usize = 7;

/// Rules: row is the error, column its change, both from NB to PB; entries −3 … 3.
pub type Table = [[i8; LEVELS]; LEVELS];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tables {
    pub kp: Table,
    pub ki: Table,
    pub kd: Table,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FuzzyRules {
    /// Point-symmetric: R(−e, −ec) = R(e, ec), so both directions of travel behave alike. Recommended.
    #[default]
    Even,
    /// The table in most textbooks. Almost antisymmetric in (e, ec): left and right behave differently. For
    /// comparison.
    Classic,
}

impl FuzzyRules {
    pub const fn tables(self) -> &'static Tables {
        match self {
            Self::Even => &EVEN,
            Self::Classic => &CLASSIC,
        }
    }

    /// Name in files and on the command line.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Even => "even",
            Self::Classic => "classic",
        }
    }

    /// Finds a set by name.
    pub fn named(name: &str) -> Option<Self> {
        [Self::Even, Self::Classic].into_iter().find(|rules| rules.name() == name)
    }
}

/// Output of `table` at error `e` and change `ec`, both clamped to −3 … 3. NaN counts as 0.
pub fn infer(table: &Table, e: f64, ec: f64) -> f64 {
    let (row, x) = level(e);
    let (column, y) = level(ec);
    let rule = |i: usize, k: usize| f64::from(table[row + i][column + k]);
    (1.0 - x) * (1.0 - y) * rule(0, 0)
        + x * (1.0 - y) * rule(1, 0)
        + (1.0 - x) * y * rule(0, 1)
        + x * y * rule(1, 1)
}

/// The level below a scaled input (0 … 5), and the fraction of the way to the next (0 … 1).
fn level(scaled: f64) -> (usize, f64) {
    let from_low = if scaled.is_nan() { 3.0 } else { scaled.clamp(-3.0, 3.0) + 3.0 };
    let under = libm::floor(from_low).min(5.0);
    (under as usize, from_low - under)
}

const EVEN: Tables = Tables {
    kp: [
        [3, 3, 3, 3, 2, 1, 0],
        [3, 3, 2, 2, 0, -1, -2],
        [2, 2, 1, 1, -1, -2, -3],
        [-2, -1, 0, 1, 0, -1, -2],
        [-3, -2, -1, 1, 1, 2, 2],
        [-2, -1, 0, 2, 2, 3, 3],
        [0, 1, 2, 3, 3, 3, 3],
    ],
    ki: [
        [-3, -3, -3, -3, -3, -3, -3],
        [-2, -2, -1, -1, -1, -2, -2],
        [0, 1, 1, 2, 1, 0, -1],
        [0, 1, 2, 3, 2, 1, 0],
        [-1, 0, 1, 2, 1, 1, 0],
        [-2, -2, -1, -1, -1, -2, -2],
        [-3, -3, -3, -3, -3, -3, -3],
    ],
    kd: [
        [1, 0, -1, -1, -1, 0, 1],
        [2, 1, 0, 0, 0, 1, 2],
        [3, 2, 1, 0, 1, 2, 3],
        [3, 2, 1, 0, 1, 2, 3],
        [3, 2, 1, 0, 1, 2, 3],
        [2, 1, 0, 0, 0, 1, 2],
        [1, 0, -1, -1, -1, 0, 1],
    ],
};

const CLASSIC: Tables = Tables {
    kp: [
        [3, 3, 2, 2, 1, 0, 0],
        [3, 3, 2, 1, 1, 0, -1],
        [2, 2, 2, 1, 0, -1, -1],
        [2, 2, 1, 0, -1, -2, -2],
        [1, 1, 0, -1, -1, -2, -2],
        [1, 0, -1, -2, -2, -2, -3],
        [0, 0, -2, -2, -2, -3, -3],
    ],
    ki: [
        [-3, -3, -2, -2, -1, 0, 0],
        [-3, -3, -2, -1, -1, 0, 0],
        [-3, -2, -1, -1, 0, 1, 1],
        [-2, -2, -1, 0, 1, 2, 2],
        [-2, -1, 0, 1, 1, 2, 3],
        [0, 0, 1, 1, 2, 3, 3],
        [0, 0, 1, 2, 2, 3, 3],
    ],
    kd: [
        [1, -1, -3, -3, -3, -2, 1],
        [1, -1, -3, -2, -2, -1, 0],
        [0, -1, -2, -2, -1, -1, 0],
        [0, -1, -1, -1, -1, -1, 0],
        [0, 0, 0, 0, 0, 0, 0],
        [3, -1, 1, 1, 1, 1, 3],
        [3, 2, 2, 2, 1, 1, 3],
    ],
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_rules_are_symmetric_and_classic_ones_are_not() {
        let even =
            |table: &Table| (0..LEVELS).all(|i| (0..LEVELS).all(|k| table[i][k] == table[6 - i][6 - k]));
        let tables = FuzzyRules::Even.tables();
        assert!(even(&tables.kp) && even(&tables.ki) && even(&tables.kd));
        assert!(!even(&FuzzyRules::Classic.tables().kp));
        for rules in [FuzzyRules::Even, FuzzyRules::Classic] {
            assert_eq!(FuzzyRules::named(rules.name()), Some(rules));
            let all = [rules.tables().kp, rules.tables().ki, rules.tables().kd];
            assert!(all.as_flattened().as_flattened().iter().all(|rule| (-3..=3).contains(rule)));
        }
    }

    #[test]
    fn rules_are_exact_on_levels_and_continuous_between() {
        for tables in [FuzzyRules::Even.tables(), FuzzyRules::Classic.tables()] {
            for table in [&tables.kp, &tables.ki, &tables.kd] {
                for i in 0..LEVELS {
                    for k in 0..LEVELS {
                        let (e, ec) = (i as f64 - 3.0, k as f64 - 3.0);
                        assert_eq!(infer(table, e, ec), f64::from(table[i][k]));
                        // Adjacent rules differ by at most 4, so a thousandth of a level changes the output
                        // by at most 0.008.
                        let moved = infer(table, e + 1e-3, ec - 1e-3);
                        assert!((moved - infer(table, e, ec)).abs() <= 0.008 + 1e-12, "{e} {ec}");
                    }
                }
            }
        }
        let outside = infer(&EVEN.kd, 9.0, f64::NEG_INFINITY);
        assert_eq!(outside, f64::from(EVEN.kd[6][0]));
        assert!(infer(&EVEN.kd, f64::NAN, 0.0).is_finite());
    }
}
