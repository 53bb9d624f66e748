//! Features too narrow for every tool of an operation, listed by size: they will be missing from the board.
//!
//! ```text
//!   sizes   0.2  0.2  0.2   0.38        an error for every size: count, and position of the first
//!           ╰─── 3 ─────╯   ╰ 1 ╯
//! ```

use crate::cam::rack::size_text;
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::units::Length;
use std::collections::BTreeMap;

/// Sizes that are listed individually; wider ones are reported together.
const MOST_SIZES: usize = 40;

#[derive(Default)]
pub(in crate::cam::toolpaths) struct Missing(BTreeMap<Length, (usize, Point)>);

impl Missing {
    pub(in crate::cam::toolpaths) fn add(&mut self, size: Length, at: Point) {
        self.0.entry(size).or_insert((0, at)).0 += 1;
    }

    /// An error `code` for every size, ascending, with `count`, `size`, `x` and `y`; lengths in mm.
    pub(in crate::cam::toolpaths) fn errors(&self, code: &str) -> Vec<Diagnostic> {
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
    fn missing_sizes_are_counted_and_many_sizes_merged() {
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
