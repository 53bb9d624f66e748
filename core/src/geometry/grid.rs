//! A grid of square cells, and the cells that an edge crosses.
//!
//! ```text
//!        ┌───┬───┬───┐
//!   row 1│   │  ╱│╲  │     row by row: the first and the last column that an edge crosses
//!        ├───┼─╱─┼───┤     or nearly crosses
//!   row 0│ ╱─┼╱  │   │
//!        └───┴───┴───┘
//! ```
//!
//! Positions outside the grid belong to the cells at its border.

use super::clusters::Extent;
use super::overlay::Edge;

pub(super) struct Grid {
    left: i64,
    low: i64,
    /// The side of a cell is this power of two, in nm.
    power: u32,
    pub(super) columns: i64,
    pub(super) rows: i64,
    /// An edge this near to a cell, in nm, counts as in it.
    near: i64,
}

impl Grid {
    /// A grid over `extent`, with cells of at most `side_nm` and more than half of it.
    pub(super) fn over(extent: Extent, side_nm: f64, near: i64) -> Self {
        let [left, low, right, high] = extent.map(i64::from);
        let power = (side_nm.max(1.0) as u64).ilog2();
        let cells = |length: i64| (length.max(0) >> power) + 1;
        Self { left, low, power, columns: cells(right - left), rows: cells(high - low), near }
    }

    pub(super) fn row(&self, y: i64) -> i64 {
        ((y - self.low) >> self.power).clamp(0, self.rows - 1)
    }

    pub(super) fn column(&self, x: i64) -> i64 {
        ((x - self.left) >> self.power).clamp(0, self.columns - 1)
    }

    /// First and last column, first and last row near a box.
    pub(super) fn about(&self, extent: Extent) -> ((i64, i64), (i64, i64)) {
        let [left, low, right, high] = extent.map(i64::from);
        let columns = (self.column(left - self.near), self.column(right + self.near));
        (columns, (self.row(low - self.near), self.row(high + self.near)))
    }

    /// Calls `visit` for every row that an edge crosses or nearly crosses, with the first and the last column
    /// there.
    pub(super) fn pass(&self, edge: &Edge, mut visit: impl FnMut(i64, i64, i64)) {
        let (a, b) = if edge.a.y <= edge.b.y { (edge.a, edge.b) } else { (edge.b, edge.a) };
        let [ax, ay, bx, by] = [a.x, a.y, b.x, b.y].map(i64::from);
        let across = |y: i64| match y {
            _ if y <= ay => ax,
            _ if y >= by => bx,
            _ => ax + (bx - ax) * (y - ay) / (by - ay),
        };
        for row in self.row(ay - self.near)..=self.row(by + self.near) {
            let bottom = self.low + (row << self.power);
            let (one, other) = (across(bottom - self.near), across(bottom + (1 << self.power) + self.near));
            visit(row, self.column(one.min(other) - self.near), self.column(one.max(other) + self.near));
        }
    }
}
