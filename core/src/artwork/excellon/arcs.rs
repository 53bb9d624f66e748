//! Where the middle of a routed arc lies.
//!
//! Comes in: both ends and either the middle or the radius. Goes out: the middle, if one fits. Lengths are nanometres
//! at rest and mm in between. Knows no words.
//!
//! ```text
//!        to ●
//!         / |  h       h² = A² − (c/2)²
//!        /  |
//!   from ●──●mid──▶ left of the way: turning left (G03), the middle lies there
//! ```

use crate::geometry::Point;

/// How far the two ends may differ in their distance from the middle: files round to a few micrometres.
const RADIUS_SLACK_MM: f64 = 0.05;

/// The middle when I and J gave one: good if both ends are equally far from it.
pub(super) fn checked(from: Point, to: Point, centre: Point) -> Option<Point> {
    let (first, second) = (from.distance_mm(centre), to.distance_mm(centre));
    (first > 0.0 && (first - second).abs() <= RADIUS_SLACK_MM).then_some(centre)
}

/// The middle of the shorter arc of radius `radius_mm`.
pub(super) fn from_radius(from: Point, to: Point, radius_mm: f64, clockwise: bool) -> Option<Point> {
    let chord = from.distance_mm(to);
    if chord <= 0.0 || chord > 2.0 * radius_mm + RADIUS_SLACK_MM {
        return None;
    }
    let height = libm::sqrt((radius_mm * radius_mm - chord * chord / 4.0).max(0.0));
    let side = if clockwise { -height } else { height };
    let (dx, dy) = ((to.x - from.x).mm() / chord, (to.y - from.y).mm() / chord);
    let middle = ((from.x.mm() + to.x.mm()) / 2.0, (from.y.mm() + to.y.mm()) / 2.0);
    Some(Point::from_mm(middle.0 - dy * side, middle.1 + dx * side))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn radius_finds_the_middle_on_the_right_side() {
        let (from, to) = (Point::from_mm(30.0, 25.0), Point::from_mm(35.0, 30.0));
        assert_eq!(from_radius(from, to, 5.0, false), Some(Point::from_mm(30.0, 30.0)));
        assert_eq!(from_radius(from, to, 5.0, true), Some(Point::from_mm(35.0, 25.0)));
        assert_eq!(from_radius(from, to, 3.0, true), None);
        assert_eq!(checked(from, to, Point::from_mm(30.0, 30.0)), Some(Point::from_mm(30.0, 30.0)));
        assert_eq!(checked(from, to, Point::from_mm(31.0, 30.0)), None);
    }
}
