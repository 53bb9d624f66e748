//! Mirroring, rotation, scaling and translation of apertures, blocks and copies, and of the whole image by
//! the obsolete commands MI, SF, OF and IR.
//!
//! ```text
//!   p ─ mirror (x ↦ −x) ─ rotate (counter-clockwise) ─ scale ─ translate ─▶ p'
//! ```

use crate::geometry::{Path, PathSegment, Point};
use crate::units::Length;
use std::borrow::Cow;
use std::f64::consts::PI;

/// The transform of an aperture (`%LM`, `%LR`, `%LS`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// Mirrored in X first.
    pub mirrored: bool,
    /// Then rotated, degrees counter-clockwise.
    pub turn_deg: f64,
    /// Then scaled.
    pub scale: f64,
}

impl Default for Transform {
    fn default() -> Self {
        Self::PLAIN
    }
}

impl Transform {
    pub const PLAIN: Self = Self { mirrored: false, turn_deg: 0.0, scale: 1.0 };

    /// The composition: `inner` first, then `self`.
    #[must_use]
    pub fn over(self, inner: Self) -> Self {
        let turned = if self.mirrored { -inner.turn_deg } else { inner.turn_deg };
        Self {
            mirrored: self.mirrored != inner.mirrored,
            turn_deg: libm::fmod(self.turn_deg + turned, 360.0),
            scale: self.scale * inner.scale,
        }
    }

    fn apply_mm(self, (x, y): (f64, f64)) -> (f64, f64) {
        let x = if self.mirrored { -x } else { x };
        let (sin, cos) = sin_cos(self.turn_deg);
        (self.scale * (x * cos - y * sin), self.scale * (x * sin + y * cos))
    }

    pub(super) fn apply(self, point: Point) -> Point {
        if self == Self::PLAIN {
            return point;
        }
        let (x, y) = self.apply_mm((point.x.mm(), point.y.mm()));
        Point::from_mm(x, y)
    }
}

/// The current arguments of `%LM`, `%LR` and `%LS`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Held {
    pub(super) mirror_x: bool,
    pub(super) mirror_y: bool,
    pub(super) turn_deg: f64,
    pub(super) scale: f64,
}

impl Held {
    pub(super) const PLAIN: Self = Self { mirror_x: false, mirror_y: false, turn_deg: 0.0, scale: 1.0 };

    /// As one transform: mirroring in Y is mirroring in X followed by half a turn.
    pub(super) fn transform(self) -> Transform {
        let half = if self.mirror_y { 180.0 } else { 0.0 };
        Transform {
            mirrored: self.mirror_x != self.mirror_y,
            turn_deg: self.turn_deg + half,
            scale: self.scale,
        }
    }
}

/// Sine and cosine of degrees; exact for quarter turns.
pub(super) fn sin_cos(degrees: f64) -> (f64, f64) {
    let quarters = degrees / 90.0;
    if quarters == libm::round(quarters) {
        return match (quarters as i64).rem_euclid(4) {
            0 => (0.0, 1.0),
            1 => (1.0, 0.0),
            2 => (0.0, -1.0),
            _ => (-1.0, 0.0),
        };
    }
    let angle = degrees * (PI / 180.0);
    (libm::sin(angle), libm::cos(angle))
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub(super) transform: Transform,
    pub(super) at: Point,
}

impl Place {
    /// As drawn.
    pub(super) const HOME: Self =
        Self { transform: Transform::PLAIN, at: Point::new(Length::ZERO, Length::ZERO) };

    pub(super) fn point(&self, point: Point) -> Point {
        let point = self.transform.apply(point);
        Point::new(point.x + self.at.x, point.y + self.at.y)
    }

    pub(super) fn segment(&self, segment: PathSegment) -> PathSegment {
        match segment {
            PathSegment::Line { to } => PathSegment::Line { to: self.point(to) },
            PathSegment::Arc { to, centre, clockwise } => PathSegment::Arc {
                to: self.point(to),
                centre: self.point(centre),
                clockwise: clockwise != self.transform.mirrored,
            },
        }
    }

    /// A path of the copy; mirroring reverses its direction.
    pub(super) fn path<'a>(&self, path: &'a Path) -> Cow<'a, Path> {
        if *self == Self::HOME {
            return Cow::Borrowed(path);
        }
        let segments = path.segments.iter().map(|&segment| self.segment(segment)).collect();
        Cow::Owned(Path { start: self.point(path.start), segments })
    }

    /// The placement of a copy inside this copy, with this transform and origin.
    pub(super) fn inner(&self, transform: Transform, at: Point) -> Self {
        Self { transform: self.transform.over(transform), at: self.point(at) }
    }
}

/// Placement of the image: mirror (MI), scale (SF), offset (OF), rotation (IR). As specified, MI and SF
/// change coordinates but not apertures; IR rotates everything.
///
/// ```text
///   as written ─ MI ─ SF ─ OF ─ IR ─▶ layer
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Image {
    pub(super) mirror_x: bool,
    pub(super) mirror_y: bool,
    /// None if not stated.
    pub(super) scale: Option<f64>,
    pub(super) offset: Point,
    pub(super) quarters: u8,
}

impl Image {
    #[inline]
    pub(super) fn point(&self, at: Point) -> Point {
        if *self == Self::default() {
            return at;
        }
        let sign = |mirrored, value: Length| if mirrored { -value } else { value };
        let (mut x, mut y) = (sign(self.mirror_x, at.x), sign(self.mirror_y, at.y));
        if let Some(factor) = self.scale {
            (x, y) = (Length::from_mm(x.mm() * factor), Length::from_mm(y.mm() * factor));
        }
        (x, y) = (x + self.offset.x, y + self.offset.y);
        match self.quarters {
            1 => Point::new(-y, x),
            2 => Point::new(-x, -y),
            3 => Point::new(y, -x),
            _ => Point::new(x, y),
        }
    }

    /// True if arcs change their direction.
    pub(super) fn flips(&self) -> bool {
        self.mirror_x != self.mirror_y
    }

    /// A transform followed by the image's rotation.
    pub(super) fn turned(&self, transform: Transform) -> Transform {
        Transform { turn_deg: f64::from(self.quarters) * 90.0, ..Transform::PLAIN }.over(transform)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nested_transforms_are_composed() {
        let outer = Place {
            transform: Transform { mirrored: true, turn_deg: 90.0, scale: 2.0 },
            at: Point::from_mm(10.0, 0.0),
        };
        let transform = Transform { mirrored: true, turn_deg: 30.0, scale: 1.5 };
        let at = Point::from_mm(1.0, 2.0);
        let inner = Place { transform, at };
        let both = outer.inner(transform, at);
        for point in [Point::from_mm(3.0, 1.0), Point::from_mm(-2.0, 0.5)] {
            assert!(both.point(point).distance_mm(outer.point(inner.point(point))) < 1e-5);
        }
        assert_eq!(outer.point(at), Point::from_mm(10.0 - 4.0, -2.0));
    }

    #[test]
    fn image_is_mirrored_then_shifted_then_rotated() {
        let image = Image {
            mirror_x: true,
            scale: Some(2.0),
            offset: Point::from_mm(1.0, 0.0),
            quarters: 1,
            ..Image::default()
        };
        assert_eq!(image.point(Point::from_mm(3.0, 4.0)), Point::from_mm(-8.0, -5.0));
        assert!(image.flips());
        assert_eq!(Image::default().point(Point::from_mm(3.0, 4.0)), Point::from_mm(3.0, 4.0));
    }
}
