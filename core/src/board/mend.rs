//! Closes an outline with one missing piece by a straight line, if the enclosed area is certain.
//!
//! ```text
//!   ╭──────────────╮
//!   │   ▪     ▪    │       one piece is missing, at most a third of the rest, and all copper and all holes
//!   └──────────┄┄┄╯        are inside the straight line
//! ```
//!
//! The caller states what must be inside.

use super::outline::{filled, nest};
use crate::geometry::{Index, Path, PathSegment, Point, Region};
use crate::units::Length;

/// The rest of the outline is at least this many times as long as the missing piece.
const LEAST_REST_FACTOR: f64 = 3.0;
/// With more lines than this nothing is closed: the layer is a drawing.
const MOST_LINES: usize = 200;

/// Index of the line in `rest` that a straight piece turns into an outline that `holds` everything.
pub(super) fn whole(rest: &[Path], holds: &dyn Fn(&Region) -> bool) -> Option<usize> {
    let short = |path: &Path| gap(path.start, path.end()).mm() * LEAST_REST_FACTOR <= path.length_mm();
    let outline = |path: &Path| Some(nest(vec![straight(path)])).filter(|region| !region.is_empty());
    let lines = rest.iter().enumerate().filter(|(_, path)| rest.len() <= MOST_LINES && short(path));
    let mut whole = lines.filter(|(_, path)| outline(path).is_some_and(|region| holds(&region)));
    whole.next().map(|(index, _)| index)
}

pub(super) fn straight(path: &Path) -> Path {
    let mut closed = path.clone();
    if closed.end() != closed.start {
        closed.segments.push(PathSegment::Line { to: closed.start });
    }
    closed
}

/// True if all `points` are within the outer edges of `region`, or no farther than `slack` from them.
pub(super) fn holds(region: &Region, points: &[Point], slack: Length) -> bool {
    let index = body(region);
    let within = |at: &Point| {
        index.island_at(*at).is_some() || (slack > Length::ZERO && index.nearest(*at, slack).is_some())
    };
    points.iter().all(within)
}

/// An index of the area inside the outer edges of `region`, for many queries.
pub(super) fn body(region: &Region) -> Index {
    Index::of(&filled(region))
}

pub(super) fn gap(from: Point, to: Point) -> Length {
    Length::from_mm(from.distance_mm(to))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(points: &[(f64, f64)]) -> Path {
        let points: Vec<Point> = points.iter().map(|&(x, y)| Point::from_mm(x, y)).collect();
        Path::through(&points).unwrap()
    }

    #[test]
    fn missing_edge_closes_only_around_all_features() {
        let corner = line(&[(0.0, 2.0), (0.0, 20.0), (30.0, 20.0), (30.0, 0.0), (2.0, 0.0)]);
        let side = line(&[(0.0, 0.0), (0.0, 20.0), (30.0, 20.0), (30.0, 0.0)]);
        let angle = line(&[(0.0, 0.0), (0.0, 20.0), (30.0, 20.0)]);
        let rows = [
            (&corner, (3.0, 3.0), true),
            (&corner, (0.5, 0.5), false), // in the corner that is cut off
            (&corner, (40.0, 3.0), false),
            (&line(&[(30.0, 0.0), (0.0, 0.0), (0.0, 20.0), (30.0, 20.0)]), (3.0, 3.0), true),
            (&side, (3.0, 3.0), false), // the piece is too long
            (&angle, (3.0, 15.0), false),
        ];
        for (path, (x, y), made) in rows {
            let all = [Point::from_mm(x, y), Point::from_mm(10.0, 12.0)];
            let found = whole(std::slice::from_ref(path), &|region| holds(region, &all, Length::ZERO));
            assert_eq!(found, made.then_some(0), "{path:?} {x} {y}");
        }
    }
}
