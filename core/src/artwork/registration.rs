//! Which reading of a drill file puts its holes on the pads of the copper beside it?
//!
//! Comes in: hole centres under one reading, the copper of the same folder. Goes out: the share of holes that lie on it,
//! and the shift under which they do. Compares; knows no threshold of truth, because pads drawn as strokes and unplated
//! holes keep even the right reading below 100 %.
//!
//! ```text
//! holes  ●    ●  ●         ●   ●● shifted by the vector that most pairs (hole, pad) agree on
//! pads     ◎    ◎  ◎         ◎   ◎◎
//! ```

use super::gerber::{Gerber, Track};
use crate::geometry::Point;
use crate::units::Length;
use rstar::primitives::{GeomWithData, Line};
use rstar::{AABB, RTree};

/// A hole this close to a pad's centre, or to a track's edge, lies on it.
const TOLERANCE_MM: f64 = 0.05;
/// Holes looked at.
pub(super) const SAMPLE: usize = 600;
/// Holes and pads that vote for a shift.
const VOTING_HOLES: usize = 24;
const VOTING_PADS: usize = 3_000;
/// Cells in which votes are counted.
const VOTE_CELL_MM: f64 = 0.1;
/// Unshifted readings that fit this well need no shift.
pub(super) const FITS: f64 = 0.5;

/// The copper of a folder, ready to be asked.
pub(super) struct Copper {
    layers: Vec<Layer>,
}

/// The pads and tracks of one layer.
pub(super) struct Layer {
    /// The name of its file.
    pub(super) name: String,
    pads: RTree<[f64; 2]>,
    tracks: RTree<GeomWithData<Line<[f64; 2]>, f64>>,
    widest_mm: f64,
}

/// How well holes fit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Fit {
    /// Share of holes on copper, 0 to 1.
    pub(super) share: f64,
    /// Added to holes, in mm.
    pub(super) shift_mm: (f64, f64),
}

impl Layer {
    /// None if there are no pads and no tracks.
    fn new(name: &str, layer: &Gerber) -> Option<Self> {
        let pads: Vec<[f64; 2]> = layer.pads().into_iter().map(mm).collect();
        let (mut tracks, mut widest_mm) = (Vec::new(), 0.0_f64);
        for Track { from, to, half_width } in layer.tracks() {
            widest_mm = widest_mm.max(half_width.mm());
            tracks.push(GeomWithData::new(Line::new(mm(from), mm(to)), half_width.mm()));
        }
        (!pads.is_empty() || !tracks.is_empty()).then(|| Self {
            name: name.to_owned(),
            pads: RTree::bulk_load(pads),
            tracks: RTree::bulk_load(tracks),
            widest_mm,
        })
    }

    fn on_copper(&self, [x, y]: [f64; 2]) -> bool {
        let near_pad = self.pads.locate_within_distance([x, y], TOLERANCE_MM * TOLERANCE_MM).next().is_some();
        let reach = self.widest_mm + TOLERANCE_MM;
        let around = AABB::from_corners([x - reach, y - reach], [x + reach, y + reach]);
        near_pad
            || self.tracks.locate_in_envelope_intersecting(&around).any(|track| {
                let within = track.data + TOLERANCE_MM;
                rstar::PointDistance::distance_2(track.geom(), &[x, y]) <= within * within
            })
    }
}

impl Copper {
    /// The pads and tracks of some layers, each with its name; none if there are no pads and no tracks.
    pub(super) fn new<'a>(layers: impl Iterator<Item = (&'a str, &'a Gerber)>) -> Option<Self> {
        let layers: Vec<Layer> = layers.filter_map(|(name, layer)| Layer::new(name, layer)).collect();
        (!layers.is_empty()).then_some(Self { layers })
    }

    /// How well holes fit where they are.
    pub(super) fn fit(&self, holes: &[Point]) -> Fit {
        Fit { share: share(&self.layers, holes, (0.0, 0.0)), shift_mm: (0.0, 0.0) }
    }

    /// How well holes fit under the one shift that serves them best.
    pub(super) fn fit_shifted(&self, holes: &[Point]) -> Fit {
        fit_shifted(&self.layers, holes)
    }

    /// Whether a hole moved by `shift` in mm lies on copper.
    pub(super) fn has(&self, hole: Point, shift: (f64, f64)) -> bool {
        on_copper(&self.layers, hole, shift)
    }

    /// The layers, each as copper of its own; none where there is only one.
    pub(super) fn apart(&self) -> &[Layer] {
        if self.layers.len() > 1 { &self.layers } else { &[] }
    }
}

fn on_copper(layers: &[Layer], hole: Point, shift: (f64, f64)) -> bool {
    let at = [hole.x.mm() + shift.0, hole.y.mm() + shift.1];
    layers.iter().any(|layer| layer.on_copper(at))
}

/// The share of holes on one of `layers`, once they are moved by `shift` in mm.
pub(super) fn share(layers: &[Layer], holes: &[Point], shift: (f64, f64)) -> f64 {
    let on = |hole: &&Point| on_copper(layers, **hole, shift);
    holes.iter().filter(on).count() as f64 / holes.len().max(1) as f64
}

/// How well holes fit `layers` under the one shift that serves them best.
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
    // A true shift may fall on the border of two cells: count each vote in the cells around it too.
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
    let mut xs: Vec<f64> = places.iter().filter(in_cell).map(|place| place.0).collect();
    let mut ys: Vec<f64> = places.iter().filter(in_cell).map(|place| place.1).collect();
    xs.sort_unstable_by(f64::total_cmp);
    ys.sort_unstable_by(f64::total_cmp);
    Some((*xs.get(xs.len() / 2)?, *ys.get(ys.len() / 2)?))
}

/// About `most` of `all`, evenly spread.
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

    /// A layer of some words, drawn with a circle of 1 mm.
    fn read(words: &str) -> Gerber {
        let text = format!("%FSLAX46Y46*%%MOMM*%%ADD10C,1*%D10*{words}M02*");
        super::super::gerber::read("t", text.as_bytes(), &super::super::Overrides::default()).0
    }

    /// Pads on a crooked grid, so that no shift but one fits.
    fn layer() -> (Gerber, Vec<Point>) {
        let points: Vec<Point> = (0..60)
            .map(|i| Point::from_mm(f64::from(i * 7 % 31) * 1.27, f64::from(i * i % 53) * 0.83))
            .collect();
        let flash = |point: &Point| format!("X{}Y{}D03*", point.x.nm(), point.y.nm());
        (read(&points.iter().map(flash).collect::<String>()), points)
    }

    #[test]
    fn a_common_shift_is_found() {
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
    fn a_hole_within_a_track_is_on_copper() {
        let gerber = read("X0Y0D02*X10000000D01*");
        let copper = Copper::new([("t", &gerber)].into_iter()).unwrap();
        let fit = copper.fit(&[Point::from_mm(5.0, 0.4), Point::from_mm(5.0, 0.7)]);
        assert_eq!(fit.share, 0.5);
    }
}
