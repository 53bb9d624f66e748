//! The primitives of macros.
//!
//! ```text
//!  1 circle   2, 20 line    21 rectangle   22 rectangle     4 outline   5 polygon   6 moiré    7 thermal
//!                by ends       by center      by corner
//!     ●          ▬             ▬              ▬                ◣           ⬢         ◎┼          ◜◝
//!                                                                                                ◟◞
//! ```

use super::transform::sin_cos;
use crate::artwork::Units;
use crate::geometry::{Path, PathSegment, Point, circle};
use crate::units::{Length, NM_PER_INCH, NM_PER_MM};

/// Closed paths whose non-zero union is dark or, if `false`, removed from what the macro has drawn before.
pub(super) type Primitive = (bool, Vec<Path>);

const MOST_CORNERS: usize = 10_000;
const MOST_RINGS: f64 = 1_000.0;
const LARGEST_MM: f64 = 2_000.0;

/// The paths of a primitive; none if its fields are invalid.
pub(super) fn primitive(fields: &[f64], units: Units) -> Option<Vec<Primitive>> {
    let mm = match units {
        Units::Mm => 1.0,
        Units::Inch => NM_PER_INCH as f64 / NM_PER_MM as f64,
    };
    let (&code, fields) = fields.split_first()?;
    let field = |index: usize| fields.get(index).copied();
    let size = |index: usize| Some(field(index)? * mm).filter(|size| size.abs() <= LARGEST_MM);
    let turn = |index: usize| Turn::by(field(index).unwrap_or(0.0));
    let dark = || Some(field(0)? != 0.0);
    let single = |path: Option<Path>| Some(vec![(dark()?, vec![path?])]);
    match code as i64 {
        1 => {
            let (diameter, x, y) = (size(1)?, size(2)?, size(3)?);
            single(turn(4).disc((x, y), diameter))
        }
        2 | 20 => {
            let (width, from, to) = (size(1)?, (size(2)?, size(3)?), (size(4)?, size(5)?));
            let (dx, dy) = (to.0 - from.0, to.1 - from.1);
            let length = libm::sqrt(dx * dx + dy * dy);
            if length == 0.0 {
                return Some(Vec::new());
            }
            let (nx, ny) = (-dy / length * width / 2.0, dx / length * width / 2.0);
            single(turn(6).ring(&[
                (from.0 - nx, from.1 - ny),
                (to.0 - nx, to.1 - ny),
                (to.0 + nx, to.1 + ny),
                (from.0 + nx, from.1 + ny),
            ]))
        }
        21 => {
            let (width, height, x, y) = (size(1)?, size(2)?, size(3)?, size(4)?);
            single(turn(5).rectangle((x - width / 2.0, y - height / 2.0), (width, height)))
        }
        22 => single(turn(5).rectangle((size(3)?, size(4)?), (size(1)?, size(2)?))),
        4 => {
            let count = field(1).filter(|count| (1.0..=MOST_CORNERS as f64).contains(count))? as usize;
            let corners: Option<Vec<_>> =
                (0..=count).map(|index| Some((size(2 + 2 * index)?, size(3 + 2 * index)?))).collect();
            single(turn(4 + 2 * count).ring(&corners?))
        }
        5 => {
            let corners = field(1).filter(|count| (3.0..=MOST_CORNERS as f64).contains(count))? as u32;
            let (x, y, radius) = (size(2)?, size(3)?, size(4)? / 2.0);
            let corner = |index: u32| {
                let (sin, cos) = sin_cos(360.0 * f64::from(index) / f64::from(corners));
                (x + radius * cos, y + radius * sin)
            };
            single(turn(5).ring(&(0..corners).map(corner).collect::<Vec<_>>()))
        }
        6 => {
            moire(&[size(0)?, size(1)?, size(2)?, size(3)?, size(4)?, field(5)?, size(6)?, size(7)?], turn(8))
        }
        7 => thermal((size(0)?, size(1)?), size(2)?, size(3)?, size(4)?, turn(5)),
        _ => None,
    }
}

/// Rings from outside to inside, and a cross over them.
fn moire(fields: &[f64; 8], turn: Turn) -> Option<Vec<Primitive>> {
    let &[x, y, outer, thickness, gap, rings, cross, length] = fields;
    let (mut made, mut diameter) = (Vec::new(), outer);
    for _ in 0..rings.clamp(0.0, MOST_RINGS) as u32 {
        if diameter <= 0.0 || thickness <= 0.0 || gap < 0.0 {
            break;
        }
        let inner = diameter - 2.0 * thickness;
        let mut ring = vec![turn.disc((x, y), diameter)?];
        if inner > 0.0 {
            ring.push(turn.disc((x, y), inner)?.reversed());
        }
        made.push((true, ring));
        diameter = inner - 2.0 * gap;
    }
    if cross > 0.0 && length > 0.0 {
        let (half, arm) = (cross / 2.0, length / 2.0);
        made.push((true, vec![turn.rectangle((x - arm, y - half), (length, cross))?]));
        made.push((true, vec![turn.rectangle((x - half, y - arm), (cross, length))?]));
    }
    Some(made)
}

/// A ring with a cross removed: four pieces, each bounded by two arcs, or by one arc and a corner.
fn thermal((x, y): (f64, f64), outer: f64, inner: f64, gap: f64, turn: Turn) -> Option<Vec<Primitive>> {
    if !(inner >= 0.0 && inner < outer && gap >= 0.0) {
        return None;
    }
    let (big, small, half) = (outer / 2.0, inner / 2.0, gap / 2.0);
    if half == 0.0 {
        let mut ring = vec![turn.disc((x, y), outer)?];
        if small > 0.0 {
            ring.push(turn.disc((x, y), inner)?.reversed());
        }
        return Some(vec![(true, ring)]);
    }
    let reach = |radius: f64| libm::sqrt((radius * radius - half * half).max(0.0));
    let (far, near) = (reach(big), reach(small));
    if far <= half {
        return Some(Vec::new());
    }
    let piece = |quarter: f64| {
        let spin = Turn::by(quarter);
        let at = |corner: (f64, f64)| {
            let (cx, cy) = spin.point(corner);
            let (px, py) = turn.point((x + cx, y + cy));
            Point::from_mm(px, py)
        };
        let centre = at((0.0, 0.0));
        let mut path = Path { start: at((far, half)), segments: Vec::new() };
        path.segments.push(PathSegment::Arc { to: at((half, far)), centre, clockwise: false });
        if near > half {
            path.segments.push(PathSegment::Line { to: at((half, near)) });
            path.segments.push(PathSegment::Arc { to: at((near, half)), centre, clockwise: true });
        } else {
            path.segments.push(PathSegment::Line { to: at((half, half)) });
        }
        path.segments.push(PathSegment::Line { to: path.start });
        path
    };
    Some(vec![(true, [0.0, 90.0, 180.0, 270.0].map(piece).to_vec())])
}

#[derive(Clone, Copy)]
struct Turn {
    sin: f64,
    cos: f64,
}

impl Turn {
    fn by(degrees: f64) -> Self {
        let (sin, cos) = sin_cos(degrees);
        Self { sin, cos }
    }

    fn point(self, (x, y): (f64, f64)) -> (f64, f64) {
        (x * self.cos - y * self.sin, x * self.sin + y * self.cos)
    }

    fn ring(self, corners: &[(f64, f64)]) -> Option<Path> {
        ring(corners.iter().map(|corner| self.point(*corner)))
    }

    fn rectangle(self, (x, y): (f64, f64), (width, height): (f64, f64)) -> Option<Path> {
        self.ring(&[(x, y), (x + width, y), (x + width, y + height), (x, y + height)])
    }

    fn disc(self, centre: (f64, f64), diameter: f64) -> Option<Path> {
        let (x, y) = self.point(centre);
        (diameter >= 0.0).then(|| circle(Point::from_mm(x, y), Length::from_mm(diameter)))
    }
}

/// The closed path through corners in mm; none for fewer than two.
pub(super) fn ring(corners: impl Iterator<Item = (f64, f64)>) -> Option<Path> {
    let points: Vec<Point> = corners.map(|(x, y)| Point::from_mm(x, y)).collect();
    let mut path = Path::through(&points).filter(|path| !path.segments.is_empty())?;
    if !path.is_closed() {
        path.segments.push(PathSegment::Line { to: path.start });
    }
    Some(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(paths: &[Path]) -> f64 {
        let twice = |path: &Path| -> f64 {
            let points = path.flattened(1e-4);
            let sides = points.iter().zip(points.iter().cycle().skip(1));
            sides.map(|(a, b)| a.x.mm() * b.y.mm() - b.x.mm() * a.y.mm()).sum()
        };
        paths.iter().map(twice).sum::<f64>().abs() / 2.0
    }

    #[test]
    fn every_primitive_has_its_area() {
        use std::f64::consts::PI;
        // A disc minus two arms of width 0.2; their crossing is counted twice.
        let sector = |r: f64| {
            let half = libm::sqrt(r * r - 0.01);
            PI * r * r - 4.0 * (0.1 * half + r * r * libm::asin(0.1 / r)) + 0.04
        };
        for (fields, parts) in [
            (&[1.0, 1.0, 2.0, 5.0, 5.0, 30.0][..], &[PI][..]),
            (&[20.0, 1.0, 0.5, 0.0, 0.0, 3.0, 4.0, 45.0], &[2.5]),
            (&[2.0, 1.0, 0.5, 1.0, 1.0, 1.0, 1.0, 0.0], &[]),
            (&[21.0, 1.0, 2.0, 3.0, 1.0, 1.0, 30.0], &[6.0]),
            (&[22.0, 0.0, 2.0, 3.0, 1.0, 1.0, 0.0], &[6.0]),
            (&[4.0, 1.0, 3.0, 0.0, 0.0, 2.0, 0.0, 2.0, 2.0, 0.0, 0.0, 10.0], &[2.0]),
            (&[5.0, 1.0, 4.0, 0.0, 0.0, 2.0, 0.0], &[2.0]),
            (&[6.0, 0.0, 0.0, 4.0, 0.5, 0.5, 1.0, 0.1, 5.0, 0.0], &[1.75 * PI, 0.5, 0.5]),
            (&[7.0, 0.0, 0.0, 2.0, 1.0, 0.0, 45.0], &[0.75 * PI]),
            (&[7.0, 0.0, 0.0, 2.0, 1.0, 0.2, 45.0], &[sector(1.0) - sector(0.5)]),
        ] {
            let made = primitive(fields, Units::Mm).unwrap();
            assert_eq!(made.len(), parts.len(), "{fields:?}");
            for ((_, paths), want) in made.iter().zip(parts) {
                assert!((area(paths) - want).abs() < 3e-3, "{fields:?}: {} not {want}", area(paths));
            }
        }
    }

    #[test]
    fn invalid_fields_give_no_primitive() {
        for fields in [
            &[][..],
            &[1.0, 1.0],
            &[1.0, 1.0, -2.0, 0.0, 0.0],
            &[4.0, 1.0, 1e9, 0.0, 0.0],
            &[5.0, 1.0, 2.0, 0.0, 0.0, 1.0, 0.0],
            &[7.0, 0.0, 0.0, 1.0, 2.0, 0.1, 0.0],
            &[1.0, 1.0, 1e9, 0.0, 0.0],
            &[8.0],
        ] {
            assert_eq!(primitive(fields, Units::Mm), None, "{fields:?}");
        }
    }
}
