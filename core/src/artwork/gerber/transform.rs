//! Mirroring, rotation, scaling and translation of apertures, blocks and copies.
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

    /// Transforms a vector in mm.
    fn apply_mm(self, (x, y): (f64, f64)) -> (f64, f64) {
        let x = if self.mirrored { -x } else { x };
        let (sin, cos) = sin_cos(self.turn_deg);
        (self.scale * (x * cos - y * sin), self.scale * (x * sin + y * cos))
    }

    /// Transforms a point around the origin.
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

/// The placement of a copy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub(super) transform: Transform,
    /// Position of its origin.
    pub(super) at: Point,
}

impl Place {
    /// As drawn.
    pub(super) const HOME: Self =
        Self { transform: Transform::PLAIN, at: Point::new(Length::ZERO, Length::ZERO) };

    /// A point of the copy.
    pub(super) fn point(&self, point: Point) -> Point {
        let point = self.transform.apply(point);
        Point::new(point.x + self.at.x, point.y + self.at.y)
    }

    /// A segment of the copy.
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
}
