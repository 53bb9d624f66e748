//! The outline of a board from the lines that draw it: closed edges, nested, arcs preserved.
//!
//! ```text
//!   ───▶ ─╮         ┌────────────╮      ends within 10 µm are one corner
//!         │   ⇒     │   ╭─╮      │      a contour inside a contour is cut out of it,
//!   ◀─────╯         │   ╰─╯      │      one inside that is board again
//!                   └────────────╯
//! ```

use crate::geometry::{Island, Path, PathSegment, Point, Region};
use crate::units::Length;
use std::collections::BTreeMap;

/// Ends this close are one corner.
pub(super) const JOIN: Length = Length::from_um(10);
pub(super) const MOST_STROKES: usize = 20_000;
const MOST_CONTOURS: usize = 2_000;
pub(super) const CHORD_ERROR_MM: f64 = 0.005;

pub(super) type Stroke = (Point, PathSegment);

pub(super) fn contours(strokes: &[Stroke]) -> (Vec<Path>, Vec<Path>) {
    let rows = once(strokes);
    if rows.len() > MOST_STROKES {
        let alone = |(start, segment)| Path { start, segments: vec![segment] };
        return (Vec::new(), rows.into_iter().map(alone).collect());
    }
    let mut ends: BTreeMap<(i64, i64), Vec<usize>> = BTreeMap::new();
    for (index, &(from, segment)) in rows.iter().enumerate() {
        ends.entry(cell(from)).or_default().push(index);
        ends.entry(cell(segment.to())).or_default().push(index);
    }
    let mut free = vec![true; rows.len()];
    let (mut closed, mut open) = (Vec::new(), Vec::new());
    for start in 0..rows.len() {
        if !free.get(start).is_some_and(|&free| free) {
            continue;
        }
        let walked = walk(start, &rows, &ends, &mut free);
        if near(walked.start, walked.end()) {
            closed.push(shut(walked));
        } else {
            open.push(walked);
        }
    }
    (closed, open)
}

/// The strokes in order, without duplicates and without zero length.
pub(super) fn once(strokes: &[Stroke]) -> Vec<Stroke> {
    let mut rows: Vec<Stroke> = strokes.iter().copied().filter(goes_somewhere).collect();
    rows.sort_unstable_by_key(same);
    rows.dedup_by_key(|row| same(row));
    rows
}

/// Makes a region of contours: even-odd by nesting. The contours must not cross.
pub(super) fn nest(contours: Vec<Path>) -> Region {
    let mut rings: Vec<(f64, Vec<Point>, Path)> = contours
        .into_iter()
        .map(|path| {
            let points = path.flattened(CHORD_ERROR_MM);
            (twice_area(&points), points, path)
        })
        .filter(|(area, ..)| *area != 0.0)
        .take(MOST_CONTOURS)
        .collect();
    rings.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
    let mut islands: Vec<Island> = Vec::new();
    // The depth of each ring, and the island of its material.
    let mut placed: Vec<(usize, usize)> = Vec::new();
    for (index, (area, points, path)) in rings.iter().enumerate() {
        let around = |&outer: &usize| {
            points.first().zip(rings.get(outer)).is_some_and(|(point, ring)| holds(&ring.1, *point))
        };
        let smallest = (0..index).rev().find(around).and_then(|outer| placed.get(outer).copied());
        let depth = smallest.map_or(0, |(depth, _)| depth + 1);
        let hole = depth % 2 == 1;
        let turned = if (*area > 0.0) == hole { path.reversed() } else { path.clone() };
        match smallest.filter(|_| hole).and_then(|(_, island)| Some((island, islands.get_mut(island)?))) {
            Some((at, island)) => {
                island.holes.push(turned);
                placed.push((depth, at));
            }
            None => {
                placed.push((depth, islands.len()));
                islands.push(Island { outer: turned, holes: Vec::new() });
            }
        }
    }
    Region { islands }
}

/// `region` with its holes filled. Islands within islands stay as they are.
pub(super) fn filled(region: &Region) -> Region {
    let whole = |island: &Island| Island { outer: island.outer.clone(), holes: Vec::new() };
    Region { islands: region.islands.iter().map(whole).collect() }
}

/// Follows strokes until the path closes, or until no stroke continues it.
fn walk(start: usize, rows: &[Stroke], ends: &BTreeMap<(i64, i64), Vec<usize>>, free: &mut [bool]) -> Path {
    let mut path = Path::default();
    let mut next = Some((start, false));
    while let Some((index, backwards)) = next {
        let (Some(&(from, segment)), Some(flag)) = (rows.get(index), free.get_mut(index)) else { break };
        *flag = false;
        let (from, segment) = if backwards { turned(from, segment) } else { (from, segment) };
        if path.segments.is_empty() {
            path.start = from;
        } else if path.end() != from && matches!(segment, PathSegment::Arc { .. }) {
            path.segments.push(PathSegment::Line { to: from });
        }
        path.segments.push(segment);
        let at = segment.to();
        if near(at, path.start) {
            break;
        }
        next = around(at).filter_map(|cell| ends.get(&cell)).flatten().find_map(|&index| {
            let &(from, segment) = rows.get(index).filter(|_| free.get(index).is_some_and(|&free| free))?;
            if near(from, at) {
                Some((index, false))
            } else {
                near(segment.to(), at).then_some((index, true))
            }
        });
    }
    path
}

/// Closes a contour exactly if its ends nearly meet.
pub(super) fn shut(mut path: Path) -> Path {
    let start = path.start;
    if path.end() != start {
        match path.segments.last_mut() {
            Some(PathSegment::Line { to }) => *to = start,
            _ => path.segments.push(PathSegment::Line { to: start }),
        }
    }
    path
}

fn turned(from: Point, segment: PathSegment) -> Stroke {
    let back = match segment {
        PathSegment::Line { .. } => PathSegment::Line { to: from },
        PathSegment::Arc { centre, clockwise, .. } => {
            PathSegment::Arc { to: from, centre, clockwise: !clockwise }
        }
    };
    (segment.to(), back)
}

/// Key that is equal for strokes drawn twice, in either direction.
pub(super) fn same(&(from, segment): &Stroke) -> (Point, Point, Option<Point>, bool) {
    let to = segment.to();
    let (low, high) = (from.min(to), from.max(to));
    match segment {
        PathSegment::Line { .. } => (low, high, None, false),
        PathSegment::Arc { centre, clockwise, .. } => (low, high, Some(centre), clockwise != (from == low)),
    }
}

fn goes_somewhere(&(from, segment): &Stroke) -> bool {
    matches!(segment, PathSegment::Arc { .. }) || !near(from, segment.to())
}

/// True if two ends are one corner.
pub(super) fn near(a: Point, b: Point) -> bool {
    (a.x - b.x).abs() <= JOIN && (a.y - b.y).abs() <= JOIN
}

fn cell(point: Point) -> (i64, i64) {
    (point.x.nm().div_euclid(JOIN.nm()), point.y.nm().div_euclid(JOIN.nm()))
}

fn around(point: Point) -> impl Iterator<Item = (i64, i64)> {
    let (x, y) = cell(point);
    (-1..=1).flat_map(move |dx| (-1..=1).map(move |dy| (x + dx, y + dy)))
}

/// Twice the area inside a ring of points, positive if counter-clockwise.
fn twice_area(ring: &[Point]) -> f64 {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(a, b)| a.x.mm() * b.y.mm() - b.x.mm() * a.y.mm()).sum()
}

pub(super) fn holds(ring: &[Point], point: Point) -> bool {
    let next = ring.iter().cycle().skip(1);
    let crossings = ring.iter().zip(next).filter(|(a, b)| {
        (a.y > point.y) != (b.y > point.y) && {
            let share = (point.y - a.y).mm() / (b.y - a.y).mm();
            point.x.mm() < a.x.mm() + share * (b.x - a.x).mm()
        }
    });
    crossings.count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(a: (f64, f64), b: (f64, f64)) -> Stroke {
        (Point::from_mm(a.0, a.1), PathSegment::Line { to: Point::from_mm(b.0, b.1) })
    }

    fn square(low: f64, high: f64) -> Vec<Stroke> {
        vec![
            line((low, low), (high, low)),
            line((high, high), (low, high)),
            line((high, low), (high, high)),
            line((low, low + 0.004), (low, high)),
        ]
    }

    #[test]
    fn outline_strokes_close_in_any_order() {
        let mut strokes = square(0.0, 10.0);
        strokes.push(strokes[1]);
        let (closed, open) = contours(&strokes);
        assert_eq!((closed.len(), open.len()), (1, 0));
        assert!(closed[0].is_closed());
        strokes.truncate(3);
        let open = contours(&strokes).1;
        assert_eq!(open.iter().map(|path| path.segments.len()).sum::<usize>(), 3, "no outline");
    }

    #[test]
    fn nested_contours_alternate_between_hole_and_board() {
        let circle = PathSegment::Arc {
            to: Point::from_mm(6.0, 5.0),
            centre: Point::from_mm(5.0, 5.0),
            clockwise: false,
        };
        let mut strokes = square(0.0, 20.0);
        strokes.extend(square(2.0, 18.0));
        strokes.push((Point::from_mm(6.0, 5.0), circle));
        let (closed, open) = contours(&strokes);
        let region = nest(closed);
        assert_eq!((region.islands.len(), open.len()), (2, 0));
        assert_eq!((region.islands[0].holes.len(), region.islands[1].holes.len()), (1, 0));
        for island in &region.islands {
            assert!(twice_area(&island.outer.flattened(0.01)) > 0.0);
            assert!(island.holes.iter().all(|hole| twice_area(&hole.flattened(0.01)) < 0.0));
        }
        assert!(matches!(region.islands[1].outer.segments[..], [PathSegment::Arc { .. }]), "arcs are kept");
    }
}
