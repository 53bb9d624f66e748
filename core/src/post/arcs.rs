//! Adapts arcs to a controller: whole, in parts, or as lines with a stated error.
//!
//! ```text
//!        ╭──●──╮  longest_deg, full_circle_parts: equal parts
//!      ●        ●
//!   radius alone: near half a circle it hardly defines the centre (h = √(r² − c²/4)), so parts stay
//!   under 120°; with a sign between 240° and 300° too, where the chord is long again
//! ```
//!
//! Lengths are whole nanometres.

use super::dialect::{Arcs, Helix};
use super::read::Centre;
use crate::geometry::{Point, chords};
use crate::units::Length;
use std::f64::consts::PI;

const HAIR_RAD: f64 = 1e-9;

/// A tip position: XY and height.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Tip {
    pub(super) at: Point,
    pub(super) height: Length,
}

/// An arc, or a helix if the height changes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Curve {
    pub(super) from: Tip,
    pub(super) to: Tip,
    pub(super) centre: Point,
    pub(super) ccw: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Piece {
    Line(Tip),
    /// Around the arc's centre, with this angle in radians.
    Arc(Tip, f64),
}

impl Curve {
    /// Angle of the arc in radians, above 0.
    pub(super) fn turn(self) -> f64 {
        chords::turn(self.from.at, self.to.at, self.centre, !self.ccw)
    }

    /// Mean of the radii at both ends, in mm.
    pub(super) fn radius(self) -> f64 {
        (self.from.at.distance_mm(self.centre) + self.to.at.distance_mm(self.centre)) / 2.0
    }

    pub(super) fn along(self, share: f64) -> Tip {
        let (first, last) = (self.from.at.distance_mm(self.centre), self.to.at.distance_mm(self.centre));
        let angle = libm::atan2((self.from.at.y - self.centre.y).mm(), (self.from.at.x - self.centre.x).mm());
        let turned = if self.ccw { self.turn() * share } else { -self.turn() * share };
        let radius = first + (last - first) * share;
        let (x, y) = (libm::cos(angle + turned) * radius, libm::sin(angle + turned) * radius);
        let height = self.from.height.mm() + (self.to.height - self.from.height).mm() * share;
        let at = Point::new(self.centre.x + Length::from_mm(x), self.centre.y + Length::from_mm(y));
        Tip { at, height: Length::from_mm(height) }
    }

    /// Splits the arc for a controller with the limits `arcs` that gets the centre as `centre`. `written`
    /// rounds a position to the output's digits.
    pub(super) fn pieces(self, arcs: &Arcs, centre: Centre, written: impl Fn(Point) -> Point) -> Vec<Piece> {
        let (turn, full) = (self.turn(), self.from.at == self.to.at);
        // A controller takes ends with equal digits for a full circle.
        let nothing = !full && turn < PI && written(self.from.at) == written(self.to.at);
        let speck = written(self.centre) == written(self.from.at);
        // If rounding swaps the ends of a tiny arc, the controller would draw nearly a full circle.
        let digits =
            chords::turn(written(self.from.at), written(self.to.at), written(self.centre), !self.ccw);
        let reversed = !full && turn < PI && digits > turn + PI;
        if nothing || speck || reversed {
            return vec![Piece::Line(self.to)];
        }
        let helix = self.from.height != self.to.height;
        let parts = parts(turn, full, arcs, centre);
        let each = turn / f64::from(parts);
        let half = 2.0 * self.radius() * libm::sin(each / 4.0);
        let small = each < arcs.shortest_deg.to_radians() || half < arcs.smallest_mm;
        if arcs.lines_only || small || (helix && arcs.helix == Helix::Lines) {
            return self.lines(arcs.chord_error_mm);
        }
        let piece = |index: u32| {
            let to = if index == parts { self.to } else { self.along(f64::from(index) / f64::from(parts)) };
            Piece::Arc(to, each)
        };
        (1..=parts).map(piece).collect()
    }

    fn lines(self, error_mm: f64) -> Vec<Piece> {
        let points = chords::arc(self.from.at, self.to.at, self.centre, !self.ccw, error_mm);
        let count = points.len() as f64;
        let rise = (self.to.height - self.from.height).mm();
        let height = |index: usize| self.from.height + Length::from_mm(rise * (index + 1) as f64 / count);
        points
            .into_iter()
            .enumerate()
            .map(|(index, at)| Piece::Line(Tip { at, height: height(index) }))
            .collect()
    }
}

fn parts(turn: f64, full: bool, arcs: &Arcs, centre: Centre) -> u32 {
    let mut parts = if full { arcs.full_circle_parts.max(1) } else { 1 };
    let fits = |parts: u32| {
        let degrees = (turn / f64::from(parts)).to_degrees() - HAIR_RAD;
        let told = match centre {
            Centre::Said => true,
            Centre::Radius => degrees <= 120.0,
            Centre::SignedRadius => degrees <= 120.0 || (240.0..=300.0).contains(&degrees),
        };
        told && degrees <= arcs.longest_deg
    };
    while !fits(parts) && parts < 64 {
        parts += 1;
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(degrees: f64, ccw: bool, rise: f64) -> Curve {
        let angle = degrees.to_radians() * if ccw { 1.0 } else { -1.0 };
        let to = Point::from_mm(10.0 * libm::cos(angle), 10.0 * libm::sin(angle));
        let tip = |at, height| Tip { at, height: Length::from_mm(height) };
        let from = tip(Point::from_mm(10.0, 0.0), 0.0);
        let to = if degrees == 360.0 { from.at } else { to };
        Curve { from, to: tip(to, rise), centre: Point::default(), ccw }
    }

    #[test]
    fn arcs_are_split_to_controller_limits() {
        let plain = Arcs::default();
        let halves = Arcs { full_circle_parts: 2, longest_deg: 180.0, ..plain };
        // degrees, limits, centre format, pieces
        let rows = [
            (90.0, plain, Centre::Said, 1),
            (360.0, plain, Centre::Said, 1),
            (360.0, halves, Centre::Said, 2),
            (180.0, halves, Centre::Said, 1),
            (181.0, halves, Centre::Said, 2),
            (360.0, Arcs { full_circle_parts: 4, ..plain }, Centre::Said, 4),
            (119.0, plain, Centre::Radius, 1),
            (180.0, plain, Centre::Radius, 2),
            (360.0, plain, Centre::Radius, 3),
            (180.0, plain, Centre::SignedRadius, 2),
            (270.0, plain, Centre::SignedRadius, 1),
            (320.0, plain, Centre::SignedRadius, 3),
            (3.0, Arcs { shortest_deg: 4.0, ..plain }, Centre::Said, 1),
        ];
        for (degrees, arcs, centre, count) in rows {
            for ccw in [true, false] {
                let whole = curve(degrees, ccw, 0.0);
                let pieces = whole.pieces(&arcs, centre, |at| at);
                assert_eq!(pieces.len(), count, "{degrees} {centre:?}");
                let end = match pieces[count - 1] {
                    Piece::Line(to) | Piece::Arc(to, _) => to,
                };
                assert_eq!(end, whole.to);
            }
        }
    }

    #[test]
    fn impossible_arcs_become_lines_within_the_error() {
        let lines = Arcs { helix: Helix::Lines, chord_error_mm: 0.01, ..Arcs::default() };
        let helix = curve(300.0, false, -1.0);
        let pieces = helix.pieces(&lines, Centre::Said, |at| at);
        let mut last = helix.from;
        for piece in &pieces {
            let Piece::Line(to) = *piece else { panic!("{piece:?}") };
            assert!(to.height < last.height);
            let middle = Point::from_mm((last.at.x + to.at.x).mm() / 2.0, (last.at.y + to.at.y).mm() / 2.0);
            assert!((middle.distance_mm(Point::default()) - 10.0).abs() < 0.010_002);
            last = to;
        }
        assert_eq!(last, helix.to);
        let rounded = |at: Point| {
            let whole = |length: Length| Length::from_um((length.nm() + 500).div_euclid(1000));
            Point::new(whole(at.x), whole(at.y))
        };
        let mut tiny = curve(90.0, true, 0.0);
        tiny.to.at = Point::new(tiny.from.at.x, Length::from_nm(200));
        assert_eq!(tiny.pieces(&Arcs::default(), Centre::Said, rounded), [Piece::Line(tiny.to)]);
        // Rounding swaps its ends: from the digits it is nearly a full circle.
        let at = |x: i64, y: i64| Tip {
            at: Point::new(Length::from_nm(x), Length::from_nm(y)),
            height: Length::ZERO,
        };
        let backwards =
            Curve { from: at(62_749, 62_499), to: at(62_400, 62_849), centre: Point::default(), ccw: true };
        let mirrored = |at: Point| {
            if at == backwards.from.at {
                backwards.to.at
            } else if at == backwards.to.at {
                backwards.from.at
            } else {
                at
            }
        };
        assert_eq!(backwards.pieces(&Arcs::default(), Centre::Said, mirrored), [Piece::Line(backwards.to)]);
    }
}
