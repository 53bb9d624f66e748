//! Converts contours of chords back to paths of lines and true arcs.
//!
//! ```text
//!   consecutive chords of one circle ─▶ one arc     ╲_│_╱  a corner between two outlines, found on chords:
//!   lines in one direction           ─▶ one line       ●   moved to the true crossing of arc and line
//!   fragments                        ─▶ nothing
//! ```
//!
//! Tolerance: an arc is on its original circle; a line is within [`STRAIGHT_NM`] of the corners it absorbed.
//! A piece shorter than the given fragment length becomes a point near or on it. A contour with a mean width
//! below [`DUST_WIDTH_NM`] is dropped.

use super::overlay::{CHORD_ERROR_NM, Circle, Fill, Found, Overlay, Shape, Spot, apart, trace};
use super::simplify::simplify;
use super::{Island, Path, PathSegment, Point, Region};
use crate::units::Length;

/// Corners this near to a straight line, in nm, are on it.
pub(super) const STRAIGHT_NM: f64 = 3.0;
/// Circles are equal if centres and radii differ by no more, in nm.
const SAME_NM: f64 = 20.0;
/// A contour is dust if its area is less than this width times half its length.
pub(super) const DUST_WIDTH_NM: f64 = 20.0;
/// A contour of less area is dust, in nm²: one square micrometre.
const DUST_AREA_NM2: f64 = 1e6;
/// Largest distance, in nm, to move a corner to the true crossing of its neighbours.
const SNAP_NM: f64 = 8.0 * CHORD_ERROR_NM;
/// An arc with a shorter chord, in nm, between other pieces is no full circle: its neck would be longer.
const TINY_NM: f64 = 1_000.0;
const LONGEST_LOOK: usize = 256;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Line,
    Arc { circle: Circle, clockwise: bool },
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Node {
    at: Spot,
    kind: Kind,
}

impl Kind {
    fn of(edge: &Found, circles: &[Circle]) -> Self {
        let Some(&circle) = edge.data.circle().and_then(|index| circles.get(index)) else {
            return Self::Line;
        };
        let (a, b, c) = (place(edge, false), place(edge, true), circle.centre);
        let side = (a.0 - c.0) * (b.1 - c.1) - (a.1 - c.1) * (b.0 - c.0);
        Self::Arc { circle, clockwise: side < 0.0 }
    }

    /// True if two consecutive pieces are one: arcs of one circle in one direction.
    fn goes_on(self, other: Self) -> bool {
        match (self, other) {
            (Self::Arc { circle: a, clockwise: left }, Self::Arc { circle: b, clockwise: right }) => {
                left == right
                    && (a == b
                        || apart(a.centre, b.centre) <= SAME_NM
                            && (a.radius_nm - b.radius_nm).abs() <= SAME_NM)
            }
            _ => false,
        }
    }
}

fn place(edge: &Found, end: bool) -> Spot {
    let point = if end { edge.b } else { edge.a };
    (f64::from(point.x), f64::from(point.y))
}

fn sub(a: Spot, b: Spot) -> Spot {
    (a.0 - b.0, a.1 - b.1)
}

fn cross(a: Spot, b: Spot) -> f64 {
    a.0 * b.1 - a.1 * b.0
}

fn dot(a: Spot, b: Spot) -> f64 {
    a.0 * b.0 + a.1 * b.1
}

/// Area to the left of a contour and its length, both from its edges, in nm² and nm.
fn size(contour: &[Found]) -> (f64, f64) {
    let start = contour.first().map_or((0.0, 0.0), |edge| place(edge, false));
    contour.iter().fold((0.0, 0.0), |(area, length), edge| {
        let (a, b) = (place(edge, false), place(edge, true));
        (area + cross(sub(a, start), sub(b, start)) / 2.0, length + apart(a, b))
    })
}

fn is_dust(contour: &[Found]) -> bool {
    let (area, length) = size(contour);
    area.abs() < DUST_AREA_NM2.max(DUST_WIDTH_NM * length / 2.0)
}

/// Merges runs of one arc. The ring starts at the start of a run.
fn runs(contour: &[Found], circles: &[Circle]) -> Vec<Node> {
    let all: Vec<Node> =
        contour.iter().map(|edge| Node { at: place(edge, false), kind: Kind::of(edge, circles) }).collect();
    join_arcs(&all)
}

/// Rotates the ring to start between two different pieces, and merges pieces that continue each other. A ring
/// of a single arc stays one node. A circle that touches the rest of its ring at its start point stays two
/// arcs: an arc from a point to itself is ambiguous.
fn join_arcs(nodes: &[Node]) -> Vec<Node> {
    let before = nodes.iter().cycle().skip(nodes.len().saturating_sub(1));
    let seam = nodes.iter().zip(before).position(|(node, before)| !before.kind.goes_on(node.kind));
    let Some(seam) = seam else { return nodes.iter().take(1).copied().collect() };
    let mut joined: Vec<Node> = Vec::with_capacity(nodes.len());
    let ring = nodes.iter().cycle().skip(seam);
    for (node, next) in ring.clone().zip(ring.skip(1)).take(nodes.len()) {
        let goes_on = |last: &Node| last.kind.goes_on(node.kind) && last.at != next.at;
        if !joined.last().is_some_and(goes_on) {
            joined.push(*node);
        }
    }
    joined
}

fn around(index: usize, count: usize) -> (usize, usize) {
    ((index + count - 1) % count, (index + 1) % count)
}

/// Crossing of the lines a–b and c–d; `None` if they are nearly parallel.
fn crossing(a: Spot, b: Spot, c: Spot, d: Spot) -> Option<Spot> {
    let (u, v) = (sub(b, a), sub(d, c));
    let slope = cross(u, v);
    if slope.abs() <= 0.02 * libm::sqrt(dot(u, u) * dot(v, v)) {
        return None;
    }
    let share = cross(sub(c, a), v) / slope;
    Some((a.0 + u.0 * share, a.1 + u.1 * share))
}

/// True if a piece is so short that it is removed. A nearly full circle is not.
fn is_fragment(here: Node, next: Node, fragment_nm: f64) -> bool {
    let chord = sub(next.at, here.at);
    dot(chord, chord) < fragment_nm * fragment_nm
        && match here.kind {
            Kind::Line => true,
            Kind::Arc { circle, clockwise } => {
                let side = cross(chord, sub(circle.centre, here.at));
                if clockwise { side < 0.0 } else { side > 0.0 }
            }
        }
}

/// Replaces pieces shorter than `fragment_nm` by one corner; never two in a row, so that a fine curve keeps
/// its shape.
fn drop_fragments(nodes: &[Node], fragment_nm: f64) -> Vec<Node> {
    let mut kept: Vec<Node> = Vec::with_capacity(nodes.len());
    let mut index = 0;
    while let Some(&here) = nodes.get(index) {
        let enough = kept.len() + nodes.len() - index > 3;
        match nodes.get(index + 1) {
            Some(&next) if enough && is_fragment(here, next, fragment_nm) => {
                let last = kept.last().or(nodes.last()).copied().unwrap_or(here);
                let far = nodes.get(index + 2).or(kept.first()).copied().unwrap_or(next);
                kept.push(Node { at: drawn_together(last, here, next, far, fragment_nm), kind: next.kind });
                index += 2;
            }
            _ => {
                kept.push(here);
                index += 1;
            }
        }
    }
    kept
}

/// The corner that replaces a fragment from `here` to `next`: the crossing of the adjacent lines, or its end
/// on an arc.
fn drawn_together(last: Node, here: Node, next: Node, far: Node, fragment_nm: f64) -> Spot {
    let middle = ((here.at.0 + next.at.0) / 2.0, (here.at.1 + next.at.1) / 2.0);
    match (last.kind, next.kind) {
        (Kind::Line, Kind::Line) => crossing(last.at, here.at, next.at, far.at)
            .filter(|&place| apart(place, middle) <= 2.0 * fragment_nm)
            .unwrap_or(middle),
        (Kind::Line, Kind::Arc { .. }) => next.at,
        (Kind::Arc { .. }, _) => here.at,
    }
}

/// True if the lines into and out of `here` reverse with less than a dust width between them.
fn is_spike(last: Node, here: Node, next: Spot) -> bool {
    let (back, on) = (sub(last.at, here.at), sub(next, here.at));
    let longer = libm::sqrt(dot(back, back).max(dot(on, on)));
    last.kind == Kind::Line
        && here.kind == Kind::Line
        && dot(back, on) > 0.0
        && cross(back, on).abs() <= DUST_WIDTH_NM * longer
}

/// Removes corners where a line reverses.
fn drop_spikes(nodes: &[Node]) -> Vec<Node> {
    let mut kept: Vec<Node> = Vec::with_capacity(nodes.len());
    for &node in nodes {
        while let [.., last, here] = kept.as_slice()
            && is_spike(*last, *here, node.at)
        {
            kept.pop();
        }
        kept.push(node);
    }
    kept
}

/// Index after the last corner of `line` that a straight line from the first one reaches, with all corners
/// between on it.
fn straight_until(line: &[Node]) -> usize {
    let Some(first) = line.first() else { return 0 };
    let mut good = 1;
    for end in 2..line.len().min(LONGEST_LOOK) {
        let Some(to) = line.get(end) else { break };
        let way = sub(to.at, first.at);
        let length = libm::sqrt(dot(way, way));
        let mut reached = 0.0;
        let on_line = line.iter().take(end).skip(1).all(|node| {
            let arm = sub(node.at, first.at);
            let along = dot(arm, way) / length.max(1.0);
            let forward = along >= reached - STRAIGHT_NM && along <= length + STRAIGHT_NM;
            reached = along;
            forward && cross(way, arm).abs() <= STRAIGHT_NM * length
        });
        if !on_line {
            break;
        }
        good = end;
    }
    good
}

/// Merges collinear lines.
fn straighten(nodes: &[Node]) -> Vec<Node> {
    let count = nodes.len();
    let round: Vec<Node> = nodes.iter().chain(nodes.first()).copied().collect();
    let mut kept = Vec::with_capacity(count);
    let mut index = 0;
    while let Some(node) = nodes.get(index) {
        kept.push(*node);
        let ahead = round.iter().skip(index).take(LONGEST_LOOK);
        let lines = ahead.take_while(|node| node.kind == Kind::Line).count();
        let reach = (index + lines + 1).min(round.len());
        index += round.get(index..reach).map_or(1, straight_until).max(1);
    }
    kept
}

/// Rotates the ring by half, so that its seam is processed as well.
fn half_round(nodes: &mut [Node]) {
    let half = nodes.len() / 2;
    nodes.rotate_left(half);
}

/// The intersection of `circle` with the line a–b, nearest to `near`.
fn line_meets(a: Spot, b: Spot, circle: Circle, near: Spot) -> Option<Spot> {
    let way = sub(b, a);
    let length = libm::sqrt(dot(way, way));
    let unit = (way.0 / length, way.1 / length);
    let arm = sub(circle.centre, a);
    let (foot, off) = (dot(arm, unit), cross(unit, arm));
    let half = libm::sqrt(circle.radius_nm * circle.radius_nm - off * off);
    [foot - half, foot + half]
        .map(|along| (a.0 + unit.0 * along, a.1 + unit.1 * along))
        .into_iter()
        .filter(|place| place.0.is_finite() && place.1.is_finite())
        .min_by(|p, q| apart(*p, near).total_cmp(&apart(*q, near)))
}

fn circles_meet(one: Circle, two: Circle, near: Spot) -> Option<Spot> {
    let way = sub(two.centre, one.centre);
    let gap = libm::sqrt(dot(way, way));
    let along = (gap * gap + one.radius_nm * one.radius_nm - two.radius_nm * two.radius_nm) / (2.0 * gap);
    let half = libm::sqrt(one.radius_nm * one.radius_nm - along * along);
    let unit = (way.0 / gap, way.1 / gap);
    [half, -half]
        .map(|side| {
            (one.centre.0 + unit.0 * along - unit.1 * side, one.centre.1 + unit.1 * along + unit.0 * side)
        })
        .into_iter()
        .filter(|place| place.0.is_finite() && place.1.is_finite())
        .min_by(|p, q| apart(*p, near).total_cmp(&apart(*q, near)))
}

fn off(circle: Circle, place: Spot) -> f64 {
    (apart(circle.centre, place) - circle.radius_nm).abs()
}

fn onto(circle: Circle, place: Spot) -> Spot {
    let arm = sub(place, circle.centre);
    let length = libm::sqrt(dot(arm, arm)).max(1e-9);
    (circle.centre.0 + arm.0 / length * circle.radius_nm, circle.centre.1 + arm.1 / length * circle.radius_nm)
}

/// Intersection of the true curves at a corner; `None` if the corner is already on both.
fn meeting(last: Node, here: Node, next: Node) -> Option<Spot> {
    match (last.kind, here.kind) {
        (Kind::Line, Kind::Line) => None,
        (Kind::Line, Kind::Arc { circle, .. }) => meet_line(last.at, here.at, circle),
        (Kind::Arc { circle, .. }, Kind::Line) => meet_line(next.at, here.at, circle),
        (Kind::Arc { circle: one, .. }, Kind::Arc { circle: two, .. }) => meet_arcs(one, two, here.at),
    }
}

/// Moves corners found on chords to the intersection of the true curves. If three curves meet in one point, a
/// piece at that corner may be nothing but chord error. If it is short enough for that and the corner needs
/// its place, the piece is removed. An arc that ends off its circle would be wrong over its whole length.
fn snap(nodes: &mut Vec<Node>) {
    let mut index = 0;
    while index < nodes.len() {
        let (before, after) = around(index, nodes.len());
        let (Some(&here), Some(&last), Some(&next)) = (nodes.get(index), nodes.get(before), nodes.get(after))
        else {
            return;
        };
        let found = meeting(last, here, next).filter(|&found| apart(found, here.at) <= SNAP_NM);
        let (back, on) = (apart(here.at, last.at), apart(here.at, next.at));
        let room = back.min(on);
        match found {
            Some(found) if apart(found, here.at) <= room / 3.0 => {
                if let Some(node) = nodes.get_mut(index) {
                    node.at = (libm::round(found.0), libm::round(found.1));
                }
                index += 1;
            }
            Some(_)
                if room <= 2.0 * CHORD_ERROR_NM && without(nodes, if on < back { index } else { before }) =>
            {
                index = index.saturating_sub(1);
            }
            _ => {
                let at = beside(last, here, next).unwrap_or(here.at);
                if let Some(node) = nodes.get_mut(index) {
                    node.at = at;
                }
                index += 1;
            }
        }
    }
}

/// Removes the piece that starts at node `index`, so that its neighbours meet in one corner. False if they
/// don't.
fn without(nodes: &mut Vec<Node>, index: usize) -> bool {
    let count = nodes.len();
    let (before, after) = around(index, count);
    let ring = [before, index, after, (after + 1) % count.max(1)].map(|index| nodes.get(index).copied());
    let [Some(from), Some(here), Some(next), Some(to)] = ring else { return false };
    let met = match (from.kind, next.kind) {
        (Kind::Line, Kind::Line) => crossing(from.at, here.at, next.at, to.at),
        (Kind::Line, Kind::Arc { circle, .. }) => line_meets(from.at, here.at, circle, next.at),
        (Kind::Arc { circle, .. }, Kind::Line) => line_meets(to.at, next.at, circle, here.at),
        (Kind::Arc { circle: one, .. }, Kind::Arc { circle: two, .. }) => circles_meet(one, two, here.at),
    };
    let near = |met: &Spot| count > 3 && apart(*met, here.at) <= SNAP_NM;
    let Some(met) = met.filter(near).filter(|&met| is_between(from.at, (here.at, next.at), to.at, met))
    else {
        return false;
    };
    if let Some(node) = nodes.get_mut(after) {
        node.at = (libm::round(met.0), libm::round(met.1));
    }
    nodes.remove(index);
    true
}

/// True if both adjacent pieces keep their direction when the two corners between them become the one at
/// `met`. Grazing curves may meet far away, beyond the next corner.
fn is_between(from: Spot, (first, second): (Spot, Spot), to: Spot, met: Spot) -> bool {
    let same_way = |one: Spot, other: Spot| dot(one, other) > 0.0;
    same_way(sub(first, from), sub(met, from)) && same_way(sub(to, second), sub(to, met))
}

/// New position of a corner that can't move to the intersection: on the longer curve, if that is an arc and
/// near.
fn beside(last: Node, here: Node, next: Node) -> Option<Spot> {
    let longer = if apart(here.at, last.at) > apart(here.at, next.at) { last.kind } else { here.kind };
    let Kind::Arc { circle, .. } = longer else { return None };
    let place = onto(circle, here.at);
    (apart(place, here.at) <= 2.0 * CHORD_ERROR_NM).then_some((libm::round(place.0), libm::round(place.1)))
}

fn meet_line(far: Spot, here: Spot, circle: Circle) -> Option<Spot> {
    if off(circle, here) <= 2.0 {
        return None;
    }
    let near = |place: &Spot| apart(*place, here) <= SNAP_NM;
    line_meets(far, here, circle, here).filter(near).or_else(|| Some(onto(circle, here)))
}

fn meet_arcs(one: Circle, two: Circle, here: Spot) -> Option<Spot> {
    if off(one, here).max(off(two, here)) <= 2.0 {
        return None;
    }
    let near = |place: &Spot| apart(*place, here) <= SNAP_NM;
    circles_meet(one, two, here).filter(near).or_else(|| {
        let (a, b) = (onto(one, here), onto(two, here));
        Some(((a.0 + b.0) / 2.0, (a.1 + b.1) / 2.0))
    })
}

fn point((x, y): Spot) -> Point {
    Point::new(Length::from_nm(libm::round(x) as i64), Length::from_nm(libm::round(y) as i64))
}

fn whole(circle: Circle, clockwise: bool) -> Path {
    let centre = point(circle.centre);
    let start = Point::new(centre.x - Length::from_nm(libm::round(circle.radius_nm) as i64), centre.y);
    Path { start, segments: vec![PathSegment::Arc { to: start, centre, clockwise }] }
}

/// True if rounding reverses a tiny arc, which would become a full circle.
fn is_reversed((from, to): (Point, Point), circle: Circle, clockwise: bool) -> bool {
    let spot = |point: Point| (point.x.nm() as f64, point.y.nm() as f64);
    let chord = sub(spot(to), spot(from));
    let side = cross(chord, sub(circle.centre, spot(from)));
    let back = if clockwise { side >= 0.0 } else { side <= 0.0 };
    dot(chord, chord) < TINY_NM * TINY_NM && back
}

/// The path of a ring, starting at its leftmost, then lowest corner.
fn path_of(nodes: &[Node]) -> Option<Path> {
    if let [Node { kind: Kind::Arc { circle, clockwise }, .. }] = *nodes {
        return Some(whole(circle, clockwise));
    }
    let corners: Vec<Point> = nodes.iter().map(|node| point(node.at)).collect();
    let first = (0..corners.len()).min_by_key(|&index| corners.get(index))?;
    let ends = corners.iter().cycle().skip(first + 1);
    let starts = corners.iter().cycle().skip(first);
    let kinds = nodes.iter().cycle().skip(first).take(nodes.len());
    let mut segments: Vec<PathSegment> = kinds
        .zip(starts.zip(ends))
        .filter(|(node, (from, to))| from != to || matches!(node.kind, Kind::Arc { .. }) && nodes.len() == 1)
        .map(|(node, (&from, &to))| match node.kind {
            Kind::Line => PathSegment::Line { to },
            Kind::Arc { circle, clockwise }
                if nodes.len() > 2 && is_reversed((from, to), circle, clockwise) =>
            {
                PathSegment::Line { to }
            }
            Kind::Arc { circle, clockwise } => {
                PathSegment::Arc { to, centre: point(circle.centre), clockwise }
            }
        })
        .collect();
    // A large board has millions of segments: unused capacity would count.
    segments.shrink_to_fit();
    let round = segments.iter().any(|segment| matches!(segment, PathSegment::Arc { .. }));
    let enough = if round { 2 } else { 3 };
    (segments.len() >= enough)
        .then(|| Path { start: corners.get(first).copied().unwrap_or_default(), segments })
}

/// One contour as a path; `None` for dust.
pub(super) fn path(contour: &[Found], circles: &[Circle], fragment_nm: f64) -> Option<Path> {
    if is_dust(contour) {
        return None;
    }
    let mut nodes = runs(contour, circles);
    for _ in 0..2 {
        nodes = straighten(&join_arcs(&drop_spikes(&drop_fragments(&nodes, fragment_nm))));
        half_round(&mut nodes);
    }
    // If snapping leaves nothing, use the contour as found.
    let found = nodes.clone();
    snap(&mut nodes);
    path_of(&nodes).or_else(|| path_of(&found))
}

/// The area inside the outlines of an overlay by `fill`; takes the outlines.
pub(super) fn traced(overlay: &mut Overlay, fill: Fill, fragment_nm: f64) -> Region {
    let [pile] = simplify([&overlay.take()]);
    region(&trace(&pile, fill), &overlay.circles, fragment_nm)
}

/// The region of shapes. Pieces shorter than `fragment_nm` are merged.
pub(super) fn region(shapes: &[Shape], circles: &[Circle], fragment_nm: f64) -> Region {
    let island = |shape: &Shape| {
        let (outer, holes) = shape.split_first()?;
        let outer = path(outer, circles, fragment_nm)?;
        let mut holes: Vec<Path> = holes.iter().filter_map(|hole| path(hole, circles, fragment_nm)).collect();
        holes.sort();
        Some(Island { outer, holes })
    };
    let mut islands: Vec<Island> = shapes.iter().filter_map(island).collect();
    islands.sort();
    Region { islands }
}
