//! A region made ready for many questions: which island a point lies in, and what edge is nearest to it.
//!
//! Comes in: a region, then points. Goes out: numbers of islands, places in whole nanometres. Exact but for that rounding:
//! arcs are not cut into chords. A point on an edge may lie in or out. Knows no boards.

use super::measure::{crossings, segment_bounds};
use super::nearest::Piece;
use super::overlay::{Spot, apart, spot};
use super::{Bounds, PathSegment, Point, Region};
use crate::units::Length;
use rstar::{AABB, PointDistance, RTree, RTreeObject};

/// Where an edge is: island, path in it (0 is the outer one, holes from 1), segment in the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Edge {
    /// Index of the island.
    pub island: u32,
    /// Index of the path: 0 the outer one, then the holes.
    pub path: u32,
    /// Index of the segment.
    pub segment: u32,
}

/// The place of a region's edges nearest to a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Near {
    /// The edge.
    pub edge: Edge,
    /// The place on it.
    pub place: Point,
    /// How far it is.
    pub distance: Length,
}

/// An edge in the tree.
#[derive(Clone, Copy, Debug)]
pub(super) struct Entry {
    /// Its number in the order of the region.
    pub(super) number: usize,
    pub(super) edge: Edge,
    pub(super) from: Point,
    pub(super) segment: PathSegment,
    pub(super) piece: Piece,
    around: AABB<[f64; 2]>,
}

impl RTreeObject for Entry {
    type Envelope = AABB<[f64; 2]>;
    fn envelope(&self) -> Self::Envelope {
        self.around
    }
}

impl PointDistance for Entry {
    fn distance_2(&self, point: &[f64; 2]) -> f64 {
        let [x, y] = *point;
        let distance = apart(self.piece.nearest((x, y)), (x, y));
        distance * distance
    }
}

/// The edges of a region in a tree of boxes.
#[derive(Clone, Debug)]
pub struct Index {
    tree: RTree<Entry>,
}

pub(super) fn envelope(bounds: Bounds) -> AABB<[f64; 2]> {
    let ((left, low), (right, high)) = (spot(bounds.min), spot(bounds.max));
    AABB::from_corners([left, low], [right, high])
}

pub(super) fn point((x, y): Spot) -> Point {
    Point::new(Length::from_nm(libm::round(x) as i64), Length::from_nm(libm::round(y) as i64))
}

/// All edges of a region, in order.
pub(super) fn entries(region: &Region) -> Vec<Entry> {
    let mut entries = Vec::new();
    for (island, paths) in (0_u32..).zip(region.islands.iter().map(|island| island.paths())) {
        for (path, outline) in (0_u32..).zip(paths) {
            for (segment, (from, piece)) in (0_u32..).zip(outline.pieces()) {
                let edge = Edge { island, path, segment };
                let number = entries.len();
                let around = envelope(segment_bounds(from, piece));
                let geometry = Piece::of(from, piece);
                entries.push(Entry { number, edge, from, segment: piece, piece: geometry, around });
            }
        }
    }
    entries
}

impl Index {
    /// Makes a region ready.
    pub fn of(region: &Region) -> Self {
        Self::from_entries(entries(region))
    }

    /// Of edges already listed.
    pub(super) fn from_entries(entries: Vec<Entry>) -> Self {
        Self { tree: RTree::bulk_load(entries) }
    }

    /// The island that a point lies in; the innermost where an island lies in a hole of another.
    pub fn island_at(&self, point: Point) -> Option<usize> {
        let (x, y) = spot(point);
        let far = self.tree.root().envelope().upper()[0].max(x);
        let ray = AABB::from_corners([x, y], [far, y]);
        let mut counts: Vec<(u32, i32)> = Vec::new();
        for entry in self.tree.locate_in_envelope_intersecting(&ray) {
            let crossed = crossings(point, entry.from, entry.segment);
            match counts.iter_mut().find(|(island, _)| *island == entry.edge.island) {
                Some((_, count)) => *count += crossed,
                None => counts.push((entry.edge.island, crossed)),
            }
        }
        counts.into_iter().find(|(_, count)| *count != 0).map(|(island, _)| island as usize)
    }

    /// The place of an edge nearest to `point`, if it is not farther than `within`.
    pub fn nearest(&self, point: Point, within: Length) -> Option<Near> {
        let (x, y) = spot(point);
        let entry = self.tree.nearest_neighbor(&[x, y])?;
        let place = entry.piece.nearest((x, y));
        let distance = Length::from_nm(libm::round(apart(place, (x, y))) as i64);
        (distance <= within).then(|| Near { edge: entry.edge, place: self::point(place), distance })
    }

    /// The edges whose boxes meet `bounds`, in order, each with its start and itself.
    pub fn edges_in(&self, bounds: Bounds) -> Vec<(Edge, Point, PathSegment)> {
        let mut found: Vec<_> = self
            .tree
            .locate_in_envelope_intersecting(&envelope(bounds))
            .map(|entry| (entry.edge, entry.from, entry.segment))
            .collect();
        found.sort_by_key(|(edge, _, _)| *edge);
        found
    }

    /// The entries whose boxes meet `bounds`.
    pub(super) fn entries_in(&self, bounds: Bounds) -> impl Iterator<Item = &Entry> {
        self.tree.locate_in_envelope_intersecting(&envelope(bounds))
    }
}
