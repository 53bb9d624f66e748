//! The obsolete commands that place the image: mirror (MI), scale (SF), offset (OF), rotation (IR). As
//! specified, MI and SF change coordinates but not apertures; IR rotates everything.
//!
//! ```text
//!   as written ─ MI ─ SF ─ OF ─ IR ─▶ layer
//! ```

use super::transform::Transform;
use crate::geometry::Point;
use crate::units::Length;

/// Placement of the image.
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
    /// Converts a point to the layer.
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
