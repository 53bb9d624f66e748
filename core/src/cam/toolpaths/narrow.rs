//! Places that a bit is too wide for.
//!
//! ```text
//!    ▓▓▓▓╲  ╱▓▓▓▓       a neck: what the cut cannot pass though it may reach all of it from both sides, so that nothing
//!    ▓▓▓▓ )( ▓▓▓▓       is closed there. Necks are where a thinner cut ░ goes on from where the wider one had to turn
//!    ▓▓▓▓╱  ╲▓▓▓▓
//!
//!    ▓▓▓▓▓▓▓│    │▓▓▓▓▓▓▓       inlets: an outline grown by the bit's radius and shrunk again closes what the bit
//!    ▓▓▓▓▓▓▓└────┘▓▓▓▓▓▓▓       cannot enter
//! ```
//!
//! Which gaps are not open the proof alone says: a cure takes the neck at its gap, and nothing asks again whether it is one. A
//! thinner bit of the same operation takes the necks between islands, and those that are more than a rounded inner corner.
//!
//! Comes in: copper and the width of a cut. Goes out: necks and inlets, and toolpaths of a thinner bit through them. Does not know
//! operations.

use super::super::work::LocalIsolation;
use super::cut::{self, Area};
use crate::geometry::{
    CombineRule, Island, Path, Point, Region, area_mm2, combine, grow, island_area_mm2, path_bounds,
    rectangle, union,
};
use crate::units::Length;

/// Toolpaths run this much nearer to the copper than the bit's radius, so that a gap exactly as wide as the bit stays open.
pub(super) const NEARER: Length = Length::from_um(1);
/// Gaps are looked for in steps of this: necks of the whole copper are made once for each.
const STEP: Length = Length::from_um(20);
/// Beyond a neck and its gap copper is not looked at.
const ROOM: Length = Length::from_um(500);
/// What lies this near to an island touches it.
const TOUCH: Length = Length::from_um(5);
/// Thinner remains than this are rounding.
const CRUMB: Length = Length::from_um(2);
/// Toolpaths of a thinner cut lie this deep in the necks that they are for.
const WITHIN: Length = Length::from_um(4);
/// What is left in a corner is no longer than so many times what the wider bit's radius is greater: that of a corner of 60°.
const CORNER_FACTOR: f64 = 2.0;

/// Half of a width.
pub(super) fn half(width: Length) -> Length {
    Length::from_nm(width.nm() / 2)
}

/// The places of one island of `outline` that a cut of `width` cannot enter: inlets and inner contours, but not where it only
/// rounds a corner, nor between islands.
pub(super) fn inlets(outline: &Region, width: Length) -> Vec<Island> {
    let radius = half(width) - NEARER;
    let edges = Area::of(outline);
    let closed = grow(&grow(outline, radius), -radius);
    let solid = grow(&grow(&combine(&closed, outline, CombineRule::Difference), -CRUMB), CRUMB);
    let corner = radius.mm() * radius.mm();
    let whole = |place: &Island| {
        let around = path_bounds(&place.outer).grown(TOUCH);
        let mut inner = outline.islands.iter().flat_map(|island| &island.holes).map(path_bounds);
        inner.any(|inner| around.contains(inner.min) && around.contains(inner.max))
    };
    let wanted = |place: &Island| {
        touched(place, &edges, TOUCH) == 1 && (island_area_mm2(place) > corner || whole(place))
    };
    solid.islands.into_iter().filter(wanted).collect()
}

/// How far the way of a cut keeps from the copper.
pub(super) fn kept(width: Length) -> Length {
    half(width) - NEARER
}

/// Where a thinner cut goes on from where a wider one had to turn, to be looked up.
pub(super) struct Necks {
    pub(super) islands: Vec<Island>,
    area: Area,
}

impl Necks {
    /// Where a cut of `width` goes on along `copper` from where one of width `wider` has to turn: what lies between copper and
    /// too near to it for the wider one, less what any of its toolpaths leaves along all edges. Wide enough for the toolpath of the
    /// thinner cut. `grown` is the copper grown by what the toolpath of the wider cut keeps.
    pub(super) fn of((copper, grown): (&Region, &Region), wider: Length, width: Length) -> Self {
        let outer = kept(wider);
        let inner = (half(width) - NEARER - WITHIN).max(Length::ZERO);
        if inner >= outer {
            return Self { islands: Vec::new(), area: Area::of(&Region::default()) };
        }
        let closed = grow(grown, inner - outer);
        let rest = combine(&closed, &grow(copper, inner), CombineRule::Difference);
        let necks = grow(&grow(&rest, -CRUMB), CRUMB);
        Self { area: Area::of(&necks), islands: necks.islands }
    }

    /// The neck that a cure is for: the one that holds the middle of its gap, else the nearest within the gap's width.
    pub(super) fn at(&self, cure: &LocalIsolation) -> Option<&Island> {
        let middle = cut::point_on(cure.from, crate::geometry::PathSegment::Line { to: cure.to }, 0.5);
        let reach = Length::from_mm(cure.from.distance_mm(cure.to)) + TOUCH;
        let near = || Some(self.area.index().nearest(middle, reach)?.edge.island as usize);
        self.islands.get(self.area.index().island_at(middle).or_else(near)?)
    }

    /// Those between islands of the copper, and those that are more than what a cut of width `wider` leaves in a corner.
    pub(super) fn of_a_bit(&self, islands: &Area, (wider, width): (Length, Length)) -> Vec<Island> {
        let corner = Length::from_mm((half(wider) - half(width)).mm() * CORNER_FACTOR);
        let large = |neck: &Island| {
            let bounds = path_bounds(&neck.outer);
            (bounds.max.x - bounds.min.x).max(bounds.max.y - bounds.min.y) > corner
        };
        let wanted = |neck: &&Island| large(neck) || touched(neck, islands, half(width) + TOUCH) > 1;
        self.islands.iter().filter(wanted).cloned().collect()
    }
}

/// The parts of the toolpaths of a cut that lie in `necks`; they go along the edges of `grown`, which is asked for where there are necks.
pub(super) fn paths_in(necks: &[Island], grown: impl FnOnce() -> Region) -> Vec<Path> {
    let zone = grow(&Region { islands: necks.to_vec() }, TOUCH);
    if zone.is_empty() {
        return Vec::new();
    }
    let (zone, region) = (Area::of(&zone), grown());
    let near = |path: &&Path| {
        let bounds = path_bounds(path);
        !zone.index().edges_in(bounds).is_empty() || zone.contains(bounds.min)
    };
    region.paths().filter(near).flat_map(|path| cut::parts(path, &zone, true)).collect()
}

/// How many islands of copper are within `reach` of a narrow place; counting ends at two.
fn touched(place: &Island, islands: &Area, reach: Length) -> usize {
    let mut first = None;
    for (from, segment) in place.paths().flat_map(Path::pieces) {
        for share in [0.0, 0.5] {
            let at = cut::point_on(from, segment, share);
            let Some(near) = islands.index().nearest(at, reach) else { continue };
            match first {
                None => first = Some(near.edge.island),
                Some(island) if island != near.edge.island => return 2,
                Some(_) => {}
            }
        }
    }
    usize::from(first.is_some())
}

/// The toolpaths of a bit that cuts `width` round `copper`, as far as they lie in `places` or near enough to clean them.
pub(super) fn paths_through(copper: &Region, places: &[Island], width: Length) -> Vec<Path> {
    let radius = half(width) - NEARER;
    let zone = grow(&Region { islands: places.to_vec() }, half(width) + TOUCH);
    if zone.is_empty() {
        return Vec::new();
    }
    let zone = Area::of(&zone);
    let region = grow(copper, radius);
    let near = |path: &&Path| {
        let bounds = path_bounds(path);
        !zone.index().edges_in(bounds).is_empty() || zone.contains(bounds.min)
    };
    region.paths().filter(near).flat_map(|path| cut::parts(path, &zone, true)).collect()
}

fn alone(place: &Island) -> Region {
    Region { islands: vec![place.clone()] }
}

/// One way through the middle of the gap of a cure: half of its width beside the island on that side of it that has less of an
/// edge. None where nothing is found.
pub(super) fn centred(copper: &Region, islands: &Area, neck: &Island, cure: &LocalIsolation) -> Vec<Path> {
    let gap = Length::from_mm(cure.from.distance_mm(cure.to));
    let island = |at: Point| {
        let near = islands.index().nearest(at, gap + TOUCH)?;
        copper.islands.get(near.edge.island as usize)
    };
    let edges = |island: &&Island| island.paths().map(|path| path.segments.len()).sum::<usize>();
    let Some(side) = [island(cure.from), island(cure.to)].into_iter().flatten().min_by_key(edges) else {
        return Vec::new();
    };
    let zone = Area::of(&grow(&alone(neck), TOUCH));
    let around = path_bounds(&neck.outer).grown(gap + ROOM);
    let near = combine(&alone(side), &union(&[rectangle(around)]), CombineRule::Intersection);
    let beside = grow(&near, half(gap));
    beside.paths().flat_map(|path| cut::parts(path, &zone, true)).collect()
}

/// The width of a cut that would fit through the middle of a gap, in whole steps, so that equal gaps are looked for once.
pub(super) fn fitting(gap: Length) -> Length {
    let less = gap - CRUMB - CRUMB;
    Length::from_nm(less.nm() - less.nm() % STEP.nm()).max(Length::ZERO)
}

/// Whether anything is left of `region` worth a way.
pub(super) fn is_fragment(region: &Region) -> bool {
    area_mm2(region) < 1e-6
}

/// The middle of a cure's gap, for people.
pub(super) fn middle_text(cure: &LocalIsolation) -> (String, String) {
    let middle: Point = cut::point_on(cure.from, crate::geometry::PathSegment::Line { to: cure.to }, 0.5);
    (format!("{:.3}", middle.x.mm()), format!("{:.3}", middle.y.mm()))
}
