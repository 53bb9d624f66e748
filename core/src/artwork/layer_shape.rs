//! Measures the drawing of a layer, compared with the holes and with other layers.
//!
//! ```text
//!   ◎──◎  copper: strokes from pad to pad     ◯  ◯  mask: the same pads, larger     ▪ ▪  paste: no holes
//! ```

use super::registration::{Copper, every};
use super::{Gerber, Role};
use crate::geometry::{Bounds, Path, PathSegment, Point, path_bounds};
use std::collections::{BTreeMap, BTreeSet};

type Stroke = (Point, PathSegment);

const MOST_LOOKED_AT: usize = 20_000;
const MOST_HOLES: usize = 600;
/// Maximum number of strokes of an outline layer.
const MOST_IN_LOOPS: usize = 400;
/// Positions closer than this count as one, nm.
const NEAR_NM: i64 = 20_000;
/// From this difference on, pad widths differ, mm.
pub(super) const WIDER_MM: f64 = 0.02;
/// A stroke that leaves a pad is at least this long, mm.
const LEAST_RUN_MM: f64 = 0.3;
/// A contour with this share of the layer's size is a plane.
const PLANE_SHARE: f64 = 0.2;
/// Pads of two layers are the same if this share of them coincides.
pub(super) const SAME_SHARE: f64 = 0.5;

pub(super) struct Shape {
    /// Width of the pad at each position, mm.
    pads: BTreeMap<(i64, i64), f64>,
    /// Positions of pads without a hole.
    surface: BTreeSet<(i64, i64)>,
    /// Strokes start or end in pads and leave them.
    pub(super) joined: bool,
    pub(super) drawn: usize,
    /// Strokes run from one pad to another.
    pub(super) is_linked: bool,
    /// The layer has only strokes in closed loops.
    pub(super) is_loops: bool,
    /// A contour is nearly as large as the layer.
    has_plane: bool,
    pub(super) has_holes: bool,
    pub(super) under_holes_share: f64,
    /// Share of the holes in the middle of a pad.
    pub(super) pads_under_holes_share: f64,
}

impl Shape {
    pub(super) fn of(name: &str, layer: &Gerber, holes: &[Point]) -> Self {
        let flashes = layer.flashes();
        let count = flashes.len();
        let pads: BTreeMap<_, _> =
            every(flashes.into_iter(), count, MOST_LOOKED_AT).map(|(at, width)| (cell(at), width)).collect();
        let strokes = layer.strokes();
        let count = strokes.len();
        let runs = |&(from, to): &(Point, Point)| {
            from.distance_mm(to) >= LEAST_RUN_MM && (pad(&pads, from) || pad(&pads, to))
        };
        let joined =
            every(strokes.iter().map(|(from, segment)| (*from, segment.to())), count, MOST_LOOKED_AT)
                .any(|stroke| runs(&stroke));
        let looked: Vec<Point> = every(holes.iter().copied(), holes.len(), MOST_HOLES).collect();
        let all = looked.len().max(1) as f64;
        let share = |on: &dyn Fn(Point) -> bool| looked.iter().filter(|at| on(**at)).count() as f64 / all;
        let copper = Copper::new([(name, layer)].into_iter());
        let contours = layer.contours();
        let boxes: Vec<(Bounds, &Path)> =
            contours.iter().take(MOST_LOOKED_AT).map(|path| (path_bounds(path), path)).collect();
        let in_contour =
            |at: Point| boxes.iter().any(|(bounds, path)| bounds.contains(at) && encloses(path, at));
        let under =
            |at: Point| copper.as_ref().is_some_and(|copper| copper.has(at, (0.0, 0.0))) || in_contour(at);
        let (under_holes_share, pads_under_holes_share) = (share(&under), share(&|at| pad(&pads, at)));
        let has_plane = layer.centre_bounds().is_some_and(|all| {
            let large = |bounds: Bounds| {
                let part = |of: Bounds| (of.max.x - of.min.x).mm() * (of.max.y - of.min.y).mm();
                part(bounds) >= PLANE_SHARE * part(all)
            };
            contours.iter().map(path_bounds).any(large)
        });
        let drawn = strokes.len() + contours.len();
        let drilled: BTreeSet<(i64, i64)> = holes.iter().map(|at| cell(*at)).collect();
        let on_hole = |at: &(i64, i64)| beside(*at).any(|cell| drilled.contains(&cell));
        let surface = pads.keys().copied().filter(|at| !on_hole(at)).collect();
        Self {
            drawn,
            surface,
            is_linked: joined && is_linked(&strokes, &pads),
            is_loops: pads.is_empty() && contours.is_empty() && is_loops(&strokes),
            has_plane,
            has_holes: !holes.is_empty(),
            joined,
            under_holes_share,
            pads_under_holes_share,
            pads,
        }
    }

    pub(super) fn has_pads(&self) -> bool {
        !self.pads.is_empty()
    }

    /// The share of its pads that coincide with pads of `other`, and how much wider its pads are on average,
    /// mm.
    pub(super) fn compared(&self, other: &Self) -> (f64, f64) {
        let both = self.pads.iter().filter_map(|(at, width)| Some(width - around(&other.pads, *at)?));
        let (count, sum) = both.fold((0_u32, 0.0), |(count, sum), wider| (count + 1, sum + wider));
        let share = f64::from(count) / self.pads.len().max(1) as f64;
        (share, sum / f64::from(count.max(1)))
    }

    /// The share of its pads without a hole that coincide with pads of `other`; none if all its pads have
    /// holes.
    pub(super) fn surface_share(&self, other: &Self) -> Option<f64> {
        let on = self.surface.iter().filter(|at| around(&other.pads, **at).is_some()).count();
        (!self.surface.is_empty()).then(|| on as f64 / self.surface.len() as f64)
    }

    /// True if only copper is drawn like this: tracks from pad to pad, and pads on most holes.
    pub(super) fn is_drawn_as_copper(&self) -> bool {
        self.is_linked && self.has_holes && self.pads_under_holes_share >= SAME_SHARE
    }

    /// True for a mask or paste layer over `copper`: only pads, the same as those of the copper, but of
    /// another width.
    pub(super) fn covers(&self, copper: &Self) -> bool {
        let (share, wider_mm) = self.compared(copper);
        let wider = wider_mm >= WIDER_MM;
        let misses_holes = self.pads_under_holes_share < copper.pads_under_holes_share;
        let narrower = wider_mm <= -WIDER_MM && self.pads_under_holes_share == 0.0 && copper.joined;
        let opens = wider || misses_holes || narrower;
        // CADs draw pads of unusual shapes with strokes and contours.
        let is_pads = self.drawn == 0 || wider && !self.has_plane && self.drawn <= self.pads.len();
        !self.joined && is_pads && self.has_pads() && share >= SAME_SHARE && opens
    }

    pub(super) fn is_same(&self, other: &Self) -> bool {
        self.pads == other.pads && self.drawn == other.drawn
    }

    /// True if the layer has openings at the holes: a mask does, paste doesn't.
    pub(super) fn opens_holes(&self, copper: &Self) -> bool {
        self.pads_under_holes_share > 0.0
            && self.pads_under_holes_share >= SAME_SHARE * copper.pads_under_holes_share
            || self.compared(copper).1 >= WIDER_MM
    }

    /// True if it can be copper: strokes from pad to pad, or most holes are on it; if not `strict`, pads are
    /// enough. If `strict` and there are holes, some must be on it.
    pub(super) fn may_be_copper(&self, has_holes: bool, strict: bool) -> bool {
        let on_holes = self.under_holes_share >= SAME_SHARE && (self.has_pads() || self.drawn > 0);
        let is_joined = self.joined && (!strict || !has_holes || self.under_holes_share > 0.0);
        on_holes && has_holes || is_joined || !strict && self.has_pads()
    }
}

pub(super) fn has_links(layer: &Gerber) -> bool {
    let strokes = layer.strokes();
    if strokes.is_empty() || layer.counts.flashes == 0 {
        return false;
    }
    let pads =
        layer.flashes().into_iter().take(MOST_LOOKED_AT).map(|(at, width)| (cell(at), width)).collect();
    is_linked(&strokes, &pads)
}

fn cell(at: Point) -> (i64, i64) {
    (at.x.nm().div_euclid(NEAR_NM), at.y.nm().div_euclid(NEAR_NM))
}

fn pad(pads: &BTreeMap<(i64, i64), f64>, at: Point) -> bool {
    around(pads, cell(at)).is_some()
}

fn is_linked(strokes: &[Stroke], pads: &BTreeMap<(i64, i64), f64>) -> bool {
    let mut parts = Parts::default();
    for (from, segment) in strokes.iter().take(MOST_LOOKED_AT) {
        let [from, to] = [*from, segment.to()].map(|at| pad_of(pads, cell(at)));
        let [(from, one), (to, other)] = [from, to];
        if parts.unite((from, one), (to, other)) {
            return true;
        }
    }
    false
}

/// Connected positions as a union-find forest. Each component has the pad that it reaches.
#[derive(Default)]
struct Parts {
    up: BTreeMap<(i64, i64), (i64, i64)>,
    pads: BTreeMap<(i64, i64), (i64, i64)>,
}

impl Parts {
    fn root(&mut self, mut at: (i64, i64)) -> (i64, i64) {
        while let Some(&above) = self.up.get(&at) {
            if let Some(&next) = self.up.get(&above) {
                self.up.insert(at, next);
            }
            at = above;
        }
        at
    }

    /// Joins the components of two positions; the flags mark pads. True if the components reach different
    /// pads.
    fn unite(&mut self, (a, is_pad_a): ((i64, i64), bool), (b, is_pad_b): ((i64, i64), bool)) -> bool {
        let roots = [self.root(a), self.root(b)];
        let pad = |root: (i64, i64), at: (i64, i64), is_pad: bool| {
            self.pads.get(&root).copied().or(is_pad.then_some(at))
        };
        let reached = [pad(roots[0], a, is_pad_a), pad(roots[1], b, is_pad_b)];
        if let [Some(one), Some(other)] = reached
            && one != other
        {
            return true;
        }
        if roots[0] != roots[1] {
            self.up.insert(roots[0], roots[1]);
        }
        if let Some(pad) = reached[0].or(reached[1]) {
            self.pads.insert(roots[1], pad);
        }
        false
    }
}

/// True if all strokes close into loops; false for more than [`MOST_IN_LOOPS`].
fn is_loops(strokes: &[Stroke]) -> bool {
    let mut ends: BTreeMap<(i64, i64), u32> = BTreeMap::new();
    for (from, segment) in strokes.iter().filter(|(from, segment)| *from != segment.to()) {
        for at in [*from, segment.to()] {
            *ends.entry(cell(at)).or_default() += 1;
        }
    }
    (1..=MOST_IN_LOOPS).contains(&strokes.len()) && ends.values().all(|count| *count == 2)
}

/// The cell of a pad in or next to a cell, and true; without a pad, the cell and false.
fn pad_of(pads: &BTreeMap<(i64, i64), f64>, at: (i64, i64)) -> ((i64, i64), bool) {
    beside(at).find(|cell| pads.contains_key(cell)).map_or((at, false), |pad| (pad, true))
}

fn beside((x, y): (i64, i64)) -> impl Iterator<Item = (i64, i64)> {
    [0, -1, 1].into_iter().flat_map(move |dx| [0, -1, 1].into_iter().map(move |dy| (x + dx, y + dy)))
}

fn around(pads: &BTreeMap<(i64, i64), f64>, at: (i64, i64)) -> Option<f64> {
    beside(at).find_map(|cell| pads.get(&cell).copied())
}

/// True if a closed path encloses a position; arcs count as their chords.
fn encloses(path: &Path, at: Point) -> bool {
    let mut inside = false;
    let mut from = path.start;
    for segment in &path.segments {
        let to = segment.to();
        let (x, y) = (at.x.mm(), at.y.mm());
        let ((ax, ay), (bx, by)) = ((from.x.mm(), from.y.mm()), (to.x.mm(), to.y.mm()));
        if (ay > y) != (by > y) && x < (bx - ax) * (y - ay) / (by - ay) + ax {
            inside = !inside;
        }
        from = to;
    }
    inside
}

/// The role of a pads-only layer over `copper`, if it is clear: mask if its pads are wider, paste if none is
/// at a hole.
pub(super) fn opening(shape: &Shape, copper: &Shape) -> Option<Role> {
    if !shape.covers(copper) {
        return None;
    }
    let is_wider = shape.compared(copper).1 >= WIDER_MM;
    let misses = shape.pads_under_holes_share == 0.0 && copper.pads_under_holes_share > 0.0;
    is_wider.then_some(Role::Mask).or(misses.then_some(Role::Paste))
}
