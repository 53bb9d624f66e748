//! Placement: mirror, rotation, shift, in this order.
//!
//! ```text
//!      ┌──╮           ╭──┐            ╭╮
//!      │ F   mirror    Ꟊ │  rotation  │╰┐  shift ─▶
//!      └──            ──┘             └ ┘
//! ```
//!
//! Quarter turns are exact; any other rotation rounds every point to the nearest nanometre.

use super::overlay::spot;
use super::{Island, Path, PathSegment, Point, Region};
use crate::units::Length;
use serde::{Deserialize, Serialize};

/// 90° in thousandths of a degree.
pub const QUARTER_MDEG: i32 = 90_000;

/// Mirrors, then rotates about the origin, then shifts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Placement {
    /// Negates X: flips about the Y axis.
    pub mirror: bool,
    /// Counter-clockwise, in thousandths of a degree.
    pub rotation_mdeg: i32,
    pub shift: Point,
}

impl Placement {
    pub const fn shifted(shift: Point) -> Self {
        Self { mirror: false, rotation_mdeg: 0, shift }
    }

    pub fn point(&self, point: Point) -> Point {
        let x = if self.mirror { -point.x } else { point.x };
        let y = point.y;
        let angle = self.rotation_mdeg.rem_euclid(4 * QUARTER_MDEG);
        let (x, y) = match angle {
            0 => (x, y),
            90_000 => (-y, x),
            180_000 => (-x, -y),
            270_000 => (y, -x),
            _ => {
                let radians = f64::from(angle) / 180_000.0 * std::f64::consts::PI;
                let (sine, cosine) = (libm::sin(radians), libm::cos(radians));
                let (fx, fy) = spot(Point::new(x, y));
                let whole = |value: f64| Length::from_nm(libm::round(value) as i64);
                (whole(fx * cosine - fy * sine), whole(fx * sine + fy * cosine))
            }
        };
        Point::new(x + self.shift.x, y + self.shift.y)
    }

    pub fn path(&self, path: &Path) -> Path {
        let segments = path.segments.iter().map(|&segment| match segment {
            PathSegment::Line { to } => PathSegment::Line { to: self.point(to) },
            PathSegment::Arc { to, centre, clockwise } => PathSegment::Arc {
                to: self.point(to),
                centre: self.point(centre),
                clockwise: clockwise != self.mirror,
            },
        });
        Path { start: self.point(path.start), segments: segments.collect() }
    }

    /// A placed closed outline, with its inside still on the same side.
    pub fn outline(&self, outline: &Path) -> Path {
        let placed = self.path(outline);
        if self.mirror { placed.reversed() } else { placed }
    }

    /// A placed region, with islands and holes in canonical order.
    pub fn region(&self, region: &Region) -> Region {
        let outline = |path: &Path| self.outline(path).from_its_left();
        let island = |island: &Island| {
            let mut holes: Vec<Path> = island.holes.iter().map(outline).collect();
            holes.sort();
            Island { outer: outline(&island.outer), holes }
        };
        let mut islands: Vec<Island> = region.islands.iter().map(island).collect();
        islands.sort();
        Region { islands }
    }
}
