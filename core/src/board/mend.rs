//! Gaps of an outline, closed straight where it is plain what they enclose.
//!
//! ```text
//!   ╭──────────── ─╮       ends within 0.1 mm: one corner, whatever is inside
//!   │   ▪     ▪    │
//!   │     ▪        │       one piece is missing, a third of the rest at most, and all copper and all holes
//!   └──────────┄┄┄╯       lie inside of the straight line: closed, and told
//! ```
//!
//! Comes in: open lines. Goes out: closed ones, and those that stay open. Does not know layers; what has to lie inside it is
//! told.

use super::outline::{filled, nest};
use crate::geometry::{Index, Path, PathSegment, Point, Region};
use crate::units::Length;

/// Ends this near to each other are meant to meet.
const NEAR: Length = Length::from_um(100);
/// A line that closes so is at least this many times as long as the gap.
const LEAST_LENGTH_FACTOR: f64 = 10.0;
/// The rest of an outline is at least this many times as long as the piece that is missing.
const LEAST_REST_FACTOR: f64 = 3.0;
/// Of more lines than this none is mended: it is a drawing.
const MOST_LINES: usize = 200;

/// Joins lines whose ends are near. Those that close by it, each with its widest gap; and the rest.
pub(super) fn joined(mut open: Vec<Path>) -> (Vec<(Path, Length)>, Vec<Path>) {
    let (mut closed, mut rest) = (Vec::new(), Vec::new());
    if open.len() > MOST_LINES {
        return (closed, open);
    }
    while let Some(mut path) = open.pop() {
        let mut widest = Length::ZERO;
        for _ in 0..2 {
            while let Some(next) = next(&path, &mut open) {
                widest = widest.max(gap(path.end(), next.start));
                append(&mut path, next);
            }
            path = path.reversed();
        }
        let ends = gap(path.start, path.end());
        if ends <= NEAR && path.length_mm() >= NEAR.mm() * LEAST_LENGTH_FACTOR {
            closed.push((straight(&path), widest.max(ends)));
        } else {
            rest.push(path);
        }
    }
    (closed, rest)
}

/// The line of `rest` that a straight piece makes an outline which `holds` all there is.
pub(super) fn whole(rest: &[Path], holds: &dyn Fn(&Region) -> bool) -> Option<usize> {
    let short = |path: &Path| gap(path.start, path.end()).mm() * LEAST_REST_FACTOR <= path.length_mm();
    let outline = |path: &Path| Some(nest(vec![straight(path)])).filter(|region| !region.is_empty());
    let lines = rest.iter().enumerate().filter(|(_, path)| rest.len() <= MOST_LINES && short(path));
    let mut whole = lines.filter(|(_, path)| outline(path).is_some_and(|region| holds(&region)));
    whole.next().map(|(index, _)| index)
}

/// `path` with a straight line from its end to its start.
pub(super) fn straight(path: &Path) -> Path {
    let mut closed = path.clone();
    if closed.end() != closed.start {
        closed.segments.push(PathSegment::Line { to: closed.start });
    }
    closed
}

/// Whether all `points` lie within the outer edges of `region`, or no farther than `slack` from them.
pub(super) fn holds(region: &Region, points: &[Point], slack: Length) -> bool {
    let index = body(region);
    let within = |at: &Point| {
        index.island_at(*at).is_some() || (slack > Length::ZERO && index.nearest(*at, slack).is_some())
    };
    points.iter().all(within)
}

/// What the outer edges of `region` enclose, made ready for many points.
pub(super) fn body(region: &Region) -> Index {
    Index::of(&filled(region))
}

/// How far apart two ends are.
pub(super) fn gap(from: Point, to: Point) -> Length {
    Length::from_mm(from.distance_mm(to))
}

/// Takes the line of `open` that goes on at the end of `path`, turned where need be; none where `path` is closed.
fn next(path: &Path, open: &mut Vec<Path>) -> Option<Path> {
    let end = path.end();
    if gap(path.start, end) <= NEAR && path.length_mm() >= NEAR.mm() * LEAST_LENGTH_FACTOR {
        return None;
    }
    let meets = |line: &Path| gap(end, line.start) <= NEAR || gap(end, line.end()) <= NEAR;
    let found = open.iter().position(meets)?;
    let line = open.remove(found);
    Some(if gap(end, line.start) <= NEAR { line } else { line.reversed() })
}

fn append(path: &mut Path, line: Path) {
    if path.end() != line.start {
        path.segments.push(PathSegment::Line { to: line.start });
    }
    path.segments.extend(line.segments);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(points: &[(f64, f64)]) -> Path {
        let points: Vec<Point> = points.iter().map(|&(x, y)| Point::from_mm(x, y)).collect();
        Path::through(&points).unwrap()
    }

    #[test]
    fn lines_whose_ends_nearly_meet_are_one_outline() {
        // The gap in mm, and whether it closes.
        for (wide, closes) in [(0.02, true), (0.09, true), (0.11, false), (2.0, false)] {
            let open = vec![
                line(&[(0.0, 0.0), (30.0, 0.0), (30.0, 20.0)]),
                line(&[(0.0, wide), (0.0, 20.0), (30.0 - 0.05, 20.0)]),
            ];
            let (closed, rest) = joined(open);
            assert_eq!((closed.len(), rest.len()), if closes { (1, 0) } else { (0, 1) }, "{wide}");
            for (path, gap) in closed {
                assert!(path.is_closed() && (gap.mm() - wide.max(0.05)).abs() < 1e-6, "{gap:?}");
                assert!((nest(vec![path]).bounds().unwrap().max.y.mm() - 20.0).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_missing_piece_is_drawn_straight_only_around_all_there_is() {
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
