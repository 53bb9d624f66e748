//! Splits strokes at crossings and T-junctions into edges between numbered nodes.
//!
//! ```text
//!       │                 ●
//!   ────┼────     ●───────●───────●      a crossing is a node of four edges
//!       │                 ●
//! ```
//!
//! Two edges with one course between the same nodes become one edge: for example a rounded corner and a line
//! that runs past its start.

use super::outline::{JOIN, Stroke, near};
use crate::geometry::{Bounds, PathSegment, Point, chords, segment_bounds};
use crate::units::Length;
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

/// Most pairs of strokes to compare; a drawing of more lines stays unsplit.
const MOST_PAIRS: usize = 20_000_000;
const MOST_CUTS: usize = 200_000;
/// Arcs between the same nodes are equal if their centres are this near, in mm.
const SAME_CENTRE_MM: f64 = 0.05;

#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    pub(super) a: usize,
    pub(super) b: usize,
    /// Start: within [`JOIN`] of its node.
    pub(super) from: Point,
    pub(super) segment: PathSegment,
    pub(super) stroke: usize,
}

#[derive(Debug, Default)]
pub(super) struct Net {
    pub(super) nodes: Vec<Point>,
    /// The edges in the order of their strokes.
    pub(super) edges: Vec<Edge>,
    /// Dropped line ends along an arc, and dropped arcs along a line: the length and start of each.
    pub(super) doubles: Vec<(Length, Point)>,
}

impl Net {
    pub(super) fn degrees(&self) -> Vec<usize> {
        let mut degrees = vec![0; self.nodes.len()];
        for end in self.edges.iter().flat_map(|edge| [edge.a, edge.b]) {
            if let Some(degree) = degrees.get_mut(end) {
                *degree += 1;
            }
        }
        degrees
    }
}

/// The net of `strokes`; `None` if they are too many to be split.
pub(super) fn net(strokes: &[Stroke]) -> Option<Net> {
    let cuts = cuts(strokes)?;
    let mut nodes = Nodes::default();
    for &(from, segment) in strokes {
        nodes.number(from);
        nodes.number(segment.to());
    }
    let mut edges = Vec::with_capacity(strokes.len() + cuts.iter().map(Vec::len).sum::<usize>());
    let mut seen = BTreeMap::new();
    let mut second = Vec::new();
    for (stroke, (&(from, segment), mut cuts)) in strokes.iter().zip(cuts).enumerate() {
        cuts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let (first, mut at, mut a) = (from, from, nodes.number(from));
        let ends = cuts.into_iter().map(|(_, point)| point).chain([segment.to()]);
        for to in ends {
            let b = nodes.number(to);
            let whole = at == first && to == segment.to();
            if a == b && !(whole && is_arc(segment)) {
                continue;
            }
            let piece = with_end(segment, to);
            let edge = Edge { a, b, from: at, segment: piece, stroke };
            let between: &mut Vec<usize> = seen.entry((a.min(b), a.max(b))).or_default();
            match between
                .iter()
                .copied()
                .find(|&known| edges.get(known).is_some_and(|own| is_same(own, &edge)))
            {
                None => {
                    between.push(edges.len());
                    edges.push(edge);
                }
                Some(known) => second.push((known, edge)),
            }
            (at, a) = (to, b);
        }
    }
    let doubles = drop_doubles(&mut edges, second, strokes);
    Some(Net { nodes: nodes.points, edges, doubles })
}

/// Of a line and an arc with one course keeps the one with stroke ends nearer to the other stroke. Returns
/// length and start of the dropped ones.
fn drop_doubles(edges: &mut [Edge], second: Vec<(usize, Edge)>, strokes: &[Stroke]) -> Vec<(Length, Point)> {
    let mut doubles = Vec::new();
    for (known, edge) in second {
        let Some(own) = edges.get_mut(known).filter(|own| is_arc(own.segment) != is_arc(edge.segment)) else {
            continue;
        };
        let off = |of: &Edge, other: &Edge| {
            let ends = strokes.get(of.stroke).map_or([of.from; 2], |(from, to)| [*from, to.to()]);
            let is_of_edge = |end: &Point| near(*end, of.from) || near(*end, of.segment.to());
            let other = strokes.get(other.stroke).copied().unwrap_or((other.from, other.segment));
            ends.into_iter().filter(is_of_edge).map(|end| distance_mm(other, end)).fold(0.0, f64::max)
        };
        let lost = if off(own, &edge) > off(&edge, own) { std::mem::replace(own, edge) } else { edge };
        doubles.push((Length::from_mm(lost.from.distance_mm(lost.segment.to())), lost.from));
    }
    doubles
}

fn is_arc(segment: PathSegment) -> bool {
    matches!(segment, PathSegment::Arc { .. })
}

fn with_end(segment: PathSegment, to: Point) -> PathSegment {
    match segment {
        PathSegment::Line { .. } => PathSegment::Line { to },
        PathSegment::Arc { centre, clockwise, .. } => PathSegment::Arc { to, centre, clockwise },
    }
}

fn is_same(one: &Edge, two: &Edge) -> bool {
    let most = match (is_arc(one.segment), is_arc(two.segment)) {
        (false, false) => return true,
        (true, true) => SAME_CENTRE_MM,
        _ => JOIN.mm(),
    };
    // Rounding moves the far centre of a flat arc, so compare midpoints.
    half_way(one).distance_mm(half_way(two)) <= most
}

/// The midpoint along an edge; for a full circle its centre.
fn half_way(edge: &Edge) -> Point {
    let (from, to) = (edge.from, edge.segment.to());
    match edge.segment {
        PathSegment::Line { .. } => Point::from_mm((from.x + to.x).mm() / 2.0, (from.y + to.y).mm() / 2.0),
        PathSegment::Arc { centre, .. } if from == to => centre,
        PathSegment::Arc { centre, clockwise, .. } => middle(from, to, centre, clockwise),
    }
}

fn middle(from: Point, to: Point, centre: Point, clockwise: bool) -> Point {
    let half = chords::turn(from, to, centre, clockwise) / 2.0;
    turned(from, centre, if clockwise { -half } else { half })
}

/// `from` rotated about `centre` by an angle in radians, counter-clockwise.
fn turned(from: Point, centre: Point, angle: f64) -> Point {
    let (x, y) = ((from.x - centre.x).mm(), (from.y - centre.y).mm());
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    Point::from_mm(centre.x.mm() + x * cos - y * sin, centre.y.mm() + x * sin + y * cos)
}

/// Numbers of nodes: points within [`JOIN`] share one.
#[derive(Default)]
struct Nodes {
    points: Vec<Point>,
    cells: BTreeMap<(i64, i64), Vec<usize>>,
}

impl Nodes {
    fn number(&mut self, point: Point) -> usize {
        let cell = |length: Length| length.nm().div_euclid(JOIN.nm());
        let (x, y) = (cell(point.x), cell(point.y));
        let around = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (x + dx, y + dy)));
        let mut close = around.filter_map(|cell| self.cells.get(&cell)).flatten().copied();
        let known = close.find(|&node| self.points.get(node).is_some_and(|&at| near(at, point)));
        known.unwrap_or_else(|| {
            let node = self.points.len();
            self.points.push(point);
            self.cells.entry((x, y)).or_default().push(node);
            node
        })
    }
}

/// Cuts of each stroke: the share of its length, and the point.
fn cuts(strokes: &[Stroke]) -> Option<Vec<Vec<(f64, Point)>>> {
    let boxes: Vec<Bounds> = strokes.iter().map(|&(from, to)| segment_bounds(from, to).grown(JOIN)).collect();
    let mut order: Vec<usize> = (0..strokes.len()).collect();
    order.sort_by_key(|&index| boxes.get(index).map(|bounds| bounds.min));
    let mut cuts = vec![Vec::new(); strokes.len()];
    let (mut pairs, mut made) = (0, 0);
    for (at, &one) in order.iter().enumerate() {
        let (Some(&first), Some(&own)) = (strokes.get(one), boxes.get(one)) else { continue };
        for &two in order.iter().skip(at + 1) {
            let (Some(&second), Some(&other)) = (strokes.get(two), boxes.get(two)) else { continue };
            if other.min.x > own.max.x {
                break;
            }
            pairs += 1;
            if !own.meets(other) {
                continue;
            }
            for point in meetings(first, second) {
                for (index, stroke) in [(one, first), (two, second)] {
                    let share = share(stroke, point);
                    if let (Some(share), Some(row)) = (share, cuts.get_mut(index)) {
                        row.push((share, point));
                        made += 1;
                    }
                }
            }
            if pairs > MOST_PAIRS || made > MOST_CUTS {
                return None;
            }
        }
    }
    Some(cuts)
}

pub(super) fn meetings(one: Stroke, two: Stroke) -> Vec<Point> {
    let ends = |a: Stroke, b: Stroke| {
        [a.0, a.1.to()].into_iter().filter(move |&end| distance_mm(b, end) <= JOIN.mm()).collect::<Vec<_>>()
    };
    let mut points = ends(one, two);
    points.extend(ends(two, one));
    let crossings = match (one.1, two.1) {
        (PathSegment::Line { to }, PathSegment::Line { to: other }) => {
            line_line((one.0, to), (two.0, other)).into_iter().collect()
        }
        (PathSegment::Line { to }, PathSegment::Arc { .. }) => line_arc((one.0, to), two),
        (PathSegment::Arc { .. }, PathSegment::Line { to }) => line_arc((two.0, to), one),
        (PathSegment::Arc { .. }, PathSegment::Arc { .. }) => arc_arc(one, two),
    };
    // A crossing near an end is that end.
    let fresh = |point: &Point| points.iter().all(|end| !near(*end, *point));
    let crossings: Vec<Point> = crossings.into_iter().filter(fresh).collect();
    points.extend(crossings);
    points
}

/// Share of a stroke's length at a point, 0 to 1; `None` at its ends.
fn share((from, segment): Stroke, point: Point) -> Option<f64> {
    let to = segment.to();
    if near(point, from) || near(point, to) {
        return None;
    }
    let share = match segment {
        PathSegment::Line { .. } => {
            let (dx, dy) = ((to.x - from.x).mm(), (to.y - from.y).mm());
            let along = (point.x - from.x).mm() * dx + (point.y - from.y).mm() * dy;
            along / (dx * dx + dy * dy)
        }
        PathSegment::Arc { centre, clockwise, .. } => {
            chords::turn(from, point, centre, clockwise) / chords::turn(from, to, centre, clockwise)
        }
    };
    Some(share).filter(|share| *share > 0.0 && *share < 1.0)
}

pub(super) fn distance_mm(stroke: Stroke, point: Point) -> f64 {
    nearest(stroke, point).distance_mm(point)
}

pub(super) fn nearest((from, segment): Stroke, point: Point) -> Point {
    let to = segment.to();
    match segment {
        PathSegment::Line { .. } => {
            let (dx, dy) = ((to.x - from.x).mm(), (to.y - from.y).mm());
            let whole = dx * dx + dy * dy;
            let along = (point.x - from.x).mm() * dx + (point.y - from.y).mm() * dy;
            let share = if whole > 0.0 { (along / whole).clamp(0.0, 1.0) } else { 0.0 };
            Point::from_mm(from.x.mm() + dx * share, from.y.mm() + dy * share)
        }
        PathSegment::Arc { centre, clockwise, .. } => {
            let radius = radius_mm(from, to, centre);
            let (x, y) = ((point.x - centre.x).mm(), (point.y - centre.y).mm());
            let away = libm::sqrt(x * x + y * y);
            let whole = chords::turn(from, to, centre, clockwise);
            if away > 1e-9 && (from == to || chords::turn(from, point, centre, clockwise) <= whole) {
                return Point::from_mm(centre.x.mm() + x * radius / away, centre.y.mm() + y * radius / away);
            }
            if from.distance_mm(point) < to.distance_mm(point) { from } else { to }
        }
    }
}

fn radius_mm(from: Point, to: Point, centre: Point) -> f64 {
    (from.distance_mm(centre) + to.distance_mm(centre)) / 2.0
}

fn line_line((a, b): (Point, Point), (c, d): (Point, Point)) -> Option<Point> {
    let (ux, uy) = ((b.x - a.x).mm(), (b.y - a.y).mm());
    let (vx, vy) = ((d.x - c.x).mm(), (d.y - c.y).mm());
    let (wx, wy) = ((c.x - a.x).mm(), (c.y - a.y).mm());
    let cross = ux * vy - uy * vx;
    if cross.abs() <= 1e-9 * libm::sqrt((ux * ux + uy * uy) * (vx * vx + vy * vy)) {
        return None;
    }
    let (t, u) = ((wx * vy - wy * vx) / cross, (wx * uy - wy * ux) / cross);
    let inside = (0.0..=1.0).contains(&t) && (0.0..=1.0).contains(&u);
    inside.then(|| Point::from_mm(a.x.mm() + t * ux, a.y.mm() + t * uy))
}

fn is_on((from, segment): Stroke, point: Point) -> bool {
    let PathSegment::Arc { to, centre, clockwise } = segment else { return false };
    from == to || chords::turn(from, point, centre, clockwise) <= chords::turn(from, to, centre, clockwise)
}

fn line_arc((a, b): (Point, Point), arc: Stroke) -> Vec<Point> {
    let PathSegment::Arc { to, centre, .. } = arc.1 else { return Vec::new() };
    let radius = radius_mm(arc.0, to, centre);
    let (dx, dy) = ((b.x - a.x).mm(), (b.y - a.y).mm());
    let (x, y) = ((a.x - centre.x).mm(), (a.y - centre.y).mm());
    let whole = dx * dx + dy * dy;
    if whole <= 0.0 {
        return Vec::new();
    }
    let half = (x * dx + y * dy) / whole;
    let root = half * half - (x * x + y * y - radius * radius) / whole;
    // A line that misses the circle by less than the join distance touches it.
    let off_mm = libm::sqrt((x * x + y * y - half * half * whole).max(0.0)) - radius;
    if root < 0.0 && off_mm > JOIN.mm() {
        return Vec::new();
    }
    let root = root.max(0.0);
    let shares = [-half - libm::sqrt(root), -half + libm::sqrt(root)];
    let inside = shares.into_iter().filter(|share| (0.0..=1.0).contains(share));
    let points = inside.map(|share| Point::from_mm(a.x.mm() + share * dx, a.y.mm() + share * dy));
    points.filter(|&point| is_on(arc, point)).collect()
}

fn arc_arc(one: Stroke, two: Stroke) -> Vec<Point> {
    let (PathSegment::Arc { to, centre, .. }, PathSegment::Arc { to: other_to, centre: other, .. }) =
        (one.1, two.1)
    else {
        return Vec::new();
    };
    let (r, s) = (radius_mm(one.0, to, centre), radius_mm(two.0, other_to, other));
    let apart = centre.distance_mm(other);
    if apart < JOIN.mm() {
        return Vec::new();
    }
    let along = (r * r - s * s + apart * apart) / (2.0 * apart);
    let squared = r * r - along * along;
    let off_mm = (apart - r - s).max((r - s).abs() - apart);
    if squared < 0.0 && off_mm > JOIN.mm() {
        return Vec::new();
    }
    let squared = squared.max(0.0);
    let (ux, uy) = ((other.x - centre.x).mm() / apart, (other.y - centre.y).mm() / apart);
    let height = libm::sqrt(squared);
    let at = |height: f64| {
        Point::from_mm(centre.x.mm() + along * ux - height * uy, centre.y.mm() + along * uy + height * ux)
    };
    [at(height), at(-height)].into_iter().filter(|&point| is_on(one, point) && is_on(two, point)).collect()
}

/// The direction, in radians, from the start of an edge to its point at distance `away_mm`.
pub(super) fn heading(from: Point, segment: PathSegment, away_mm: f64) -> f64 {
    match segment {
        PathSegment::Line { to } => libm::atan2((to.y - from.y).mm(), (to.x - from.x).mm()),
        PathSegment::Arc { centre, clockwise, .. } => {
            let radius = from.distance_mm(centre).max(1e-9);
            let outwards = libm::atan2((from.y - centre.y).mm(), (from.x - centre.x).mm());
            let half = libm::asin((away_mm / (2.0 * radius)).clamp(0.0, 1.0));
            let heading = PI / 2.0 + half;
            let angle = if clockwise { outwards - heading } else { outwards + heading };
            angle - TAU * libm::floor((angle + PI) / TAU)
        }
    }
}

/// Largest radius, in mm, for which a circle around the start meets the edge only once.
pub(super) fn reach_mm(from: Point, segment: PathSegment) -> f64 {
    match segment {
        PathSegment::Line { to } => from.distance_mm(to),
        PathSegment::Arc { to, centre, clockwise } => {
            let short = from != to && chords::turn(from, to, centre, clockwise) <= PI;
            if short { from.distance_mm(to) } else { from.distance_mm(centre) }
        }
    }
}
