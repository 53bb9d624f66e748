//! The area that a round tool sweeps along a path, with few outlines and corners.
//!
//! ```text
//!        ╭───────────────╮╲      pieces share one outline: right side, cap, left side back, cap. If the path
//!       (●───────────────● ╲     returns to an earlier corner, the loop becomes two sides without caps.
//!        ╰─────────────╮  ● )    Outside of a corner: an arc. Inside: the corner. Retracing adds nothing.
//! ```
//!
//! An outline is the sum of strips, sectors and caps, each with its inside on the left. Its winding number at
//! a point is the number of these that cover the point, so it may overlap itself and never encloses anything
//! else. An arc no wider than the tool sweeps a sector up to its centre. The area beyond is in the
//! neighbouring strips and caps.

use super::edges::Spot;
use crate::geometry::{Path, PathSegment, Point, chords, stroke};
use crate::units::Length;
use std::collections::BTreeMap;

/// Pieces with a smaller difference of direction, in radians, continue smoothly.
const SMOOTH_RAD: f64 = 1e-3;
/// Arcs with a smaller inner radius, in mm, sweep a sector.
const TIGHT_MM: f64 = 1e-4;
/// An inner side of an arc below this length (mm) and turn (radians) becomes straight: in whole nanometres
/// its direction is uncertain.
const SHORT_MM: f64 = 1e-5;
const SHORT_RAD: f64 = 0.1;

type Piece = (Point, PathSegment);

/// The outlines of the area that a round tool of this width sweeps along `path`.
pub(super) fn outlines(path: &Path, width: Length) -> Vec<Path> {
    let half = width.mm() / 2.0;
    let mut outlines = Vec::new();
    // Pieces not yet output, and pieces that retrace them.
    let (mut chain, mut back): (Vec<Piece>, Vec<Piece>) = (Vec::new(), Vec::new());
    // Start points of the chain's pieces, with their index.
    let mut corners: BTreeMap<Point, usize> = BTreeMap::new();
    for (from, segment) in path.pieces().filter(|piece| is_long(*piece)) {
        if let Some((corner, _)) = chain.pop_if(|last| turned_back(last) == (from, segment)) {
            corners.remove(&corner);
            back.push((from, segment));
            continue;
        }
        outlines.extend(about(&back, half));
        back.clear();
        corners.insert(from, chain.len());
        chain.push((from, segment));
        if let Some(&before) = corners.get(&segment.to()) {
            let round = chain.split_off(before);
            for (corner, _) in &round {
                corners.remove(corner);
            }
            outlines.extend(about_ring(&round, half).into_iter().flatten());
        }
    }
    outlines.extend([&back, &chain].into_iter().filter_map(|pieces| about(pieces, half)));
    if outlines.is_empty() { stroke(path, width) } else { outlines }
}

/// The angle from one direction to another, positive to the left, in radians.
fn bend(before: Spot, after: Spot) -> f64 {
    libm::atan2(before.x * after.y - before.y * after.x, before.dot(after))
}

fn is_long((from, segment): Piece) -> bool {
    match segment {
        PathSegment::Line { to } => to != from,
        PathSegment::Arc { centre, .. } => centre != from,
    }
}

fn is_tight((from, segment): Piece, half: f64) -> bool {
    match segment {
        PathSegment::Line { .. } => false,
        PathSegment::Arc { to, centre, .. } => {
            from.distance_mm(centre).min(to.distance_mm(centre)) < half + TIGHT_MM
        }
    }
}

fn directions((from, segment): Piece) -> (Spot, Spot) {
    let unit = |way: Spot| {
        let length = way.length().max(1e-12);
        Spot { x: way.x / length, y: way.y / length }
    };
    match segment {
        PathSegment::Line { to } => {
            let way = unit(Spot::of(to).minus(Spot::of(from)));
            (way, way)
        }
        PathSegment::Arc { to, centre, clockwise } => {
            let sign = if clockwise { -1.0 } else { 1.0 };
            let heading = |at: Point| {
                let arm = unit(Spot::of(at).minus(Spot::of(centre)));
                Spot { x: -arm.y * sign, y: arm.x * sign }
            };
            (heading(from), heading(to))
        }
    }
}

/// A point at this distance to the right of a heading; to the left if `by` is negative.
fn beside(at: Point, heading: Spot, by: f64) -> Point {
    Point::from_mm(at.x.mm() + heading.y * by, at.y.mm() - heading.x * by)
}

/// A piece in reverse direction.
fn turned_back(&(from, segment): &Piece) -> Piece {
    match segment {
        PathSegment::Line { to } => (to, PathSegment::Line { to: from }),
        PathSegment::Arc { to, centre, clockwise } => {
            (to, PathSegment::Arc { to: from, centre, clockwise: !clockwise })
        }
    }
}

fn about(chain: &[Piece], half: f64) -> Option<Path> {
    let (first, last) = (*chain.first()?, *chain.last()?);
    let start = beside(first.0, directions(first).0, half);
    let mut outline = Path { start, segments: Vec::new() };
    side(&mut outline, None, chain.iter().copied(), half);
    let end = last.1.to();
    let cap = |to: Point, centre: Point| PathSegment::Arc { to, centre, clockwise: false };
    outline.segments.push(cap(beside(end, directions(last).1, -half), end));
    side(&mut outline, None, chain.iter().rev().map(turned_back), half);
    outline.segments.push(cap(start, first.0));
    Some(outline)
}

/// The two sides of pieces that form a closed loop.
fn about_ring(round: &[Piece], half: f64) -> Option<[Path; 2]> {
    let (first, last) = (*round.first()?, *round.last()?);
    let begun = |last: Piece| {
        let heading = directions(last).1;
        (Path { start: beside(last.1.to(), heading, half), segments: Vec::new() }, Some(heading))
    };
    let (mut right, heading) = begun(last);
    side(&mut right, heading, round.iter().copied(), half);
    let (mut left, heading) = begun(turned_back(&first));
    side(&mut left, heading, round.iter().rev().map(turned_back), half);
    Some([right, left])
}

/// Continues along the right side of pieces, from the heading `before`.
fn side(outline: &mut Path, before: Option<Spot>, pieces: impl Iterator<Item = Piece>, half: f64) {
    let mut before = before;
    for (from, segment) in pieces {
        let (first, last) = directions((from, segment));
        let (begin, to) = (beside(from, first, half), beside(segment.to(), last, half));
        let bend = before.map_or(0.0, |before| bend(before, first));
        if bend > SMOOTH_RAD {
            outline.segments.push(PathSegment::Arc { to: begin, centre: from, clockwise: false });
        } else if bend < -SMOOTH_RAD {
            outline.segments.extend([from, begin].map(|to| PathSegment::Line { to }));
        } else if outline.end() != begin {
            outline.segments.push(PathSegment::Line { to: begin });
        }
        match segment {
            PathSegment::Arc { centre, clockwise: true, .. } if is_tight((from, segment), half) => {
                outline.segments.extend([centre, to].map(|to| PathSegment::Line { to }));
            }
            PathSegment::Arc { centre, clockwise, .. } if !is_short((from, segment), (begin, to)) => {
                outline.segments.push(PathSegment::Arc { to, centre, clockwise });
            }
            _ => outline.segments.push(PathSegment::Line { to }),
        }
        before = Some(last);
    }
}

/// True if the side of an arc between two points is too short to be an arc.
fn is_short((from, segment): Piece, (begin, to): (Point, Point)) -> bool {
    match segment {
        PathSegment::Line { .. } => true,
        PathSegment::Arc { to: end, centre, clockwise } => {
            begin.distance_mm(to) < SHORT_MM && chords::turn(from, end, centre, clockwise) < SHORT_RAD
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{CombineRule, Exposure, area_mm2, combine, paint};

    /// Lines, arcs in both directions, a corner, a tight arc, a loop over itself.
    fn toolpaths() -> Vec<Path> {
        let at = |x: f64, y: f64| Point::from_mm(x, y);
        let line = |x: f64, y: f64| PathSegment::Line { to: at(x, y) };
        let arc =
            |x: f64, y: f64, centre: Point, clockwise| PathSegment::Arc { to: at(x, y), centre, clockwise };
        let bent = vec![line(2.0, 0.0), arc(3.0, 1.0, at(2.0, 1.0), false), line(3.0, 3.0), line(1.0, 3.0)];
        let back = vec![line(2.0, 0.0), arc(2.2, 0.0, at(2.1, 0.0), true), arc(4.2, 0.0, at(3.2, 0.0), true)];
        let round = vec![arc(1.0, 0.0, at(0.0, 0.0), false)];
        let loop_ = vec![arc(1.0, 0.0, at(0.0, 0.0), false), line(1.0, 2.0)];
        // A circle with overlap as robots write it: three arcs with four digits, each with its own centre.
        let robot = vec![
            arc(-0.9708, 0.0, Point::new(Length::from_nm(-200), Length::from_nm(0)), true),
            arc(0.9704, 0.0, Point::new(Length::from_nm(-200), Length::from_nm(0)), true),
            arc(0.8445, -0.4782, Point::new(Length::from_nm(40), Length::from_nm(25)), true),
        ];
        let start = |segments: Vec<PathSegment>, x: f64| Path { start: at(x, 0.0), segments };
        vec![
            start(bent, 0.0),
            start(back, 0.0),
            start(round, 1.0),
            start(loop_, 1.0),
            start(robot, 0.9704),
            start(Vec::new(), 1.0),
        ]
    }

    fn odd_toolpaths() -> Vec<Path> {
        let at = |x: f64, y: f64| Point::from_mm(x, y);
        let line = |x: f64, y: f64| PathSegment::Line { to: at(x, y) };
        let arc =
            |x: f64, y: f64, centre: Point, clockwise| PathSegment::Arc { to: at(x, y), centre, clockwise };
        let start = |x: f64, y: f64, segments: Vec<PathSegment>| Path { start: at(x, y), segments };
        // Zigzags that cross themselves, with sharp and blunt corners.
        let zigzag = vec![line(3.0, 0.1), line(0.1, 0.4), line(3.0, 0.5), line(1.0, -1.0), line(1.1, 2.0)];
        let star = vec![line(2.0, 1.5), line(-0.5, 1.5), line(1.5, 0.0), line(0.75, 2.3), line(0.0, 0.0)];
        // Closed loops: of lines, around a corner with arcs as wide as the cut and less, with an overlap, in
        // both directions.
        let square = vec![line(1.0, 0.0), line(1.0, 1.0), line(0.0, 1.0), line(0.0, 0.0)];
        let small = vec![line(0.1, 0.0), line(0.1, 0.12), line(0.0, 0.0)];
        let round = |radius: f64| {
            let (far, side) = (1.0 + radius, 1.0);
            vec![
                line(side, -radius),
                arc(far, 0.0, at(side, 0.0), false),
                line(far, 1.0),
                arc(side, far, at(side, 1.0), false),
                line(0.0, far),
                arc(-radius, 1.0, at(0.0, 1.0), false),
                line(-radius, 0.0),
                arc(0.0, -radius, at(0.0, 0.0), false),
            ]
        };
        let over = |mut ring: Vec<PathSegment>, more: PathSegment| {
            ring.push(more);
            ring
        };
        // Loops joined by a link; a detour out of a loop and back.
        let joined =
            [square.clone(), vec![line(-0.1, 0.0), line(-0.1, 2.0), line(2.0, 2.0), line(-0.1, 0.0)]];
        let detour = vec![line(1.0, 0.0), line(1.3, 0.4), line(1.6, 0.4), line(1.3, 0.4), line(1.0, 0.0)];
        // Arcs of almost no radius, and beyond a half circle.
        let dot = vec![arc(0.0, 0.0, at(0.00005, 0.0), true), line(1.0, 0.0)];
        let most = vec![arc(0.0, -0.1, at(0.0, 0.0), false), arc(0.2, -0.1, at(0.1, -0.1), true)];
        vec![
            start(0.0, 0.0, zigzag),
            start(0.0, 0.0, star),
            start(0.0, 0.0, square.clone()),
            start(0.0, 0.0, small),
            start(0.0, -0.05, round(0.05)),
            start(0.0, -0.1, round(0.1)),
            start(0.0, -0.101, round(0.101)),
            start(0.0, -0.25, round(0.25)),
            start(0.0, -0.1, over(round(0.1), line(0.5, -0.1))),
            start(0.0, 0.0, joined.concat()),
            start(0.0, 0.0, [detour, square].concat()),
            start(0.0, 0.0, vec![line(1.0, 0.0), line(0.5, 0.0)]),
            start(0.0, 0.0, vec![line(1.0, 0.3), line(0.0, 0.0)]),
            start(0.0, 0.0, vec![line(1.0, 0.0), line(1.0, 0.0), line(0.0, 0.001)]),
            start(0.0, 0.0, vec![line(0.0, 0.0)]),
            start(0.0, 0.0, dot),
            start(0.1, 0.0, most),
        ]
    }

    #[test]
    fn outlines_cover_the_area_of_single_pieces() {
        let painted = |outlines: Vec<Path>| paint(&[Exposure { clear: false, outlines }]);
        let all = toolpaths().into_iter().chain(odd_toolpaths());
        for path in all.flat_map(|path| [path.reversed(), path]) {
            for width in [0.05, 0.2, 0.5] {
                let width = Length::from_mm(width);
                let (fewer, single) = (painted(outlines(&path, width)), painted(stroke(&path, width)));
                let off = area_mm2(&combine(&fewer, &single, CombineRule::Xor));
                assert!(off < 5e-4, "{off} mm² at {width:?} for {path:?}");
                assert!(area_mm2(&fewer) > 0.0019);
            }
        }
    }

    #[test]
    fn closed_paths_have_two_outlines_and_open_ones_one() {
        let count = |path: &Path| outlines(path, Length::from_mm(0.2)).len();
        let odd = odd_toolpaths();
        assert_eq!(count(&toolpaths()[0]), 1);
        assert_eq!([0, 2, 5, 8, 9].map(|number| count(&odd[number])), [1, 2, 2, 3, 5]);
        // Out of a loop and back, and only out and back.
        assert_eq!([10, 12].map(|number| count(&odd[number])), [3, 1]);
    }

    /// In whole nanometres the direction of the inner side of a tiny arc is uncertain.
    #[test]
    fn tiny_arc_adds_no_turn_on_its_inner_side() {
        let line = |x: f64| PathSegment::Line { to: Point::from_mm(x, 0.0) };
        let width = Length::from_mm(0.2);
        let painted = |outlines: Vec<Path>| area_mm2(&paint(&[Exposure { clear: false, outlines }]));
        let straight = Path { start: Point::default(), segments: vec![line(2.0)] };
        for (by, side) in [(1, 0.12), (2, 0.12), (3, 0.15), (2, -0.12), (5, -5.0)] {
            let to = Point::new(Length::from_nm(1_000_000 + by), Length::ZERO);
            let centre = Point::from_mm(1.0, side);
            let arc = PathSegment::Arc { to, centre, clockwise: side < 0.0 };
            let path = Path { start: Point::default(), segments: vec![line(1.0), arc, line(2.0)] };
            let off = painted(outlines(&path, width)) - painted(outlines(&straight, width));
            assert!(off.abs() < 1e-5, "{off} mm² for {by} nm about {side}");
        }
    }
}
