//! Narrow gaps: copper nearer than a width to other copper, or to itself across a clear channel.
//!
//! ```text
//!    ┌───────┐   ┌──────      ━━━━━━━┓          one entry for each connected gap, with its two
//!    │   a  p●───●q  b        ━━━p●━━┛          points
//!    └───────┘   └──────      ━━━q●━━┓
//!                             ━━━━━━━┛
//! ```
//!
//! Pairs of edges nearer than the width are gathered into gaps, if their nearest points see each other across
//! the clear. Pairs are neighbours if their edges are. A pair of one island counts only at a true minimum. In
//! an inner corner, for example, moving along an edge decreases the distance.
//!
//! Widths are exact to the nanometre. Gaps of one pair of islands nearer to each other than the width are
//! merged.

use super::clusters::{groups, unite};
use super::index::{Entry, Index, point};
use super::nearest::{Piece, nearest_pair};
use super::overlay::{Spot, apart};
use super::{Bounds, Point, Region};
use crate::units::Length;

/// Pairs tried for each gap, the narrowest first, until one has nothing in between.
const MOST_TRIES: usize = 8;
const LEVEL_SLOPE: f64 = 1e-3;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gap {
    /// Island on one side.
    pub a: usize,
    /// Island on the other side, not below `a`; equal to `a` for a gap within one island.
    pub b: usize,
    /// Point on `a`.
    pub from: Point,
    /// Point on `b`.
    pub to: Point,
    pub width: Length,
}

#[derive(Clone, Copy, Debug)]
struct Pair {
    edges: [usize; 2],
    places: [Spot; 2],
    width: f64,
}

struct Outlines<'a> {
    entries: &'a [Entry],
    around: Vec<[usize; 2]>,
}

fn outlines<'a>(region: &Region, entries: &'a [Entry]) -> Outlines<'a> {
    let mut around = Vec::with_capacity(entries.len());
    let mut first = 0;
    for path in region.paths() {
        let count = path.segments.len();
        around.extend((0..count).map(|at| [first + (at + count - 1) % count, first + (at + 1) % count]));
        first += count;
    }
    Outlines { entries, around }
}

fn dot(a: Spot, b: Spot) -> f64 {
    a.0 * b.0 + a.1 * b.1
}

fn cross(a: Spot, b: Spot) -> f64 {
    a.0 * b.1 - a.1 * b.0
}

impl Outlines<'_> {
    fn piece(&self, number: usize) -> Option<&Piece> {
        self.entries.get(number).map(|entry| &entry.piece)
    }

    fn neighbours(&self, number: usize) -> [usize; 2] {
        self.around.get(number).copied().unwrap_or([number; 2])
    }

    /// Directions into and out of a point on an edge. They differ at a corner.
    fn headings(&self, number: usize, place: Spot) -> Option<[Spot; 2]> {
        let piece = self.piece(number)?;
        let [before, after] = self.neighbours(number);
        if apart(place, piece.from) < 1.0 {
            Some([self.piece(before)?.heading(true), piece.heading(false)])
        } else if apart(place, piece.to) < 1.0 {
            Some([piece.heading(true), self.piece(after)?.heading(false)])
        } else {
            Some([piece.heading_at(place); 2])
        }
    }

    /// True if the direction `to` leads from a point on an edge into the clear. With `narrowest`, also no
    /// movement along the outline may decrease the distance.
    fn sees(&self, number: usize, place: Spot, to: Spot, narrowest: bool) -> bool {
        let Some([in_by, out_by]) = self.headings(number, place) else { return false };
        let (right_in, right_out) = (cross(in_by, to) < 0.0, cross(out_by, to) < 0.0);
        let convex = cross(in_by, out_by) > 0.0;
        let clear = if convex { right_in || right_out } else { right_in && right_out };
        clear && (!narrowest || dot(to, out_by) <= LEVEL_SLOPE && dot(to, in_by) >= -LEVEL_SLOPE)
    }

    /// The pair of two edges, if they see each other within `width` nm.
    fn pair(&self, one: &Entry, two: &Entry, width: f64) -> Option<Pair> {
        let (p, q) = nearest_pair(&one.piece, &two.piece);
        let distance = apart(p, q);
        if distance >= width || distance < 0.5 {
            return None;
        }
        let way = ((q.0 - p.0) / distance, (q.1 - p.1) / distance);
        let same = one.edge.island == two.edge.island;
        let back = (-way.0, -way.1);
        (self.sees(one.number(), p, way, same) && self.sees(two.number(), q, back, same)).then_some(Pair {
            edges: [one.number(), two.number()],
            places: [p, q],
            width: distance,
        })
    }

    fn island(&self, number: usize) -> usize {
        self.entries.get(number).map_or(0, |entry| entry.edge.island as usize)
    }
}

/// All pairs of edges nearer than `width`, in the order of their edges.
fn pairs(outlines: &Outlines<'_>, index: &Index, width: Length) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for entry in outlines.entries {
        let room = entry.bounds().grown(width);
        let others = index.entries_in(room).filter(|other| other.number() > entry.number());
        pairs.extend(others.filter_map(|other| outlines.pair(entry, other, width.nm() as f64)));
    }
    pairs.sort_by_key(|pair| pair.edges);
    pairs
}

/// Pairs gathered into places: each a list of indices, the narrowest first.
fn places(outlines: &Outlines<'_>, pairs: &[Pair]) -> Vec<Vec<usize>> {
    let mut parents: Vec<usize> = (0..pairs.len()).collect();
    for (index, pair) in pairs.iter().enumerate() {
        let [one, two] = pair.edges;
        let [one_before, one_after] = outlines.neighbours(one);
        let [two_before, two_after] = outlines.neighbours(two);
        for a in [one_before, one, one_after] {
            for b in [two_before, two, two_after] {
                let key = [a.min(b), a.max(b)];
                if let Ok(found) = pairs.binary_search_by_key(&key, |pair| pair.edges) {
                    unite(&mut parents, index, found);
                }
            }
        }
    }
    let width = |index: &usize| pairs.get(*index).map_or(f64::INFINITY, |pair| pair.width);
    let mut places = groups(&mut parents);
    places.iter_mut().for_each(|place| place.sort_by(|a, b| width(a).total_cmp(&width(b))));
    places
}

/// True if a third edge crosses the line between the two points.
fn is_blocked(index: &Index, pair: &Pair) -> bool {
    let [p, q] = pair.places;
    let inner = |share: f64| (p.0 + (q.0 - p.0) * share, p.1 + (q.1 - p.1) * share);
    let (from, to) = (inner(0.02), inner(0.98));
    let way = Piece { from, to, bow: None };
    let room = Bounds::of(point(from)).with(point(to));
    index.entries_in(room).filter(|entry| !pair.edges.contains(&entry.number())).any(|entry| {
        let (a, b) = nearest_pair(&way, &entry.piece);
        apart(a, b) < 1.0 || crosses(&way, &entry.piece)
    })
}

fn crosses(way: &Piece, piece: &Piece) -> bool {
    let heading = |from: Spot, to: Spot| (to.0 - from.0, to.1 - from.1);
    let along = heading(way.from, way.to);
    match piece.bow {
        None => {
            let over = heading(piece.from, piece.to);
            let sides =
                cross(along, heading(way.from, piece.from)) * cross(along, heading(way.from, piece.to));
            let ends = cross(over, heading(piece.from, way.from)) * cross(over, heading(piece.from, way.to));
            sides < 0.0 && ends < 0.0
        }
        Some(bow) => {
            let inside = |place: Spot| apart(place, bow.centre) < bow.radius_nm;
            inside(way.from) != inside(way.to) && {
                let middle = ((way.from.0 + way.to.0) / 2.0, (way.from.1 + way.to.1) / 2.0);
                let near = piece.nearest(middle);
                apart(near, middle) <= apart(way.from, way.to) / 2.0
            }
        }
    }
}

/// Merges gaps of one pair of islands nearer to each other than `width`; the narrowest stays.
fn joined(mut gaps: Vec<Gap>, width: Length) -> Vec<Gap> {
    gaps.sort_by_key(|gap| (gap.a, gap.b, gap.width, gap.from, gap.to));
    let mut kept: Vec<Gap> = Vec::new();
    for of_islands in gaps.chunk_by(|one, two| (one.a, one.b) == (two.a, two.b)) {
        let first = kept.len();
        for gap in of_islands {
            let near = |other: &Gap| {
                let direct = other.from.distance_mm(gap.from).max(other.to.distance_mm(gap.to));
                let turned = other.from.distance_mm(gap.to).max(other.to.distance_mm(gap.from));
                direct < width.mm() || gap.a == gap.b && turned < width.mm()
            };
            if !kept.get(first..).is_some_and(|same| same.iter().any(near)) {
                kept.push(*gap);
            }
        }
    }
    kept.sort_by_key(|gap| (gap.from, gap.to));
    kept
}

/// The gaps of a region narrower than `narrower_than`.
pub fn gaps(region: &Region, narrower_than: Length) -> Vec<Gap> {
    if narrower_than.nm() <= 0 {
        return Vec::new();
    }
    let index = Index::of(region);
    let outlines = outlines(region, index.entries());
    let pairs = pairs(&outlines, &index, narrower_than);
    let narrowest = |place: Vec<usize>| {
        let tries = place.into_iter().take(MOST_TRIES).filter_map(|number| pairs.get(number));
        tries.into_iter().find(|pair| !is_blocked(&index, pair)).map(|pair| {
            let ([one, two], [p, q]) = (pair.edges.map(|edge| outlines.island(edge)), pair.places);
            let (a, b, from, to) = if one <= two { (one, two, p, q) } else { (two, one, q, p) };
            let width = Length::from_nm(libm::round(pair.width) as i64);
            Gap { a, b, from: point(from), to: point(to), width }
        })
    };
    let gaps = places(&outlines, &pairs).into_iter().filter_map(narrowest).collect();
    joined(gaps, narrower_than)
}
