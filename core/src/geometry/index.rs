//! An index of a region: the island at a point, and the nearest edge.
//!
//! ```text
//!   ───────────────
//!    /\ _ | / _ \/    Boxes of edges, sorted by height, thousands in each tree. A single tree would need
//!   ───────────────   several times the memory of the result.
//!    | _ /\ \ | _
//!   ───────────────
//! ```
//!
//! Exact except for rounding: arcs are not cut into chords. A point on an edge may count either way.

use super::measure::{crossings, segment_bounds};
use super::nearest::Piece;
use super::overlay::{Spot, apart, spot};
use super::{Bounds, PathSegment, Point, Region};
use crate::units::Length;
use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Edge {
    pub island: u32,
    /// Index of the path: 0 the outer one, then the holes.
    pub path: u32,
    pub segment: u32,
}

/// The point of a region's edges nearest to a query point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Near {
    pub edge: Edge,
    /// The point on the edge.
    pub place: Point,
    pub distance: Length,
}

/// An edge with its number and geometry. A board has millions of them.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    number: u32,
    pub(super) edge: Edge,
    pub(super) piece: Piece,
}

impl Entry {
    pub(super) fn number(&self) -> usize {
        self.number as usize
    }

    pub(super) fn start(&self) -> Point {
        at(self.piece.from)
    }

    pub(super) fn segment(&self) -> PathSegment {
        let to = at(self.piece.to);
        match self.piece.bow {
            None => PathSegment::Line { to },
            Some(bow) => PathSegment::Arc { to, centre: at(bow.centre), clockwise: bow.clockwise },
        }
    }

    pub(super) fn bounds(&self) -> Bounds {
        segment_bounds(self.start(), self.segment())
    }
}

type Boxed = GeomWithData<Rectangle<[f64; 2]>, u32>;

/// Edges in each tree.
const EACH: usize = 16_384;

/// The edges of a region in trees of boxes.
#[derive(Clone, Debug)]
pub struct Index {
    entries: Vec<Entry>,
    trees: Vec<RTree<Boxed>>,
}

pub(super) fn envelope(bounds: Bounds) -> AABB<[f64; 2]> {
    let ((left, low), (right, high)) = (spot(bounds.min), spot(bounds.max));
    AABB::from_corners([left, low], [right, high])
}

pub(super) fn point((x, y): Spot) -> Point {
    Point::new(Length::from_nm(libm::round(x) as i64), Length::from_nm(libm::round(y) as i64))
}

/// The point at a place in whole nanometres.
fn at((x, y): Spot) -> Point {
    Point::new(Length::from_nm(x as i64), Length::from_nm(y as i64))
}

fn entries(region: &Region) -> Vec<Entry> {
    let mut entries = Vec::with_capacity(region.paths().map(|path| path.segments.len()).sum());
    for (island, shape) in (0..).zip(&region.islands) {
        for (path, outline) in (0..).zip(shape.paths()) {
            for (segment, (from, piece)) in (0..).zip(outline.pieces()) {
                let (number, edge) = (entries.len() as u32, Edge { island, path, segment });
                entries.push(Entry { number, edge, piece: Piece::of(from, piece) });
            }
        }
    }
    entries
}

impl Index {
    pub fn of(region: &Region) -> Self {
        let entries = entries(region);
        let boxed = |entry: &Entry| Boxed::new(Rectangle::from_aabb(envelope(entry.bounds())), entry.number);
        let mut boxes: Vec<Boxed> = entries.iter().map(boxed).collect();
        if boxes.len() > EACH {
            let height = |own: &Boxed| own.geom().lower()[1] + own.geom().upper()[1];
            boxes.sort_by(|a, b| height(a).total_cmp(&height(b)).then(a.data.cmp(&b.data)));
        }
        let trees = boxes.chunks(EACH).map(|own| RTree::bulk_load(own.to_vec())).collect();
        Self { entries, trees }
    }

    /// The island at a point; the innermost if islands are nested.
    pub fn island_at(&self, point: Point) -> Option<usize> {
        let (x, y) = spot(point);
        let mut counts: Vec<(u32, i32)> = Vec::new();
        for tree in &self.trees {
            let far = tree.root().envelope().upper()[0].max(x);
            let ray = AABB::from_corners([x, y], [far, y]);
            for entry in tree.locate_in_envelope_intersecting(&ray).filter_map(|own| self.entry(own)) {
                let crossed = crossings(point, entry.start(), entry.segment());
                match counts.iter_mut().find(|(island, _)| *island == entry.edge.island) {
                    Some((_, count)) => *count += crossed,
                    None => counts.push((entry.edge.island, crossed)),
                }
            }
        }
        counts.into_iter().find(|(_, count)| *count != 0).map(|(island, _)| island as usize)
    }

    pub(super) fn entries(&self) -> &[Entry] {
        &self.entries
    }

    fn entry(&self, own: &Boxed) -> Option<&Entry> {
        self.entries.get(own.data as usize)
    }

    /// The edge point nearest to `point`, if within `within`.
    pub fn nearest(&self, point: Point, within: Length) -> Option<Near> {
        let at = spot(point);
        let away = |tree: &RTree<Boxed>| tree.root().envelope().distance_2(&[at.0, at.1]);
        let mut trees: Vec<(f64, &RTree<Boxed>)> = self.trees.iter().map(|tree| (away(tree), tree)).collect();
        trees.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut best: Option<(f64, Edge, Spot)> = None;
        // 1 nm more, because the distance is rounded before the comparison.
        let mut reach = (within.nm() as f64 + 1.0).max(0.0);
        for (away, tree) in trees {
            if away > reach * reach {
                break;
            }
            for (own, away) in tree.nearest_neighbor_iter_with_distance_2(&[at.0, at.1]) {
                if away > reach * reach {
                    break;
                }
                let Some(entry) = self.entry(own) else { continue };
                let place = entry.piece.nearest(at);
                let distance = apart(place, at);
                if distance < reach || best.is_none() && distance <= reach {
                    reach = distance;
                    best = Some((distance, entry.edge, place));
                }
            }
        }
        let (distance, edge, place) = best?;
        let distance = Length::from_nm(libm::round(distance) as i64);
        (distance <= within).then(|| Near { edge, place: self::point(place), distance })
    }

    /// The edges whose boxes meet `bounds`, in order, each with its start and itself.
    pub fn edges_in(&self, bounds: Bounds) -> Vec<(Edge, Point, PathSegment)> {
        let mut found: Vec<_> =
            self.entries_in(bounds).map(|entry| (entry.edge, entry.start(), entry.segment())).collect();
        found.sort_by_key(|(edge, _, _)| *edge);
        found
    }

    pub(super) fn entries_in(&self, bounds: Bounds) -> impl Iterator<Item = &Entry> {
        let around = envelope(bounds);
        let found = self.trees.iter().flat_map(move |tree| tree.locate_in_envelope_intersecting(&around));
        found.filter_map(|own| self.entry(own))
    }
}
