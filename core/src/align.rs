//! Alignment: computes the shift and rotation of a board from planned and measured holes, and moves programs
//! accordingly.
//!
//! ```text
//!  planned   ○ a        ○ b           measured  ○ a'
//!                               ─▶                    ○ b'     shift, rotation, and an error at each hole
//! ```
//!
//! A board doesn't stretch: shift and rotation leave an error at each hole, and too large an error is
//! refused.

use crate::diagnostic::Diagnostic;
use crate::error;
use crate::geometry::Point;
use crate::job::{Command, Leg, Mark, Program};
use serde::{Deserialize, Serialize};

/// Smallest distance between alignment holes that gives a reliable rotation, mm.
const NEAREST_MM: f64 = 5.0;
/// Greatest error at a hole, mm: a third of a typical isolation gap.
const LEFT_OVER_MM: f64 = 0.1;
/// Greatest rotation, degrees. A larger one means that the board was placed the wrong way round.
const MOST_DEG: f64 = 15.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FoundHole {
    /// Planned position, work coordinates.
    pub planned: Point,
    /// Measured position, work coordinates.
    pub found: Point,
}

/// Pose of a board: rotated about the work zero, then shifted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoardFit {
    pub turn_rad: f64,
    /// Shift after the rotation, mm.
    pub shift_mm: [f64; 2],
    /// Error at the worst hole, mm.
    pub left_over_mm: f64,
}

impl BoardFit {
    pub fn of(holes: &[FoundHole]) -> Result<Self, Diagnostic> {
        if holes.len() < 2 {
            return Err(error!("align.too_few"));
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
            return Err(error!("align.too_near", mm = format!("{:.1}", spread_mm * 2.0)));
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
            return Err(error!("align.apart", mm = format!("{:.3}", fit.left_over_mm)));
        }
        if libm::fabs(fit.degrees()) > MOST_DEG {
            return Err(error!("align.turned", degrees = format!("{:.1}", fit.degrees())));
        }
        Ok(fit)
    }

    pub fn degrees(&self) -> f64 {
        self.turn_rad * 180.0 / std::f64::consts::PI
    }

    /// Real position of a planned position.
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

/// Moves the program to the board's pose. The program still starts and ends at the work zero.
#[must_use]
pub fn aligned(program: &Program, fit: &BoardFit) -> Program {
    let moved = |command: &Command| match *command {
        Command::Rapid { to } => Command::Rapid { to: fit.moved(to) },
        Command::Mill { to, height, feed_um_per_s } => {
            Command::Mill { to: fit.moved(to), height, feed_um_per_s }
        }
        Command::MillArc { to, height, center, ccw, feed_um_per_s } => {
            Command::MillArc { to: fit.moved(to), height, center: fit.moved(center), ccw, feed_um_per_s }
        }
        same => same,
    };
    let legs = program.legs.iter().map(|leg| match leg.mark {
        Mark::Prepare | Mark::ToolChange(_) | Mark::Finish => leg.clone(),
        Mark::Hole(_) | Mark::Toolpath(_) => {
            Leg { mark: leg.mark, commands: leg.commands.iter().map(moved).collect() }
        }
    });
    Program { legs: legs.collect(), ..program.clone() }
}

/// Up to three of `places` that determine the pose best: the two with the greatest distance, and the one
/// furthest from both.
pub fn telling(places: &[Point]) -> Vec<Point> {
    let apart = |a: Point, b: Point| a.distance_mm(b);
    // Only points on the rim can be furthest apart, and that saves time with many points.
    let mut rim: Vec<Point> = Vec::new();
    for turn in 0..32 {
        let angle = f64::from(turn) * std::f64::consts::PI / 16.0;
        let along = |at: &Point| at.x.mm() * libm::cos(angle) + at.y.mm() * libm::sin(angle);
        let furthest = places.iter().copied().max_by(|a, b| along(a).total_cmp(&along(b)));
        rim.extend(furthest.filter(|at| !rim.contains(at)));
    }
    let pairs = rim.iter().flat_map(|a| rim.iter().map(move |b| (*a, *b)));
    let Some((a, b)) = pairs.max_by(|one, other| apart(one.0, one.1).total_cmp(&apart(other.0, other.1)))
    else {
        return Vec::new();
    };
    let from_both = |at: &Point| apart(*at, a).min(apart(*at, b));
    let third = rim.iter().copied().max_by(|one, other| from_both(one).total_cmp(&from_both(other)));
    let mut found = vec![a];
    found.extend((apart(a, b) > 0.0).then_some(b));
    found.extend(third.filter(|at| from_both(at) > NEAREST_MM));
    found
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
    fn fit_recovers_rotation_and_shift() {
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
    fn fit_minimises_squared_distances() {
        // Three holes, one of them off by 90 µm: every other shift and rotation has a larger error.
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
    fn alignment_moves_toolpaths_but_not_the_finish() {
        use crate::units::Length;
        let at = Point::from_mm;
        let leg = |mark, commands| Leg { mark, commands };
        let arc =
            |to, center| Command::MillArc { to, height: Length::ZERO, center, ccw: true, feed_um_per_s: 1 };
        let path = vec![Command::Rapid { to: at(10.0, 0.0) }, arc(at(0.0, 10.0), at(0.0, 0.0))];
        let home = vec![Command::Rapid { to: Point::default() }];
        let program = Program::of_legs(vec![leg(Mark::Toolpath(0), path), leg(Mark::Finish, home)]);
        let quarter = std::f64::consts::FRAC_PI_2;
        let fit = BoardFit { turn_rad: quarter, shift_mm: [1.0, 2.0], left_over_mm: 0.0 };
        let moved = aligned(&program, &fit);
        let expected = [Command::Rapid { to: at(1.0, 12.0) }, arc(at(-9.0, 2.0), at(1.0, 2.0))];
        assert_eq!(moved.legs[0].commands, expected);
        assert_eq!(moved.legs[1], program.legs[1]);
    }

    #[test]
    fn telling_holes_are_far_apart() {
        let at = Point::from_mm;
        let grid: Vec<Point> =
            (0..60).map(|n| at(f64::from(n % 10) * 8.0, f64::from(n / 10) * 8.0)).collect();
        let found = telling(&grid);
        assert_eq!(found.len(), 3);
        assert!((found[0].distance_mm(found[1]) - libm::hypot(72.0, 40.0)).abs() < 1e-9, "{found:?}");
        assert!(found[2].distance_mm(found[0]).min(found[2].distance_mm(found[1])) >= 40.0, "{found:?}");
        assert_eq!(telling(&[at(0.0, 0.0), at(30.0, 0.0), at(31.0, 0.0)]).len(), 2, "nothing far from both");
        assert_eq!((telling(&[at(1.0, 1.0)]).len(), telling(&[]).len()), (1, 0));
    }

    #[test]
    fn impossible_alignments_are_errors() {
        let rows: [(&str, Vec<FoundHole>); 5] = [
            ("align.too_few", vec![hole([0.0, 0.0], [0.0, 0.0])]),
            ("align.too_near", vec![hole([0.0, 0.0], [0.0, 0.0]), hole([2.0, 0.0], [2.0, 0.0])]),
            // Stretched by a millimetre, mirrored, rotated half a turn.
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
