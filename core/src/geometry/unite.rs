//! Unites outlines of one colour, even very many overlapping ones, within a budget of work.
//!
//! ```text
//!   few crossings     all outlines at once
//!   many crossings    ●●●●│●●●●     outlines sorted by position, neighbours united first: a thousand pads
//!                     ●●●●│●●●●     become a few edges before they meet the next thousand
//!                         └── then the unions whose boxes overlap
//! ```
//!
//! Work is counted, not timed, so results are the same on every machine.

use super::afford::{Fuel, afford};
use super::clusters::{Extent, NOTHING, clusters, with};
use super::overlay::{Edge, Fill, Pile, Shape, edges_of, extent_of, trace};

/// Limit of work for each edge, up to which all outlines are united at once: an edge costs 1, a crossing 2.
const QUICK: u64 = 8;
/// A failed count costs the limit divided by this.
const IN_VAIN: u64 = 4;
/// Minimum limit of work for uniting all outlines at once.
const LEAST: u64 = 20_000;
/// Edges that are united at once when sorted by position.
const LEAF_EDGES: usize = 400;
const FAN: usize = 16;
/// Bits of a position along each axis when sorting.
const BITS: u32 = 16;

struct Part<'p> {
    first: usize,
    outlines: &'p [&'p [Edge]],
    extent: Extent,
    edges: usize,
}

/// The area inside a pile of outlines that have their inside on the left, as shapes that do not overlap.
/// Fails with the index of the outline at which the fuel ran out.
pub(super) fn united(pile: &Pile, fuel: &mut Fuel) -> Result<Vec<Shape>, usize> {
    let limit = LEAST.max(QUICK * pile.edges.len() as u64).min(fuel.left());
    let mut quick = Fuel::new(limit);
    if afford(pile, 0, &mut quick).is_ok() {
        fuel.spend(limit - quick.left());
        return Ok(trace(pile, Fill::NonZero));
    }
    fuel.spend((limit / IN_VAIN).min(fuel.left()));
    by_place(&pile.outlines().collect::<Vec<_>>(), fuel)
}

/// The area inside outlines: sorted by position, neighbours united first.
fn by_place(outlines: &[&[Edge]], fuel: &mut Fuel) -> Result<Vec<Shape>, usize> {
    let mut parts = parts(outlines);
    let all = parts.iter().fold(NOTHING, |all, part| joined(all, part.extent));
    parts.sort_by_cached_key(|part| (part.edges > LEAF_EDGES, curve(part.extent, all), part.first));
    // Large parts last, or a zone would be united again with every few pads.
    let (small, large) = parts.split_at(parts.partition_point(|part| part.edges <= LEAF_EDGES));
    let first = large.first().map_or(0, |part| part.first);
    let unions = vec![gathered(small, fuel)?, gathered(large, fuel)?];
    together(unions, first, fuel)
}

fn extent(outline: &[Edge]) -> Extent {
    outline.iter().fold(NOTHING, |extent, edge| with(extent, edge.a.x, edge.a.y))
}

fn joined(one: Extent, other: Extent) -> Extent {
    if other[0] > other[2] { one } else { with(with(one, other[0], other[1]), other[2], other[3]) }
}

fn holds(outer: Extent, inner: Extent) -> bool {
    outer[0] <= inner[0] && outer[1] <= inner[1] && outer[2] >= inner[2] && outer[3] >= inner[3]
}

/// Twice the area inside an outline, in nm²; below zero for a hole.
fn area2(outline: &[Edge]) -> f64 {
    let Some(origin) = outline.first().map(|edge| edge.a) else { return 0.0 };
    let from = |x: i32, y: i32| (f64::from(x) - f64::from(origin.x), f64::from(y) - f64::from(origin.y));
    let cross = |edge: &Edge| {
        let (a, b) = (from(edge.a.x, edge.a.y), from(edge.b.x, edge.b.y));
        a.0 * b.1 - a.1 * b.0
    };
    outline.iter().map(cross).sum()
}

/// The outlines as parts: a hole joins all outlines from the one before it that contains it.
fn parts<'p>(outlines: &'p [&'p [Edge]]) -> Vec<Part<'p>> {
    let mut starts: Vec<usize> = Vec::new();
    let extents: Vec<Extent> = outlines.iter().map(|outline| extent(outline)).collect();
    let of = |at: usize| extents.get(at).copied().unwrap_or(NOTHING);
    for (number, outline) in outlines.iter().enumerate() {
        if area2(outline) >= 0.0 {
            starts.push(number);
            continue;
        }
        while let Some(&start) = starts.last() {
            if (start..number).any(|before| holds(of(before), of(number))) || starts.len() == 1 {
                break;
            }
            starts.pop();
        }
        if starts.is_empty() {
            starts.push(number);
        }
    }
    let ends = starts.iter().skip(1).copied().chain([outlines.len()]);
    let part = |(start, end): (usize, usize)| {
        let own = outlines.get(start..end).unwrap_or_default();
        let extent = (start..end).fold(NOTHING, |all, at| joined(all, of(at)));
        Part { first: start, outlines: own, extent, edges: own.iter().map(|outline| outline.len()).sum() }
    };
    starts.iter().copied().zip(ends).map(part).collect()
}

/// The position of a box's centre on a Z-order curve: near on the curve is near in the plane.
fn curve(of: Extent, all: Extent) -> u64 {
    let share = |low: i32, high: i32, from: i32, to: i32| {
        let wide = (i64::from(to) - i64::from(from)).max(1);
        let middle = (i64::from(low) + i64::from(high)) / 2 - i64::from(from);
        (middle.clamp(0, wide) * ((1 << BITS) - 1) / wide).unsigned_abs()
    };
    let (x, y) = (share(of[0], of[2], all[0], all[2]), share(of[1], of[3], all[1], all[3]));
    (0..BITS).map(|bit| ((x >> bit & 1) << (2 * bit)) | ((y >> bit & 1) << (2 * bit + 1))).sum()
}

/// The union of parts sorted by position: neighbours first, then all.
fn gathered(parts: &[Part<'_>], fuel: &mut Fuel) -> Result<Vec<Shape>, usize> {
    let edges: usize = parts.iter().map(|part| part.edges).sum();
    let Some(first) = parts.first() else { return Ok(Vec::new()) };
    if edges <= LEAF_EDGES || parts.len() == 1 {
        let outlines = parts.iter().flat_map(|part| part.outlines);
        return checked(outlines.map(|outline| outline.iter().copied()), first.first, fuel);
    }
    let mut before = 0;
    let bins: Vec<(usize, usize)> = parts
        .iter()
        .enumerate()
        .map(|(number, part)| {
            let bin = before * FAN / edges;
            before += part.edges;
            (bin, number)
        })
        .collect();
    // If one part has nearly all edges, halve by number instead.
    let is_one = bins.first().map(|first| first.0) == bins.last().map(|last| last.0);
    let bin = |&(bin, number): &(usize, usize)| if is_one { 2 * number / parts.len() } else { bin };
    let mut unions = Vec::new();
    for own in bins.chunk_by(|one, other| bin(one) == bin(other)) {
        let start = own.first().map_or(0, |first| first.1);
        unions.push(gathered(parts.get(start..start + own.len()).unwrap_or_default(), fuel)?);
    }
    together(unions, first.first, fuel)
}

/// The union of unions: overlays only shapes of different unions that have overlapping boxes.
fn together(unions: Vec<Vec<Shape>>, outline: usize, fuel: &mut Fuel) -> Result<Vec<Shape>, usize> {
    let owners: Vec<usize> = unions
        .iter()
        .enumerate()
        .flat_map(|(number, union)| std::iter::repeat_n(number, union.len()))
        .collect();
    let mut all: Vec<Option<Shape>> = unions.into_iter().flatten().map(Some).collect();
    let extents: Vec<Extent> = all.iter().flatten().map(extent_of).collect();
    let mut found = Vec::new();
    for group in clusters(&extents) {
        let owner = |at: &usize| owners.get(*at);
        let is_one = group.windows(2).all(|pair| pair.first().and_then(owner) == pair.last().and_then(owner));
        let shapes: Vec<Shape> =
            group.into_iter().filter_map(|at| all.get_mut(at).and_then(Option::take)).collect();
        if is_one {
            found.extend(shapes);
        } else {
            found.extend(checked(shapes.iter().map(edges_of), outline, fuel)?);
        }
    }
    Ok(found)
}

/// The area inside outlines, if there is fuel for it.
fn checked<E: Iterator<Item = Edge>>(
    outlines: impl Iterator<Item = E>,
    outline: usize,
    fuel: &mut Fuel,
) -> Result<Vec<Shape>, usize> {
    let mut pile = Pile::default();
    for edges in outlines {
        pile.edges.extend(edges);
        pile.ends.push(pile.edges.len());
    }
    afford(&pile, 0, fuel).map_err(|_| outline)?;
    Ok(trace(&pile, Fill::NonZero))
}

#[cfg(test)]
mod tests {
    use super::super::combine::together as all_at_once;
    use super::super::overlay::Overlay;
    use super::super::{CombineRule, Path, Point, Region, area_mm2, circle, combine, rebuild};
    use super::*;
    use crate::chance::Chance;
    use crate::units::Length;

    /// Discs and rings at random positions in a square.
    fn heap(count: usize, side_um: usize) -> Vec<Path> {
        let mut chance = Chance::new(5);
        let mut outlines = Vec::new();
        for number in 0..count {
            let mut at = || chance.below(side_um) as f64 / 1_000.0;
            let centre = Point::from_mm(at(), at());
            outlines.push(circle(centre, Length::from_um(400)));
            if number % 3 == 0 {
                outlines.push(circle(centre, Length::from_um(250)).reversed());
            }
        }
        outlines
    }

    fn region(shapes: &[Shape], overlay: &Overlay) -> Region {
        rebuild::region(shapes, &overlay.circles, 100.0)
    }

    #[test]
    fn union_of_a_heap_by_position_has_the_same_area() {
        for (count, side_um) in [(500, 2_000), (700, 6_000), (60, 500)] {
            let outlines = heap(count, side_um);
            let mut overlay = Overlay::default();
            outlines.iter().for_each(|outline| overlay.path(outline));
            let pile = overlay.take();
            let all: Vec<&[Edge]> = pile.outlines().collect();
            let found = by_place(&all, &mut Fuel::new(u64::MAX)).unwrap();
            let off =
                area_mm2(&combine(&region(&found, &overlay), &all_at_once(&outlines), CombineRule::Xor));
            assert!(off < 1e-4, "{count}: {off} mm² differ");
        }
    }

    #[test]
    fn union_cost_is_linear_in_edges() {
        let outlines = heap(1_500, 1_500);
        let mut overlay = Overlay::default();
        outlines.iter().for_each(|outline| overlay.path(outline));
        let pile = overlay.take();
        let mut fuel = Fuel::new(u64::MAX);
        united(&pile, &mut fuel).unwrap();
        let spent = u64::MAX - fuel.left();
        assert!(spent < 40 * pile.edges.len() as u64, "{spent} for {} edges", pile.edges.len());
        assert!(united(&pile, &mut Fuel::new(spent / 2)).is_err());
    }
}
