//! Moves, strokes, flashes and contours: the effect of coordinates.
//!
//! ```text
//!  G74: I and J have no sign; of four possible         G75: I and J give the center.
//!       ·   ·      centers, the one that fits both
//!         ●        ends with an arc of at most         An arc that ends at its start is a full
//!       ·   ◉      a quarter turn is used.             circle with G75, a dot with G74.
//! ```

use super::Reader;
use super::crossing::crosses_itself;
use super::graphics::{Action, Interpolation, Quadrants};
use super::object::ObjectShape;
use super::words::{At, Numbers};
use crate::artwork::number::Decimal;
use crate::code;
use crate::diagnostic::Severity;
use crate::geometry::{PathSegment, Point, REACH, chords};
use crate::units::Length;
use std::f64::consts::PI;

/// From this difference between the radii of an arc's ends on, the user gets a warning.
const UNEVEN_MM: f64 = 0.05;
/// A center is moved by at most this to make both radii equal.
const RECENTRED_MM: f64 = 0.02;
/// An arc with a far center whose ends are this close is a line.
const POINT_MM: f64 = 0.01;
/// A quarter turn plus rounding, radians.
const QUARTER_RAD: f64 = 1.6;

impl Reader {
    pub(super) fn go(&mut self, numbers: &Numbers, acted: Option<Action>, place: At) {
        let moved = numbers.x.is_some() || numbers.y.is_some();
        let circle = acted == Some(Action::Draw)
            && self.graphics.interpolation != Interpolation::Straight
            && (numbers.i.is_some() || numbers.j.is_some());
        // A D-code alone only sets the action of later coordinates; in a region, it adds a point to the
        // contour.
        if !moved
            && !circle
            && acted != Some(Action::Flash)
            && (acted.is_none() || self.graphics.region.is_none())
        {
            return;
        }
        let Some(scale) = self.format.scale_here() else {
            self.tell_once(Severity::Error, code!("gerber.no_format"), place, b"");
            return;
        };
        let length = |number: Option<Decimal>| number.map_or(Some(Length::ZERO), |n| scale.length(n));
        let axis = |at: Length, number: Option<Decimal>| {
            let value = number.map(|number| scale.length(number));
            match value {
                Some(Some(value)) if self.format.incremental => Some(at + value),
                Some(value) => value,
                None => Some(at),
            }
        };
        let to = axis(self.graphics.at.x, numbers.x).zip(axis(self.graphics.at.y, numbers.y));
        let to = to.filter(|(x, y)| x.abs() <= Length::LIMIT && y.abs() <= Length::LIMIT);
        let offset = length(numbers.i).zip(length(numbers.j));
        let (Some((x, y)), Some(offset)) = (to, offset) else {
            self.tell_once(Severity::Error, code!("gerber.too_far"), place, b"");
            return;
        };
        let to = Point::new(x, y);
        let from = std::mem::replace(&mut self.graphics.at, to);
        match self.graphics.action {
            Action::Draw => {
                let segment = self.segment(from, to, offset, place);
                self.stroke(from, segment, place);
            }
            Action::Flash if self.graphics.region.is_none() => self.flash(to, place),
            Action::Flash => self.tell_once(Severity::Error, code!("gerber.flash_in_region"), place, b""),
            Action::Move => {
                self.end_contour(place);
                if let Some(path) = &mut self.graphics.region {
                    path.start = self.graphics.image.point(to);
                }
            }
        }
    }

    fn flash(&mut self, at: Point, place: At) {
        self.out.counts.flashes += 1;
        let at = self.graphics.image.point(at);
        match self.graphics.aperture {
            Some(aperture) => self.put(ObjectShape::Flash { at }, aperture, place),
            None => self.tell_once(Severity::Error, code!("gerber.no_aperture"), place, b""),
        }
    }

    fn stroke(&mut self, from: Point, segment: PathSegment, place: At) {
        let image = self.graphics.image;
        let segment = match segment {
            PathSegment::Line { to } => PathSegment::Line { to: image.point(to) },
            PathSegment::Arc { to, centre, clockwise } => PathSegment::Arc {
                to: image.point(to),
                centre: image.point(centre),
                clockwise: clockwise != image.flips(),
            },
        };
        let from = image.point(from);
        if let Some(path) = &mut self.graphics.region {
            if path.segments.is_empty() {
                path.start = from;
            }
            path.segments.push(segment);
            self.step_repeat.kept += 1;
            return;
        }
        match segment {
            PathSegment::Line { .. } => self.out.counts.lines += 1,
            PathSegment::Arc { .. } => self.out.counts.arcs += 1,
        }
        match self.graphics.aperture {
            Some(aperture) => self.put(ObjectShape::Stroke { from, segment }, aperture, place),
            None => self.tell_once(Severity::Error, code!("gerber.no_aperture"), place, b""),
        }
    }

    pub(super) fn end_contour(&mut self, place: At) {
        let Some(path) = self.graphics.region.as_mut().filter(|path| !path.segments.is_empty()) else {
            return;
        };
        let mut path = std::mem::take(path);
        self.out.counts.regions += 1;
        if !path.is_closed() {
            self.tell_once(Severity::Warning, code!("gerber.contour_open"), place, b"");
            path.segments.push(PathSegment::Line { to: path.start });
        }
        if crosses_itself(&path, &mut self.pairs_left) {
            self.tell_once(Severity::Warning, code!("gerber.contour_crosses"), place, b"");
        }
        self.put(ObjectShape::Contour(path), 0, place);
    }

    fn segment(&mut self, from: Point, to: Point, offset: (Length, Length), place: At) -> PathSegment {
        if self.graphics.interpolation == Interpolation::Straight {
            return PathSegment::Line { to };
        }
        let clockwise = self.graphics.interpolation == Interpolation::Clockwise;
        let signed = Point::new(from.x + offset.0, from.y + offset.1);
        let many = match self.graphics.quadrants {
            Some(quadrants) => quadrants == Quadrants::Many,
            None => {
                self.tell_once(Severity::Warning, code!("gerber.quadrant_missing"), place, b"");
                offset.0 < Length::ZERO || offset.1 < Length::ZERO
            }
        };
        let centre = if many { signed } else { quarter_centre(from, to, offset, clockwise) };
        let (first, last) = (from.distance_mm(centre), to.distance_mm(centre));
        if from == to && !many {
            return PathSegment::Line { to };
        }
        if first < 1e-6 || last < 1e-6 {
            self.tell_once(Severity::Warning, code!("gerber.arc_without_radius"), place, b"");
            return PathSegment::Line { to };
        }
        if first > REACH.mm() && self.is_impossible(from, to, (centre, clockwise), place) {
            return PathSegment::Line { to };
        }
        if !many && chords::turn(from, to, centre, clockwise) >= QUARTER_RAD {
            self.tell_once(Severity::Warning, code!("gerber.arc_over_quarter"), place, b"");
        }
        if (first - last).abs() > UNEVEN_MM {
            self.tell_once(Severity::Warning, code!("gerber.arc_uneven"), place, b"");
        }
        PathSegment::Arc { to, centre: even_centre(from, to, centre), clockwise }
    }
}

impl Reader {
    /// True if an arc with a far center can't be real: an integer overflow in the CAD. Signs: the ends
    /// coincide or have different radii, the arc is more than half a circle, or the center is out of reach.
    /// Reports it; the caller draws a line.
    fn is_impossible(
        &mut self,
        from: Point,
        to: Point,
        (centre, clockwise): (Point, bool),
        place: At,
    ) -> bool {
        let chord = from.distance_mm(to);
        let uneven = (from.distance_mm(centre) - to.distance_mm(centre)).abs() > UNEVEN_MM;
        let is_point = chord <= POINT_MM;
        let far = from.distance_mm(centre) > 2.0 * REACH.mm();
        if !is_point && !uneven && !far && chords::turn(from, to, centre, clockwise) <= PI {
            return false;
        }
        let (severity, code) = if is_point {
            (Severity::Note, code!("gerber.arc_as_line"))
        } else {
            (Severity::Error, code!("gerber.arc_impossible"))
        };
        let at = format!("X {:.3} Y {:.3} mm", from.x.mm(), from.y.mm());
        self.tell(severity, code, place, at.as_bytes());
        true
    }
}

/// Single-quadrant mode: of the four possible centers, the one that fits both ends best with at most a
/// quarter turn.
fn quarter_centre(from: Point, to: Point, offset: (Length, Length), clockwise: bool) -> Point {
    let middle =
        |(sx, sy): (i64, i64)| Point::new(from.x + offset.0.abs() * sx, from.y + offset.1.abs() * sy);
    let fits = |centre: &Point| {
        let uneven = (from.distance_mm(*centre) - to.distance_mm(*centre)).abs();
        let turn = chords::turn(from, to, *centre, clockwise);
        uneven + if turn < QUARTER_RAD { 0.0 } else { turn * 1_000.0 }
    };
    let signs = [(1, 1), (1, -1), (-1, 1), (-1, -1)];
    signs.map(middle).into_iter().min_by(|a, b| fits(a).total_cmp(&fits(b))).unwrap_or(from)
}

/// Moves the center along the chord until both radii are equal, because files round I and J. A large move
/// would make another arc, so it is limited.
fn even_centre(from: Point, to: Point, centre: Point) -> Point {
    let chord = from.distance_mm(to);
    let (first, last) = (from.distance_mm(centre), to.distance_mm(centre));
    let by = (last * last - first * first) / (2.0 * chord);
    if chord == 0.0 || by.abs() > RECENTRED_MM {
        return centre;
    }
    let (dx, dy) = ((to.x - from.x).mm() / chord, (to.y - from.y).mm() / chord);
    Point::new(centre.x + Length::from_mm(dx * by), centre.y + Length::from_mm(dy * by))
}

#[cfg(test)]
mod tests {
    use super::super::object::Gerber;
    use super::*;
    use crate::artwork::Overrides;

    fn arc(mode: &str, words: &str) -> PathSegment {
        let text = format!("%FSLAX33Y33*%%MOMM*%%ADD10C,0.1*%{mode}D10*X0Y0D02*{words}*M02*");
        let (gerber, _): (Gerber, _) = super::super::read("t", text.as_bytes(), &Overrides::default());
        match gerber.objects[0].shape {
            ObjectShape::Stroke { segment, .. } => segment,
            ref other => panic!("{other:?}"),
        }
    }

    #[test]
    fn arcs_get_their_centre() {
        let quarter = arc("G74*G03*", "X5000Y5000I0J5000D01");
        let centre = Point::from_mm(0.0, 5.0);
        assert_eq!(quarter, PathSegment::Arc { to: Point::from_mm(5.0, 5.0), centre, clockwise: false });
        let backwards = arc("G74*G02*", "X5000Y5000I5000J0D01");
        let centre = Point::from_mm(5.0, 0.0);
        assert_eq!(backwards, PathSegment::Arc { to: Point::from_mm(5.0, 5.0), centre, clockwise: true });
        let unsaid = arc("G03*", "X-5000Y5000I-5000J0D01");
        assert!(
            matches!(unsaid, PathSegment::Arc { centre, .. } if centre == Point::from_mm(-5.0, 0.0)),
            "{unsaid:?}"
        );
        let full = arc("G75*G02*", "X0Y0I5000J0D01");
        assert!(matches!(full, PathSegment::Arc { to, .. } if to == Point::default()));
        assert!(matches!(arc("G74*G02*", "X0Y0I5000J0D01"), PathSegment::Line { .. }));
        let rounded = arc("G75*G03*", "X10000Y0I5004J0D01");
        assert!(matches!(rounded, PathSegment::Arc { centre, .. } if centre == Point::from_mm(5.0, 0.0)));
        assert!(matches!(arc("G75*G02*", "X1000Y0I0J0D01"), PathSegment::Line { .. }));
    }

    #[test]
    fn overflowing_arc_centres_become_lines() {
        // The end of the arc, its center, and the diagnostic.
        for (words, code) in [
            ("X2000Y2000I-2147483647J2147483646", Some((Severity::Note, "gerber.arc_as_line"))),
            ("X0Y0I-2147483647J2147483646", Some((Severity::Note, "gerber.arc_as_line"))),
            ("X9000Y4000I2147483647J-2147483647", Some((Severity::Note, "gerber.arc_as_line"))),
            ("X11000Y0I-2147483647J2147483646", Some((Severity::Error, "gerber.arc_impossible"))),
            ("X50000000Y0I-2147483647J2147483646", Some((Severity::Error, "gerber.arc_impossible"))),
            // A long edge with a slight bend.
            ("X100000000Y0I50000000J1500000000", None),
        ] {
            let text = format!("%FSLAX46Y46*%%MOMM*%%ADD10C,0.1*%D10*G75*G03*X0Y0D02*{words}D01*M02*");
            let (gerber, diagnostics) = super::super::read("t", text.as_bytes(), &Overrides::default());
            let found: Vec<_> = diagnostics.iter().map(|told| (told.severity, told.code.as_str())).collect();
            assert_eq!(found, code.into_iter().collect::<Vec<_>>(), "{words}");
            let is_line = matches!(
                gerber.objects[0].shape,
                ObjectShape::Stroke { segment: PathSegment::Line { .. }, .. }
            );
            assert_eq!(is_line, code.is_some(), "{words}");
            assert!(painted_bounds_mm(&gerber) < 110.0, "{words}");
        }
    }

    fn painted_bounds_mm(gerber: &Gerber) -> f64 {
        let bounds = gerber.centre_bounds().unwrap();
        (bounds.max.x - bounds.min.x).mm().max((bounds.max.y - bounds.min.y).mm())
    }
}
