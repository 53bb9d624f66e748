//! Subtracts many outlines from a ground, band by band, so that memory depends on the result and not on the
//! outlines.
//!
//! ```text
//!   ┌────┬────┬────┐    outlines are cut at the borders of the bands, each band is computed alone. Where two
//!   │ ▒▒▒▒▒▒▒│▒▒▒  │    bands meet, edges on their border cancel, and the rest is chained to whole contours.
//!   │   ▒▒▒▒▒│▒    │    A contour that meets no later border is a path at once
//!   └────┴────┴────┘
//! ```
//!
//! The topology is exact: a band's contours are closed, so their sum is closed as well.

use super::clusters::{root, unite};
use super::combine::FRAGMENT_NM;
use super::overlay::{Circle, Edge, Fill, Overlay, Pile, Place, Tag, edge, edges_of, found, overlaid, trace};
use super::simplify::simplify;
use super::{Bounds, Exposure, Island, Path, Region, paint, rebuild, winding};
use std::collections::BTreeMap;

/// Edges overlaid in one band; up to twice as many need no bands.
const BAND_EDGES: usize = 150_000;
const EDGES_PER_ARC: usize = 16;
/// Columns in which edges are counted to place the borders.
const COLUMNS: usize = 4_096;

/// Outlines that are generated on demand.
pub struct Outlines<'a> {
    /// Bounds of each, and its number of segments, about.
    pub sizes: &'a [(Bounds, usize)],
    pub make: &'a dyn Fn(usize) -> Vec<Path>,
}

/// A range of X: above `low`, up to `high`.
#[derive(Clone, Copy)]
struct Band {
    low: i32,
    high: i32,
}

#[derive(Clone, Copy)]
struct Open {
    a: Place,
    b: Place,
    circle: Option<Circle>,
    piece: usize,
}

/// A piece of a border with the inside on its left.
#[derive(Clone, Copy)]
struct Rim {
    from: i32,
    to: i32,
    piece: usize,
}

#[derive(Default)]
struct Seam {
    parents: Vec<usize>,
    open: Vec<Open>,
    rims: Vec<Rim>,
    whole: Vec<Island>,
    contours: Vec<(usize, Path)>,
}

/// The rest of `ground`, its paths with the inside on the left, after subtracting `outlines`.
pub fn left_of(ground: &[Path], outlines: &Outlines<'_>) -> Region {
    left_of_in(ground, outlines, BAND_EDGES)
}

fn left_of_in(ground: &[Path], outlines: &Outlines<'_>, most: usize) -> Region {
    let borders = borders(outlines.sizes, most);
    if borders.is_empty() {
        let away = (0..outlines.sizes.len()).flat_map(outlines.make).collect();
        let material = Exposure { clear: false, outlines: ground.to_vec() };
        return paint(&[material, Exposure { clear: true, outlines: away }]);
    }
    let mut seam = Seam::default();
    let lows = std::iter::once(i32::MIN).chain(borders.iter().copied());
    for (low, high) in lows.zip(borders.iter().copied().chain([i32::MAX])) {
        seam.add(ground, outlines, Band { low, high });
    }
    seam.region()
}

/// Borders between bands; empty if everything fits into one.
fn borders(sizes: &[(Bounds, usize)], most: usize) -> Vec<i32> {
    let edges = |segments: usize| segments.saturating_mul(EDGES_PER_ARC);
    let all: usize = sizes.iter().map(|(_, segments)| edges(*segments)).sum();
    let bounds =
        sizes.iter().map(|(bounds, _)| *bounds).reduce(|all, next| all.with(next.min).with(next.max));
    let Some(bounds) = bounds.filter(|bounds| all > 2 * most && bounds.is_in_reach()) else {
        return Vec::new();
    };
    let (left, wide) = (bounds.min.x.nm(), (bounds.max.x - bounds.min.x).nm() + 1);
    let column =
        |x: i64| ((x - left).saturating_mul(COLUMNS as i64) / wide).clamp(0, COLUMNS as i64 - 1) as usize;
    let mut counts = vec![0.0; COLUMNS];
    for (bounds, segments) in sizes {
        let (first, last) = (column(bounds.min.x.nm()), column(bounds.max.x.nm()));
        let share = edges(*segments) as f64 / (last - first + 1) as f64;
        counts.iter_mut().skip(first).take(last - first + 1).for_each(|count| *count += share);
    }
    let (mut borders, mut sum) = (Vec::new(), 0.0);
    for (number, count) in counts.into_iter().enumerate() {
        if sum > 0.0 && sum + count > most as f64 {
            borders.extend(i32::try_from(left + wide * number as i64 / COLUMNS as i64));
            sum = 0.0;
        }
        sum += count;
    }
    borders.dedup();
    borders
}

impl Band {
    /// 0 left of the band, 1 in it, 2 right of it.
    fn zone(self, (x, _): Place) -> u8 {
        if x <= self.low { 0 } else { 1 + u8::from(x > self.high) }
    }

    /// The crossing of an edge with a border: identical for both adjacent bands.
    fn at(border: i32, a: Place, b: Place) -> Place {
        let share = (f64::from(border) + 0.5 - f64::from(a.0)) / (f64::from(b.0) - f64::from(a.0));
        let y = f64::from(a.1) + (f64::from(b.1) - f64::from(a.1)) * share;
        (border, libm::round(y) as i32)
    }

    /// The part of an outline inside the band, closed along the borders.
    fn part(self, outline: &[Edge], into: &mut Pile) {
        let start = into.edges.len();
        let mut last: Option<Place> = None;
        let mut first = None;
        let mut put = |into: &mut Pile, a: Place, b: Place, tag: Tag| {
            if let Some(before) = last.filter(|before| *before != a) {
                into.edges.push(edge(before, a, Tag::STRAIGHT));
            }
            first = first.or(Some(a));
            if a != b {
                into.edges.push(edge(a, b, tag));
            }
            last = Some(b);
        };
        for one in outline {
            let (a, b) = ((one.a.x, one.a.y), (one.b.x, one.b.y));
            let (from, to) = (self.zone(a), self.zone(b));
            if from == to && from != 1 {
                continue;
            }
            let end = |zone: u8, place: Place| match zone {
                0 => Self::at(self.low, a, b),
                1 => place,
                _ => Self::at(self.high, a, b),
            };
            put(into, end(from, a), end(to, b), one.data);
        }
        if let (Some(first), Some(last)) = (first, last)
            && first != last
        {
            into.edges.push(edge(last, first, Tag::STRAIGHT));
        }
        if into.edges.len() > start {
            into.ends.push(into.edges.len());
        }
    }

    fn is_border(self, (x, _): Place) -> bool {
        x == self.low || x == self.high
    }
}

impl Seam {
    fn add(&mut self, ground: &[Path], outlines: &Outlines<'_>, band: Band) {
        let mut overlay = Overlay::default();
        let lay = |overlay: &mut Overlay, paths: &[Path], into: &mut Pile| {
            for path in paths {
                overlay.path(path);
                let pile = overlay.take();
                pile.outlines().for_each(|outline| band.part(outline, into));
            }
        };
        let (mut under, mut away) = (Pile::default(), Pile::default());
        lay(&mut overlay, ground, &mut under);
        for (number, (bounds, _)) in outlines.sizes.iter().enumerate() {
            if bounds.max.x.nm() >= i64::from(band.low) && bounds.min.x.nm() <= i64::from(band.high) {
                lay(&mut overlay, &(outlines.make)(number), &mut away);
            }
        }
        // Simplify both together: or a long chord would meet an edge of the other pile far from its arc.
        let [under, away] = simplify([&under, &away]);
        let away = trace(&away, Fill::NonZero);
        let under = trace(&under, Fill::NonZero);
        let under = under.iter().flat_map(edges_of);
        let shapes = overlaid(under, away.iter().flat_map(edges_of), std::iter::empty());
        drop(away);
        let mut rims = Vec::new();
        for shape in &shapes {
            let places = || shape.iter().flatten().map(|edge| (edge.a.x, edge.a.y));
            if !places().any(|place| band.is_border(place)) {
                self.whole.extend(
                    rebuild::region(std::slice::from_ref(shape), &overlay.circles, FRAGMENT_NM).islands,
                );
                continue;
            }
            let piece = self.parents.len();
            self.parents.push(piece);
            for contour in shape {
                if !contour.iter().any(|edge| band.is_border((edge.a.x, edge.a.y))) {
                    let path = rebuild::path(contour, &overlay.circles, FRAGMENT_NM);
                    self.contours.extend(path.map(|path| (piece, path)));
                    continue;
                }
                for edge in contour {
                    let (a, b) = ((edge.a.x, edge.a.y), (edge.b.x, edge.b.y));
                    let circle = edge.data.circle().and_then(|index| overlay.circles.get(index).copied());
                    let rim = Rim { from: a.1, to: b.1, piece };
                    match (a.0 == b.0, a.0) {
                        (true, x) if x == band.low => self.rims.push(rim),
                        (true, x) if x == band.high => rims.push(rim),
                        _ => self.open.push(Open { a, b, circle, piece }),
                    }
                }
            }
        }
        self.cancel(band.low);
        self.rims = rims;
        self.close(band.high);
    }

    /// Removes border edges present on both sides, which unites their pieces; the rest becomes normal edges.
    fn cancel(&mut self, border: i32) {
        let rims = std::mem::take(&mut self.rims);
        let mut stops: Vec<i32> = rims.iter().flat_map(|rim| [rim.from, rim.to]).collect();
        stops.sort_unstable();
        stops.dedup();
        let mut starting: Vec<&Rim> = rims.iter().collect();
        starting.sort_by_key(|rim| rim.from.min(rim.to));
        let (mut next, mut here): (usize, Vec<&Rim>) = (0, Vec::new());
        for pair in stops.windows(2) {
            let &[low, high] = pair else { continue };
            here.retain(|rim| rim.from.max(rim.to) > low);
            while let Some(rim) = starting.get(next).filter(|rim| rim.from.min(rim.to) <= low) {
                here.push(rim);
                next += 1;
            }
            let up: i32 = here.iter().map(|rim| if rim.to > rim.from { 1 } else { -1 }).sum();
            let Some(first) = here.first() else { continue };
            if here.len() > 1 {
                here.iter().for_each(|rim| unite(&mut self.parents, first.piece, rim.piece));
            }
            let (from, to) = if up > 0 { (low, high) } else { (high, low) };
            for _ in 0..up.abs() {
                let (a, b) = ((border, from), (border, to));
                self.open.push(Open { a, b, circle: None, piece: first.piece });
            }
        }
    }

    /// Chains open edges to contours; contours that meet the border ahead stay open.
    fn close(&mut self, ahead: i32) {
        let open = std::mem::take(&mut self.open);
        let mut by_start: Vec<(Place, usize)> =
            open.iter().enumerate().map(|(index, edge)| (edge.a, index)).collect();
        by_start.sort_unstable();
        let mut used = vec![false; open.len()];
        for first in 0..open.len() {
            if used.get(first).copied().unwrap_or(true) {
                continue;
            }
            let (mut ring, mut at) = (Vec::new(), first);
            let is_whole = loop {
                let Some((edge, slot)) = open.get(at).zip(used.get_mut(at)) else { break false };
                *slot = true;
                ring.push(*edge);
                if ring.first().is_some_and(|first| first.a == edge.b) {
                    break true;
                }
                if edge.b.0 == ahead {
                    break false;
                }
                let from = by_start.partition_point(|(place, _)| *place < edge.b);
                let here = by_start.iter().skip(from).take_while(|(place, _)| *place == edge.b);
                let free = here.filter(|(_, index)| used.get(*index) == Some(&false));
                let turn =
                    |(_, index): &&(Place, usize)| open.get(*index).map_or(0.0, |next| turned(edge, next));
                match free.max_by(|one, other| turn(one).total_cmp(&turn(other))) {
                    Some((_, index)) => at = *index,
                    None => break false,
                }
            };
            if is_whole {
                self.contours.extend(whole(&ring));
            } else {
                self.open.extend(ring);
            }
        }
    }

    fn region(mut self) -> Region {
        let mut pieces: BTreeMap<usize, Vec<Path>> = BTreeMap::new();
        for (piece, path) in std::mem::take(&mut self.contours) {
            pieces.entry(root(&mut self.parents, piece)).or_default().push(path);
        }
        let mut islands = self.whole;
        for paths in pieces.into_values() {
            let (outer, mut holes): (Vec<Path>, Vec<Path>) =
                paths.into_iter().partition(|path| super::path_area_mm2(path) > 0.0);
            holes.sort();
            let alone = outer.len() == 1;
            for outer in outer {
                let inside = |hole: &Path| alone || winding(&outer, hole.start) != 0;
                let holes = holes.iter().filter(|hole| inside(hole)).cloned().collect();
                islands.push(Island { outer, holes });
            }
        }
        islands.sort();
        Region { islands }
    }
}

/// Left turn from `edge` to `next`, in radians; turning back is the smallest.
fn turned(edge: &Open, next: &Open) -> f64 {
    let way =
        |edge: &Open| (f64::from(edge.b.0) - f64::from(edge.a.0), f64::from(edge.b.1) - f64::from(edge.a.1));
    let (one, two) = (way(edge), way(next));
    libm::atan2(one.0 * two.1 - one.1 * two.0, one.0 * two.0 + one.1 * two.1)
}

/// A complete contour as a path of its piece; `None` for dust.
fn whole(ring: &[Open]) -> Option<(usize, Path)> {
    let mut circles: Vec<Circle> = Vec::new();
    let mut contour = Vec::with_capacity(ring.len());
    for edge in ring {
        let tag = match edge.circle {
            None => Tag::STRAIGHT,
            Some(circle) => {
                if circles.last() != Some(&circle) {
                    circles.push(circle);
                }
                Tag::of(circles.len() - 1)
            }
        };
        contour.push(found(edge.a, edge.b, tag));
    }
    Some((ring.first()?.piece, rebuild::path(&contour, &circles, FRAGMENT_NM)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{CombineRule, Point, area_mm2, combine, rectangle, stroke};
    use crate::units::Length;

    /// Rings, straight cuts across, a spiral and plunges on a plate of 30 by 12 mm.
    fn cuts() -> Vec<(Path, Length)> {
        let at = |x: f64, y: f64| Point::from_mm(x, y);
        let ring = |x: f64, y: f64, radius: f64| {
            let start = at(x + radius, y);
            let round = super::super::PathSegment::Arc { to: start, centre: at(x, y), clockwise: false };
            Path { start, segments: vec![round] }
        };
        let mut paths: Vec<Path> = Vec::new();
        for column in 0..20 {
            for row in 0..7 {
                let (x, y) = (f64::from(column) * 1.4 + 1.0, f64::from(row) * 1.6 + 1.0);
                paths.push(ring(x, y, 0.3 + 0.03 * f64::from((column * 7 + row) % 18)));
            }
        }
        paths.extend([1.0, 7.0, 7.05].map(|y| Path::through(&[at(-1.0, y), at(31.0, y + 0.3)]).unwrap()));
        paths.push(Path::through(&[at(12.0, -1.0), at(12.0, 13.0)]).unwrap());
        let spiral = |step: u32| {
            let turn = f64::from(step) * 0.2;
            at(15.0 + turn * 0.15 * libm::cos(turn), 6.0 + turn * 0.15 * libm::sin(turn))
        };
        paths.push(Path::through(&(0..150).map(spiral).collect::<Vec<_>>()).unwrap());
        paths.push(Path { start: at(3.0, 6.0), segments: Vec::new() });
        paths.into_iter().map(|path| (path, Length::from_mm(0.2))).collect()
    }

    #[test]
    fn painting_in_bands_equals_painting_at_once() {
        let cuts = cuts();
        let plate = rectangle(Bounds { min: Point::default(), max: Point::from_mm(30.0, 12.0) });
        let ground =
            [plate, super::super::circle(Point::from_mm(20.0, 6.0), Length::from_mm(3.0)).reversed()];
        let sizes: Vec<(Bounds, usize)> =
            cuts.iter().map(|(path, width)| (super::super::path_bounds(path).grown(*width), 8)).collect();
        let make = |number: usize| stroke(&cuts[number].0, cuts[number].1);
        let outlines = Outlines { sizes: &sizes, make: &make };
        let whole = left_of_in(&ground, &outlines, usize::MAX / 2);
        assert!(whole.islands.len() > 50, "{}", whole.islands.len());
        for most in [400, 1_000, 3_000] {
            let borders = borders(&sizes, most);
            assert!(borders.len() > 2, "{most}: {borders:?}");
            let banded = left_of_in(&ground, &outlines, most);
            let counts = |region: &Region| {
                let holes: usize = region.islands.iter().map(|island| island.holes.len()).sum();
                let segments: usize = region.paths().map(|path| path.segments.len()).sum();
                (region.islands.len(), holes, segments)
            };
            assert_eq!(counts(&banded), counts(&whole), "{most}");
            let off = area_mm2(&combine(&banded, &whole, CombineRule::Xor));
            assert!(off < 1e-5, "{most}: {off} mm² differ");
        }
    }
}
