//! A board that lies elsewhere than it should: the best shift and turn from alignment holes that were planned to those that were found,
//! how well they fit, and programs that go along (N17).
//!
//! ```text
//!  planned   ○ a        ○ b           found     ○ a'
//!                               ─▶                        ○ b'     shift, turn, and what is left over at each hole
//! ```
//!
//! Comes in: pairs of places, whole nanometres. Goes out: an [`BoardFit`], places that are moved by it. A board does not stretch: what
//! shift and turn cannot explain is left over, and too much of it is refused. Does not know who found the holes, nor with what.

use crate::diagnostic::Diagnostic;
use crate::geometry::Point;

/// Holes nearer to each other than this do not tell how a board is turned, mm.
const NEAREST_MM: f64 = 5.0;
/// What may be left over at a hole, mm: a third of a usual isolation gap.
const LEFT_OVER_MM: f64 = 0.1;
/// A board that is turned by more than this was put down another way round, degrees.
const MOST_DEG: f64 = 15.0;

/// An alignment hole: where it was planned, and where it was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FoundHole {
    /// As planned, work coordinates.
    pub planned: Point,
    /// As found, work coordinates.
    pub found: Point,
}

/// How a board lies: turned about the work zero, then shifted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardFit {
    /// Turn counter-clockwise, radians.
    pub turn_rad: f64,
    /// Shift after it, mm.
    pub shift_mm: [f64; 2],
    /// What is left over at the worst hole, mm.
    pub left_over_mm: f64,
}

impl BoardFit {
    /// The best fit of two holes or more: the sum of the squares of what is left over is the least that it can be.
    pub fn of(holes: &[FoundHole]) -> Result<Self, Diagnostic> {
        if holes.len() < 2 {
            return Err(Diagnostic::error("align.too_few"));
        }
        let count = holes.len() as f64;
        let mean = |place: fn(&FoundHole) -> Point| {
            let sum = holes.iter().map(place).fold([0.0, 0.0], |[x, y], at| [x + at.x.mm(), y + at.y.mm()]);
            sum.map(|sum| sum / count)
        };
        let (planned, found) = (mean(|hole| hole.planned), mean(|hole| hole.found));
        let about = |at: Point, middle: [f64; 2]| [at.x.mm() - middle[0], at.y.mm() - middle[1]];
        let (mut dot, mut cross, mut spread_mm) = (0.0, 0.0, 0.0_f64);
        for hole in holes {
            let ([a, b], [c, d]) = (about(hole.planned, planned), about(hole.found, found));
            (dot, cross) = (dot + a * c + b * d, cross + a * d - b * c);
            spread_mm = spread_mm.max(libm::hypot(a, b)).max(libm::hypot(c, d) * 0.5);
        }
        if spread_mm * 2.0 < NEAREST_MM {
            return Err(Diagnostic::error("align.too_near").with("mm", format!("{:.1}", spread_mm * 2.0)));
        }
        let turn_rad = libm::atan2(cross, dot);
        let mut fit = Self { turn_rad, shift_mm: [0.0; 2], left_over_mm: 0.0 };
        let turned = fit.moved_mm(planned);
        fit.shift_mm = [found[0] - turned[0], found[1] - turned[1]];
        let left_over = |hole: &FoundHole| {
            let [x, y] = fit.moved_mm([hole.planned.x.mm(), hole.planned.y.mm()]);
            libm::hypot(hole.found.x.mm() - x, hole.found.y.mm() - y)
        };
        fit.left_over_mm = holes.iter().map(left_over).fold(0.0, f64::max);
        if fit.left_over_mm > LEFT_OVER_MM {
            return Err(Diagnostic::error("align.apart").with("mm", format!("{:.3}", fit.left_over_mm)));
        }
        if libm::fabs(fit.degrees()) > MOST_DEG {
            return Err(Diagnostic::error("align.turned").with("degrees", format!("{:.1}", fit.degrees())));
        }
        Ok(fit)
    }

    /// Turn counter-clockwise, degrees.
    pub fn degrees(&self) -> f64 {
        self.turn_rad * 180.0 / std::f64::consts::PI
    }

    /// Where a planned place is.
    #[must_use]
    pub fn moved(&self, at: Point) -> Point {
        let [x, y] = self.moved_mm([at.x.mm(), at.y.mm()]);
        Point::from_mm(x, y)
    }

    fn moved_mm(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = (libm::sin(self.turn_rad), libm::cos(self.turn_rad));
        [cos * x - sin * y + self.shift_mm[0], sin * x + cos * y + self.shift_mm[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::Chance;

    fn hole(planned: [f64; 2], found: [f64; 2]) -> FoundHole {
        let at = |[x, y]: [f64; 2]| Point::from_mm(x, y);
        FoundHole { planned: at(planned), found: at(found) }
    }

    #[test]
    fn a_shift_and_a_turn_are_found_again() {
        let mut chance = Chance::new(5);
        for round in 0..500 {
            let truth = BoardFit {
                turn_rad: chance.between(-0.2, 0.2),
                shift_mm: [chance.between(-50.0, 50.0), chance.between(-50.0, 50.0)],
                left_over_mm: 0.0,
            };
            let count = 2 + round % 3;
            let places: Vec<Point> = (0..count)
                .map(|index| Point::from_mm(f64::from(index) * 40.0, chance.between(0.0, 60.0)))
                .collect();
            let holes: Vec<FoundHole> =
                places.iter().map(|at| FoundHole { planned: *at, found: truth.moved(*at) }).collect();
            let fit = BoardFit::of(&holes).unwrap();
            assert!(
                (fit.turn_rad - truth.turn_rad).abs() < 1e-6 && fit.left_over_mm < 1e-5,
                "{round} {fit:?}"
            );
            let far = Point::from_mm(100.0, -70.0);
            assert!(fit.moved(far).distance_mm(truth.moved(far)) < 1e-4, "{round}");
        }
    }

    #[test]
    fn what_is_left_over_is_the_least_and_told() {
        // Three holes, one of them 90 µm off: every other shift and turn leaves more.
        let holes =
            [hole([0.0, 0.0], [0.0, 0.0]), hole([80.0, 0.0], [80.0, 0.0]), hole([0.0, 60.0], [0.0, 60.09])];
        let fit = BoardFit::of(&holes).unwrap();
        assert!((0.02..0.09).contains(&fit.left_over_mm), "{fit:?}");
        let squares = |fit: &BoardFit| -> f64 {
            let each = holes.iter().map(|hole| fit.moved(hole.planned).distance_mm(hole.found));
            each.map(|mm| mm * mm).sum()
        };
        let best = squares(&fit);
        for (turn, x, y) in [(1e-4, 0.0, 0.0), (-1e-4, 0.0, 0.0), (0.0, 0.01, 0.0), (0.0, 0.0, -0.01)] {
            let shift_mm = [fit.shift_mm[0] + x, fit.shift_mm[1] + y];
            assert!(squares(&BoardFit { turn_rad: fit.turn_rad + turn, shift_mm, ..fit }) > best);
        }
    }

    #[test]
    fn what_no_board_does_is_refused() {
        let rows: [(&str, Vec<FoundHole>); 5] = [
            ("align.too_few", vec![hole([0.0, 0.0], [0.0, 0.0])]),
            ("align.too_near", vec![hole([0.0, 0.0], [0.0, 0.0]), hole([2.0, 0.0], [2.0, 0.0])]),
            // Stretched by a millimetre, seen from below, put down the other way round.
            ("align.apart", vec![hole([0.0, 0.0], [0.0, 0.0]), hole([80.0, 0.0], [81.0, 0.0])]),
            (
                "align.apart",
                vec![
                    hole([0.0, 0.0], [0.0, 0.0]),
                    hole([80.0, 0.0], [80.0, 0.0]),
                    hole([0.0, 60.0], [0.0, -60.0]),
                ],
            ),
            ("align.turned", vec![hole([0.0, 0.0], [80.0, 60.0]), hole([80.0, 60.0], [0.0, 0.0])]),
        ];
        for (code, holes) in rows {
            assert_eq!(BoardFit::of(&holes).unwrap_err().code, code);
        }
    }
}
