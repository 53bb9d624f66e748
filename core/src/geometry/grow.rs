//! Regions grown and shrunk by a distance, with round corners.
//!
//! ```text
//!   every piece sweeps a strip to its right, every outer corner a slice of a circle:
//!
//!      ╭┄┄┬┄┄┄┄┄┄┄┄┄┬┄┄╮          strip of a line, of an arc turning left (radius + by),
//!      ┊  │  strip  │  ┊          of an arc turning right (radius − by; the whole slice where by is more)
//!      ├┄┄┏━━━━━━━━━┓┄┄┤
//!      ┊  ┃  area   ┃  ┊          all of them wind once to the left, so the area wanted is where the sum of
//!         ┗━━━━━                  windings is above zero, however they overlap
//! ```
//!
//! Shrinking is the same with everything turned round: what was inside counts one, every strip inwards takes one away.
//! Where two straight pieces meet in an inner corner and both are long enough, the strips are trimmed to where
//! their far sides cross, since there they overlap twice.
//!
//! Comes in: a region and a distance. Goes out: a region. Tolerance: every edge is within 1 µm of the true offset (arcs about
//! the true centre with the true radius, to the nanometre; corners within 0.8 µm); pieces shorter than 1 µm are
//! drawn together. Before shrinking, clefts narrower than 40 nm are closed, since the rounding of earlier unions leaves
//! such and they would grow into gouges. Knows no tools.

use super::combine::FRAGMENT_NM;
use super::rebuild;
use super::sheet::{Circle, Fill, Sheet, Spot, apart, spot};
use super::{Path, Point, REACH, Region, Segment, chords};
use crate::units::Length;
use std::f64::consts::PI;

/// Clefts of twice this width, in nm, are closed before shrinking.
const CLOSING_NM: f64 = 20.0;
/// Pieces of a grown outline shorter than this, in nm, are drawn together.
const GROWN_CRUMB_NM: f64 = 1_000.0;
/// Strips whose far corners are this near, in nm, are joined straight.
const TOUCH_NM: f64 = 60.0;
/// Up to this distance, in nm, outer corners are pointed instead of round.
const POINTED_NM: f64 = 100.0;
/// Turning by more than this, in rad, is turning back.
const TURNING_BACK: f64 = PI - 1e-3;

/// One piece of an outline and the far side of its strip.
#[derive(Clone, Copy)]
struct Strip {
    /// The ends of the piece.
    ends: [Spot; 2],
    /// The ends of the far side.
    far: [Spot; 2],
    /// Unit vectors to the right at both ends.
    right: [Spot; 2],
    /// How long the strip is where it is shortest.
    length: f64,
    /// What the far side is a part of, and whether it turns clockwise; none for a line.
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
    if circle.radius < 1.0 {
        return line_strip(a, b, by);
    }
    let outward = |end: Spot| {
        let length = apart(end, c).max(1.0);
        ((end.0 - c.0) / length, (end.1 - c.1) / length)
    };
    let (from_c, to_c) = (outward(a), outward(b));
    let turn = chords::turn(from, to, centre, clockwise);
    if !clockwise {
        let radius = circle.radius + by;
        let far = [moved(c, from_c, radius), moved(c, to_c, radius)];
        let arc = Some((Circle { centre: c, radius }, false));
        return Some(Strip { ends: [a, b], far, right: [from_c, to_c], length: turn * circle.radius, arc });
    }
    let radius = (circle.radius - by).max(0.0);
    let far = [moved(c, from_c, radius), moved(c, to_c, radius)];
    let right = [(-from_c.0, -from_c.1), (-to_c.0, -to_c.1)];
    let arc = Some((Circle { centre: c, radius }, true));
    Some(Strip { ends: [a, b], far, right, length: turn * radius, arc })
}

fn strips(path: &Path, by: f64) -> Vec<Strip> {
    let strip = |(from, segment): (Point, Segment)| match segment {
        Segment::Line { to } => line_strip(spot(from), spot(to), by),
        Segment::Arc { to, centre, clockwise } => arc_strip(from, to, centre, clockwise, by),
    };
    let closing = Segment::Line { to: path.start };
    path.pieces().chain([(path.end(), closing)]).filter_map(strip).collect()
}

/// What lies between the far sides of two strips in a row.
enum Corner {
    /// Nothing: they end in one point.
    Straight,
    /// An inner corner where both are cut off at a point.
    Trimmed(Spot),
    /// An inner corner: back to the corner of the outline and out again.
    Inner(Spot),
    /// An outer corner: an arc about the corner of the outline.
    Round(Circle),
    /// An outer corner of a very small distance.
    Pointed(Spot),
}

fn corner(first: &Strip, second: &Strip, by: f64) -> Corner {
    let (at, one, two) = (second.ends[0], first.right[1], second.right[0]);
    let turn = libm::atan2(one.0 * two.1 - one.1 * two.0, one.0 * two.0 + one.1 * two.1);
    let gap = apart(first.far[1], second.far[0]);
    let room = first.length.min(second.length) / 2.0;
    if turn.abs() > TURNING_BACK {
        return Corner::Round(Circle { centre: at, radius: by });
    }
    if gap <= TOUCH_NM && (turn >= 0.0 || gap <= room) {
        return Corner::Straight;
    }
    let tip = moved(at, (one.0 + two.0, one.1 + two.1), by / (1.0 + one.0 * two.0 + one.1 * two.1));
    if turn > 0.0 {
        let pointed = by <= POINTED_NM && turn < 2.5;
        return if pointed { Corner::Pointed(tip) } else { Corner::Round(Circle { centre: at, radius: by }) };
    }
    let lines = first.arc.is_none() && second.arc.is_none();
    if lines && by * libm::tan(-turn / 2.0) <= room {
        return Corner::Trimmed(tip);
    }
    if gap <= room { Corner::Straight } else { Corner::Inner(at) }
}

/// Lays down the outline moved to the right by `by` nm, above zero.
fn lay(path: &Path, by: f64, sheet: &mut Sheet) {
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
            None => sheet.line(strip.far[0], strip.far[1]),
            Some((circle, clockwise)) if circle.radius >= 1.0 => {
                sheet.arc(strip.far[0], strip.far[1], circle, clockwise);
            }
            Some(_) => {}
        }
        let (end, start) = (strip.far[1], next.far[0]);
        match *corner {
            Corner::Straight | Corner::Trimmed(_) => sheet.line(end, start),
            Corner::Inner(by_way) | Corner::Pointed(by_way) => {
                sheet.line(end, by_way);
                sheet.line(by_way, start);
            }
            Corner::Round(circle) => sheet.arc(end, start, circle, false),
        }
    }
    sheet.end_outline();
}

fn grown(region: &Region, by: f64, fragment: f64) -> Region {
    let mut sheet = Sheet::default();
    region.paths().for_each(|path| lay(path, by, &mut sheet));
    rebuild::traced(&mut sheet, Fill::Positive, fragment)
}

fn shrunk(region: &Region, by: f64) -> Region {
    let closed = grown(region, CLOSING_NM, FRAGMENT_NM);
    let mut sheet = Sheet::default();
    closed.paths().for_each(|path| lay(&path.reversed(), by + CLOSING_NM, &mut sheet));
    sheet.turn();
    rebuild::traced(&mut sheet, Fill::Positive, GROWN_CRUMB_NM)
}

/// All that is at most `by` away from `region`; for a negative `by` all of it that is farther than that from its
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

    /// Shrinking by what a region was grown by leaves arcs of hardly any radius, whose ends may round differently.
    #[test]
    fn every_outline_laid_down_is_closed() {
        let mut chance = 5_u64;
        let mut mm = move || {
            chance = chance.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (chance >> 40) as f64 * 1e-7
        };
        let mut corner = || Point::from_mm(mm() * 6.0, mm() * 6.0);
        let triangles = (0..60).filter_map(|_| Path::through(&[corner(), corner(), corner()]));
        let copper = union(&triangles.collect::<Vec<_>>());
        for radius_um in [75, 99, 100, 149, 199, 250] {
            let grown = grow(&copper, Length::from_um(radius_um));
            for more_nm in [-1.0, 0.0, 1.0, 20.0] {
                let mut sheet = Sheet::default();
                let by = Length::from_um(radius_um).nm() as f64 + more_nm;
                grown.paths().for_each(|path| lay(&path.reversed(), by, &mut sheet));
                for outline in sheet.take().outlines() {
                    let ends = outline.iter().zip(outline.iter().cycle().skip(1));
                    ends.for_each(|(edge, next)| {
                        assert_eq!(edge.b, next.a, "{radius_um} µm and {more_nm} nm");
                    });
                }
            }
        }
    }
}
