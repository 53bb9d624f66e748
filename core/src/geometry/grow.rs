//! Grows and shrinks regions by a distance, with round corners.
//!
//! ```text
//!   every piece sweeps a strip to its right, every outer corner a sector of a circle:
//!
//!      ╭┄┄┬┄┄┄┄┄┄┄┄┄┬┄┄╮          strip of a line, of an arc turning left (radius + by),
//!      ┊  │  strip  │  ┊          of an arc turning right (radius − by; the whole sector if by is larger)
//!      ├┄┄┏━━━━━━━━━┓┄┄┤
//!      ┊  ┃  area   ┃  ┊          all of them wind once to the left, so the result is the area with a sum of
//!         ┗━━━━━                  windings above zero, regardless of overlaps
//! ```
//!
//! To shrink, all signs are reversed: the inside counts one, every strip inwards subtracts one. At an inner
//! corner between long pieces the strips are trimmed where their far sides cross, because they overlap twice
//! there. An arc is trimmed only if its end stays on its circle. Joining the far sides straight would make a
//! cleft that stops a tool.
//!
//! Tolerance: every edge is within 1 µm of the true offset. Arcs have the true centre and radius, to the
//! nanometre; corners are within 0.8 µm. Pieces shorter than 1 µm are merged. Before shrinking, clefts
//! narrower than 40 nm are closed: rounding in earlier unions makes them, and they would grow into gouges.

use super::combine::FRAGMENT_NM;
use super::overlay::{Circle, Fill, Overlay, Spot, apart, spot};
use super::rebuild;
use super::{Path, PathSegment, Point, REACH, Region, chords};
use crate::units::Length;
use std::f64::consts::PI;

const CLOSING_NM: f64 = 20.0;
const GROWN_CRUMB_NM: f64 = 1_000.0;
/// Strips with far corners this near, in nm, are joined straight.
const TOUCH_NM: f64 = 60.0;
/// A strip is trimmed if its far side then ends at most this far, in nm, off its circle.
const TRIMMED_OFF_NM: f64 = 20.0;
/// Up to this distance, in nm, outer corners are pointed instead of round.
const POINTED_NM: f64 = 100.0;
/// A larger turn, in rad, is a reversal.
const TURNING_BACK_RAD: f64 = PI - 1e-3;

#[derive(Clone, Copy)]
struct Strip {
    ends: [Spot; 2],
    far: [Spot; 2],
    right: [Spot; 2],
    length: f64,
    /// The circle of the far side and its direction (clockwise); `None` for a line.
    arc: Option<(Circle, bool)>,
}

fn moved(from: Spot, way: Spot, by: f64) -> Spot {
    (from.0 + way.0 * by, from.1 + way.1 * by)
}

fn line_strip(from: Spot, to: Spot, by: f64) -> Option<Strip> {
    let length = apart(from, to);
    if length < 0.5 {
        return None;
    }
    let right = ((to.1 - from.1) / length, (from.0 - to.0) / length);
    let far = [moved(from, right, by), moved(to, right, by)];
    Some(Strip { ends: [from, to], far, right: [right; 2], length, arc: None })
}

fn arc_strip(from: Point, to: Point, centre: Point, clockwise: bool, by: f64) -> Option<Strip> {
    let (a, b, c) = (spot(from), spot(to), spot(centre));
    let circle = Circle::through(c, a, b);
    if circle.radius_nm < 1.0 {
        return line_strip(a, b, by);
    }
    let outward = |end: Spot| {
        let length = apart(end, c).max(1.0);
        ((end.0 - c.0) / length, (end.1 - c.1) / length)
    };
    let (from_c, to_c) = (outward(a), outward(b));
    let turn = chords::turn(from, to, centre, clockwise);
    if !clockwise {
        let radius = circle.radius_nm + by;
        let far = [moved(c, from_c, radius), moved(c, to_c, radius)];
        let arc = Some((Circle { centre: c, radius_nm: radius }, false));
        return Some(Strip {
            ends: [a, b],
            far,
            right: [from_c, to_c],
            length: turn * circle.radius_nm,
            arc,
        });
    }
    let radius = (circle.radius_nm - by).max(0.0);
    let far = [moved(c, from_c, radius), moved(c, to_c, radius)];
    let right = [(-from_c.0, -from_c.1), (-to_c.0, -to_c.1)];
    let arc = Some((Circle { centre: c, radius_nm: radius }, true));
    Some(Strip { ends: [a, b], far, right, length: turn * radius, arc })
}

fn strips(path: &Path, by: f64) -> Vec<Strip> {
    let strip = |(from, segment): (Point, PathSegment)| match segment {
        PathSegment::Line { to } => line_strip(spot(from), spot(to), by),
        PathSegment::Arc { to, centre, clockwise } => arc_strip(from, to, centre, clockwise, by),
    };
    let closing = PathSegment::Line { to: path.start };
    path.pieces().chain([(path.end(), closing)]).filter_map(strip).collect()
}

/// Connection of the far sides of two consecutive strips.
enum Corner {
    /// None needed: they end in one point.
    Straight,
    /// An inner corner, both sides cut off at a point.
    Trimmed(Spot),
    /// An inner corner: back to the corner of the outline and out again.
    Inner(Spot),
    /// An outer corner: an arc about the corner of the outline.
    Round(Circle),
    /// An outer corner at a very small distance.
    Pointed(Spot),
}

fn corner(first: &Strip, second: &Strip, by: f64) -> Corner {
    let (at, one, two) = (second.ends[0], first.right[1], second.right[0]);
    let turn = libm::atan2(one.0 * two.1 - one.1 * two.0, one.0 * two.0 + one.1 * two.1);
    let gap = apart(first.far[1], second.far[0]);
    let room = first.length.min(second.length) / 2.0;
    if turn.abs() > TURNING_BACK_RAD {
        return Corner::Round(Circle { centre: at, radius_nm: by });
    }
    if gap <= TOUCH_NM && (turn >= 0.0 || gap <= room) {
        return Corner::Straight;
    }
    let tip = moved(at, (one.0 + two.0, one.1 + two.1), by / (1.0 + one.0 * two.0 + one.1 * two.1));
    if turn > 0.0 {
        let pointed = by <= POINTED_NM && turn < 2.5;
        return if pointed {
            Corner::Pointed(tip)
        } else {
            Corner::Round(Circle { centre: at, radius_nm: by })
        };
    }
    let cut = by * libm::tan(-turn / 2.0);
    let stays_near = |strip: &Strip| {
        strip.arc.is_none_or(|(circle, _)| cut * cut <= 2.0 * TRIMMED_OFF_NM * circle.radius_nm)
    };
    let trimmed = cut <= room && stays_near(first) && stays_near(second);
    if trimmed { Corner::Trimmed(tip) } else { Corner::Inner(at) }
}

/// Adds the outline moved to the right by `by` nm, above zero.
fn lay(path: &Path, by: f64, overlay: &mut Overlay) {
    let mut strips = strips(path, by);
    let count = strips.len();
    let corners: Vec<Corner> = strips
        .iter()
        .zip(strips.iter().cycle().skip(1))
        .map(|(first, second)| corner(first, second, by))
        .collect();
    for (index, corner) in corners.iter().enumerate() {
        if let Corner::Trimmed(tip) = corner {
            if let Some(first) = strips.get_mut(index) {
                first.far[1] = *tip;
            }
            if let Some(second) = strips.get_mut((index + 1) % count) {
                second.far[0] = *tip;
            }
        }
    }
    let following = strips.iter().cycle().skip(1);
    for ((strip, next), corner) in strips.iter().zip(following).zip(&corners) {
        match strip.arc {
            None => overlay.line(strip.far[0], strip.far[1]),
            Some((circle, clockwise)) if circle.radius_nm >= 1.0 => {
                overlay.arc(strip.far[0], strip.far[1], circle, clockwise);
            }
            Some(_) => {}
        }
        let (end, start) = (strip.far[1], next.far[0]);
        match *corner {
            Corner::Straight | Corner::Trimmed(_) => overlay.line(end, start),
            Corner::Inner(by_way) | Corner::Pointed(by_way) => {
                overlay.line(end, by_way);
                overlay.line(by_way, start);
            }
            Corner::Round(circle) => overlay.arc(end, start, circle, false),
        }
    }
    overlay.end_outline();
}

fn grown(region: &Region, by: f64, fragment: f64) -> Region {
    let mut overlay = Overlay::default();
    region.paths().for_each(|path| lay(path, by, &mut overlay));
    rebuild::traced(&mut overlay, Fill::Positive, fragment)
}

fn shrunk(region: &Region, by: f64) -> Region {
    let closed = grown(region, CLOSING_NM, FRAGMENT_NM);
    let mut overlay = Overlay::default();
    closed.paths().for_each(|path| lay(&path.reversed(), by + CLOSING_NM, &mut overlay));
    overlay.turn();
    rebuild::traced(&mut overlay, Fill::Positive, GROWN_CRUMB_NM)
}

/// Everything within `by` of `region`; for a negative `by` everything inside farther than that from its
/// edges.
pub fn grow(region: &Region, by: Length) -> Region {
    let distance = by.abs().min(REACH).nm() as f64;
    match by.nm() {
        0 => region.clone(),
        1.. => grown(region, distance, GROWN_CRUMB_NM),
        _ => shrunk(region, distance),
    }
}

#[cfg(test)]
mod tests {
    use super::super::union;
    use super::*;
    use crate::chance::Chance;

    /// Shrinking by the distance that a region was grown by leaves arcs of nearly zero radius; their ends may
    /// round differently.
    #[test]
    fn every_grown_outline_is_closed() {
        let mut chance = Chance::new(5);
        let mut mm = move || (chance.bits() >> 40) as f64 * 1e-7;
        let mut corner = || Point::from_mm(mm() * 6.0, mm() * 6.0);
        let triangles = (0..60).filter_map(|_| Path::through(&[corner(), corner(), corner()]));
        let copper = union(&triangles.collect::<Vec<_>>());
        for radius_um in [75, 99, 100, 149, 199, 250] {
            let grown = grow(&copper, Length::from_um(radius_um));
            for more_nm in [-1.0, 0.0, 1.0, 20.0] {
                let mut overlay = Overlay::default();
                let by = Length::from_um(radius_um).nm() as f64 + more_nm;
                grown.paths().for_each(|path| lay(&path.reversed(), by, &mut overlay));
                for outline in overlay.take().outlines() {
                    let ends = outline.iter().zip(outline.iter().cycle().skip(1));
                    ends.for_each(|(edge, next)| {
                        assert_eq!(edge.b, next.a, "{radius_um} µm and {more_nm} nm");
                    });
                }
            }
        }
    }

    /// A line, the cap of a stroke that protrudes from it by 0.2 µm, a line: the far sides of the strips
    /// cross.
    #[test]
    fn grown_outline_has_no_spike_at_a_flat_cap() {
        let at = |x: i64, y: i64| Point::new(Length::from_nm(x), Length::from_nm(y));
        let line = |x: i64, y: i64| PathSegment::Line { to: at(x, y) };
        let cap = PathSegment::Arc { to: at(18_096, 29_787), centre: at(-72_880, -14_500), clockwise: false };
        let left = [line(-118_600, 361_229), line(-300_000, 361_229), line(-300_000, -128_599)];
        let segments = [line(51_409, -50_985), line(22_822, 18_329), cap].into_iter().chain(left);
        let outer = Path {
            start: at(129_023, -128_599),
            segments: segments.chain([line(129_023, -128_599)]).collect(),
        };
        let copper = Region { islands: vec![super::super::Island { outer, holes: Vec::new() }] };
        for by_um in [20, 71, 150] {
            let grown = grow(&copper, Length::from_um(by_um));
            let corners: Vec<Spot> = grown.paths().flat_map(Path::corners).map(spot).collect();
            let pairs =
                corners.iter().zip(corners.iter().cycle().skip(1)).map(|(a, b)| (b.0 - a.0, b.1 - a.1));
            let ways: Vec<Spot> = pairs.filter(|way| apart(*way, (0.0, 0.0)) > 0.0).collect();
            for (one, two) in ways.iter().zip(ways.iter().cycle().skip(1)) {
                let along = one.0 * two.0 + one.1 * two.1;
                let both = apart(*one, (0.0, 0.0)) * apart(*two, (0.0, 0.0));
                assert!(along > -0.9 * both, "{by_um} µm: back along {one:?} {two:?} nm");
            }
        }
    }
}
