//! Places that a drill was at: where a file, two files or two operations name a hole twice, one stroke makes it.
//!
//! ```text
//!   file  ─ 0.8 at 15, 5 ─┐
//!                         ├─▶ one stroke     as deep as before, the same bit, within 1 µm: nothing is left to drill
//!   file  ─ 0.8 at 15, 5 ─┘
//! ```
//!
//! Comes in: strokes one after the other: bit, place, depth. Goes out: whether each is one too many, and what to say about
//! them. Does not know why there are two.

use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::units::Length;
use std::collections::BTreeMap;

/// Places this near to each other, along X and along Y, are one.
const SAME: Length = Length::from_um(1);

/// Where which bit was how deep, and what came again.
#[derive(Default)]
pub(super) struct Places(BTreeMap<(Length, i64, i64), (Point, Length)>);

impl Places {
    /// Whether the bit of `size` was at `at` before, and at least as deep; else it has been now.
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

/// How many holes were there twice, and where the first of them is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Twice(Option<(usize, Point)>);

impl Twice {
    /// One more, at `at`.
    pub(super) fn add(&mut self, at: Point) {
        self.0.get_or_insert((0, at)).0 += 1;
    }

    /// A note called `code` with `count`, `x` and `y` in mm, if there were any.
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
    fn a_place_is_the_same_within_a_micrometre_for_the_same_bit_and_depth() {
        let nm = Length::from_nm;
        let (bit, wide) = (Length::from_um(800), Length::from_um(1_000));
        // Bit, x and y in nm, depth in µm, and whether it was there before.
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
