//! Points, boxes, paths and regions in whole nanometres. Only this module uses geometry crates.

mod afford;
mod bands;
pub mod chords;
mod clusters;
mod combine;
mod compose;
mod families;
mod gaps;
mod grid;
mod grow;
mod index;
mod measure;
mod nearest;
mod overlay;
mod placement;
mod rebuild;
mod ribbon;
mod segments;
mod shape;
mod simplify;
mod strips;
mod stroke;
mod unite;
mod voronoi;

pub use afford::Fuel;
pub use bands::{Outlines, left_of};
pub use combine::{
    CombineRule, Enclosing, Exposure, combine, enclosed, even_odd, paint, paint_within, settled, union,
};
pub use families::families;
pub use gaps::{Gap, gaps};
pub use grow::grow;
pub use index::{Edge, Index, Near};
pub use measure::{
    area_mm2, contains, island_area_mm2, island_contains, path_area_mm2, path_bounds, segment_bounds, winding,
};
pub use placement::{Placement, QUARTER_MDEG};
pub use ribbon::ribbon;
pub use segments::Segments;
pub use shape::{Island, Path, PathSegment, Region};
pub use strips::{Strip, strips};
pub use stroke::{circle, rectangle, stroke, sweep};
pub use voronoi::voronoi;

use crate::units::Length;
use serde::{Deserialize, Serialize};

/// Range of coordinates for boolean operations: 1.07 m from the origin in each direction. Points beyond are
/// clamped, so readers must refuse them with their own diagnostic.
pub const REACH: Length = Length::from_nm((1 << 30) - 1);

/// A point in the plane of the board: X to the right, Y away from the user.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Point {
    pub x: Length,
    /// Away from the user.
    pub y: Length,
}

impl Point {
    pub const fn new(x: Length, y: Length) -> Self {
        Self { x, y }
    }

    pub fn from_mm(x: f64, y: f64) -> Self {
        Self::new(Length::from_mm(x), Length::from_mm(y))
    }

    pub fn distance_mm(self, other: Self) -> f64 {
        let dx = (self.x - other.x).mm();
        let dy = (self.y - other.y).mm();
        libm::sqrt(dx * dx + dy * dy)
    }
}

/// An axis-parallel box. Both corners belong to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bounds {
    pub min: Point,
    pub max: Point,
}

impl Bounds {
    pub const fn of(point: Point) -> Self {
        Self { min: point, max: point }
    }

    /// The smallest box around all `points`; `None` for no points.
    pub fn around(points: impl IntoIterator<Item = Point>) -> Option<Self> {
        points
            .into_iter()
            .fold(None, |bounds, point| Some(bounds.map_or(Self::of(point), |b: Self| b.with(point))))
    }

    #[must_use]
    pub fn with(self, point: Point) -> Self {
        Self {
            min: Point::new(self.min.x.min(point.x), self.min.y.min(point.y)),
            max: Point::new(self.max.x.max(point.x), self.max.y.max(point.y)),
        }
    }

    #[must_use]
    pub fn grown(self, margin: Length) -> Self {
        Self {
            min: Point::new(self.min.x - margin, self.min.y - margin),
            max: Point::new(self.max.x + margin, self.max.y + margin),
        }
    }

    /// True if boolean operations can handle all of it, see [`REACH`].
    pub fn is_in_reach(self) -> bool {
        let reach = Self::of(Point::default()).grown(REACH);
        reach.contains(self.min) && reach.contains(self.max)
    }

    /// True if the boxes share a point.
    pub fn meets(self, other: Self) -> bool {
        self.min.x <= other.max.x
            && other.min.x <= self.max.x
            && self.min.y <= other.max.y
            && other.min.y <= self.max.y
    }

    pub fn contains(self, point: Point) -> bool {
        self.min.x <= point.x && point.x <= self.max.x && self.min.y <= point.y && point.y <= self.max.y
    }
}

#[cfg(test)]
mod laws;
#[cfg(test)]
mod tests;
