//! Grid of the probe points, with a margin inside the edges of the cut area.
//!
//! ```text
//!   ┌───────────────┐  cut area
//!   │ ·   ·   ·   · │
//!   │               │  spacing: greatest distance between points, spread evenly
//!   │ ·   ·   ·   · │  margin: distance of the outermost points from the edge
//!   └───────────────┘
//! ```

use crate::code;
use crate::diagnostic::Diagnostic;
use crate::geometry::{Bounds, Point};
use crate::units::Length;
use serde::{Deserialize, Serialize};

const CLOSEST: Length = Length::from_um(1_000);
/// A smaller cut area needs no height map.
const SMALLEST: Length = Length::from_um(2_000);

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ProbeGrid {
    pub low: Point,
    pub high: Point,
    /// Points along X, at least 2.
    pub columns: u16,
    /// Points along Y, at least 2.
    pub rows: u16,
    /// Margin between the cut area and the outermost points.
    pub margin: Length,
}

impl ProbeGrid {
    /// Greatest number of points: about an hour of probing.
    pub const MOST: usize = 1_024;

    /// A grid over `bounds` with points at most `spacing` apart and a margin of `margin`, at most a quarter
    /// of a small board.
    pub fn over(bounds: Bounds, spacing: Length, margin: Length) -> Result<Self, Diagnostic> {
        let size = [bounds.max.x - bounds.min.x, bounds.max.y - bounds.min.y];
        let least = size[0].min(size[1]);
        let refuse = |code: &str| Diagnostic::error(code);
        if least < SMALLEST {
            return Err(refuse(code!("level.too_small")).with("mm", least.mm()));
        }
        if spacing < CLOSEST || margin < Length::ZERO || !bounds.is_in_reach() {
            return Err(refuse(code!("level.bad_grid")).with("mm", spacing.mm()));
        }
        let margin = margin.min(Length::from_nm(least.nm() / 4));
        let low = Point::new(bounds.min.x + margin, bounds.min.y + margin);
        let high = Point::new(bounds.max.x - margin, bounds.max.y - margin);
        let count = |length: Length| {
            usize::try_from((length.nm() - 1).max(0) / spacing.nm()).unwrap_or(Self::MOST) + 2
        };
        let (columns, rows) = (count(high.x - low.x), count(high.y - low.y));
        if columns.saturating_mul(rows) > Self::MOST {
            let why = refuse(code!("level.too_many")).with("places", columns.saturating_mul(rows));
            return Err(why.with("most", Self::MOST));
        }
        Ok(Self { low, high, columns: columns as u16, rows: rows as u16, margin })
    }

    pub fn count(&self) -> usize {
        usize::from(self.columns) * usize::from(self.rows)
    }

    /// True if the grid is valid. Grids read from files or messages may not be.
    pub fn is_sound(&self) -> bool {
        let wide = |low: Length, high: Length| high - low >= Length::from_um(100);
        Bounds { min: self.low, max: self.high }.is_in_reach()
            && wide(self.low.x, self.high.x)
            && wide(self.low.y, self.high.y)
            && (Length::ZERO..=Length::from_um(1_000_000)).contains(&self.margin)
            && self.columns >= 2
            && self.rows >= 2
            && self.count() <= Self::MOST
    }

    /// The point at a column and row, from 0.
    pub fn place(&self, column: usize, row: usize) -> Point {
        Point::new(self.line(0, column), self.line(1, row))
    }

    /// Point `index`, row by row.
    pub fn nth(&self, index: usize) -> Point {
        let columns = usize::from(self.columns);
        self.place(index % columns, index / columns)
    }

    /// Number of grid lines across an axis: 0 X, 1 Y.
    pub(super) fn lines(&self, axis: usize) -> usize {
        usize::from(if axis == 0 { self.columns } else { self.rows })
    }

    pub(super) fn line(&self, axis: usize, index: usize) -> Length {
        let (low, high) = if axis == 0 { (self.low.x, self.high.x) } else { (self.low.y, self.high.y) };
        let spans = self.lines(axis) as i64 - 1;
        low + Length::from_nm((high - low).nm() * index as i64 / spans.max(1))
    }

    /// Index of the cell that contains `at`; the outermost cells extend beyond the grid.
    pub(super) fn cell(&self, axis: usize, at: Length) -> usize {
        let (low, high) = (self.line(axis, 0), self.line(axis, self.lines(axis) - 1));
        let cells = self.lines(axis) - 1;
        let share = (at - low).mm() / (high - low).mm() * cells as f64;
        let near = libm::floor(share).clamp(0.0, cells as f64 - 1.0) as usize;
        // Grid lines are rounded to nanometres, so the division may be off by one cell.
        if near + 1 < cells && self.line(axis, near + 1) <= at {
            return near + 1;
        }
        if near > 0 && self.line(axis, near) > at { near - 1 } else { near }
    }
}
