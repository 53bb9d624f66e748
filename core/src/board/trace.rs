//! The loops of an outline layer: splits strokes, closes gaps, trims dead ends.
//!
//! ```text
//!   ──┬───────┐        the end on the left runs past its corner: trimmed
//!     │       │
//!     └────── ┘        the ends on the right nearly meet: closed
//! ```

use super::boards::alone;
use super::faces::{Faces, Piece, faces};
use super::outline::{self, MOST_STROKES, Stroke, contours, near, once, shut};
use super::split::{Edge, Net, nearest, net};
use crate::geometry::{Path, PathSegment, Point};
use crate::units::Length;
use std::collections::{BTreeMap, BTreeSet};

/// Ends this near to each other are meant to meet.
const NEAR: Length = Length::from_um(100);
/// Wide pens close larger gaps visually, but at most this.
const MOST_NEAR: Length = Length::from_um(500);
/// A shorter line end beyond a corner is always trimmed.
const OVERSHOOT_MM: f64 = 0.5;
/// A stroke shorter than this is not closed on itself, in mm.
const LEAST_CLOSED_MM: f64 = 1.0;
/// With more free ends than this nothing is joined: the layer is a drawing.
const MOST_ENDS: usize = 400;
const MOST_SHARED: usize = 500;

#[derive(Debug, Default)]
pub(super) struct Trace {
    pub(super) pieces: Vec<Piece>,
    pub(super) open: Vec<Path>,
    pub(super) gaps: Vec<(Length, Point)>,
    pub(super) trimmed: Vec<(Length, Point)>,
}

/// Traces `strokes`, each with the width of its pen, and `areas`. `crossed` returns true if a track crosses
/// an edge; then the edge separates no boards.
pub(super) fn trace(
    strokes: &[(Stroke, Length)],
    areas: Vec<Path>,
    crossed: &dyn Fn(Stroke) -> bool,
) -> Trace {
    let drawn: Vec<Stroke> = strokes.iter().map(|(stroke, _)| *stroke).collect();
    let areas: Vec<Path> = areas.into_iter().map(shut).collect();
    let mut rows = once(&drawn);
    rows.extend(
        areas.iter().flat_map(|path| path.pieces()).filter(|&(from, to)| from != to.to() || is_arc(to)),
    );
    let rows = once(&rows);
    let found = if rows.len() > MOST_STROKES { None } else { net(&rows) };
    let Some(found) = found.filter(|net| !is_simple(net, &rows)) else { return plain(&drawn, areas) };
    let widths = widths(&rows, strokes);
    let drawn_count = rows.len();
    let (mut rows, mut found) = (rows, found);
    // Join nearly meeting ends first. A line end that then remains is an overshoot; a wide pen must not join
    // it.
    for most in [NEAR, MOST_NEAR] {
        let joins = joins(&found, &widths, most);
        rows.extend(joins.iter().map(|&(from, to)| (from, PathSegment::Line { to })));
        if !joins.is_empty() {
            let Some(next) = net(&rows) else { return plain(&drawn, areas) };
            found = next;
        }
    }
    let mut made = faces(&found, &[]);
    let mut dropped = Vec::new();
    if made.shared.len() <= MOST_SHARED {
        // If a track crosses any part of a line, no part of the line separates boards.
        let drawn_by = |edge: usize| found.edges.get(edge).map(|edge| edge.stroke);
        let is_crossed = |edge: &&usize| stroke(&found, **edge).is_some_and(crossed);
        let crossed: BTreeSet<Option<usize>> =
            made.shared.iter().filter(is_crossed).map(|&edge| drawn_by(edge)).collect();
        dropped = made.shared.iter().copied().filter(|&edge| crossed.contains(&drawn_by(edge))).collect();
    }
    if !dropped.is_empty() {
        made = faces(&found, &dropped);
    }
    finish(&found, made, &dropped, drawn_count)
}

/// True if all strokes join in pairs without crossings: then there is nothing to split.
fn is_simple(net: &Net, rows: &[Stroke]) -> bool {
    net.doubles.is_empty() && net.edges.len() == rows.len() && net.degrees().iter().all(|&degree| degree == 2)
}

/// Chains strokes without splitting.
fn plain(strokes: &[Stroke], areas: Vec<Path>) -> Trace {
    let (mut closed, open) = contours(strokes);
    closed.extend(areas);
    Trace { pieces: closed.into_iter().filter_map(alone).collect(), open, ..Trace::default() }
}

fn is_arc(segment: PathSegment) -> bool {
    matches!(segment, PathSegment::Arc { .. })
}

fn stroke(net: &Net, edge: usize) -> Option<Stroke> {
    net.edges.get(edge).map(|edge| (edge.from, edge.segment))
}

/// The pen of each row: the widest of those that drew it.
fn widths(rows: &[Stroke], strokes: &[(Stroke, Length)]) -> Vec<Length> {
    let mut known: BTreeMap<_, Length> = BTreeMap::new();
    for (stroke, width) in strokes {
        let widest = known.entry(outline::same(stroke)).or_default();
        *widest = (*widest).max(*width);
    }
    rows.iter().map(|row| known.get(&outline::same(row)).copied().unwrap_or_default()).collect()
}

#[derive(Clone, Copy)]
struct FreeEnd {
    node: usize,
    at: Point,
    edge: usize,
    width: Length,
}

/// Straight lines that join free ends with each other, or with a stroke that they nearly reach.
fn joins(net: &Net, widths: &[Length], most: Length) -> Vec<(Point, Point)> {
    let degrees = net.degrees();
    let mut ends: Vec<FreeEnd> = Vec::new();
    for (index, edge) in net.edges.iter().enumerate() {
        let branches =
            [edge.a, edge.b].iter().any(|&node| degrees.get(node).is_some_and(|&degree| degree > 2));
        if most > NEAR && branches && length_mm(net, index) < OVERSHOOT_MM {
            continue;
        }
        for node in [edge.a, edge.b].into_iter().filter(|&node| degrees.get(node) == Some(&1)) {
            let at = if node == edge.a { edge.from } else { edge.segment.to() };
            let width = widths.get(edge.stroke).copied().unwrap_or_default();
            ends.push(FreeEnd { node, at, edge: index, width });
        }
    }
    if ends.len() > MOST_ENDS {
        return Vec::new();
    }
    let (mut joins, taken) = pairs(net, &ends, most);
    for (_, end) in ends.iter().enumerate().filter(|(at, _)| !taken.contains(at)) {
        joins.extend(to_edge(net, &degrees, end, (widths, most)).map(|to| (end.at, to)));
    }
    joins
}

/// Joins free ends in pairs, the nearest first; also returns the joined ends.
fn pairs(net: &Net, ends: &[FreeEnd], most: Length) -> (Vec<(Point, Point)>, Vec<usize>) {
    let mut close: Vec<(f64, usize, usize)> = Vec::new();
    for (one, a) in ends.iter().enumerate() {
        for (two, b) in ends.iter().enumerate().skip(one + 1) {
            let apart = a.at.distance_mm(b.at);
            let own = a.edge == b.edge && length_mm(net, a.edge) < LEAST_CLOSED_MM;
            if apart <= reach(a.width, b.width, most).mm() && !own && a.node != b.node {
                close.push((apart, one, two));
            }
        }
    }
    close.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let (mut joins, mut taken) = (Vec::new(), Vec::new());
    for (_, one, two) in close {
        if taken.contains(&one) || taken.contains(&two) {
            continue;
        }
        taken.extend([one, two]);
        joins.extend(ends.get(one).zip(ends.get(two)).map(|(a, b)| (a.at, b.at)));
    }
    (joins, taken)
}

/// The nearest point of another stroke that an end nearly reaches. An overshooting end reaches nothing.
fn to_edge(
    net: &Net,
    degrees: &[usize],
    end: &FreeEnd,
    (widths, most): (&[Length], Length),
) -> Option<Point> {
    let own = net.edges.get(end.edge)?;
    let other_end = if own.a == end.node { own.b } else { own.a };
    if degrees.get(other_end).is_some_and(|&degree| degree > 2) && length_mm(net, end.edge) < OVERSHOOT_MM {
        return None;
    }
    let near =
        net.edges.iter().enumerate().filter(|(index, _)| *index != end.edge).filter_map(|(_, edge)| {
            let place = nearest((edge.from, edge.segment), end.at);
            let width = widths.get(edge.stroke).copied().unwrap_or_default();
            let apart = place.distance_mm(end.at);
            (apart <= reach(end.width, width, most).mm()).then_some((apart, place))
        });
    near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, place)| place)
}

/// Largest gap between ends of two pens.
fn reach(one: Length, two: Length, most: Length) -> Length {
    let both = Length::from_nm((one.nm() + two.nm()) / 2);
    both.min(most).max(NEAR)
}

fn length_mm(net: &Net, edge: usize) -> f64 {
    let path = stroke(net, edge).map(|(start, segment)| Path { start, segments: vec![segment] });
    path.map_or(0.0, |path| path.length_mm())
}

/// Classifies the rest: gaps that closed a loop, trimmed ends, and open lines.
fn finish(net: &Net, made: Faces, dropped: &[usize], drawn: usize) -> Trace {
    let loose: Vec<usize> = made.loose.iter().chain(dropped).copied().collect();
    let mut lost = vec![false; net.edges.len()];
    for &edge in &loose {
        if let Some(flag) = lost.get_mut(edge) {
            *flag = true;
        }
    }
    let mut on_rim = vec![false; net.nodes.len()];
    let mut gaps = Vec::new();
    for (edge, _) in net.edges.iter().zip(&lost).filter(|(_, lost)| !**lost) {
        for node in [edge.a, edge.b] {
            if let Some(flag) = on_rim.get_mut(node) {
                *flag = true;
            }
        }
        if edge.stroke >= drawn {
            gaps.push((Length::from_mm(edge.from.distance_mm(edge.segment.to())), edge.from));
        }
    }
    let (mut trimmed, rest) = trims(net, &loose, &on_rim);
    trimmed.extend(&net.doubles);
    let strokes: Vec<Stroke> = rest.iter().filter_map(|&edge| stroke(net, edge)).collect();
    Trace { pieces: made.pieces, open: joined(contours(&strokes).1), gaps, trimmed }
}

fn joined(mut open: Vec<Path>) -> Vec<Path> {
    let mut rest = Vec::new();
    if open.len() > MOST_ENDS {
        return open;
    }
    while let Some(mut path) = open.pop() {
        for _ in 0..2 {
            while let Some(at) =
                open.iter().position(|line| near(line.start, path.end()) || near(line.end(), path.end()))
            {
                let line = open.remove(at);
                let line = if near(line.start, path.end()) { line } else { line.reversed() };
                path.segments.extend(line.segments);
            }
            path = path.reversed();
        }
        rest.push(path);
    }
    rest
}

/// Splits loose edges: short groups attached to at most one node of a loop, which are trimmed; and the
/// others.
fn trims(net: &Net, loose: &[usize], on_rim: &[bool]) -> (Vec<(Length, Point)>, Vec<usize>) {
    let is_rim = |node: usize| on_rim.get(node) == Some(&true);
    // Edges that meet at a node of no loop form one group.
    let mut group_of: BTreeMap<usize, usize> = BTreeMap::new();
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for &index in loose {
        let Some(edge) = net.edges.get(index) else { continue };
        let free = [edge.a, edge.b].into_iter().filter(|&node| !is_rim(node));
        let mut own = vec![index];
        for node in free.clone() {
            if let Some(&group) = group_of.get(&node) {
                own.append(groups.get_mut(group).map_or(&mut Vec::new(), |edges| edges));
            }
        }
        let group = groups.len();
        let ends = own.iter().filter_map(|&index| net.edges.get(index)).flat_map(|edge| [edge.a, edge.b]);
        for node in ends.filter(|&node| !is_rim(node)) {
            group_of.insert(node, group);
        }
        groups.push(own);
    }
    let (mut trimmed, mut rest) = (Vec::new(), Vec::new());
    for group in groups.into_iter().filter(|group| !group.is_empty()) {
        let edges: Vec<&Edge> = group.iter().filter_map(|&index| net.edges.get(index)).collect();
        let rim = edges.iter().flat_map(|edge| [edge.a, edge.b]).filter(|&node| is_rim(node));
        let rim: Vec<Point> = rim.filter_map(|node| net.nodes.get(node).copied()).collect();
        let long: f64 = group.iter().map(|&index| length_mm(net, index)).sum();
        match rim[..] {
            [at] if long < OVERSHOOT_MM => trimmed.push((Length::from_mm(long), at)),
            _ => rest.extend(group),
        }
    }
    (trimmed, rest)
}

/// Rounded corners with overlong lines or arcs: several lengths, radii and angles.
#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::path_area_mm2;
    use std::f64::consts::PI;

    /// A rectangle of 40 × 28 mm with rounded corners, rotated by `turn` rad. Its lines run past the arcs by
    /// `line` mm, its arcs past the lines by `arc` mm.
    fn rounded(radius: f64, line: f64, arc: f64, turn: f64, step_mm: f64) -> Vec<(Stroke, Length)> {
        let (sin, cos) = turn.sin_cos();
        let round = |value: f64| (value / step_mm).round() * step_mm;
        let at = |x: f64, y: f64| Point::from_mm(round(x * cos - y * sin), round(x * sin + y * cos));
        let (left, right, low, high) = (radius, 40.0 - radius, radius, 28.0 - radius);
        let lines = [
            [(left - line, 0.0), (right + line, 0.0)],
            [(40.0, low - line), (40.0, high + line)],
            [(right + line, 28.0), (left - line, 28.0)],
            [(0.0, high + line), (0.0, low - line)],
        ];
        let mut strokes: Vec<Stroke> =
            lines.map(|[a, b]| (at(a.0, a.1), PathSegment::Line { to: at(b.0, b.1) })).to_vec();
        let past = arc / radius;
        for (x, y, from) in [(right, low, 1.5), (right, high, 0.0), (left, high, 0.5), (left, low, 1.0)] {
            let on = |angle: f64| at(x + radius * libm::cos(angle), y + radius * libm::sin(angle));
            let (from, to) = (on(from * PI - past), on((from + 0.5) * PI + past));
            strokes.push((from, PathSegment::Arc { to, centre: at(x, y), clockwise: false }));
        }
        strokes.into_iter().map(|stroke| (stroke, Length::from_um(150))).collect()
    }

    #[test]
    fn overlong_ends_at_rounded_corners_are_trimmed() {
        let lengths = [0.0, 0.004, 0.01, 0.012, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.45];
        for radius in [0.5, 1.0, 3.0, 8.0] {
            // Longer lines nearly meet in a sharp corner, which is then a second edge.
            for length in lengths.into_iter().filter(|length| *length < 0.7 * radius) {
                for (turn, step) in [(0.0, 1e-4), (0.0, 2.54e-3), (0.23, 1e-4), (0.7, 1e-6), (1.0, 1e-3)] {
                    for (line, arc) in [(length, 0.0), (0.0, length), (length, length)] {
                        let row = format!("r {radius}, line +{line}, arc +{arc}, turn {turn}, step {step}");
                        let traced = trace(&rounded(radius, line, arc, turn, step), Vec::new(), &|_| false);
                        assert_eq!(traced.open.len(), 0, "{row}: {:?}", traced.open);
                        assert_eq!(traced.pieces.len(), 1, "{row}");
                        let area = path_area_mm2(&traced.pieces[0].rim).abs();
                        let whole = 40.0 * 28.0 - (4.0 - PI) * radius * radius;
                        assert!((area - whole).abs() < 1.0, "{row}: {area} of {whole}");
                        // Up to 15 µm, rounding decides whether an end is trimmed or joined.
                        let is_certain = length == 0.0 || length > 0.015;
                        assert!(!is_certain || traced.trimmed.is_empty() == (length == 0.0), "{row}");
                    }
                }
            }
        }
    }
}
