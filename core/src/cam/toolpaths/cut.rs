//! Splits paths: at lengths along them, and at the edges of an area.
//!
//! ```text
//!   path  ────────┼─────────┼──────▶        at lengths: tabs, ramps, overlaps
//!
//!            ┌─────────┐
//!   path  ───┼─────────┼─── path            at an area: the parts inside, or the parts outside
//!            └─────────┘
//! ```
//!
//! Ends of pieces are on the original line or circle, to a nanometre.

use crate::geometry::{Index, Path, PathSegment, Point, Region, chords, segment_bounds};
use crate::units::Length;
use std::f64::consts::TAU;

const CRUMB_MM: f64 = 1e-5;

/// A segment with its start, and the lengths along the path of its ends, in mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Piece {
    pub(crate) from: Point,
    pub(crate) segment: PathSegment,
    pub(crate) begin_mm: f64,
    pub(crate) end_mm: f64,
}

pub(crate) struct Area {
    index: Index,
}

impl Area {
    pub(crate) fn of(region: &Region) -> Self {
        Self { index: Index::of(region) }
    }

    pub(crate) fn index(&self) -> &Index {
        &self.index
    }

    pub(crate) fn contains(&self, point: Point) -> bool {
        self.index.island_at(point).is_some()
    }
}

/// Length of a segment, in mm.
pub(super) fn length(from: Point, segment: PathSegment) -> f64 {
    match segment {
        PathSegment::Line { to } => from.distance_mm(to),
        PathSegment::Arc { to, centre, clockwise } => {
            from.distance_mm(centre) * chords::turn(from, to, centre, clockwise)
        }
    }
}

pub(crate) fn point_on(from: Point, segment: PathSegment, share: f64) -> Point {
    match segment {
        PathSegment::Line { to } => {
            let mix = |a: Length, b: Length| a.mm() + (b.mm() - a.mm()) * share;
            Point::from_mm(mix(from.x, to.x), mix(from.y, to.y))
        }
        PathSegment::Arc { to, centre, clockwise } => {
            let turn = chords::turn(from, to, centre, clockwise) * share;
            let angle = if clockwise { -turn } else { turn };
            let (x, y) = ((from.x - centre.x).mm(), (from.y - centre.y).mm());
            let (sin, cos) = (libm::sin(angle), libm::cos(angle));
            Point::from_mm(centre.x.mm() + x * cos - y * sin, centre.y.mm() + x * sin + y * cos)
        }
    }
}

fn ending(segment: PathSegment, to: Point) -> PathSegment {
    match segment {
        PathSegment::Line { .. } => PathSegment::Line { to },
        PathSegment::Arc { centre, clockwise, .. } => PathSegment::Arc { to, centre, clockwise },
    }
}

/// The segment split at ascending shares: the parts with their starts, and the shares of their ends.
pub(crate) fn parted(
    from: Point,
    segment: PathSegment,
    shares: &[f64],
) -> Vec<(Point, PathSegment, f64, f64)> {
    let whole = length(from, segment).max(1e-9);
    let mut parts = Vec::new();
    let (mut start, mut begin) = (from, 0.0);
    for &share in shares {
        if (share - begin) * whole < CRUMB_MM || (1.0 - share) * whole < CRUMB_MM {
            continue;
        }
        let to = point_on(from, segment, share);
        if to != start {
            parts.push((start, ending(segment, to), begin, share));
            (start, begin) = (to, share);
        }
    }
    parts.push((start, segment, begin, 1.0));
    parts
}

pub(crate) fn cut_at(path: &Path, lengths: &[f64]) -> Vec<Piece> {
    let mut sorted = lengths.to_vec();
    sorted.sort_by(f64::total_cmp);
    let mut pieces = Vec::new();
    let mut before = 0.0;
    for (from, segment) in path.pieces() {
        let own = length(from, segment);
        let inside = |at: &f64| *at > before && *at < before + own;
        let shares: Vec<f64> = sorted.iter().copied().filter(inside).map(|at| (at - before) / own).collect();
        for (from, segment, begin, end) in parted(from, segment, &shares) {
            pieces.push(Piece { from, segment, begin_mm: before + begin * own, end_mm: before + end * own });
        }
        before += own;
    }
    pieces
}

pub(crate) fn between(path: &Path, begin_mm: f64, end_mm: f64) -> Option<Path> {
    let pieces = cut_at(path, &[begin_mm, end_mm]);
    let mut kept = pieces.iter().filter(|piece| {
        let middle = (piece.begin_mm + piece.end_mm) / 2.0;
        middle > begin_mm && middle < end_mm
    });
    let first = kept.next()?;
    let segments = std::iter::once(first.segment).chain(kept.map(|piece| piece.segment)).collect();
    Some(Path { start: first.from, segments })
}

pub(crate) fn started_at(path: &Path, corner: usize) -> Path {
    let mut segments = path.segments.clone();
    let start = path.corners().nth(corner).unwrap_or(path.start);
    if corner < segments.len() {
        segments.rotate_left(corner);
    }
    Path { start, segments }
}

pub(crate) fn nearest_share(from: Point, segment: PathSegment, at: Point) -> f64 {
    let found = share(from, segment, (at.x.mm(), at.y.mm()));
    if (0.0..=1.0).contains(&found) {
        return found;
    }
    let to_end = segment.to().distance_mm(at);
    if from.distance_mm(at) <= to_end { 0.0 } else { 1.0 }
}

pub(crate) fn started_near(path: &Path, at: Point) -> Path {
    let away = |(from, segment): &(Point, PathSegment)| {
        point_on(*from, *segment, nearest_share(*from, *segment, at)).distance_mm(at)
    };
    let nearest = path.pieces().enumerate().min_by(|a, b| away(&a.1).total_cmp(&away(&b.1)));
    let Some((index, (from, segment))) = nearest else { return path.clone() };
    let mut turned = started_at(path, index);
    let parts = parted(from, segment, &[nearest_share(from, segment, at)]);
    if let [(_, first, ..), (start, second, ..)] = parts.as_slice() {
        turned.start = *start;
        if let Some(segment) = turned.segments.first_mut() {
            *segment = *second;
        }
        turned.segments.push(*first);
    }
    turned
}

/// Intersections of the lines or circles of two segments: at most two points, in mm.
fn meetings(a: (Point, PathSegment), b: (Point, PathSegment)) -> Vec<(f64, f64)> {
    match (a.1, b.1) {
        (PathSegment::Line { to: a1 }, PathSegment::Line { to: b1 }) => lines((a.0, a1), (b.0, b1)),
        (PathSegment::Line { to }, PathSegment::Arc { centre, .. }) => line_circle((a.0, to), centre, b.0),
        (PathSegment::Arc { centre, .. }, PathSegment::Line { to }) => line_circle((b.0, to), centre, a.0),
        (PathSegment::Arc { centre: c, .. }, PathSegment::Arc { centre: d, .. }) => {
            circles((c, a.0), (d, b.0))
        }
    }
}

fn lines((a, b): (Point, Point), (c, d): (Point, Point)) -> Vec<(f64, f64)> {
    let (ux, uy) = ((b.x - a.x).mm(), (b.y - a.y).mm());
    let (vx, vy) = ((d.x - c.x).mm(), (d.y - c.y).mm());
    let cross = ux * vy - uy * vx;
    if cross.abs() < 1e-15 {
        return Vec::new();
    }
    let t = ((c.x - a.x).mm() * vy - (c.y - a.y).mm() * vx) / cross;
    vec![(a.x.mm() + ux * t, a.y.mm() + uy * t)]
}

fn line_circle((a, b): (Point, Point), centre: Point, on: Point) -> Vec<(f64, f64)> {
    let (ux, uy) = ((b.x - a.x).mm(), (b.y - a.y).mm());
    let (px, py) = ((a.x - centre.x).mm(), (a.y - centre.y).mm());
    let radius = on.distance_mm(centre);
    let (square, half) = (ux * ux + uy * uy, ux * px + uy * py);
    let inside = half * half - square * (px * px + py * py - radius * radius);
    if square <= 0.0 || inside < 0.0 {
        return Vec::new();
    }
    let root = libm::sqrt(inside);
    [-root, root].map(|root| (root - half) / square).map(|t| (a.x.mm() + ux * t, a.y.mm() + uy * t)).to_vec()
}

fn circles((c, on_c): (Point, Point), (d, on_d): (Point, Point)) -> Vec<(f64, f64)> {
    let (r, s, apart) = (on_c.distance_mm(c), on_d.distance_mm(d), c.distance_mm(d));
    if apart < 1e-9 || apart > r + s || apart < (r - s).abs() {
        return Vec::new();
    }
    let along = (apart * apart + r * r - s * s) / (2.0 * apart);
    let aside = libm::sqrt((r * r - along * along).max(0.0));
    let (ux, uy) = ((d.x - c.x).mm() / apart, (d.y - c.y).mm() / apart);
    let foot = (c.x.mm() + ux * along, c.y.mm() + uy * along);
    vec![(foot.0 - uy * aside, foot.1 + ux * aside), (foot.0 + uy * aside, foot.1 - ux * aside)]
}

/// Share of a segment at a point of its line or circle; outside 0 … 1 if the point is not on the segment.
fn share(from: Point, segment: PathSegment, at: (f64, f64)) -> f64 {
    match segment {
        PathSegment::Line { to } => {
            let (ux, uy) = ((to.x - from.x).mm(), (to.y - from.y).mm());
            let square = (ux * ux + uy * uy).max(1e-18);
            ((at.0 - from.x.mm()) * ux + (at.1 - from.y.mm()) * uy) / square
        }
        PathSegment::Arc { to, centre, clockwise } => {
            let angle = |x: f64, y: f64| libm::atan2(y - centre.y.mm(), x - centre.x.mm());
            let (start, here) = (angle(from.x.mm(), from.y.mm()), angle(at.0, at.1));
            let turned = if clockwise { start - here } else { here - start };
            let turned = if turned < 0.0 { turned + TAU } else { turned };
            turned / chords::turn(from, to, centre, clockwise)
        }
    }
}

/// The shares at which a segment crosses edges of `area`, ascending.
fn crossings(from: Point, segment: PathSegment, area: &Area) -> Vec<f64> {
    let near = segment_bounds(from, segment).grown(Length::from_nm(10));
    let mut shares = Vec::new();
    for (_, edge_from, edge) in area.index.edges_in(near) {
        for at in meetings((from, segment), (edge_from, edge)) {
            let (own, others) = (share(from, segment, at), share(edge_from, edge, at));
            if (0.0..=1.0).contains(&own) && (-1e-9..=1.0 + 1e-9).contains(&others) {
                shares.push(own);
            }
        }
    }
    shares.sort_by(f64::total_cmp);
    shares
}

/// The parts of `path` inside `area` (`inside`), or outside. A complete closed path stays closed.
pub(crate) fn parts(path: &Path, area: &Area, inside: bool) -> Vec<Path> {
    let mut found: Vec<Path> = Vec::new();
    let mut open = false;
    let mut whole = true;
    for (from, segment) in path.pieces() {
        let shares = crossings(from, segment, area);
        for (start, part, begin, end) in parted(from, segment, &shares) {
            if area.contains(point_on(from, segment, (begin + end) / 2.0)) != inside {
                (open, whole) = (false, false);
                continue;
            }
            match found.last_mut().filter(|_| open) {
                Some(last) => last.segments.push(part),
                None => found.push(Path { start, segments: vec![part] }),
            }
            open = true;
        }
    }
    if whole || !path.is_closed() || found.len() < 2 || !open {
        return found;
    }
    // If the closed path starts within a part, join the last part with the first.
    if found.first().is_some_and(|first| first.start == path.start)
        && let Some(mut last) = found.pop()
    {
        if let Some(first) = found.first_mut() {
            last.segments.append(&mut first.segments);
            *first = last;
        } else {
            found.push(last);
        }
    }
    found
}

/// Distance of `path` from `at`, and the length along the path at the nearest point, if within `reach_mm`;
/// all in mm.
pub(super) fn nearest(path: &Path, at: Point, reach_mm: f64) -> Option<(f64, f64)> {
    let pieces = cut_at(path, &[]);
    let mut best: Option<(f64, f64)> = None;
    for piece in pieces {
        let looks = (((piece.end_mm - piece.begin_mm) / 0.1) as u32).clamp(1, 10_000);
        for look in 0..=looks {
            let share = f64::from(look) / f64::from(looks);
            let away = point_on(piece.from, piece.segment, share).distance_mm(at);
            if best.is_none_or(|(least, _)| away < least) {
                best = Some((away, piece.begin_mm + (piece.end_mm - piece.begin_mm) * share));
            }
        }
    }
    best.filter(|(away, _)| *away <= reach_mm)
}
