//! Records drilled positions: a hole listed twice, in files or operations, is drilled once.
//!
//! ```text
//!   file  ─ 0.8 at 15, 5 ─┐
//!                         ├─▶ one drill cycle     equally deep, same tool, within 1 µm
//!   file  ─ 0.8 at 15, 5 ─┘
//! ```

use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::units::Length;
use std::collections::BTreeMap;

/// Positions within this along X and along Y are equal.
const SAME: Length = Length::from_um(1);

#[derive(Default)]
pub(super) struct Places(BTreeMap<(Length, i64, i64), (Point, Length)>);

impl Places {
    /// True if a tool of `size` was already at `at`, at least as deep; else records it.
    pub(super) fn again(&mut self, size: Length, at: Point, depth: Length) -> bool {
        let cell = |length: Length| length.nm().div_euclid(SAME.nm());
        let (x, y) = (cell(at.x), cell(at.y));
        let near = |place: &Point| (place.x - at.x).abs() <= SAME && (place.y - at.y).abs() <= SAME;
        let mut around = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (size, x + dx, y + dy)));
        let was = |cell| self.0.get(&cell).is_some_and(|(place, deep)| near(place) && *deep >= depth);
        if around.any(was) {
            return true;
        }
        self.0.insert((size, x, y), (at, depth));
        false
    }
}

/// Number of repeated holes, and the position of the first.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Twice(Option<(usize, Point)>);

impl Twice {
    pub(super) fn add(&mut self, at: Point) {
        self.0.get_or_insert((0, at)).0 += 1;
    }

    /// A note `code` with `count`, `x` and `y` in mm, if there were any.
    pub(super) fn note(self, code: &str) -> Option<Diagnostic> {
        let (count, at) = self.0?;
        let mm = |length: Length| format!("{:.3}", length.mm());
        let note = Diagnostic::note(code).with("count", count);
        Some(note.with("x", mm(at.x)).with("y", mm(at.y)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_holes_within_1_um_are_recognised() {
        let nm = Length::from_nm;
        let (bit, wide) = (Length::from_um(800), Length::from_um(1_000));
        // Tool, x and y in nm, depth in µm, and whether it was already there.
        let rows = [
            (bit, 15_000_000, -5_000_000, 1_600, false),
            (bit, 15_000_000, -5_000_000, 1_600, true),
            (bit, 15_001_000, -5_001_000, 1_600, true),
            (bit, 14_999_000, -4_999_000, 1_600, true),
            (bit, 15_000_000, -5_000_000, 200, true),
            (bit, 15_001_001, -5_000_000, 1_600, false),
            (bit, 15_000_000, -5_001_001, 1_600, false),
            (wide, 15_000_000, -5_000_000, 1_600, false),
            (bit, 15_000_000, -5_000_000, 2_000, false),
            (bit, 15_000_000, -5_000_000, 1_800, true),
        ];
        let mut places = Places::default();
        for (row, (size, x, y, depth, again)) in rows.into_iter().enumerate() {
            let at = Point::new(nm(x), nm(y));
            assert_eq!(places.again(size, at, Length::from_um(depth)), again, "row {row}");
        }
    }
}
