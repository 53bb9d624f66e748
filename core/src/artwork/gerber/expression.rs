//! Arithmetic in macros: `$1x2-($2+.5)/3`.
//!
//! ```text
//!   sum = product (+|- product)*     product = atom ((x|X|/) atom)*     atom = [+|-] (number | $n | ( sum ))
//! ```

use std::collections::BTreeMap;

const DEEPEST: u32 = 64;

/// Evaluates the whole text; none if it isn't valid, or without fuel.
pub(super) fn value(text: &[u8], variables: &BTreeMap<u32, f64>, fuel: &mut usize) -> Option<f64> {
    let mut walk = Walk { text, at: 0, variables, depth: 0 };
    *fuel = fuel.checked_sub(text.len() + 1)?;
    let found = walk.sum()?;
    (walk.peek().is_none() && found.is_finite()).then_some(found)
}

struct Walk<'a> {
    text: &'a [u8],
    at: usize,
    variables: &'a BTreeMap<u32, f64>,
    depth: u32,
}

impl Walk<'_> {
    /// The next byte that isn't white space.
    fn peek(&mut self) -> Option<u8> {
        while self.text.get(self.at)?.is_ascii_whitespace() {
            self.at += 1;
        }
        self.text.get(self.at).copied()
    }

    fn sum(&mut self) -> Option<f64> {
        let mut total = self.product()?;
        while let Some(sign @ (b'+' | b'-')) = self.peek() {
            self.at += 1;
            let right = self.product()?;
            total = if sign == b'+' { total + right } else { total - right };
        }
        Some(total)
    }

    fn product(&mut self) -> Option<f64> {
        let mut total = self.atom()?;
        while let Some(sign @ (b'x' | b'X' | b'/')) = self.peek() {
            self.at += 1;
            let right = self.atom()?;
            total = if sign == b'/' { total / right } else { total * right };
        }
        Some(total)
    }

    fn atom(&mut self) -> Option<f64> {
        let mut negative = false;
        while let Some(sign @ (b'+' | b'-')) = self.peek() {
            self.at += 1;
            negative ^= sign == b'-';
        }
        let found = match self.peek()? {
            b'(' => {
                self.at += 1;
                self.depth += 1;
                let inner = (self.depth <= DEEPEST).then(|| self.sum())??;
                self.depth -= 1;
                (self.peek()? == b')').then(|| self.at += 1)?;
                inner
            }
            b'$' => {
                self.at += 1;
                let index = self.digits()?;
                // An undefined variable is 0.
                self.variables.get(&index).copied().unwrap_or(0.0)
            }
            _ => self.number()?,
        };
        Some(if negative { -found } else { found })
    }

    fn digits(&mut self) -> Option<u32> {
        let rest = self.text.get(self.at..)?;
        let length = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
        let text = std::str::from_utf8(rest.get(..length)?).ok()?;
        self.at += length;
        text.parse().ok()
    }

    fn number(&mut self) -> Option<f64> {
        let rest = self.text.get(self.at..)?;
        let length = rest.iter().take_while(|byte| byte.is_ascii_digit() || **byte == b'.').count();
        let text = std::str::from_utf8(rest.get(..length)?).ok()?;
        self.at += length;
        text.parse().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn expressions_are_evaluated_or_invalid() {
        let variables = BTreeMap::from([(1, 2.0), (2, 0.5)]);
        for (text, want) in [
            ("1", Some(1.0)),
            ("-.5", Some(-0.5)),
            ("$1x3-$2", Some(5.5)),
            ("$1X($2+1)/3", Some(1.0)),
            ("1-2-3", Some(-4.0)),
            ("8/2/2", Some(2.0)),
            ("1+2x3", Some(7.0)),
            ("-($1)", Some(-2.0)),
            ("1--2", Some(3.0)),
            ("$7", Some(0.0)),
            (" 1 + 1 ", Some(2.0)),
            ("1/0", None),
            ("1+", None),
            ("(1", None),
            ("1)", None),
            ("1.2.3", None),
            ("$", None),
            ("", None),
        ] {
            assert_eq!(value(text.as_bytes(), &variables, &mut 1_000), want, "{text}");
        }
    }

    #[test]
    fn depth_and_fuel_are_bounded() {
        let deep = format!("{}1{}", "(".repeat(100_000), ")".repeat(100_000));
        assert_eq!(value(deep.as_bytes(), &BTreeMap::new(), &mut 1_000_000), None);
        let fine = format!("{}1{}", "(".repeat(60), ")".repeat(60));
        assert_eq!(value(fine.as_bytes(), &BTreeMap::new(), &mut 1_000), Some(1.0));
        assert_eq!(value(fine.as_bytes(), &BTreeMap::new(), &mut 100), None);
    }
}
