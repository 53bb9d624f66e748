//! The outlines of apertures, around their origin.
//!
//! ```text
//!  Circle ●   Rectangle ▬   Obround ⬭   Polygon ⬢   Macro: its primitives in order
//!             an opening is removed from the aperture only, not from what is below a flash
//! ```

use super::exposures::{Piece, exposures};
use super::object::{Aperture, Form, Opening};
use super::primitives::{Primitive, ring};
use super::transform::sin_cos;
use crate::geometry::{
    Bounds, Enclosing, Exposure, Fuel, Path, PathSegment, Point, circle, enclosed, paint_within, rectangle,
};
use crate::units::Length;
use geo::{ConvexHull, Coord, MultiPoint};

/// The outlines of an aperture around its origin. Empty for a block, whose objects are drawn directly, and
/// for size 0. None if there is not enough fuel.
pub(super) fn outlines(aperture: &Aperture, fuel: &mut Fuel) -> Option<Vec<Path>> {
    let whole = match &aperture.form {
        Form::Circle { diameter } if diameter.nm() > 0 => vec![circle(Point::default(), *diameter)],
        Form::Rectangle { width, height } => box_of(*width, *height),
        Form::Obround { width, height } => obround(*width, *height),
        Form::Polygon { diameter, corners, turn_deg } => polygon(*diameter, *corners, *turn_deg),
        Form::Macro { primitives, .. } => return worked_out(primitives, fuel),
        Form::Circle { .. } | Form::Block { .. } => Vec::new(),
    };
    let opening = match aperture.opening {
        None => return Some(whole),
        Some(Opening::Round(diameter)) => vec![circle(Point::default(), diameter)],
        Some(Opening::Rectangle(width, height)) => box_of(width, height),
    };
    painted(&[Exposure { clear: false, outlines: whole }, Exposure { clear: true, outlines: opening }], fuel)
}

/// The outlines of primitives drawn in order. A primitive with one path can run in either direction; with
/// several, these are rings, and holes run clockwise.
fn worked_out(primitives: &[Primitive], fuel: &mut Fuel) -> Option<Vec<Path>> {
    let mut pieces = Vec::with_capacity(primitives.len());
    for (dark, paths) in primitives {
        let outlines = match paths.as_slice() {
            [one] => enclosed(one, Enclosing::Once, fuel)?,
            several => several.to_vec(),
        };
        pieces.push(Piece { clear: !dark, outlines });
    }
    let (mut exposures, _) = exposures(pieces);
    match exposures.as_mut_slice() {
        [only] if !only.clear && primitives.len() == 1 => Some(std::mem::take(&mut only.outlines)),
        _ => painted(&exposures, fuel),
    }
}

fn painted(exposures: &[Exposure], fuel: &mut Fuel) -> Option<Vec<Path>> {
    Some(paint_within(exposures, false, fuel).ok()?.paths().cloned().collect())
}

fn box_of(width: Length, height: Length) -> Vec<Path> {
    if width.nm() <= 0 || height.nm() <= 0 {
        return Vec::new();
    }
    let min = Point::new(Length::from_nm(-width.nm() / 2), Length::from_nm(-height.nm() / 2));
    vec![rectangle(Bounds { min, max: Point::new(min.x + width, min.y + height) })]
}

/// Two half circles joined by straight sides.
fn obround(width: Length, height: Length) -> Vec<Path> {
    let radius = Length::from_nm(width.min(height).nm() / 2);
    if radius.nm() <= 0 {
        return Vec::new();
    }
    if width == height {
        return vec![circle(Point::default(), width)];
    }
    // The center of the first half circle, and its radius perpendicular to the direction of the second.
    let reach = Length::from_nm((width.nm() - height.nm()).abs() / 2);
    let (a, side) = if width > height {
        (Point::new(reach, Length::ZERO), Point::new(Length::ZERO, radius))
    } else {
        (Point::new(Length::ZERO, reach), Point::new(-radius, Length::ZERO))
    };
    let b = Point::new(-a.x, -a.y);
    let plus = |p: Point, q: Point| Point::new(p.x + q.x, p.y + q.y);
    let minus = |p: Point, q: Point| Point::new(p.x - q.x, p.y - q.y);
    let start = minus(a, side);
    let segments = vec![
        PathSegment::Arc { to: plus(a, side), centre: a, clockwise: false },
        PathSegment::Line { to: plus(b, side) },
        PathSegment::Arc { to: minus(b, side), centre: b, clockwise: false },
        PathSegment::Line { to: start },
    ];
    vec![Path { start, segments }]
}

fn polygon(diameter: Length, corners: u32, turn_deg: f64) -> Vec<Path> {
    let radius = diameter.mm() / 2.0;
    let corner = |index: u32| {
        let (sin, cos) = sin_cos(turn_deg + 360.0 * f64::from(index) / f64::from(corners));
        (radius * cos, radius * sin)
    };
    ring((0..corners).map(corner)).into_iter().filter(|_| radius > 0.0).collect()
}

/// The convex hull as a closed path, counter-clockwise from its leftmost corner; none without area. Exact:
/// whole nanometres are integers in f64, and `geo` uses robust predicates.
pub(super) fn hull(points: &[Point]) -> Option<Path> {
    let exact = |point: &Point| Coord { x: point.x.nm() as f64, y: point.y.nm() as f64 };
    let around = points.iter().map(exact).collect::<MultiPoint>().convex_hull();
    let whole = |at: &Coord| Point::new(Length::from_nm(at.x as i64), Length::from_nm(at.y as i64));
    let mut corners: Vec<Point> = around.exterior().coords().skip(1).map(whole).collect();
    corners.dedup();
    let leftmost = corners.iter().enumerate().min_by_key(|(_, corner)| **corner)?.0;
    corners.rotate_left(leftmost);
    let (&first, rest) = corners.split_first().filter(|(_, rest)| rest.len() >= 2)?;
    let segments = rest.iter().copied().chain([first]).map(|to| PathSegment::Line { to }).collect();
    Some(Path { start: first, segments })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{area_mm2, paint, union};
    use std::f64::consts::PI;

    fn area(form: Form, opening: Option<Opening>) -> f64 {
        let aperture = Aperture { code: 10, form, opening, function: None, repeated: 1, depth: 0 };
        let paths = outlines(&aperture, &mut Fuel::new(100_000)).unwrap();
        area_mm2(&paint(&[Exposure { clear: false, outlines: paths }]))
    }

    #[test]
    fn apertures_have_their_exact_area() {
        let um = Length::from_um;
        let (width, height) = (um(3_000), um(1_000));
        let hexagon = 3.0 * libm::sqrt(3.0) / 2.0;
        for (form, opening, want) in [
            (Form::Circle { diameter: um(2_000) }, None, PI),
            (Form::Circle { diameter: um(2_000) }, Some(Opening::Round(um(1_000))), 0.75 * PI),
            (Form::Circle { diameter: um(2_000) }, Some(Opening::Round(um(3_000))), 0.0),
            (Form::Circle { diameter: Length::ZERO }, None, 0.0),
            (Form::Rectangle { width, height }, None, 3.0),
            (Form::Rectangle { width, height }, Some(Opening::Rectangle(um(500), um(500))), 2.75),
            (Form::Obround { width, height }, None, 2.0 + PI / 4.0),
            (Form::Obround { width: height, height: width }, None, 2.0 + PI / 4.0),
            (Form::Obround { width, height: width }, None, 9.0 * PI / 4.0),
            (Form::Polygon { diameter: um(2_000), corners: 6, turn_deg: 12.0 }, None, hexagon),
        ] {
            let found = area(form.clone(), opening);
            assert!((found - want).abs() < 1e-4, "{form:?} {opening:?}: {found} not {want}");
        }
    }

    #[test]
    fn hull_encloses_its_points() {
        let at = Point::from_mm;
        let points = vec![at(0.0, 0.0), at(2.0, 0.0), at(1.0, 0.5), at(2.0, 1.0), at(0.0, 1.0), at(1.0, 0.0)];
        let found = hull(&points).unwrap();
        assert_eq!(found.start, at(0.0, 0.0));
        assert_eq!(found.segments.len(), 4);
        assert!((area_mm2(&union(&[found])) - 2.0).abs() < 1e-6);
        assert_eq!(hull(&[at(0.0, 0.0), at(1.0, 1.0), at(2.0, 2.0)]), None);
        assert_eq!((hull(&[]), hull(&[at(1.0, 1.0); 3])), (None, None));
    }
}
