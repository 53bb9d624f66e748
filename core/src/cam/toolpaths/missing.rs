//! What no bit of an operation fits into, told size by size: it will be missing from the board.
//!
//! ```text
//!   sizes   0.2  0.2  0.2   0.38        an error for every size: how many, and where the first of them is
//!           ╰─── 3 ─────╯   ╰ 1 ╯
//! ```
//!
//! Comes in: sizes and places, one after the other. Goes out: diagnostics. Does not know what has these sizes.

use super::super::rack::size_text;
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::units::Length;
use std::collections::BTreeMap;

/// Sizes that are told one by one; all wider ones are told together.
const MOST_SIZES: usize = 40;

/// How many there are of every size, and where the first of them is.
#[derive(Default)]
pub(super) struct Missing(BTreeMap<Length, (usize, Point)>);

impl Missing {
    /// One more of `size`.
    pub(super) fn add(&mut self, size: Length, at: Point) {
        self.0.entry(size).or_insert((0, at)).0 += 1;
    }

    /// An error called `code` for every size, thin ones first, with `count`, `size`, `x` and `y`; lengths in mm.
    pub(super) fn errors(&self, code: &str) -> Vec<Diagnostic> {
        let error = |size: String, count: usize, at: Point| {
            let mm = |length: Length| format!("{:.3}", length.mm());
            let error = Diagnostic::error(code).with("count", count).with("size", size);
            error.with("x", mm(at.x)).with("y", mm(at.y))
        };
        let one = |(size, (count, at)): (&Length, &(usize, Point))| error(size_text(*size), *count, *at);
        let mut errors: Vec<Diagnostic> = self.0.iter().take(MOST_SIZES).map(one).collect();
        let wider = || self.0.iter().skip(MOST_SIZES);
        if let (Some((thin, (_, at))), Some((wide, _))) = (wider().next(), wider().last()) {
            let count = wider().map(|(_, (count, _))| count).sum();
            errors.push(error(format!("{} … {}", size_text(*thin), size_text(*wide)), count, *at));
        }
        errors
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_size_is_told_once_and_a_great_many_sizes_together() {
        let mut missing = Missing::default();
        for hole in 0..120_i64 {
            missing.add(Length::from_um(100 + hole / 2), Point::from_mm(hole as f64, 1.0));
        }
        let errors = missing.errors("cam.holes_missing");
        assert_eq!(errors.len(), MOST_SIZES + 1);
        let said = |at: usize, name: &str| {
            errors[at].args.iter().find(|(own, _)| own == name).map(|(_, value)| value.clone()).unwrap()
        };
        assert_eq!(
            (said(1, "size"), said(1, "count"), said(1, "x")),
            ("0.101".into(), "2".into(), "2.000".into())
        );
        assert_eq!((said(40, "size"), said(40, "count")), ("0.14 … 0.159".into(), "40".into()));
    }
}
