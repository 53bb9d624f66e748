//! Merges overlapping toolpaths of neighbours: a stretch in both is cut once.
//!
//! ```text
//!   ▓▓▓▓╭┄╮╭┄╮▓▓▓▓      islands exactly one cut apart: both toolpaths run through the gap, a few µm apart.
//!   ▓▓▓▓┊ ┊┊ ┊▓▓▓▓      The second omits that stretch. If it overlaps the first completely, it is removed.
//!   ▓▓▓▓╰┄╯╰┄╯▓▓▓▓
//! ```
//!
//! Every omitted stretch costs a retract and a plunge, so only long ones are omitted.
//!
//! Open toolpaths are unchanged.

use super::cut;
use crate::geometry::{Path, PathSegment, Point, chords};
use crate::units::Length;
use std::collections::BTreeSet;
use std::f64::consts::TAU;

/// Toolpaths this near to each other cut equally: each is within 2 µm of its ideal.
const SAME: Length = Length::from_um(5);
const LEAST_MM: f64 = 0.2;
/// The longest stretch of a toolpath is omitted, and others only if longer than this, in mm.
const WORTH_MM: f64 = 8.0;
/// Stretches this near to each other, in mm, are merged; a shorter rest is dropped.
const JOINED_MM: f64 = 0.02;

/// Lines or circles this near to each other may have overlapping edges: [`SAME`] across a slanting line.
const NEAR: Length = Length::from_um(8);
/// Lines with slopes that differ by less than 1 over this are compared.
const SLOPE_PARTS: f64 = 1e3;
/// From this slope on a line counts as vertical; not 1, which many lines have.
const STEEP_SLOPE: f64 = 0.84;
/// Offset of the grid for centres of arcs, in nm: centres are usually on whole micrometres, so the grid lines
/// must not be.
const BESIDE: i64 = 1_700;

/// Lengths along a closed path in mm; the end may be beyond its start.
type Stretch = (f64, f64);
type Edge = (u32, u32);

/// An edge by its carrier: a line of about this slope, or a circle about this centre.
struct Row {
    carrier: (u8, i64, i64),
    /// Position of the line on its axis, or the radius; in nm.
    at: i64,
    /// How much it moves on its axis for each nm along the other one.
    slope: f64,
    /// What it covers of the axis that it runs along, in nm.
    from: i64,
    to: i64,
    edge: Edge,
}

impl Row {
    /// True if the two are at most [`NEAR`] apart where they overlap: rows of one carrier may be far apart.
    fn is_near(&self, other: &Self) -> bool {
        let along = self.from.max(other.from) as f64;
        let by = (self.at - other.at) as f64 + (self.slope - other.slope) * along;
        by.abs() <= NEAR.nm() as f64
    }
}

/// `toolpaths` without what one of them cuts as well as another one. The order of `toolpaths` does not matter.
pub(super) fn once(toolpaths: Vec<Path>) -> Vec<Path> {
    let mut is_any = false;
    beside(&toolpaths, &mut |_, _| {
        is_any = true;
        false
    });
    if !is_any {
        return toolpaths;
    }
    let mut toolpaths: Vec<Path> =
        toolpaths.into_iter().map(|way| if way.is_closed() { way.from_its_left() } else { way }).collect();
    toolpaths.sort_unstable();
    let pairs = pairs(&toolpaths);
    let mut rest = pairs.as_slice();
    let mut gone: BTreeSet<Edge> = BTreeSet::new();
    let mut out = Vec::new();
    for (number, way) in (0..).zip(&toolpaths) {
        let (own, others) = rest.split_at(rest.partition_point(|(edge, _)| edge.0 <= number));
        rest = others;
        let total = way.length_mm();
        let found = doubled(way, own, &toolpaths, &gone);
        let chosen = chosen(joined(&found, total), total);
        if chosen.is_empty() {
            out.push(way.clone());
            continue;
        }
        let cut = found.iter().filter(|(_, own)| chosen.iter().any(|one| meet(*own, *one, total)));
        gone.extend(cut.map(|(edge, _)| *edge));
        out.extend(without(way, &chosen, total));
    }
    out
}

/// Pairs of edges of closed toolpaths on one line or circle that may overlap; the edge of the later toolpath
/// first. In order.
fn pairs(toolpaths: &[Path]) -> Vec<(Edge, Edge)> {
    let mut found = Vec::new();
    beside(toolpaths, &mut |row, other| {
        if row.is_near(other) {
            found.push((row.edge.max(other.edge), row.edge.min(other.edge)));
        }
        true
    });
    found.sort_unstable();
    found
}

/// Calls `each` with every pair of neighbours on about the same line or circle, until `each` returns false. A large board has many
/// more such pairs than edges that overlap, because many of its lines are about the same.
fn beside(toolpaths: &[Path], each: &mut dyn FnMut(&Row, &Row) -> bool) {
    let closed = || (0..).zip(toolpaths).filter(|(_, way)| way.is_closed());
    let mut rows: Vec<Row> = Vec::with_capacity(closed().map(|(_, way)| way.segments.len()).sum());
    for (number, way) in closed() {
        rows.extend((0..).zip(way.pieces()).filter_map(|(segment, piece)| row((number, segment), piece)));
    }
    rows.sort_unstable_by_key(|row| (row.carrier, row.at, row.edge));
    let apart = |a: &Row, b: &Row| a.carrier != b.carrier || b.at - a.at > NEAR.nm();
    for together in rows.chunk_by_mut(|a, b| !apart(a, b)).filter(|rows| rows.len() > 1) {
        together.sort_unstable_by_key(|row| (row.from, row.edge));
        let mut open: Vec<&Row> = Vec::new();
        for row in &*together {
            open.retain(|other| other.to > row.from);
            for other in open.iter().filter(|other| other.edge.0 != row.edge.0) {
                if !each(row, other) {
                    return;
                }
            }
            open.push(row);
        }
    }
}

/// The carrier of an edge; `None` for edges too short to compare.
fn row(edge: Edge, (from, segment): (Point, PathSegment)) -> Option<Row> {
    match segment {
        PathSegment::Line { to } => {
            let (dx, dy) = ((to.x - from.x).mm(), (to.y - from.y).mm());
            if dx.abs().max(dy.abs()) < JOINED_MM {
                return None;
            }
            let upright = dy.abs() > STEEP_SLOPE * dx.abs();
            let (along, across, slope) =
                if upright { ((from.y, to.y), from.x, dx / dy) } else { ((from.x, to.x), from.y, dy / dx) };
            let foot = across.mm() - slope * along.0.mm();
            Some(Row {
                carrier: (u8::from(upright), libm::round(slope * SLOPE_PARTS) as i64, 0),
                at: Length::from_mm(foot).nm(),
                slope,
                from: along.0.min(along.1).nm(),
                to: along.0.max(along.1).nm(),
                edge,
            })
        }
        PathSegment::Arc { centre, .. } => {
            let cell = |length: Length| (length.nm() + BESIDE).div_euclid(NEAR.nm());
            let radius = Length::from_mm(from.distance_mm(centre)).nm();
            let carrier = (2, cell(centre.x), cell(centre.y));
            Some(Row { carrier, at: radius, slope: 0.0, from: 0, to: 1, edge })
        }
    }
}

/// Stretches of `way` that earlier toolpaths also cut, from `pairs`, with their edges of `way`.
fn doubled(
    way: &Path,
    pairs: &[(Edge, Edge)],
    toolpaths: &[Path],
    gone: &BTreeSet<Edge>,
) -> Vec<(Edge, Stretch)> {
    let mut found = Vec::new();
    let mut rest = pairs;
    let mut begin = 0.0;
    for (segment, (from, piece)) in (0..).zip(way.pieces()) {
        if rest.is_empty() {
            break;
        }
        let own = cut::length(from, piece);
        let (here, others) = rest.split_at(rest.partition_point(|(edge, _)| edge.1 <= segment));
        rest = others;
        for (edge, other) in here.iter().filter(|(_, other)| !gone.contains(other)) {
            let way = toolpaths.get(other.0 as usize);
            let Some(beside) = way.and_then(|way| way.pieces().nth(other.1 as usize)) else { continue };
            let shares = covered((from, piece), beside);
            found.extend(shares.into_iter().map(|(a, b)| (*edge, (begin + a * own, begin + b * own))));
        }
        begin += own;
    }
    found
}

/// The shares of a piece along which another one runs in the opposite direction.
fn covered(one: (Point, PathSegment), other: (Point, PathSegment)) -> Vec<(f64, f64)> {
    let found = match (one.1, other.1) {
        (PathSegment::Line { to }, PathSegment::Line { to: others }) => {
            beside_line((one.0, to), (other.0, others))
        }
        (
            PathSegment::Arc { to, centre, clockwise },
            PathSegment::Arc { to: others, centre: middle, clockwise: turned },
        ) if clockwise != turned => {
            let far = one.0.distance_mm(centre) - other.0.distance_mm(middle);
            let same = SAME.mm();
            if centre.distance_mm(middle) > same / 2.0 || far.abs() > same {
                return Vec::new();
            }
            let angle =
                |at: Point, centre: Point| libm::atan2((at.y - centre.y).mm(), (at.x - centre.x).mm());
            let sign = if clockwise { -1.0 } else { 1.0 };
            let turn = chords::turn(one.0, to, centre, clockwise);
            let others_turn = chords::turn(other.0, others, middle, turned);
            let first = (sign * (angle(others, middle) - angle(one.0, centre))).rem_euclid(TAU);
            // The other one may start before this one.
            [first, first - TAU].map(|first| (first / turn, (first + others_turn) / turn)).to_vec()
        }
        _ => Vec::new(),
    };
    let within = |(a, b): (f64, f64)| (a.max(0.0), b.min(1.0));
    found.into_iter().map(within).filter(|(a, b)| a < b).collect()
}

fn beside_line((from, to): (Point, Point), (start, end): (Point, Point)) -> Vec<(f64, f64)> {
    let length = from.distance_mm(to).max(1e-9);
    let (x, y) = ((to.x - from.x).mm() / length, (to.y - from.y).mm() / length);
    let seen = |at: Point| {
        let (dx, dy) = ((at.x - from.x).mm(), (at.y - from.y).mm());
        (dx * x + dy * y, x * dy - y * dx)
    };
    let ((first, off), (last, way_off)) = (seen(start), seen(end));
    let near = off.abs() <= SAME.mm() && way_off.abs() <= SAME.mm();
    if near && last < first { vec![(last / length, first / length)] } else { Vec::new() }
}

/// Merges touching stretches of a closed toolpath of length `total`.
fn joined(found: &[(Edge, Stretch)], total: f64) -> Vec<Stretch> {
    let mut sorted: Vec<Stretch> = found.iter().map(|(_, stretch)| *stretch).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut out: Vec<Stretch> = Vec::new();
    for (begin, end) in sorted {
        match out.last_mut().filter(|last| begin <= last.1 + JOINED_MM) {
            Some(last) => last.1 = last.1.max(end),
            None => out.push((begin, end)),
        }
    }
    // A stretch at the end of the path continues at its start.
    if let (Some(first), Some(last)) = (out.first().copied(), out.last_mut())
        && first.0 <= JOINED_MM
        && last.1 >= total - JOINED_MM
        && first != *last
    {
        last.1 = total + first.1;
        out.remove(0);
    }
    out
}

/// The stretches worth omitting, the longest first.
fn chosen(mut stretches: Vec<Stretch>, total: f64) -> Vec<Stretch> {
    let length = |stretch: &Stretch| stretch.1 - stretch.0;
    stretches.retain(|stretch| length(stretch) >= LEAST_MM.min(total - JOINED_MM));
    stretches.sort_by(|a, b| length(b).total_cmp(&length(a)).then(a.0.total_cmp(&b.0)));
    let worth = stretches.iter().skip(1).take_while(|stretch| length(stretch) > WORTH_MM).count();
    stretches.truncate(1 + worth);
    stretches
}

fn meet(one: Stretch, other: Stretch, total: f64) -> bool {
    let apart = |one: Stretch, by: f64| one.1 + by <= other.0 || other.1 <= one.0 + by;
    !(apart(one, 0.0) && apart(one, total))
}

fn without(way: &Path, chosen: &[Stretch], total: f64) -> Vec<Path> {
    let Some(&(begin, end)) = chosen.first() else { return vec![way.clone()] };
    if end - begin >= total - JOINED_MM {
        return Vec::new();
    }
    // Opened at the end of the longest stretch.
    let opened = match end.rem_euclid(total) {
        start if end >= total => cut::between(way, start, begin),
        start => {
            let (last, first) = (cut::between(way, start, total), cut::between(way, 0.0, begin));
            match (last, first) {
                (Some(mut last), Some(first)) => {
                    last.segments.extend(first.segments);
                    Some(last)
                }
                (last, first) => last.or(first),
            }
        }
    };
    let Some(opened) = opened else { return Vec::new() };
    let mut others: Vec<Stretch> = chosen
        .iter()
        .skip(1)
        .map(|other| ((other.0 - end).rem_euclid(total), other.1 - other.0))
        .map(|(from, length)| (from, from + length))
        .collect();
    others.sort_by(|a, b| a.0.total_cmp(&b.0));
    let ends = others.iter().map(|other| other.0).chain([opened.length_mm()]);
    let starts = [0.0].into_iter().chain(others.iter().map(|other| other.1));
    let pieces = starts.zip(ends).filter(|(from, to)| to - from > JOINED_MM);
    pieces.filter_map(|(from, to)| cut::between(&opened, from, to)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Bounds, circle, rectangle};

    fn boxed(x0: f64, y0: f64, x1: f64, y1: f64) -> Path {
        rectangle(Bounds::of(Point::from_mm(x0, y0)).with(Point::from_mm(x1, y1)))
    }

    fn total(toolpaths: &[Path]) -> f64 {
        toolpaths.iter().map(Path::length_mm).sum()
    }

    #[test]
    fn shared_stretches_of_two_toolpaths_are_cut_once() {
        let ring = |mm: f64| circle(Point::default(), Length::from_mm(mm));
        // The toolpaths, the number of toolpaths left, and their length.
        let rows: [(Vec<Path>, usize, f64); 10] = [
            (vec![boxed(0.0, 0.0, 2.0, 1.0), boxed(2.002, 0.0, 3.0, 1.0)], 2, 6.0 + 2.996),
            (vec![boxed(0.0, 0.0, 2.0, 1.0), boxed(2.0, 0.5, 3.0, 2.0)], 2, 6.0 + 4.5),
            (vec![boxed(0.0, 0.0, 2.0, 1.0), boxed(2.006, 0.0, 3.0, 1.0)], 2, 6.0 + 3.988),
            // Three in a row, and two short ones next to a long one.
            (vec![boxed(0.0, 0.0, 1.0, 1.0), boxed(1.0, 0.0, 2.0, 1.0), boxed(2.0, 0.0, 3.0, 1.0)], 3, 10.0),
            (
                vec![boxed(0.0, 0.0, 1.0, 9.0), boxed(1.0, 0.0, 2.0, 1.0), boxed(1.0, 3.0, 2.0, 5.0)],
                3,
                20.0 + 3.0 + 4.0,
            ),
            // Two that overlap completely: one is removed.
            (vec![ring(4.0), ring(3.996).reversed()], 1, TAU * 2.0),
            (vec![boxed(0.0, 0.0, 2.0, 1.0), boxed(0.0, 0.0, 2.0, 1.0).reversed()], 1, 6.0),
            // The middle one is last: long sides are worth a retract, short ones are not.
            (
                vec![boxed(0.0, 0.0, 20.0, 1.0), boxed(0.5, 1.0, 20.0, 2.0), boxed(0.0, 2.0, 20.0, 3.0)],
                4,
                86.0,
            ),
            (vec![boxed(0.0, 0.0, 2.0, 1.0), boxed(0.5, 1.0, 2.0, 2.0), boxed(0.0, 2.0, 2.0, 3.0)], 3, 15.5),
            // Two that touch in a corner share nothing.
            (vec![boxed(0.0, 0.0, 1.0, 1.0), boxed(1.0, 1.0, 2.0, 2.0)], 2, 8.0),
        ];
        for (row, (toolpaths, count, length)) in rows.into_iter().enumerate() {
            let mut backwards = toolpaths.clone();
            backwards.reverse();
            let left = once(toolpaths);
            assert_eq!(left.len(), count, "row {row}: {left:?}");
            assert!((total(&left) - length).abs() < 0.02, "row {row}: {} not {length}", total(&left));
            let sorted = |mut toolpaths: Vec<Path>| {
                toolpaths.sort_unstable();
                toolpaths
            };
            assert_eq!(sorted(once(backwards)), sorted(left), "row {row}: the order does not matter");
        }
    }

    /// Lines of one slope from equal islands on a grid: neighbours among them are nearer than [`NEAR`], but not where the islands are.
    #[test]
    fn parallel_edges_pair_only_if_adjacent() {
        let turned = |column: i64, row: i64| {
            let at = |x: i64, y: i64| {
                let nm = |nm: i64| Length::from_nm(nm);
                Point::new(nm(column * 130_000 + x), nm(row * 131_000 + y))
            };
            let corners = [at(0, 0), at(90_000, 27_000), at(63_000, 117_000), at(-27_000, 90_000), at(0, 0)];
            Path::through(&corners).expect("corners")
        };
        let toolpaths: Vec<Path> = (0..2_500).map(|number| turned(number % 50, number / 50)).collect();
        let mut beside_each_other = 0;
        beside(&toolpaths, &mut |_, _| {
            beside_each_other += 1;
            true
        });
        assert!(beside_each_other > 100_000, "{beside_each_other}");
        assert_eq!(pairs(&toolpaths), []);
        let twice = [toolpaths, vec![turned(7, 9).reversed()]].concat();
        assert_eq!(pairs(&twice).len(), 4);
    }

    #[test]
    fn stretches_across_the_start_are_joined() {
        let edge = (0, 0);
        let found = [(edge, (9.0, 10.0)), (edge, (0.0, 2.0)), (edge, (4.0, 4.1))];
        let stretches = joined(&found, 10.0);
        assert_eq!(stretches, [(4.0, 4.1), (9.0, 12.0)]);
        assert_eq!(chosen(stretches, 10.0), [(9.0, 12.0)]);
        assert!(meet((1.0, 1.5), (9.0, 12.0), 10.0) && !meet((2.0, 9.0), (9.0, 12.0), 10.0));
        let way = boxed(0.0, 0.0, 3.0, 2.0);
        let left = without(&way, &[(9.0, 12.0)], 10.0);
        assert_eq!(
            (left.len(), left[0].start, left[0].end()),
            (1, Point::from_mm(2.0, 0.0), Point::from_mm(0.0, 1.0))
        );
    }
}
