//! Places that a bit is too wide for: what stays between copper when a round bit has gone round all of it.
//!
//! ```text
//!    ▓▓▓▓▓▓▓│    │▓▓▓▓▓▓▓       the copper grown by the bit's radius and shrunk again closes what the bit
//!    ▓▓▓▓▓▓▓│░░░░│▓▓▓▓▓▓▓       cannot enter; less the copper that is the narrow place ░
//! ```
//!
//! Rounded inner corners are such places too; they are left out as long as they join no two islands and are small.
//!
//! ```text
//!    ▓▓▓▓╲  ╱▓▓▓▓       a neck: what the cut cannot pass though it may reach all of it from both sides, so that nothing
//!    ▓▓▓▓ )( ▓▓▓▓       is closed there. Necks are where a thinner cut ░ goes on from where the wider one had to turn
//!    ▓▓▓▓╱  ╲▓▓▓▓
//! ```
//!
//! Which gaps are not open the proof alone says: a cure takes the neck at its gap, and nothing asks again whether it is one.
//!
//! Comes in: copper and the width of a cut. Goes out: narrow places and necks, and ways of a thinner bit through them. Does not
//! know operations.

use super::super::work::Cure;
use super::cut::{self, Area};
use crate::geometry::{
    Island, Path, Point, Region, Rule, area_mm2, combine, grow, island_area_mm2, path_bounds,
};
use crate::units::Length;

/// Ways run this much nearer to the copper than the bit's radius, so that a gap exactly as wide as the bit stays open.
pub(super) const NEARER: Length = Length::from_um(1);
/// Gaps are looked for in steps of this.
const STEP: Length = Length::from_um(5);
/// What lies this near to an island touches it.
const TOUCH: Length = Length::from_um(5);
/// Thinner remains than this are rounding.
const CRUMB: Length = Length::from_um(2);
/// Ways of a thinner cut lie this deep in the necks that they are for.
const WITHIN: Length = Length::from_um(4);
/// Corners whose remains are smaller than the square of the radius times this stay.
const CORNER: f64 = 1.0;

/// Half of a width.
pub(super) fn half(width: Length) -> Length {
    Length::from_nm(width.nm() / 2)
}

/// The places of `copper` that a cut of `width` cannot enter and that join islands, or are more than a corner.
pub(super) fn narrow(copper: &Region, islands: &Area, width: Length) -> Vec<Island> {
    let radius = half(width) - NEARER;
    let closed = grow(&grow(copper, radius), -radius);
    let rest = combine(&closed, copper, Rule::Difference);
    let solid = grow(&grow(&rest, -CRUMB), CRUMB);
    let corner = CORNER * radius.mm() * radius.mm();
    let wanted = |island: &Island| touched(island, islands) > 1 || island_area_mm2(island) > corner;
    solid.islands.into_iter().filter(wanted).collect()
}

/// The places of one island of `outline` that a cut of `width` cannot enter: inlets and inner contours, but not where it only
/// rounds a corner, nor between islands.
pub(super) fn inlets(outline: &Region, width: Length) -> Vec<Island> {
    let radius = half(width) - NEARER;
    let edges = Area::of(outline);
    let closed = grow(&grow(outline, radius), -radius);
    let solid = grow(&grow(&combine(&closed, outline, Rule::Difference), -CRUMB), CRUMB);
    let corner = CORNER * radius.mm() * radius.mm();
    let whole = |place: &Island| {
        let around = path_bounds(&place.outer).grown(TOUCH);
        let mut inner = outline.islands.iter().flat_map(|island| &island.holes).map(path_bounds);
        inner.any(|inner| around.contains(inner.min) && around.contains(inner.max))
    };
    let wanted =
        |place: &Island| touched(place, &edges) == 1 && (island_area_mm2(place) > corner || whole(place));
    solid.islands.into_iter().filter(wanted).collect()
}

/// Where a cut of `width` goes on along `copper` from where one of width `wider` has to turn: what lies between copper and too
/// near to it for the wider one, less what any of its ways leaves along all edges. Wide enough for the way of the thinner cut.
pub(super) fn necks(copper: &Region, wider: Length, width: Length) -> Vec<Island> {
    let outer = half(wider) - NEARER;
    let inner = (half(width) - NEARER - WITHIN).max(Length::ZERO);
    if inner >= outer {
        return Vec::new();
    }
    let closed = grow(&grow(copper, outer), inner - outer);
    let rest = combine(&closed, &grow(copper, inner), Rule::Difference);
    grow(&grow(&rest, -CRUMB), CRUMB).islands
}

/// The parts of the ways of a cut of `width` round `copper` that lie in `necks`.
pub(super) fn ways_in(copper: &Region, necks: &[Island], width: Length) -> Vec<Path> {
    let zone = grow(&Region { islands: necks.to_vec() }, TOUCH);
    if zone.is_empty() {
        return Vec::new();
    }
    let zone = Area::of(&zone);
    let region = grow(copper, half(width) - NEARER);
    let near = |path: &&Path| {
        let bounds = path_bounds(path);
        !zone.index().edges_in(bounds).is_empty() || zone.contains(bounds.min)
    };
    region.paths().filter(near).flat_map(|path| cut::parts(path, &zone, true)).collect()
}

/// How many islands of copper a narrow place touches; counting ends at two.
fn touched(place: &Island, islands: &Area) -> usize {
    let mut first = None;
    for (from, segment) in place.paths().flat_map(Path::pieces) {
        for share in [0.0, 0.5] {
            let at = cut::point_on(from, segment, share);
            let Some(near) = islands.index().nearest(at, TOUCH) else { continue };
            match first {
                None => first = Some(near.edge.island),
                Some(island) if island != near.edge.island => return 2,
                Some(_) => {}
            }
        }
    }
    usize::from(first.is_some())
}

/// The ways of a bit that cuts `width` round `copper`, as far as they lie in `places` or near enough to clean them.
pub(super) fn ways_through(copper: &Region, places: &[Island], width: Length) -> Vec<Path> {
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

/// The narrow place that a cure is for: the one that holds the middle of its gap, else the nearest within the gap's width.
pub(super) fn place_of<'a>(cure: &Cure, places: &'a [Island]) -> Option<&'a Island> {
    let middle = cut::point_on(cure.from, crate::geometry::Segment::Line { to: cure.to }, 0.5);
    let reach = Length::from_mm(cure.from.distance_mm(cure.to)) + TOUCH;
    let holds = |place: &&Island| crate::geometry::island_contains(place, middle);
    places.iter().find(holds).or_else(|| {
        let near = |place: &&Island| {
            let bounds = path_bounds(&place.outer).grown(reach);
            bounds.contains(middle) && Area::of(&alone(place)).index().nearest(middle, reach).is_some()
        };
        places.iter().find(near)
    })
}

fn alone(place: &Island) -> Region {
    Region { islands: vec![place.clone()] }
}

/// One way through the middle of the gap of a cure: half of its width beside the island on that side of it that has less of an
/// edge. None where nothing is found.
pub(super) fn centred(copper: &Region, islands: &Area, neck: &Island, cure: &Cure) -> Vec<Path> {
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
    let beside = grow(&alone(side), half(gap));
    beside.paths().flat_map(|path| cut::parts(path, &zone, true)).collect()
}

/// The width of a cut that would fit through the middle of a gap, in whole steps, so that equal gaps are looked for once.
pub(super) fn fitting(gap: Length) -> Length {
    (Length::from_nm(gap.nm() - gap.nm() % STEP.nm()) - CRUMB - CRUMB).max(Length::ZERO)
}

/// Whether anything is left of `region` worth a way.
pub(super) fn is_crumb(region: &Region) -> bool {
    area_mm2(region) < 1e-6
}

/// The middle of a cure's gap, for people.
pub(super) fn middle_text(cure: &Cure) -> (String, String) {
    let middle: Point = cut::point_on(cure.from, crate::geometry::Segment::Line { to: cure.to }, 0.5);
    (format!("{:.3}", middle.x.mm()), format!("{:.3}", middle.y.mm()))
}
