//! What a round tool sweeps along a way, in as few outlines and corners as there are.
//!
//! ```text
//!        ╭───────────────╮╲        pieces share one outline: right side, cap, left side back, cap; it may overlap itself, and
//!       (●───────────────● ╲       its inside is always on its left. Outside of a corner it goes round by an arc, inside of it
//!        ╰─────────────╮  ● )      by the corner: so every piece and every arc lies in it, and nothing else.
//! ```
//!
//! Comes in: a way and a width. Goes out: closed outlines whose union is the area. Does not know what is cut.

use super::edges::Spot;
use crate::geometry::{Path, PathSegment, Point, chords, stroke};
use crate::units::Length;

/// Pieces whose directions differ by less than this, in radians, go on.
const SMOOTH_RAD: f64 = 1e-3;
/// Corners whose directions have a lesser cosine than this part outlines.
const SHARP_COSINE: f64 = -0.1;
/// An outline goes round by at most this, in radians: beyond that the next one begins, so that none lies over itself.
const ROUND_RAD: f64 = 4.5;
/// Arcs tighter than so many half widths are swept by themselves.
const TIGHT_FACTOR: f64 = 1.05;

/// The outlines of what a round tool of this width sweeps along `path`.
pub(super) fn outlines(path: &Path, width: Length) -> Vec<Path> {
    let half = width.mm() / 2.0;
    let mut outlines = Vec::new();
    let (mut chain, mut round): (Vec<(Point, PathSegment)>, f64) = (Vec::new(), 0.0);
    for (from, segment) in path.pieces().filter(|piece| is_long(*piece)) {
        let alone = is_tight(from, segment, half);
        let first = directions((from, segment)).0;
        let (before, goes_on) = chain.last().map_or((0.0, true), |&last| {
            let before = directions(last).1;
            (bend(before, first), before.dot(first) > SHARP_COSINE)
        });
        round += before + turn(from, segment);
        if alone || !goes_on || libm::fabs(round) > ROUND_RAD {
            outlines.extend(about(&chain, half));
            chain.clear();
            round = turn(from, segment);
        }
        if alone {
            outlines.extend(stroke(&Path { start: from, segments: vec![segment] }, width));
        } else {
            chain.push((from, segment));
        }
    }
    outlines.extend(about(&chain, half));
    if outlines.is_empty() { stroke(path, width) } else { outlines }
}

/// The angle from one direction to another, to the left above zero, in radians.
fn bend(before: Spot, after: Spot) -> f64 {
    libm::atan2(before.x * after.y - before.y * after.x, before.dot(after))
}

/// By how much a piece goes round, to the left above zero, in radians.
fn turn(from: Point, segment: PathSegment) -> f64 {
    match segment {
        PathSegment::Line { .. } => 0.0,
        PathSegment::Arc { to, centre, clockwise } => {
            chords::turn(from, to, centre, clockwise) * if clockwise { -1.0 } else { 1.0 }
        }
    }
}

fn is_long((from, segment): (Point, PathSegment)) -> bool {
    match segment {
        PathSegment::Line { to } => to != from,
        PathSegment::Arc { centre, .. } => centre != from,
    }
}

fn is_tight(from: Point, segment: PathSegment, half: f64) -> bool {
    match segment {
        PathSegment::Line { .. } => false,
        PathSegment::Arc { to, centre, .. } => {
            from.distance_mm(centre).min(to.distance_mm(centre)) <= half * TIGHT_FACTOR
        }
    }
}

/// Where a piece heads at its start and at its end, one long.
fn directions((from, segment): (Point, PathSegment)) -> (Spot, Spot) {
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

/// A place so far to the right of a heading; to the left where `by` is below zero.
fn beside(at: Point, heading: Spot, by: f64) -> Point {
    Point::from_mm(at.x.mm() + heading.y * by, at.y.mm() - heading.x * by)
}

/// The one outline about pieces that follow each other.
fn about(chain: &[(Point, PathSegment)], half: f64) -> Option<Path> {
    let (first, last) = (*chain.first()?, *chain.last()?);
    let start = beside(first.0, directions(first).0, half);
    let mut outline = Path { start, segments: Vec::new() };
    side(&mut outline, chain.iter().copied(), half);
    let end = last.1.to();
    let cap = |to: Point, centre: Point| PathSegment::Arc { to, centre, clockwise: false };
    outline.segments.push(cap(beside(end, directions(last).1, -half), end));
    let back = |&(from, segment): &(Point, PathSegment)| match segment {
        PathSegment::Line { to } => (to, PathSegment::Line { to: from }),
        PathSegment::Arc { to, centre, clockwise } => {
            (to, PathSegment::Arc { to: from, centre, clockwise: !clockwise })
        }
    };
    side(&mut outline, chain.iter().rev().map(back), half);
    outline.segments.push(cap(start, first.0));
    Some(outline)
}

/// Goes on along the right side of pieces.
fn side(outline: &mut Path, pieces: impl Iterator<Item = (Point, PathSegment)>, half: f64) {
    let mut before: Option<Spot> = None;
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
        outline.segments.push(match segment {
            PathSegment::Line { .. } => PathSegment::Line { to },
            PathSegment::Arc { centre, clockwise, .. } => PathSegment::Arc { to, centre, clockwise },
        });
        before = Some(last);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{CombineRule, Exposure, area_mm2, combine, paint};

    /// Lines, arcs either way, a corner, a tight arc, a loop over itself.
    fn toolpaths() -> Vec<Path> {
        let at = |x: f64, y: f64| Point::from_mm(x, y);
        let line = |x: f64, y: f64| PathSegment::Line { to: at(x, y) };
        let arc =
            |x: f64, y: f64, centre: Point, clockwise| PathSegment::Arc { to: at(x, y), centre, clockwise };
        let bent = vec![line(2.0, 0.0), arc(3.0, 1.0, at(2.0, 1.0), false), line(3.0, 3.0), line(1.0, 3.0)];
        let back = vec![line(2.0, 0.0), arc(2.2, 0.0, at(2.1, 0.0), true), arc(4.2, 0.0, at(3.2, 0.0), true)];
        let round = vec![arc(1.0, 0.0, at(0.0, 0.0), false)];
        let loop_ = vec![arc(1.0, 0.0, at(0.0, 0.0), false), line(1.0, 2.0)];
        // As robots write a circle and its overlap: three arcs by places of four digits, each with a centre of its own.
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

    #[test]
    fn outlines_cover_what_single_pieces_cover() {
        let painted = |outlines: Vec<Path>| paint(&[Exposure { clear: false, outlines }]);
        for path in toolpaths().into_iter().flat_map(|path| [path.reversed(), path]) {
            for width in [0.2, 0.5] {
                let width = Length::from_mm(width);
                let (fewer, single) = (painted(outlines(&path, width)), painted(stroke(&path, width)));
                let off = area_mm2(&combine(&fewer, &single, CombineRule::Xor));
                assert!(off < 1e-3, "{off} mm² for {path:?}");
                assert!(area_mm2(&fewer) > 0.03);
            }
        }
        assert_eq!(outlines(&toolpaths()[0], Length::from_mm(0.2)).len(), 1);
    }
}
