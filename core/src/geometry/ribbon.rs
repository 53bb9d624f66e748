//! The area that a round tool sweeps along a polyline, as one outline.
//!
//! ```text
//!    ╭────────────╮          outer side of a corner: an arc about the corner
//!   (a ·········· b╲         inner side: through the corner, so that every part winds to the left
//!    ╰─────────┐╲ · ╲
//!               b╲ · c)      fewer edges than one outline for each line, and no round ends inside
//! ```
//!
//! The outline has its inside on the left, crosses itself, and winds around its area once or more.
//! Corners are whole nanometres.

use super::overlay::{Spot, apart, spot};
use super::{Path, PathSegment, Point};
use crate::units::Length;

/// The outline of a round tool of `width` along `corners`. Neighbouring corners must differ. `None` for fewer
/// than two corners or no width.
pub fn ribbon(corners: &[Point], width: Length) -> Option<Path> {
    if corners.len() < 2 || width.nm() <= 0 {
        return None;
    }
    let half = width.nm() as f64 / 2.0;
    let back: Vec<Point> = corners.iter().rev().copied().collect();
    let mut segments = Vec::with_capacity(6 * corners.len());
    side(corners, half, &mut segments);
    side(&back, half, &mut segments);
    let start = match segments.last() {
        Some(PathSegment::Arc { to, .. } | PathSegment::Line { to }) => *to,
        None => return None,
    };
    Some(Path { start, segments })
}

/// Adds the right side of the lines and the round end after the last.
fn side(corners: &[Point], half: f64, segments: &mut Vec<PathSegment>) {
    let lines: Vec<(Point, Point)> =
        corners.iter().zip(corners.iter().skip(1)).map(|(&a, &b)| (a, b)).collect();
    for (number, &(from, to)) in lines.iter().enumerate() {
        let right = right_of(from, to, half);
        segments.push(PathSegment::Line { to: moved(to, right) });
        let bend = |to: Point, centre: Point| PathSegment::Arc { to, centre, clockwise: false };
        match lines.get(number + 1) {
            None => segments.push(bend(moved(to, (-right.0, -right.1)), to)),
            Some(&(_, after)) => {
                let next = right_of(to, after, half);
                let start = moved(to, next);
                let turn = right.0 * next.1 - right.1 * next.0;
                let is_straight = start == moved(to, right);
                if turn > 0.0 || (turn == 0.0 && !is_straight) {
                    segments.push(bend(start, to));
                } else if !is_straight {
                    segments.push(PathSegment::Line { to });
                    segments.push(PathSegment::Line { to: start });
                }
            }
        }
    }
}

fn right_of(from: Point, to: Point, half: f64) -> Spot {
    let (a, b) = (spot(from), spot(to));
    let length = apart(a, b).max(1.0);
    ((b.1 - a.1) / length * half, -(b.0 - a.0) / length * half)
}

fn moved(from: Point, by: Spot) -> Point {
    let (x, y) = spot(from);
    let length = |nm: f64| Length::from_nm(libm::round(nm) as i64);
    Point::new(length(x + by.0), length(y + by.1))
}

#[cfg(test)]
mod tests {
    use super::super::combine::together;
    use super::super::{CombineRule, area_mm2, combine};
    use super::*;
    use crate::chance::Chance;
    use crate::geometry::stroke;

    #[test]
    fn ribbon_covers_the_area_of_its_lines() {
        let mut chance = Chance::new(3);
        let width = Length::from_um(200);
        let mut rows: Vec<Vec<(f64, f64)>> = vec![
            vec![(0.0, 0.0), (1.0, 0.0)],
            vec![(0.0, 0.0), (1.0, 0.0), (0.2, 0.0)],
            vec![(0.0, 0.0), (1.0, 0.0), (2.0, 0.0), (2.0, 1.0), (0.0, 1.0), (0.0, 0.0)],
            vec![(0.0, 0.0), (0.05, 0.0), (0.05, 0.05), (0.0, 0.05), (0.3, 0.3)],
        ];
        for _ in 0..40 {
            let mut at = |most: usize| chance.below(most) as f64 / 1_000.0;
            rows.push((0..12).map(|_| (at(1_500), at(900))).collect());
            rows.push((0..12).map(|_| (at(150), at(90))).collect());
        }
        for row in rows {
            let corners: Vec<Point> = row.iter().map(|&(x, y)| Point::from_mm(x, y)).collect();
            let outline = ribbon(&corners, width).unwrap();
            assert!(outline.is_closed());
            let lines = stroke(&Path::through(&corners).unwrap(), width);
            let (one, all) = (together(&[outline]), together(&lines));
            let off = area_mm2(&combine(&one, &all, CombineRule::Xor));
            assert!(off < 2e-5, "{off} mm² differ: {row:?}");
        }
    }
}
