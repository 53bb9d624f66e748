//! Cuts arcs into chords with a stated error.
//!
//! ```text
//!   radius r, chord over the angle a: error = r·(1 − cos(a/2)), so a = 2·acos(1 − error/r)
//! ```

use super::Point;
use std::f64::consts::{PI, TAU};

/// Limit of chords; beyond it the error grows.
const MOST_CHORDS: usize = 4_096;

/// Angle of an arc in radians, above 0, at most a full turn. Equal ends are a full circle.
pub fn turn(from: Point, to: Point, centre: Point, clockwise: bool) -> f64 {
    let angle = |point: Point| libm::atan2((point.y - centre.y).mm(), (point.x - centre.x).mm());
    let turned = if clockwise { angle(from) - angle(to) } else { angle(to) - angle(from) };
    let wrapped = if turned <= 0.0 { turned + TAU } else { turned };
    if from == to { TAU } else { wrapped }
}

/// The points of an arc after its start, ending exactly at `to`. If the radii of the ends differ, the radius
/// changes evenly.
pub fn arc(from: Point, to: Point, centre: Point, clockwise: bool, error_mm: f64) -> Vec<Point> {
    let (first, last) = (from.distance_mm(centre), to.distance_mm(centre));
    let turn = turn(from, to, centre, clockwise);
    let radius = first.max(last);
    let flat = (1.0 - error_mm / radius.max(error_mm)).clamp(-1.0, 1.0);
    let step = (2.0 * libm::acos(flat)).clamp(1e-3, PI / 2.0);
    let count = (libm::ceil(turn / step) as usize).clamp(1, MOST_CHORDS);
    let start = libm::atan2((from.y - centre.y).mm(), (from.x - centre.x).mm());
    let inner = (1..count).map(|index| {
        let share = index as f64 / count as f64;
        let angle = if clockwise { start - turn * share } else { start + turn * share };
        let radius = first + (last - first) * share;
        Point::from_mm(centre.x.mm() + radius * libm::cos(angle), centre.y.mm() + radius * libm::sin(angle))
    });
    inner.chain([to]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chords_stay_within_tolerance_of_the_arc() {
        let (from, to, centre) =
            (Point::from_mm(25.0, 20.0), Point::from_mm(30.0, 25.0), Point::from_mm(25.0, 25.0));
        assert!((turn(from, to, centre, true) - 1.5 * PI).abs() < 1e-12);
        assert!((turn(from, to, centre, false) - 0.5 * PI).abs() < 1e-12);
        let points = arc(from, to, centre, true, 0.005);
        let mut last = from;
        for &point in &points {
            let middle =
                Point::from_mm((last.x.mm() + point.x.mm()) / 2.0, (last.y.mm() + point.y.mm()) / 2.0);
            assert!((5.0 - middle.distance_mm(centre)).abs() <= 0.005 + 1e-6);
            last = point;
        }
        assert_eq!(last, to);
        assert_eq!(arc(from, from, centre, true, 0.005).last(), Some(&from));
    }
}
