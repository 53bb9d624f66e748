//! Area, bounds and point tests of paths and regions.
//!
//! ```text
//!   area = Σ of the polygon of corners ± the segments between arcs and their chords
//!
//!   contains: a ray to the right counts the pieces it crosses, arcs cut at their top and bottom
//!        ●────┼──────┼───▶   odd: inside
//! ```
//!
//! Exact up to f64 rounding: arcs are not cut into chords. A point on the edge may count either way.

use super::overlay::{Spot, apart, spot};
use super::{Bounds, Island, Path, PathSegment, Point, Region, chords};
use crate::units::Length;
use std::f64::consts::TAU;

/// Area inside a closed path, in mm²: positive if the inside is on the left.
pub fn path_area_mm2(path: &Path) -> f64 {
    let origin = path.start;
    let of_piece = |(from, segment): (Point, PathSegment)| {
        let to = segment.to();
        let (ax, ay) = ((from.x - origin.x).mm(), (from.y - origin.y).mm());
        let (bx, by) = ((to.x - origin.x).mm(), (to.y - origin.y).mm());
        let triangle = (ax * by - ay * bx) / 2.0;
        match segment {
            PathSegment::Line { .. } => triangle,
            PathSegment::Arc { centre, clockwise, .. } => {
                let turn = chords::turn(from, to, centre, clockwise);
                let squared = from.distance_mm(centre) * to.distance_mm(centre);
                let round = squared / 2.0 * (turn - libm::sin(turn));
                triangle + if clockwise { -round } else { round }
            }
        }
    };
    path.pieces().map(of_piece).sum()
}

/// Area of an island without its holes, in mm².
pub fn island_area_mm2(island: &Island) -> f64 {
    island.paths().map(path_area_mm2).sum()
}

pub fn area_mm2(region: &Region) -> f64 {
    // An empty sum is −0.
    region.islands.iter().map(island_area_mm2).sum::<f64>() + 0.0
}

/// Bounds of one piece, including the bulge of an arc, to the nanometre.
pub fn segment_bounds(from: Point, segment: PathSegment) -> Bounds {
    let to = segment.to();
    let ends = Bounds::of(from).with(to);
    let PathSegment::Arc { centre, clockwise, .. } = segment else { return ends };
    let radius = Length::from_nm(libm::round(apart(spot(centre), spot(from))) as i64);
    let (first, last) = if clockwise { (to, from) } else { (from, to) };
    let turn = chords::turn(first, last, centre, false);
    let start = libm::atan2((first.y - centre.y).mm(), (first.x - centre.x).mm());
    let passes = |angle: f64| {
        let ahead = angle - start;
        let ahead = ahead - TAU * libm::floor(ahead / TAU);
        ahead <= turn
    };
    let quarter = TAU / 4.0;
    let tops = [
        (0.0, Point::new(centre.x + radius, centre.y)),
        (quarter, Point::new(centre.x, centre.y + radius)),
        (2.0 * quarter, Point::new(centre.x - radius, centre.y)),
        (3.0 * quarter, Point::new(centre.x, centre.y - radius)),
    ];
    tops.into_iter().filter(|(angle, _)| passes(*angle)).fold(ends, |bounds, (_, top)| bounds.with(top))
}

/// Bounds of a path, including the bulges of arcs, to the nanometre.
pub fn path_bounds(path: &Path) -> Bounds {
    path.pieces().fold(Bounds::of(path.start), |bounds, (from, segment)| match segment {
        PathSegment::Line { to } => bounds.with(to),
        PathSegment::Arc { .. } => {
            let of = segment_bounds(from, segment);
            bounds.with(of.min).with(of.max)
        }
    })
}

impl Region {
    /// Bounds, including the bulges of arcs, to a nanometre; `None` if empty.
    pub fn bounds(&self) -> Option<Bounds> {
        let boxes = self.islands.iter().map(|island| path_bounds(&island.outer));
        boxes.reduce(|all, next| all.with(next.min).with(next.max))
    }
}

/// Crossings of the ray from `point` to the right with a piece: upward minus downward.
pub(super) fn crossings(point: Point, from: Point, segment: PathSegment) -> i32 {
    let (p, a, b) = (spot(point), spot(from), spot(segment.to()));
    let PathSegment::Arc { centre, clockwise, .. } = segment else { return line_crossing(p, a, b) };
    let c = spot(centre);
    // A monotonic part of an arc, on the right or on the left half of the circle.
    let part = |low: Spot, high: Spot, right: bool| {
        let rises = low.1 <= p.1 && p.1 < high.1;
        let falls = high.1 <= p.1 && p.1 < low.1;
        if !rises && !falls {
            return 0;
        }
        let radius = (apart(c, a) + apart(c, b)) / 2.0;
        let height = p.1 - c.1;
        let half = libm::sqrt((radius * radius - height * height).max(0.0));
        let x = if right { c.0 + half } else { c.0 - half };
        if p.0 < x { if rises { 1 } else { -1 } } else { 0 }
    };
    let turn = chords::turn(from, segment.to(), centre, clockwise);
    arc_parts(a, b, c, turn, clockwise).map(|(low, high, right)| part(low, high, right)).sum()
}

/// Splits an arc at the top and the bottom of its circle: start, end and half of each part.
fn arc_parts(
    a: Spot,
    b: Spot,
    c: Spot,
    turn: f64,
    clockwise: bool,
) -> impl Iterator<Item = (Spot, Spot, bool)> {
    let radius = (apart(c, a) + apart(c, b)) / 2.0;
    let start = libm::atan2(a.1 - c.1, a.0 - c.0);
    let sign = if clockwise { -1.0 } else { 1.0 };
    // Angles from the start to the first cut, and to the following ones.
    let cut = TAU / 4.0;
    let ahead = sign * (cut - start);
    let first = ahead - TAU / 2.0 * libm::floor(ahead / (TAU / 2.0));
    let first_is_top = libm::sin(start + sign * first) > 0.0;
    let cuts: Vec<f64> =
        (0..3).map(|index| first + f64::from(index) * TAU / 2.0).filter(|&cut| cut < turn).collect();
    let mut parts = Vec::with_capacity(4);
    let mut at = a;
    for (index, _) in cuts.iter().enumerate() {
        let top = first_is_top == (index % 2 == 0);
        let next = (c.0, if top { c.1 + radius } else { c.1 - radius });
        // Counter-clockwise towards the top is the right half; clockwise the left one.
        parts.push((at, next, top != clockwise));
        at = next;
    }
    let middle = start + sign * (cuts.last().copied().unwrap_or(0.0) + turn) / 2.0;
    parts.push((at, b, libm::cos(middle) > 0.0));
    parts.into_iter()
}

fn line_crossing(p: Spot, a: Spot, b: Spot) -> i32 {
    let left = (b.0 - a.0) * (p.1 - a.1) - (b.1 - a.1) * (p.0 - a.0);
    if a.1 <= p.1 && p.1 < b.1 && left > 0.0 {
        1
    } else if b.1 <= p.1 && p.1 < a.1 && left < 0.0 {
        -1
    } else {
        0
    }
}

/// Winding number of a closed path around a point, counter-clockwise.
pub fn winding(path: &Path, point: Point) -> i32 {
    path.pieces().map(|(from, segment)| crossings(point, from, segment)).sum()
}

/// True if a point is in an island and in none of its holes.
pub fn island_contains(island: &Island, point: Point) -> bool {
    path_bounds(&island.outer).contains(point)
        && island.paths().map(|path| winding(path, point)).sum::<i32>() != 0
}

/// True if a point is in a region. For many points use an index.
pub fn contains(region: &Region, point: Point) -> bool {
    region.islands.iter().any(|island| island_contains(island, point))
}
