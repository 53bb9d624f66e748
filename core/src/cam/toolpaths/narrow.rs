//! Places too narrow for a tool.
//!
//! ```text
//!    ▓▓▓▓╲  ╱▓▓▓▓       a neck: the cut can't pass, although it may reach all of it from both sides.
//!    ▓▓▓▓ )( ▓▓▓▓       In necks a narrower cut ░ continues where the wider one had to turn
//!    ▓▓▓▓╱  ╲▓▓▓▓
//!
//!    ▓▓▓▓▓▓▓│    │▓▓▓▓▓▓▓       inlets: growing an outline by the tool's radius and shrinking it again
//!    ▓▓▓▓▓▓▓└────┘▓▓▓▓▓▓▓       closes places that the tool cannot enter
//! ```
//!
//! Only the proof decides which gaps are uncut: a fix uses the neck at its gap without another check. A
//! narrower tool of the operation cuts the necks between islands, and those larger than a rounded inner
//! corner.

use super::super::work::LocalIsolation;
use super::cut::{self, Area};
use crate::geometry::{
    CombineRule, Island, Path, Point, Region, area_mm2, combine, grow, island_area_mm2, path_bounds,
    rectangle, union,
};
use crate::units::Length;

/// Toolpaths are this much nearer to the copper than the tool's radius, so that a gap exactly as wide as the
/// tool stays open.
pub(super) const NEARER: Length = Length::from_um(1);
/// Gaps are searched in steps of this: necks of the whole copper are computed once for each.
const STEP: Length = Length::from_um(20);
/// Copper beyond a neck and its gap by this is ignored.
const ROOM: Length = Length::from_um(500);
/// A place this near to an island touches it.
const TOUCH: Length = Length::from_um(5);
const CRUMB: Length = Length::from_um(2);
const WITHIN: Length = Length::from_um(4);
/// The rest in a corner is at most this many times the difference of both radii long: a corner of 60°.
const CORNER_FACTOR: f64 = 2.0;

pub(super) fn half(width: Length) -> Length {
    Length::from_nm(width.nm() / 2)
}

/// Inlets and inner contours of one island of `outline` that a cut of `width` cannot enter. Excludes rounded
/// corners and gaps between islands.
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

/// Distance of a cut's toolpath from the copper.
pub(super) fn kept(width: Length) -> Length {
    half(width) - NEARER
}

/// Necks where a narrower cut continues and a wider one had to turn, prepared for queries.
pub(super) struct Necks {
    pub(super) islands: Vec<Island>,
    area: Area,
}

impl Necks {
    /// Necks along `copper` where a cut of `width` continues and one of width `wider` has to turn. A neck is
    /// the area between copper that is too near for the wider cut. The rest that its toolpaths leave along
    /// all edges is subtracted. Each is wide enough for the toolpath of the narrower cut. `grown` is the
    /// copper grown by the distance of the wider toolpath.
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

    /// The neck of a fix: the one that contains the middle of its gap, else the nearest within the gap's
    /// width.
    pub(super) fn at(&self, cure: &LocalIsolation) -> Option<&Island> {
        let middle = cut::point_on(cure.from, crate::geometry::PathSegment::Line { to: cure.to }, 0.5);
        let reach = Length::from_mm(cure.from.distance_mm(cure.to)) + TOUCH;
        let near = || Some(self.area.index().nearest(middle, reach)?.edge.island as usize);
        self.islands.get(self.area.index().island_at(middle).or_else(near)?)
    }

    /// Necks between islands of the copper, and necks larger than the rest that a cut of width `wider` leaves
    /// in a corner.
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

/// The parts of a cut's toolpaths in `necks`. They follow the edges of `grown`, which is computed only if
/// there are necks.
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

/// Number of copper islands within `reach` of a narrow place; stops at two.
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

/// The toolpaths of a tool that cuts `width` around `copper`, as far as they are in `places` or near enough
/// to clear them.
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

/// One path through the middle of the gap of a fix: at half its width from the island on the side with fewer
/// edges. Empty if nothing is found.
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

/// Width of a cut that fits through the middle of a gap, in steps, so that equal gaps are searched once.
pub(super) fn fitting(gap: Length) -> Length {
    let less = gap - CRUMB - CRUMB;
    Length::from_nm(less.nm() - less.nm() % STEP.nm()).max(Length::ZERO)
}

/// True if the rest of `region` is negligible.
pub(super) fn is_fragment(region: &Region) -> bool {
    area_mm2(region) < 1e-6
}

/// The middle of a fix's gap, for people.
pub(super) fn middle_text(cure: &LocalIsolation) -> (String, String) {
    let middle: Point = cut::point_on(cure.from, crate::geometry::PathSegment::Line { to: cure.to }, 0.5);
    (format!("{:.3}", middle.x.mm()), format!("{:.3}", middle.y.mm()))
}
