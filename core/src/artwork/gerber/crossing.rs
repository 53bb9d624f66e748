//! Contours that cross themselves: with even-odd filling, areas covered twice become empty.
//!
//! ```text
//!    ▟▙  ╲╱  a bow tie: its straight edges cross        ┌──┐ a cut-in to a hole: coincident edges
//!    ▜▛  ╱╲  well inside both                           │□═┤ don't cross
//! ```

use crate::geometry::{Path, PathSegment, Point};

/// Maximum number of edge pairs compared per layer.
pub(super) const FUEL: u32 = 2_000_000;
/// An edge counts as crossed only if both ends are further away from the other than this, because rounding in
/// CADs causes smaller crossings.
const SLACK_MM: f64 = 1e-3;

/// True if straight edges of `path` cross. Each compared pair costs one of `fuel`; without fuel returns
/// false.
pub(super) fn crosses_itself(path: &Path, fuel: &mut u32) -> bool {
    let line = |(from, segment): (Point, PathSegment)| match segment {
        PathSegment::Line { to } => Some((from.min(to), from.max(to))),
        PathSegment::Arc { .. } => None,
    };
    // The end with the smaller X is the first one.
    let mut edges: Vec<(Point, Point)> = path.pieces().filter_map(line).collect();
    edges.sort_unstable_by_key(|edge| edge.0.x);
    let heights = |edge: &(Point, Point)| (edge.0.y.min(edge.1.y), edge.0.y.max(edge.1.y));
    let mut rest = edges.iter();
    while let Some(edge) = rest.next() {
        let (low, high) = heights(edge);
        for other in rest.clone().take_while(|other| other.0.x <= edge.1.x) {
            if *fuel == 0 {
                return false;
            }
            *fuel -= 1;
            let (bottom, top) = heights(other);
            if bottom <= high && low <= top && parts(*edge, *other) && parts(*other, *edge) {
                return true;
            }
        }
    }
    false
}

/// True if the ends of `other` are clearly on different sides of the line through `edge`.
fn parts(edge: (Point, Point), other: (Point, Point)) -> bool {
    let mm = |from: Point, to: Point| ((to.x - from.x).mm(), (to.y - from.y).mm());
    let along = mm(edge.0, edge.1);
    let side = |point: Point| {
        let (x, y) = mm(edge.0, point);
        along.0 * y - along.1 * x
    };
    let (first, second) = (side(other.0), side(other.1));
    let (right, left) = (first.min(second), first.max(second));
    right < 0.0 && left > 0.0 && {
        let slack = SLACK_MM * libm::sqrt(along.0 * along.0 + along.1 * along.1);
        right < -slack && left > slack
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bow_ties_cross_and_cut_ins_do_not() {
        let bow_tie = [(0.0, 0.0), (4.0, 4.0), (4.0, 0.0), (0.0, 4.0)];
        let square = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)];
        let cut_in = [
            (0.0, 0.0),
            (4.0, 0.0),
            (4.0, 2.0),
            (3.0, 2.0),
            (3.0, 1.0),
            (1.0, 1.0),
            (1.0, 2.0),
            (3.0, 2.0),
            (4.0, 2.0),
            (4.0, 4.0),
            (0.0, 4.0),
        ];
        let rounded = [(0.0, 0.0), (4.0, 0.0), (2.0, 0.000_5), (2.0, -0.000_4), (4.0, 4.0)];
        let touching = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (2.0, 0.0), (0.0, 4.0)];
        for (corners, crosses) in
            [(&bow_tie[..], true), (&square, false), (&cut_in, false), (&rounded, false), (&touching, false)]
        {
            let points: Vec<Point> = corners.iter().map(|&(x, y)| Point::from_mm(x, y)).collect();
            let segments =
                points[1..].iter().chain([&points[0]]).map(|&to| PathSegment::Line { to }).collect();
            let path = Path { start: points[0], segments };
            let mut fuel = FUEL;
            assert_eq!(crosses_itself(&path, &mut fuel), crosses, "{corners:?}");
            assert!(fuel < FUEL && FUEL - fuel <= 45, "{corners:?}");
            assert!(!crosses_itself(&path, &mut 0));
        }
    }
}
