//! The center of a routed arc. Input and output in nanometres, computed in mm.
//!
//! ```text
//!        to ●
//!         / |  h       h² = A² − (c/2)²
//!        /  |
//!   from ●──●mid──▶ for a counter-clockwise arc (G03), the center is left of the path
//! ```

use crate::geometry::Point;

/// Tolerance for the difference of both radii: files round to a few micrometres.
const RADIUS_SLACK_MM: f64 = 0.05;

/// The center given by I and J, if both ends have the same distance from it.
pub(super) fn checked(from: Point, to: Point, centre: Point) -> Option<Point> {
    let (first, second) = (from.distance_mm(centre), to.distance_mm(centre));
    (first > 0.0 && (first - second).abs() <= RADIUS_SLACK_MM).then_some(centre)
}

/// The center of the shorter arc of radius `radius_mm`.
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
    fn radius_gives_the_arc_centre_on_the_right_side() {
        let (from, to) = (Point::from_mm(30.0, 25.0), Point::from_mm(35.0, 30.0));
        assert_eq!(from_radius(from, to, 5.0, false), Some(Point::from_mm(30.0, 30.0)));
        assert_eq!(from_radius(from, to, 5.0, true), Some(Point::from_mm(35.0, 25.0)));
        assert_eq!(from_radius(from, to, 3.0, true), None);
        assert_eq!(checked(from, to, Point::from_mm(30.0, 30.0)), Some(Point::from_mm(30.0, 30.0)));
        assert_eq!(checked(from, to, Point::from_mm(31.0, 30.0)), None);
    }
}
