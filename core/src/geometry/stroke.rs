//! The area that a round tool sweeps along a path.
//!
//! ```text
//!      ╭──────────────╮          an arc: ╭─────╮     a tool wider than the arc's diameter fills it:
//!     (● from      to ●)                ╱ ╭───╮ ╲    the sector and the two round ends
//!      ╰──────────────╯                (●╯     ╰●)
//! ```
//!
//! Tolerance: every corner is the nearest whole nanometre.

use super::combine::together;
use super::overlay::{Spot, apart, spot};
use super::{Path, PathSegment, Point, Region, chords};
use crate::units::Length;
use std::f64::consts::PI;

/// A circle about `centre`, counter-clockwise, as one arc from its leftmost point. A point if `diameter` is
/// not above zero.
pub fn circle(centre: Point, diameter: Length) -> Path {
    let start = Point::new(centre.x - Length::from_nm(diameter.nm().max(0) / 2), centre.y);
    Path { start, segments: vec![PathSegment::Arc { to: start, centre, clockwise: false }] }
}

/// The outline of a box, counter-clockwise from its lower left corner.
pub fn rectangle(bounds: super::Bounds) -> Path {
    let (low, high) = (bounds.min, bounds.max);
    let corners = [Point::new(high.x, low.y), high, Point::new(low.x, high.y), low];
    Path { start: low, segments: corners.map(|to| PathSegment::Line { to }).to_vec() }
}

fn at((x, y): Spot) -> Point {
    Point::new(Length::from_nm(libm::round(x) as i64), Length::from_nm(libm::round(y) as i64))
}

fn about_line(from: Point, to: Point, half: f64) -> Path {
    let (a, b) = (spot(from), spot(to));
    let length = apart(a, b);
    let right = ((b.1 - a.1) / length * half, -(b.0 - a.0) / length * half);
    let shifted = |(x, y): Spot, sign: f64| at((x + sign * right.0, y + sign * right.1));
    let end = |to: Point, centre: Point| PathSegment::Arc { to, centre, clockwise: false };
    let start = shifted(a, 1.0);
    let segments = vec![
        PathSegment::Line { to: shifted(b, 1.0) },
        end(shifted(b, -1.0), to),
        PathSegment::Line { to: shifted(a, -1.0) },
        end(start, from),
    ];
    Path { start, segments }
}

/// The outline about at most a half circle, counter-clockwise from `from` to `to`.
fn about_arc(from: Point, to: Point, centre: Point, half: f64, outlines: &mut Vec<Path>) {
    let (a, b, c) = (spot(from), spot(to), spot(centre));
    let scaled = |end: Spot, by: f64| {
        let radius = apart(end, c).max(1.0);
        let share = (radius + by) / radius;
        at((c.0 + (end.0 - c.0) * share, c.1 + (end.1 - c.1) * share))
    };
    let bend = |to: Point, centre: Point, clockwise: bool| PathSegment::Arc { to, centre, clockwise };
    let (outer_from, outer_to) = (scaled(a, half), scaled(b, half));
    if apart(a, c).min(apart(b, c)) > half + 1.0 {
        let (inner_from, inner_to) = (scaled(a, -half), scaled(b, -half));
        let segments = vec![
            bend(outer_to, centre, false),
            bend(inner_to, to, false),
            bend(inner_from, centre, true),
            bend(outer_from, from, false),
        ];
        outlines.push(Path { start: outer_from, segments });
        return;
    }
    let sector = vec![
        bend(outer_to, centre, false),
        PathSegment::Line { to: centre },
        PathSegment::Line { to: outer_from },
    ];
    outlines.push(Path { start: outer_from, segments: sector });
    let diameter = Length::from_nm(libm::round(2.0 * half) as i64);
    outlines.extend([circle(from, diameter), circle(to, diameter)]);
}

/// The midpoint of a counter-clockwise arc.
fn half_way(from: Point, centre: Point, turn: f64) -> Point {
    let (a, c) = (spot(from), spot(centre));
    let (sine, cosine) = (libm::sin(turn / 2.0), libm::cos(turn / 2.0));
    let arm = (a.0 - c.0, a.1 - c.1);
    at((c.0 + arm.0 * cosine - arm.1 * sine, c.1 + arm.0 * sine + arm.1 * cosine))
}

/// The outlines of the area that a round tool of `width` sweeps along `path`. A path of zero length gives the
/// tool's circle; no width gives nothing.
pub fn stroke(path: &Path, width: Length) -> Vec<Path> {
    let mut outlines = Vec::new();
    if width.nm() <= 0 {
        return outlines;
    }
    let half = width.nm() as f64 / 2.0;
    for (from, segment) in path.pieces() {
        match segment {
            PathSegment::Line { to } if to == from => {}
            PathSegment::Line { to } => outlines.push(about_line(from, to, half)),
            PathSegment::Arc { centre, .. } if centre == from => {}
            PathSegment::Arc { to, centre, clockwise } => {
                let (first, last) = if clockwise { (to, from) } else { (from, to) };
                let turn = chords::turn(first, last, centre, false);
                if turn > PI * 0.999 {
                    let middle = half_way(first, centre, turn);
                    about_arc(first, middle, centre, half, &mut outlines);
                    about_arc(middle, last, centre, half, &mut outlines);
                } else {
                    about_arc(first, last, centre, half, &mut outlines);
                }
            }
        }
    }
    if outlines.is_empty() {
        outlines.push(circle(path.start, width));
    }
    outlines
}

pub fn sweep(paths: &[Path], width: Length) -> Region {
    let outlines: Vec<Path> = paths.iter().flat_map(|path| stroke(path, width)).collect();
    together(&outlines)
}
