//! Compares the holes of a drill file with copper: which reading and shift put them on pads? Sets no
//! threshold for a correct reading: pads drawn as strokes and unplated holes keep even that below 1.
//!
//! ```text
//! holes  ●    ●  ●         ●   ●● shifted by the vector that most pairs (hole, pad) agree on
//! pads     ◎    ◎  ◎         ◎   ◎◎
//! ```

use super::gerber::{Gerber, Track};
use crate::geometry::{Bounds, Point};
use crate::units::Length;
use rstar::primitives::{GeomWithData, Line, Rectangle};
use rstar::{AABB, RTree};
use std::collections::BTreeSet;

/// A hole this close to a pad's center, or to a track's edge, is on it.
const TOLERANCE_MM: f64 = 0.05;
pub(super) const SAMPLE: usize = 600;
const VOTING_HOLES: usize = 24;
const VOTING_PADS: usize = 3_000;
const VOTE_CELL_MM: f64 = 0.1;
/// A reading that fits this well needs no shift.
pub(super) const FITS_SHARE: f64 = 0.5;
/// Offsets in mm to estimate how many holes are on copper by chance: no multiples of any grid.
const BESIDE_MM: [(f64, f64); 6] =
    [(0.71, 0.43), (-0.59, 0.97), (1.13, -0.67), (-0.83, -1.09), (1.87, 0.79), (-1.61, 1.73)];
/// Evidence needs at least this many different pads and tracks under the holes.
const VOTERS: usize = 8;
/// Evidence also needs this share of the holes, minus the share by chance.
const SPEAKS_SHARE: f64 = 0.5;
/// Holes may be outside copper and outline by this many mm plus this share of the board.
const BEYOND_MM: f64 = 3.0;
const BEYOND_SHARE: f64 = 0.15;
/// Holes that span less than this share of a board don't prove its scale.
const SPANS_SHARE: f64 = 0.25;

pub(super) struct Copper {
    layers: Vec<Layer>,
}

pub(super) struct Layer {
    pub(super) name: String,
    pads: RTree<[f64; 2]>,
    boxes: RTree<Rectangle<[f64; 2]>>,
    tracks: RTree<GeomWithData<Line<[f64; 2]>, f64>>,
    widest_mm: f64,
    bounds: Bounds,
}

/// How well holes fit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Fit {
    /// Share of holes on copper, 0 to 1.
    pub(super) share: f64,
    pub(super) shift_mm: (f64, f64),
}

impl Layer {
    /// None if there are no pads and no tracks.
    fn new(name: &str, layer: &Gerber) -> Option<Self> {
        let pads: Vec<[f64; 2]> = layer.pads().into_iter().map(mm).collect();
        let (mut tracks, mut widest_mm) = (Vec::new(), 0.0_f64);
        let all = layer.tracks();
        let ends = all.iter().flat_map(|track| [track.from, track.to]);
        let bounds = Bounds::around(layer.pads().into_iter().chain(ends))?;
        for Track { from, to, half_width } in all {
            widest_mm = widest_mm.max(half_width.mm());
            tracks.push(GeomWithData::new(Line::new(mm(from), mm(to)), half_width.mm()));
        }
        let boxes = layer.pad_boxes().into_iter();
        let boxes = boxes.map(|Bounds { min, max }| Rectangle::from_corners(mm(min), mm(max))).collect();
        Some(Self {
            name: name.to_owned(),
            boxes: RTree::bulk_load(boxes),
            pads: RTree::bulk_load(pads),
            tracks: RTree::bulk_load(tracks),
            widest_mm,
            bounds,
        })
    }

    fn on_copper(&self, at: [f64; 2]) -> bool {
        self.pad_at(at).is_some() || self.track_at(at).is_some() || self.is_on_edge(at)
    }

    /// True if a hole is on the edge of a pad, as castellated holes are.
    fn is_on_edge(&self, [x, y]: [f64; 2]) -> bool {
        let around =
            AABB::from_corners([x - TOLERANCE_MM, y - TOLERANCE_MM], [x + TOLERANCE_MM, y + TOLERANCE_MM]);
        self.boxes.locate_in_envelope_intersecting(&around).any(|pad| {
            let ([left, low], [right, high]) = (pad.lower(), pad.upper());
            let inside = (x - left).min(right - x).min(y - low).min(high - y);
            inside.abs() <= TOLERANCE_MM
        })
    }

    fn pad_at(&self, at: [f64; 2]) -> Option<[f64; 2]> {
        self.pads.locate_within_distance(at, TOLERANCE_MM * TOLERANCE_MM).next().copied()
    }

    fn track_at(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let reach = self.widest_mm + TOLERANCE_MM;
        let around = AABB::from_corners([x - reach, y - reach], [x + reach, y + reach]);
        let mut tracks = self.tracks.locate_in_envelope_intersecting(&around);
        let track = tracks.find(|track| {
            let within = track.data + TOLERANCE_MM;
            rstar::PointDistance::distance_2(track.geom(), &[x, y]) <= within * within
        });
        track.map(|track| track.geom().from)
    }
}

impl Copper {
    /// Indexes layers by name; none if there are no pads and no tracks.
    pub(super) fn new<'a>(layers: impl Iterator<Item = (&'a str, &'a Gerber)>) -> Option<Self> {
        let layers: Vec<Layer> = layers.filter_map(|(name, layer)| Layer::new(name, layer)).collect();
        (!layers.is_empty()).then_some(Self { layers })
    }

    pub(super) fn fit(&self, holes: &[Point]) -> Fit {
        Fit { share: share(&self.layers, holes, (0.0, 0.0)), shift_mm: (0.0, 0.0) }
    }

    pub(super) fn fit_shifted(&self, holes: &[Point]) -> Fit {
        fit_shifted(&self.layers, holes)
    }

    pub(super) fn has(&self, hole: Point, shift: (f64, f64)) -> bool {
        on_copper(&self.layers, hole, shift)
    }

    /// True if holes with this `fit` are evidence for their reading: enough of them, on different pads, more
    /// than by chance.
    pub(super) fn votes(&self, holes: &[Point], fit: Fit) -> bool {
        let place = |hole: &Point| [hole.x.mm() + fit.shift_mm.0, hole.y.mm() + fit.shift_mm.1];
        // In 0.1 µm, because floats cannot be keys.
        let key = |[x, y]: [f64; 2]| ((x * 1e4) as i64, (y * 1e4) as i64);
        let mut under: BTreeSet<(i64, i64)> = BTreeSet::new();
        let mut on_pads = 0_usize;
        for at in holes.iter().map(place) {
            let pad = self.layers.iter().find_map(|layer| layer.pad_at(at));
            on_pads += usize::from(pad.is_some());
            let copper = pad.or_else(|| self.layers.iter().find_map(|layer| layer.track_at(at)));
            under.extend(copper.map(key));
        }
        let all = holes.len().max(1) as f64;
        let shifted = |(x, y): (f64, f64)| (fit.shift_mm.0 + x, fit.shift_mm.1 + y);
        let chance: f64 = BESIDE_MM.iter().map(|by| share(&self.layers, holes, shifted(*by))).sum();
        let more = fit.share - chance / BESIDE_MM.len() as f64;
        // On a board with large copper areas chance is high, so holes on pad centers count on their own.
        under.len() >= VOTERS && more.max(on_pads as f64 / all) >= SPEAKS_SHARE
    }

    pub(super) fn bounds(&self) -> Option<Bounds> {
        let boxes = self.layers.iter().map(|layer| layer.bounds);
        boxes.reduce(|a, b| a.with(b.min).with(b.max))
    }

    pub(super) fn layers(&self) -> &[Layer] {
        &self.layers
    }

    pub(super) fn has_pads(&self) -> bool {
        self.layers.iter().any(|layer| layer.pads.size() > 0)
    }

    /// Each layer on its own; empty if there is only one.
    pub(super) fn apart(&self) -> &[Layer] {
        if self.layers.len() > 1 { &self.layers } else { &[] }
    }
}

/// True if holes with bounding box `holes` can belong to a board with bounding box `board`, in any position.
pub(super) fn same_size(holes: Bounds, board: Bounds) -> bool {
    let size = |bounds: Bounds| ((bounds.max.x - bounds.min.x).mm(), (bounds.max.y - bounds.min.y).mm());
    let ((w, h), (width, height)) = (size(holes), size(board));
    let fits = |own: f64, board: f64| own <= board * (1.0 + BEYOND_SHARE) + BEYOND_MM;
    fits(w, width) && fits(h, height) && w.max(h) >= SPANS_SHARE * width.max(height)
}

pub(super) fn same_place(holes: Bounds, board: Bounds) -> bool {
    let size = (board.max.x - board.min.x).mm().max((board.max.y - board.min.y).mm());
    let around = board.grown(Length::from_mm(size * BEYOND_SHARE + BEYOND_MM));
    same_size(holes, board) && around.contains(holes.min) && around.contains(holes.max)
}

fn on_copper(layers: &[Layer], hole: Point, shift: (f64, f64)) -> bool {
    let at = [hole.x.mm() + shift.0, hole.y.mm() + shift.1];
    layers.iter().any(|layer| layer.on_copper(at))
}

pub(super) fn share(layers: &[Layer], holes: &[Point], shift: (f64, f64)) -> f64 {
    let on = |hole: &&Point| on_copper(layers, **hole, shift);
    holes.iter().filter(on).count() as f64 / holes.len().max(1) as f64
}

/// The share of holes, shifted by `shift` in mm, that are centered on a pad of `layers`.
pub(super) fn pad_share(layers: &[Layer], holes: &[Point], shift: (f64, f64)) -> f64 {
    let place = |hole: &Point| [hole.x.mm() + shift.0, hole.y.mm() + shift.1];
    let on = |hole: &&Point| layers.iter().any(|layer| layer.pad_at(place(hole)).is_some());
    holes.iter().filter(on).count() as f64 / holes.len().max(1) as f64
}

pub(super) fn fit_shifted(layers: &[Layer], holes: &[Point]) -> Fit {
    let Some(shift_mm) = vote(layers, holes) else { return Fit::default() };
    Fit { share: share(layers, holes, shift_mm), shift_mm }
}

/// The shift that most pairs of a hole and a pad agree on.
fn vote(layers: &[Layer], holes: &[Point]) -> Option<(f64, f64)> {
    let count = layers.iter().map(|layer| layer.pads.size()).sum();
    let pads = layers.iter().flat_map(|layer| layer.pads.iter().copied());
    let pads: Vec<[f64; 2]> = every(pads, count, VOTING_PADS).collect();
    let mut votes: Vec<(i64, i64)> = Vec::new();
    let mut places: Vec<(f64, f64)> = Vec::new();
    for hole in every(holes.iter().copied(), holes.len(), VOTING_HOLES) {
        places.extend(pads.iter().map(|[x, y]| (x - hole.x.mm(), y - hole.y.mm())));
    }
    let cell = |value: f64| libm::floor(value / VOTE_CELL_MM) as i64;
    // A true shift can be on the border of two cells, so each vote also counts in the neighbouring cells.
    for &(dx, dy) in &places {
        let half = VOTE_CELL_MM / 2.0;
        votes.extend(
            [(-half, -half), (half, -half), (-half, half), (half, half)]
                .map(|(ox, oy)| (cell(dx + ox), cell(dy + oy))),
        );
    }
    votes.sort_unstable();
    let best =
        votes.chunk_by(|a, b| a == b).max_by_key(|run| run.len()).and_then(|run| run.first().copied())?;
    let in_cell = |&&(dx, dy): &&(f64, f64)| {
        let middle = |index: i64| (index as f64 + 0.5) * VOTE_CELL_MM;
        (dx - middle(best.0)).abs() <= VOTE_CELL_MM && (dy - middle(best.1)).abs() <= VOTE_CELL_MM
    };
    // The median: a few wrong pairs in the cell do not move it.
    let mut xs: Vec<f64> = places.iter().filter(in_cell).map(|place| place.0).collect();
    let mut ys: Vec<f64> = places.iter().filter(in_cell).map(|place| place.1).collect();
    xs.sort_unstable_by(f64::total_cmp);
    ys.sort_unstable_by(f64::total_cmp);
    Some((*xs.get(xs.len() / 2)?, *ys.get(ys.len() / 2)?))
}

pub(super) fn every<T>(all: impl Iterator<Item = T>, count: usize, most: usize) -> impl Iterator<Item = T> {
    all.step_by(count.div_ceil(most).max(1))
}

fn mm(point: Point) -> [f64; 2] {
    let mm = |length: Length| length.mm();
    [mm(point.x), mm(point.y)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A layer drawn by `words` with a circle of 1 mm.
    fn read(words: &str) -> Gerber {
        let text = format!("%FSLAX46Y46*%%MOMM*%%ADD10C,1*%D10*{words}M02*");
        super::super::gerber::read("t", text.as_bytes(), &super::super::Overrides::default()).0
    }

    /// Pads at irregular positions, so that only one shift fits.
    fn layer() -> (Gerber, Vec<Point>) {
        let points: Vec<Point> = (0..60)
            .map(|i| Point::from_mm(f64::from(i * 7 % 31) * 1.27, f64::from(i * i % 53) * 0.83))
            .collect();
        let flash = |point: &Point| format!("X{}Y{}D03*", point.x.nm(), point.y.nm());
        (read(&points.iter().map(flash).collect::<String>()), points)
    }

    #[test]
    fn common_shift_is_found() {
        let (gerber, points) = layer();
        let copper = Copper::new([("t", &gerber)].into_iter()).unwrap();
        assert_eq!(copper.fit(&points).share, 1.0);
        let moved: Vec<Point> =
            points.iter().map(|p| Point::from_mm(p.x.mm() - 3.295, p.y.mm() - 140.124)).collect();
        assert_eq!(copper.fit(&moved).share, 0.0);
        let fit = copper.fit_shifted(&moved);
        assert_eq!(fit.share, 1.0);
        assert!((fit.shift_mm.0 - 3.295).abs() < 1e-6 && (fit.shift_mm.1 - 140.124).abs() < 1e-6);
    }

    #[test]
    fn hole_within_a_track_is_on_copper() {
        let gerber = read("X0Y0D02*X10000000D01*");
        let copper = Copper::new([("t", &gerber)].into_iter()).unwrap();
        let fit = copper.fit(&[Point::from_mm(5.0, 0.4), Point::from_mm(5.0, 0.7)]);
        assert_eq!(fit.share, 0.5);
    }
}
