//! Overlays outlines: straight edges on whole nanometres, each with the circle that it is a chord of. Only
//! this file uses the overlay crate.
//!
//! ```text
//!   Path ──▶ edges ──────────▶ overlay ──────▶ contours of edges ──▶ Path (see `rebuild`)
//!            a─b, circle 7                     a─b, circle 7
//!
//!   all arcs of one circle use the same chord angles, so that equal arcs become equal chords
//! ```
//!
//! Tolerance: a chord is within [`CHORD_ERROR_NM`] of its arc; a crossing is within 2 nm of the crossing of
//! the chords. Coordinates beyond [`super::REACH`] are clamped, so nothing overflows.

use super::clusters::{self, Extent};
use super::{Path, PathSegment, Point, REACH, chords};
use i_overlay::core::edge_data::{EdgeDataMerge, OverlayEdgeData};
use i_overlay::core::edge_overlay::{EdgeOverlay, InputEdge};
use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay::ShapeType;
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::i_float::int::point::IntPoint;
use i_overlay::segm::boolean::ShapeCountBoolean;
use i_overlay::vector::edge::DataVectorEdge;
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_4, TAU};

/// Tolerance of chords, in nm. Arcs are restored exactly, so the error shows only where two outlines cross.
pub(super) const CHORD_ERROR_NM: f64 = 800.0;
/// Tolerance of chords in a picture, in nm: a tenth of the thinnest line.
const COARSE_ERROR_NM: f64 = 5_000.0;
const MOST_EIGHTHS: usize = 512;
/// Edges in a batch of outlines. The overlay crate compares nearly all pairs in a small pile, but builds
/// expensive structures for a large one. This number is above the setup cost and far below the threshold for
/// large structures.
const BATCH_EDGES: usize = 600;
/// Ends with a larger difference of radius, in nm, are not on one arc.
const UNEVEN_NM: f64 = 1_000.0;

/// A position in nm; whole numbers except during computations.
pub(super) type Spot = (f64, f64);

/// The circle of chords: centre and radius in nm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Circle {
    pub(super) centre: Spot,
    pub(super) radius_nm: f64,
}

/// Number of an edge's circle, from 1; 0 for a straight edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Tag(u32);

impl Tag {
    pub(super) const STRAIGHT: Self = Self(0);

    pub(super) fn of(place: usize) -> Self {
        Self(u32::try_from(place + 1).unwrap_or(0))
    }

    pub(super) const fn circle(self) -> Option<usize> {
        if self.0 == 0 { None } else { Some(self.0 as usize - 1) }
    }
}

impl OverlayEdgeData for Tag {
    type Store = ();

    /// Straight wins, then the older circle: independent of the order of the two.
    fn merge(both: EdgeDataMerge<ShapeCountBoolean, Self>, (): &mut ()) -> Self {
        Self(both.lhs_data.0.min(both.rhs_data.0))
    }
}

pub(super) type Edge = InputEdge<i32, Tag>;
pub(super) type Found = DataVectorEdge<i32, Tag>;
/// X and Y in whole nanometres.
pub(super) type Place = (i32, i32);

pub(super) fn edge(a: Place, b: Place, data: Tag) -> Edge {
    InputEdge { a: IntPoint::new(a.0, a.1), b: IntPoint::new(b.0, b.1), data }
}

pub(super) fn found(a: Place, b: Place, data: Tag) -> Found {
    DataVectorEdge { a: IntPoint::new(a.0, a.1), b: IntPoint::new(b.0, b.1), fill: 0, data }
}

pub(super) type Shape = Vec<Vec<Found>>;

/// Winding numbers that count as inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fill {
    NonZero,
    EvenOdd,
    Positive,
}

impl From<Fill> for FillRule {
    fn from(fill: Fill) -> Self {
        match fill {
            Fill::NonZero => Self::NonZero,
            Fill::EvenOdd => Self::EvenOdd,
            Fill::Positive => Self::Positive,
        }
    }
}

#[derive(Clone, Default)]
pub(super) struct Pile {
    pub(super) edges: Vec<Edge>,
    pub(super) ends: Vec<usize>,
}

/// Outlines being collected, and the circles of their edges.
#[derive(Default)]
pub(super) struct Overlay {
    pub(super) circles: Vec<Circle>,
    pile: Pile,
    wheels: BTreeMap<usize, Vec<Spot>>,
    room: Option<usize>,
    full: bool,
    /// Use few chords for arcs: the result is only a picture.
    is_picture: bool,
}

impl Pile {
    pub(super) fn outlines(&self) -> impl Iterator<Item = &[Edge]> {
        let starts = std::iter::once(0).chain(self.ends.iter().copied());
        starts.zip(&self.ends).map(|(start, &end)| self.edges.get(start..end).unwrap_or_default())
    }
}

pub(super) fn pin((x, y): Spot) -> IntPoint<i32> {
    let reach = REACH.nm() as f64;
    let hold = |value: f64| libm::round(value).clamp(-reach, reach) as i32;
    IntPoint::new(hold(x), hold(y))
}

/// A point in nm.
pub(super) fn spot(point: Point) -> Spot {
    (point.x.nm() as f64, point.y.nm() as f64)
}

/// Distance in nm.
pub(super) fn apart(a: Spot, b: Spot) -> f64 {
    let (dx, dy) = (a.0 - b.0, a.1 - b.1);
    libm::sqrt(dx * dx + dy * dy)
}

impl Circle {
    pub(super) fn through(centre: Spot, from: Spot, to: Spot) -> Self {
        Self { centre, radius_nm: (apart(centre, from) + apart(centre, to)) / 2.0 }
    }
}

/// Number of chords of a circle, in eighths of it, for an error of at most `error_nm`.
fn eighths(radius: f64, error_nm: f64) -> usize {
    let flat = (1.0 - error_nm / radius.max(error_nm)).clamp(-1.0, 1.0);
    let step = 2.0 * libm::acos(flat);
    (libm::ceil(FRAC_PI_4 / step.max(1e-9)) as usize).clamp(1, MOST_EIGHTHS)
}

/// The corners of a regular polygon in the unit circle, mirrored from one eighth so that they are exactly
/// symmetric.
fn wheel(eighths: usize) -> Vec<Spot> {
    let count = 8 * eighths;
    let first = |index: usize| {
        let angle = TAU * index as f64 / count as f64;
        (libm::cos(angle), libm::sin(angle))
    };
    let quarter = |index: usize| {
        if index <= eighths {
            first(index)
        } else {
            let (x, y) = first(2 * eighths - index);
            (y, x)
        }
    };
    (0..count)
        .map(|index| {
            let (x, y) = quarter(index % (2 * eighths));
            match index / (2 * eighths) {
                0 => (x, y),
                1 => (-y, x),
                2 => (-x, -y),
                _ => (y, -x),
            }
        })
        .collect()
}

impl Overlay {
    pub(super) fn with_room(room: usize) -> Self {
        Self { room: Some(room), ..Self::default() }
    }

    /// As [`Self::with_room`], with few chords for each arc.
    pub(super) fn for_picture(room: usize) -> Self {
        Self { is_picture: true, ..Self::with_room(room) }
    }

    pub(super) const fn is_full(&self) -> bool {
        self.full
    }

    fn open(&self) -> &[Edge] {
        self.pile.edges.get(self.pile.ends.last().copied().unwrap_or(0)..).unwrap_or_default()
    }

    /// Adds an edge, starting where the previous one ended. Two roundings of one position may differ by a
    /// nanometre, and an open outline has no inside.
    fn put(&mut self, from: Spot, to: Spot, data: Tag) {
        let (a, b) = (self.open().last().map_or_else(|| pin(from), |last| last.b), pin(to));
        if self.room.is_some_and(|room| self.pile.edges.len() >= room) {
            self.full = true;
        } else if a != b {
            self.pile.edges.push(InputEdge { a, b, data });
        }
    }

    pub(super) fn line(&mut self, from: Spot, to: Spot) {
        self.put(from, to, Tag::STRAIGHT);
    }

    /// Adds an arc of `circle` as chords; equal ends are a full circle.
    pub(super) fn arc(&mut self, from: Spot, to: Spot, circle: Circle, clockwise: bool) {
        if circle.radius_nm < 1.0 {
            return self.line(from, to);
        }
        self.circles.push(circle);
        let tag = Tag(u32::try_from(self.circles.len()).unwrap_or(0));
        let size = eighths(circle.radius_nm, if self.is_picture { COARSE_ERROR_NM } else { CHORD_ERROR_NM });
        let count = 8 * size;
        let step = TAU / count as f64;
        let angle = |(x, y): Spot| {
            let turned = libm::atan2(y - circle.centre.1, x - circle.centre.0);
            if turned < 0.0 { turned + TAU } else { turned }
        };
        let (low, high) = if clockwise { (angle(to), angle(from)) } else { (angle(from), angle(to)) };
        let high = if high <= low || from == to { high + TAU } else { high };
        let high = if high > low + TAU { high - TAU } else { high };
        // Corners of the polygon strictly between the ends, none so near to an end that the edge would be a
        // fragment.
        let first = libm::floor(low / step + 0.01) as usize + 1;
        let last = libm::ceil(high / step - 0.01) as usize;
        let wheel = self.wheels.entry(size).or_insert_with(|| wheel(size));
        let corner = |index: usize| {
            let (x, y) = wheel.get(index % count).copied().unwrap_or_default();
            (circle.centre.0 + circle.radius_nm * x, circle.centre.1 + circle.radius_nm * y)
        };
        let inner: Vec<Spot> = if clockwise {
            (first..last).rev().map(corner).collect()
        } else {
            (first..last).map(corner).collect()
        };
        let mut at = from;
        for next in inner.into_iter().chain([to]) {
            self.put(at, next, tag);
            at = next;
        }
    }

    pub(super) fn segment(&mut self, from: Point, segment: PathSegment) {
        let start = spot(from);
        match segment {
            PathSegment::Line { to } => self.line(start, spot(to)),
            PathSegment::Arc { to, centre, clockwise } => {
                let (end, middle) = (spot(to), spot(centre));
                if (apart(middle, start) - apart(middle, end)).abs() > UNEVEN_NM {
                    let mut at = start;
                    for point in chords::arc(from, to, centre, clockwise, CHORD_ERROR_NM * 1e-6) {
                        self.line(at, spot(point));
                        at = spot(point);
                    }
                } else {
                    self.arc(start, end, Circle::through(middle, start, end), clockwise);
                }
            }
        }
    }

    /// Closes and ends an outline. Outlines are grouped by overlap, so areas that belong together must be one
    /// outline or overlap.
    pub(super) fn end_outline(&mut self) {
        if let [first, .., last] = *self.open()
            && last.b != first.a
        {
            self.pile.edges.push(InputEdge { a: last.b, b: first.a, data: Tag::STRAIGHT });
        }
        self.pile.ends.push(self.pile.edges.len());
    }

    /// Adds a path as an outline, closing an open one by a straight edge.
    pub(super) fn path(&mut self, path: &Path) {
        for (from, segment) in path.pieces() {
            if self.full {
                break;
            }
            self.segment(from, segment);
        }
        self.line(spot(path.end()), spot(path.start));
        self.end_outline();
    }

    /// Reverses all outlines: winding +1 becomes −1.
    pub(super) fn turn(&mut self) {
        let back = |outline: &[Edge]| outline.iter().rev().copied().map(turned).collect::<Vec<_>>();
        self.pile.edges = self.pile.outlines().flat_map(back).collect();
    }

    /// Takes the outlines. The circles stay.
    pub(super) fn take(&mut self) -> Pile {
        std::mem::take(&mut self.pile)
    }
}

pub(super) fn turned(edge: Edge) -> Edge {
    InputEdge { a: edge.b, b: edge.a, data: edge.data }
}

fn extent<'a>(points: impl IntoIterator<Item = &'a IntPoint<i32>>) -> Extent {
    points.into_iter().fold(clusters::NOTHING, |extent, point| clusters::with(extent, point.x, point.y))
}

pub(super) fn extent_of(shape: &Shape) -> Extent {
    extent(shape.iter().take(1).flatten().map(|edge| &edge.a))
}

fn run(edges: impl IntoIterator<Item = Edge>, fill: Fill) -> Vec<Shape> {
    let edges = edges.into_iter();
    let mut overlay = EdgeOverlay::<i32, Tag>::new(edges.size_hint().0);
    overlay.add_edges(edges, ShapeType::Subject);
    overlay.build_vector_shapes(OverlayRule::Subject, fill.into())
}

/// The area in `ground` but not in `away`, plus `over`, in a single run.
pub(super) fn overlaid(
    ground: impl Iterator<Item = Edge>,
    away: impl Iterator<Item = Edge>,
    over: impl Iterator<Item = Edge>,
) -> Vec<Shape> {
    let mut overlay = EdgeOverlay::<i32, Tag>::new(0);
    overlay.add_edges(ground.chain(away.map(turned)), ShapeType::Subject);
    overlay.add_edges(over, ShapeType::Clip);
    overlay.build_vector_shapes(OverlayRule::Union, FillRule::Positive)
}

/// Groups of overlapping outlines; small groups are combined so that each run has enough edges.
fn batches(outlines: &[&[Edge]]) -> Vec<Vec<usize>> {
    let extents: Vec<Extent> =
        outlines.iter().map(|outline| extent(outline.iter().map(|edge| &edge.a))).collect();
    let size = |group: &[usize]| -> usize {
        group.iter().filter_map(|&index| outlines.get(index)).map(|outline| outline.len()).sum()
    };
    let mut batches: Vec<Vec<usize>> = Vec::new();
    let mut filled = BATCH_EDGES;
    for group in clusters::clusters(&extents) {
        let more = size(&group);
        match batches.last_mut() {
            Some(last) if filled + more <= BATCH_EDGES => {
                last.extend(group);
                filled += more;
            }
            _ => {
                batches.push(group);
                filled = more;
            }
        }
    }
    batches
}

/// The area inside a pile of outlines by `fill`.
pub(super) fn trace(pile: &Pile, fill: Fill) -> Vec<Shape> {
    let outlines: Vec<&[Edge]> = pile.outlines().collect();
    let mut shapes = Vec::new();
    for batch in batches(&outlines) {
        let chosen = batch.iter().filter_map(|&index| outlines.get(index));
        let edges: Vec<Edge> = chosen.copied().flatten().copied().collect();
        shapes.extend(run(edges, fill));
    }
    shapes
}

/// Combines two piles, each by nonzero winding, by `rule`.
pub(super) fn trace_two(subject: &Pile, clip: &Pile, rule: OverlayRule) -> Vec<Shape> {
    let subjects: Vec<&[Edge]> = subject.outlines().collect();
    let outlines: Vec<&[Edge]> = subjects.iter().copied().chain(clip.outlines()).collect();
    let mut shapes = Vec::new();
    for batch in batches(&outlines) {
        let mut overlay = EdgeOverlay::<i32, Tag>::new(batch.len());
        for index in batch {
            let kind = if index < subjects.len() { ShapeType::Subject } else { ShapeType::Clip };
            overlay.add_edges(outlines.get(index).copied().unwrap_or_default().iter().copied(), kind);
        }
        shapes.extend(overlay.build_vector_shapes(rule, FillRule::NonZero));
    }
    shapes
}

pub(super) fn edges_of(shape: &Shape) -> impl Iterator<Item = Edge> {
    shape.iter().flatten().map(|edge| InputEdge { a: edge.a, b: edge.b, data: edge.data })
}
