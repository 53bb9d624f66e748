//! Strips: clear channels between facing edges of a region that are narrower than a width, as centre lines.
//!
//! ```text
//!    ▓▓▓▓▓▓▓▓▓▓▓▓         at points along every edge, find the nearest facing edge; if near enough, the
//!    ──┬──┬──┬──┬         midpoint belongs to a strip, unless it was already found from the
//!    ··●··●··●··●··       opposite edge
//!    ──┴──┴──┴──┴
//!    ▓▓▓▓▓▓▓▓▓▓▓▓
//! ```
//!
//! Points are a third of the smaller width apart.

use super::index::{Entry, Index, Near, point};
use super::nearest::{Piece, nearest_pair};
use super::overlay::{Spot, apart};
use super::{Point, Region};
use crate::units::Length;
use std::collections::BTreeMap;

const ACROSS_COSINE: f64 = 0.6;
/// Consecutive edges with a cosine above this do not face each other.
const ONWARD_COSINE: f64 = -0.3;
/// Facing lines have at most this cosine between their directions.
const AGAINST_COSINE: f64 = -0.5;
/// Points of the strip itself count as found only this many points before its front.
const TRAIL: usize = 3;
const MOST_PLACES: f64 = 100_000.0;

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Strip {
    /// Points of the centre line, with the width of the channel.
    pub middle: Vec<(Point, Length)>,
    /// True if both sides are edges of one outline.
    pub own: bool,
    /// The point of the region's edges nearest to the first point.
    pub beside: Option<Near>,
}

struct Side<'a> {
    entry: &'a Entry,
    around: [usize; 2],
    outline: usize,
}

fn dot(a: Spot, b: Spot) -> f64 {
    a.0 * b.0 + a.1 * b.1
}

fn right_of(heading: Spot) -> Spot {
    (heading.1, -heading.0)
}

fn sides<'a>(region: &Region, entries: &'a [Entry]) -> Vec<Side<'a>> {
    let mut sides = Vec::with_capacity(entries.len());
    let mut rest = entries.iter();
    let mut first = 0;
    for (outline, path) in region.paths().enumerate() {
        let count = path.segments.len();
        for (at, entry) in rest.by_ref().take(count).enumerate() {
            let around = [first + (at + count - 1) % count, first + (at + 1) % count];
            sides.push(Side { entry, around, outline });
        }
        first += count;
    }
    sides
}

impl Side<'_> {
    /// True if `other` may face it within `reach` nm.
    fn may_face(&self, other: &Entry, reach: f64) -> bool {
        let (one, two) = (&self.entry.piece, &other.piece);
        if other.number() == self.entry.number() {
            return false;
        }
        let [before, after] = self.around;
        if other.number() == after && dot(one.heading(true), two.heading(false)) > ONWARD_COSINE
            || other.number() == before && dot(two.heading(true), one.heading(false)) > ONWARD_COSINE
        {
            return false;
        }
        let lines = one.bow.is_none() && two.bow.is_none();
        if lines && dot(one.heading(false), two.heading(false)) > AGAINST_COSINE {
            return false;
        }
        let (p, q) = nearest_pair(one, two);
        apart(p, q) < reach
    }
}

fn length(piece: &Piece) -> f64 {
    piece.bow.map_or_else(|| apart(piece.from, piece.to), |bow| bow.radius_nm * bow.turn_rad)
}

fn facing<'a>(place: Spot, out: Spot, others: &[&'a Entry]) -> Option<(Spot, f64, &'a Entry)> {
    let mut best: Option<(Spot, f64, &Entry)> = None;
    for &other in others {
        let at = other.piece.nearest(place);
        let distance = apart(place, at);
        if distance < 1.0 || best.is_some_and(|(_, least, _)| distance >= least) {
            continue;
        }
        let way = ((at.0 - place.0) / distance, (at.1 - place.1) / distance);
        let theirs = right_of(other.piece.heading_at(at));
        if dot(way, out) > ACROSS_COSINE && -dot(way, theirs) > ACROSS_COSINE {
            best = Some((at, distance, other));
        }
    }
    best
}

/// Points already found, in cells of the tolerance.
struct Told {
    reach: f64,
    cells: BTreeMap<(i64, i64), Vec<Spot>>,
}

impl Told {
    fn cell(&self, at: Spot) -> (i64, i64) {
        let cell = |value: f64| libm::floor(value / self.reach) as i64;
        (cell(at.0), cell(at.1))
    }

    fn holds(&self, at: Spot) -> bool {
        let (column, row) = self.cell(at);
        let mut near = (-1..=1).flat_map(|dx| (-1..=1).map(move |dy| (column + dx, row + dy)));
        near.any(|cell| {
            self.cells.get(&cell).is_some_and(|spots| spots.iter().any(|spot| apart(*spot, at) < self.reach))
        })
    }

    fn add(&mut self, at: Spot) {
        self.cells.entry(self.cell(at)).or_default().push(at);
    }
}

struct Search<'a> {
    index: &'a Index,
    wider: f64,
    told: Told,
    open: Strip,
    found: Vec<Strip>,
}

impl Search<'_> {
    /// Continues the strip at a midpoint, or ends it.
    fn next(&mut self, found: Option<(Spot, f64, bool)>) {
        let clear = |middle: Spot| {
            let near = self.index.nearest(point(middle), Length::from_nm((self.wider * 0.46) as i64));
            near.is_none() && self.index.island_at(point(middle)).is_none()
        };
        let wanted = |&(middle, width, _): &(Spot, f64, bool)| {
            width > self.wider && !self.told.holds(middle) && clear(middle)
        };
        let Some((middle, width, own)) = found.filter(wanted) else {
            self.end();
            return;
        };
        self.open.own = own && (self.open.own || self.open.middle.is_empty());
        self.open.middle.push((point(middle), Length::from_nm(width as i64)));
        if let Some(&(behind, _)) = self.open.middle.iter().rev().nth(TRAIL) {
            self.told.add(super::overlay::spot(behind));
        }
    }

    fn end(&mut self) {
        let mut strip = std::mem::take(&mut self.open);
        for &(at, _) in strip.middle.iter().rev().take(TRAIL) {
            self.told.add(super::overlay::spot(at));
        }
        if let Some(&(first, _)) = strip.middle.first() {
            strip.beside = self.index.nearest(first, super::REACH);
            self.found.push(strip);
        }
    }
}

/// The strips clear of `region`, wider than `wider` and narrower than `narrower`. Each centre point is at
/// least 0.46 of `wider` away from the region.
pub fn strips(region: &Region, wider: Length, narrower: Length) -> Vec<Strip> {
    if wider.nm() <= 0 || narrower <= wider {
        return Vec::new();
    }
    let index = Index::of(region);
    let sides = sides(region, index.entries());
    let (step, reach) = (wider.nm() as f64 / 3.0, narrower.nm() as f64);
    let told = Told { reach: step * 1.2, cells: BTreeMap::new() };
    let mut search =
        Search { index: &index, wider: wider.nm() as f64, told, open: Strip::default(), found: Vec::new() };
    let mut outline = None;
    for side in &sides {
        if outline.replace(side.outline) != Some(side.outline) {
            search.end();
        }
        let entry = side.entry;
        let room = entry.bounds().grown(narrower);
        let mut others: Vec<&Entry> =
            index.entries_in(room).filter(|other| side.may_face(other, reach)).collect();
        if others.is_empty() {
            search.end();
            continue;
        }
        others.sort_by_key(|other| other.number());
        let count = libm::ceil(length(&entry.piece) / step).clamp(1.0, MOST_PLACES);
        for number in 0..count as usize {
            let place = entry.piece.at((number as f64 + 0.5) / count);
            let out = right_of(entry.piece.heading_at(place));
            let found = facing(place, out, &others).filter(|(_, width, _)| *width < reach);
            search.next(found.map(|(at, width, other)| {
                let own = sides.get(other.number()).is_some_and(|other| other.outline == side.outline);
                (((place.0 + at.0) / 2.0, (place.1 + at.1) / 2.0), width, own)
            }));
        }
    }
    search.end();
    search.found
}
