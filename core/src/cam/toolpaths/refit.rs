//! Toolpaths with fewer segments: one line or arc replaces a series of short segments.
//!
//! ```text
//!   ──·─·──·─·─·──     short segments, with every point within the tolerance of one line or arc
//!   ●────────────●     the line or arc that replaces them, between the original ends
//! ```
//!
//! A long segment changes only if a short neighbour fits on its line or arc.

use super::cut;
use crate::geometry::{Path, PathSegment, Point, chords};
use crate::units::Length;
use std::f64::consts::PI;

/// Segments shorter than this, in mm, are merged: a controller stops and starts at each.
pub(super) const SHORT_MM: f64 = 0.05;
const MOST: usize = 96;
const MOST_TURN_RAD: f64 = 0.9 * PI;
/// The largest radius of an arc, in mm. Flatter arcs are not fitted.
const LARGEST_RADIUS_MM: f64 = 1_000.0;

type Piece = (Point, PathSegment);
type Spot = (f64, f64);

pub(super) fn refitted(path: &Path, tolerance: Length) -> Path {
    let mut pieces: Vec<Piece> = path.pieces().collect();
    if !pieces.iter().any(is_short) {
        return path.clone();
    }
    if path.is_closed() {
        // Start a closed path at its longest segment: no short segments are split over the start.
        let longest =
            (0..pieces.len()).max_by(|a, b| length_mm(&pieces, *a).total_cmp(&length_mm(&pieces, *b)));
        pieces.rotate_left(longest.unwrap_or_default());
    }
    let start = pieces.first().map_or(path.start, |piece| piece.0);
    let mut out = Path { start, segments: Vec::with_capacity(pieces.len()) };
    let mut rest = pieces.as_slice();
    while let Some((first, _)) = rest.split_first() {
        let (count, segment) = longest_fit(rest, tolerance.mm()).unwrap_or((1, first.1));
        out.segments.push(segment);
        rest = rest.get(count..).unwrap_or_default();
    }
    out
}

fn length_mm(pieces: &[Piece], index: usize) -> f64 {
    pieces.get(index).map_or(0.0, |(from, segment)| cut::length(*from, *segment))
}

fn is_short((from, segment): &Piece) -> bool {
    cut::length(*from, *segment) < SHORT_MM
}

/// The line or arc that replaces the most leading segments, and their number: at least two, one of them
/// short.
fn longest_fit(pieces: &[Piece], tolerance: f64) -> Option<(usize, PathSegment)> {
    let first = pieces.first()?;
    let mut places: Vec<Spot> = vec![spot(first.0)];
    let mut found = None;
    let mut short = false;
    for (count, piece) in (1..=MOST).zip(pieces) {
        short |= is_short(piece);
        add_places(piece, &mut places);
        if count == 1 {
            continue;
        }
        // Two consecutive long segments stay.
        if !short && count > 1 {
            break;
        }
        let to = piece.1.to();
        match fit(first.0, to, &places, tolerance) {
            Some(segment) => found = Some((count, segment)),
            None if count > 3 || found.is_some() => break,
            None => {}
        }
    }
    found
}

fn spot(at: Point) -> Spot {
    (at.x.mm(), at.y.mm())
}

/// Adds the check points of a piece: none at its start, the last at its end.
fn add_places(&(from, segment): &Piece, places: &mut Vec<Spot>) {
    let count = match segment {
        PathSegment::Line { .. } => 2,
        PathSegment::Arc { to, centre, clockwise } => {
            4 + (chords::turn(from, to, centre, clockwise) / 0.1) as u32
        }
    };
    places.extend(
        (1..count).map(|look| spot(cut::point_on(from, segment, f64::from(look) / f64::from(count)))),
    );
    places.push(spot(segment.to()));
}

/// The line or arc between two points that passes all `places` in order, none farther away than `tolerance`.
fn fit(from: Point, to: Point, places: &[Spot], tolerance: f64) -> Option<PathSegment> {
    let (a, b) = (spot(from), spot(to));
    let (dx, dy) = (b.0 - a.0, b.1 - a.1);
    let length = libm::hypot(dx, dy);
    if length <= tolerance {
        return None;
    }
    let (ux, uy) = (dx / length, dy / length);
    let seen = |at: &Spot| {
        let (x, y) = (at.0 - a.0, at.1 - a.1);
        (x * ux + y * uy, y * ux - x * uy)
    };
    let (mut along, mut low, mut high) = (0.0_f64, 0.0_f64, 0.0_f64);
    let mut top = (0.0_f64, 0.0_f64);
    let mut straight = true;
    for place in places {
        let (x, y) = seen(place);
        straight &= x >= along - tolerance / 4.0;
        along = along.max(x);
        (low, high) = (low.min(y), high.max(y));
        if (x / length - 0.5).abs() < (top.0 / length - 0.5).abs() {
            top = (x, y);
        }
    }
    if straight && low >= -tolerance && high <= tolerance {
        return Some(PathSegment::Line { to });
    }
    arc(from, to, places, (length, top, tolerance))
}

/// The arc through two ends and `top`, a point given along and across the chord of `length`.
fn arc(
    from: Point,
    to: Point,
    places: &[Spot],
    (length, top, tolerance): (f64, Spot, f64),
) -> Option<PathSegment> {
    let (x, y) = (top.0 - length / 2.0, top.1);
    let half = length / 2.0;
    if y.abs() < 1e-6 {
        return None;
    }
    // At this distance from the chord, the centre is equally far from `top` and both ends.
    let off = (x * x + y * y - half * half) / (2.0 * y);
    let radius = libm::hypot(off, half);
    if radius > LARGEST_RADIUS_MM {
        return None;
    }
    let (a, b) = (spot(from), spot(to));
    let (ux, uy) = ((b.0 - a.0) / length, (b.1 - a.1) / length);
    let middle = ((a.0 + b.0) / 2.0 - uy * off, (a.1 + b.1) / 2.0 + ux * off);
    let centre = Point::from_mm(middle.0, middle.1);
    // An arc to the left of its chord runs clockwise.
    let clockwise = y > 0.0;
    let turn = chords::turn(from, to, centre, clockwise);
    if turn > MOST_TURN_RAD {
        return None;
    }
    let centre_at = spot(centre);
    let begin = libm::atan2(a.1 - centre_at.1, a.0 - centre_at.0);
    let mut before = 0.0_f64;
    for place in places.iter().skip(1) {
        let (dx, dy) = (place.0 - centre_at.0, place.1 - centre_at.1);
        if (libm::hypot(dx, dy) - radius).abs() > tolerance {
            return None;
        }
        let angle = libm::atan2(dy, dx) - begin;
        let angle = if clockwise { -angle } else { angle };
        let angle = libm::remainder(angle - turn / 2.0, 2.0 * PI) + turn / 2.0;
        if (angle - before) * radius < -tolerance / 4.0 || (angle - turn) * radius > tolerance {
            return None;
        }
        before = before.max(angle);
    }
    Some(PathSegment::Arc { to, centre, clockwise })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::circle;

    fn length(path: &Path) -> f64 {
        path.length_mm()
    }

    /// Many chords, or many short arcs that differ by less than the tolerance.
    #[test]
    fn short_segments_become_lines_and_arcs_and_long_ones_stay() {
        let tolerance = Length::from_um(1);
        let ring = circle(Point::default(), Length::from_mm(2.0));
        let chords = |count: u32, off_mm: f64| {
            let places: Vec<Point> = (0..=count)
                .map(|index| {
                    let angle = f64::from(index % count) / f64::from(count) * 2.0 * PI;
                    let radius = 1.0 + if index % 2 == 1 { off_mm } else { 0.0 };
                    Point::from_mm(radius * libm::cos(angle), radius * libm::sin(angle))
                })
                .collect();
            Path::through(&places).expect("places apart")
        };
        let stairs = |step_mm: f64, off_mm: f64| {
            let places: Vec<Point> = (0..200)
                .map(|index| Point::from_mm(f64::from(index) * step_mm, f64::from(index % 2) * off_mm))
                .collect();
            Path::through(&places).expect("places apart")
        };
        // A path, the most and the fewest segments that may be left.
        let rows = [
            (ring, 1, 1),
            (chords(400, 0.0), 24, 2),
            (chords(400, 0.0004), 24, 2),
            (stairs(0.02, 0.0005), 4, 1),
            (stairs(0.02, 0.010), 199, 190),
            (stairs(0.2, 0.010), 199, 199),
        ];
        for (row, (path, most, least)) in rows.into_iter().enumerate() {
            let fitted = refitted(&path, tolerance);
            let count = fitted.segments.len();
            assert!((least..=most).contains(&count), "row {row}: {count} pieces");
            assert_eq!((fitted.is_closed(), path.is_closed()), (path.is_closed(), fitted.is_closed()));
            assert!((length(&fitted) / length(&path) - 1.0).abs() < 0.01, "row {row}: {}", length(&fitted));
        }
    }
}
