//! Combines three kinds of shapes: a ground, areas to subtract, and covers to add on top.
//!
//! ```text
//!   ▒▒▒▒┌─────┐▒▒▒▒▒▒▒▒▒      ▒ ground    ┌┐ away    ▓ cover
//!   ▒▒▒▒│ ▓▓▓ │▒▒▒▒▓▓▒▒▒
//!   ▒▒▒▒└─────┘▒▒▒▒▓▓▒▒▒      The left ▓ meets no edge and is in the clear: unchanged in the result.
//!   ▒▒▒▒▒▓▓▓▓▓▓▓▒▒▒▒▒▒▒▒      The right one is on ground: adds nothing. Only the lowest one must be overlaid
//!        ▓▓▓▓▓▓▓              with the ground.
//! ```
//!
//! A grid of cells decides whether a cover is free of edges of the others. A wrong "no" is possible and
//! harmless.

use super::clusters::{Extent, NOTHING, clusters, with};
use super::grid::Grid;
use super::overlay::{Edge, Shape, edges_of, extent_of, overlaid, turned};

/// Cells for each edge of ground and subtracted areas, about; up to four times as many.
const CELLS_PER_EDGE: f64 = 32.0;
/// Limit of cells, about; up to four times as many.
const MOST_CELLS: f64 = 2e6;
/// Limit of the mean number of cell rows that an edge crosses; up to twice as many.
const ROWS_PER_EDGE: f64 = 4.0;
/// Edges this near to each other, in nm, count as meeting.
const NEAR_NM: i64 = 1_000;

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    Ground,
    /// Subtracted from the ground.
    Away,
    Over,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Fate {
    Meets,
    Stays,
    /// Entirely on ground: changes nothing.
    Goes,
}

/// A grid, with the cells that edges of the ground and of subtracted areas cross.
struct Cells {
    grid: Grid,
    /// For each row, prefix sums over the columns of cells with edges.
    taken: Vec<i32>,
    /// The edges in each row; those of subtracted areas reversed.
    edges: Vec<Vec<Edge>>,
}

fn index(number: i64) -> usize {
    usize::try_from(number).unwrap_or(0)
}

impl Cells {
    fn of(edges: &[Edge]) -> Self {
        let extent = edges.iter().fold(NOTHING, |extent, edge| with(extent, edge.a.x, edge.a.y));
        let [left, low, right, high] = extent.map(i64::from);
        let (width, height) = ((right - left).max(0), (high - low).max(0));
        let count = (edges.len() as f64).max(1.0);
        let rise = |edge: &Edge| (f64::from(edge.b.y) - f64::from(edge.a.y)).abs();
        let wanted = f64::min(count * CELLS_PER_EDGE, MOST_CELLS);
        let side = libm::sqrt(width as f64 / wanted * height as f64)
            .max(width.max(height) as f64 / wanted)
            .max(edges.iter().map(rise).sum::<f64>() / (ROWS_PER_EDGE * count))
            .max(4.0 * NEAR_NM as f64);
        let grid = Grid::over(extent, side, NEAR_NM);
        let (taken, rows) =
            (vec![0; index((grid.columns + 1) * grid.rows)], vec![Vec::new(); index(grid.rows)]);
        let mut cells = Self { grid, taken, edges: rows };
        cells.mark(edges);
        cells
    }

    fn mark(&mut self, edges: &[Edge]) {
        // Difference of the edge count from the previous cell.
        let mut taken = std::mem::take(&mut self.taken);
        let mut lists = std::mem::take(&mut self.edges);
        for edge in edges {
            self.grid.pass(edge, |row, from, to| {
                for (column, step) in [(from, 1), (to + 1, -1)] {
                    if let Some(slot) = taken.get_mut(self.place(row, column)) {
                        *slot += step;
                    }
                }
                if let Some(list) = lists.get_mut(index(row)) {
                    list.push(*edge);
                }
            });
        }
        for row in taken.chunks_exact_mut(index(self.grid.columns + 1)) {
            let (mut before, mut passing) = (0, 0);
            for slot in row {
                passing += *slot;
                *slot = before;
                before += i32::from(passing > 0);
            }
        }
        (self.taken, self.edges) = (taken, lists);
    }

    fn place(&self, row: i64, column: i64) -> usize {
        index(row * (self.grid.columns + 1) + column)
    }

    /// True if edges cross cells of a row between two columns.
    fn any(&self, row: i64, from: i64, to: i64) -> bool {
        from <= to && self.taken.get(self.place(row, from)) != self.taken.get(self.place(row, to + 1))
    }

    /// True if no edge is near a shape, or between two of its positions in a row.
    fn is_free(&self, shape: &Shape, extent: Extent) -> bool {
        let ((from, to), (first, last)) = self.grid.about(extent);
        if !(first..=last).any(|row| self.any(row, from, to)) {
            return true;
        }
        let mut spans = vec![(self.grid.columns, -1); index(last - first + 1)];
        for edge in edges_of(shape) {
            self.grid.pass(&edge, |row, from, to| {
                if let Some(span) = spans.get_mut(index(row - first)) {
                    *span = (span.0.min(from), span.1.max(to));
                }
            });
        }
        !spans.iter().zip(first..).any(|(&(from, to), row)| self.any(row, from, to))
    }

    fn is_ground(&self, (x, y): (i64, i64)) -> bool {
        let crossing = |edge: &Edge| {
            let [ax, ay, bx, by] = [edge.a.x, edge.a.y, edge.b.x, edge.b.y].map(i64::from);
            let left = (bx - ax) * (y - ay) - (by - ay) * (x - ax);
            i32::from(ay <= y && y < by && left > 0) - i32::from(by <= y && y < ay && left < 0)
        };
        self.edges.get(index(self.grid.row(y))).is_some_and(|row| row.iter().map(crossing).sum::<i32>() > 0)
    }

    fn fate(&self, shape: &Shape) -> Fate {
        match shape.first().and_then(|outer| outer.first()) {
            Some(edge) if self.is_free(shape, extent_of(shape)) => {
                let ground = self.is_ground((i64::from(edge.a.x), i64::from(edge.a.y)));
                if ground { Fate::Goes } else { Fate::Stays }
            }
            _ => Fate::Meets,
        }
    }
}

/// Combines shapes. Groups with overlapping boxes are processed separately; groups of a single role stay
/// unchanged.
pub(super) fn laid<const N: usize>(parts: [(Role, Vec<Shape>); N]) -> Vec<Shape> {
    let all: Vec<(Role, Shape)> = parts
        .into_iter()
        .flat_map(|(part, shapes)| shapes.into_iter().map(move |shape| (part, shape)))
        .collect();
    let of = |wanted| all.iter().filter(move |of| of.0 == wanted).flat_map(|(_, shape)| edges_of(shape));
    let under: Vec<Edge> = of(Role::Ground).chain(of(Role::Away).map(turned)).collect();
    let cells = Cells::of(&under);
    let mut found = Vec::new();
    let mut meeting: Vec<Option<(Role, Shape)>> = Vec::new();
    for (part, shape) in all {
        match if part == Role::Over { cells.fate(&shape) } else { Fate::Meets } {
            Fate::Meets => meeting.push(Some((part, shape))),
            Fate::Stays => found.push(shape),
            Fate::Goes => {}
        }
    }
    let extents: Vec<_> = meeting.iter().flatten().map(|(_, shape)| extent_of(shape)).collect();
    for group in clusters(&extents) {
        let group: Vec<(Role, Shape)> =
            group.into_iter().filter_map(|index| meeting.get_mut(index).and_then(Option::take)).collect();
        let Some((first, _)) = group.first() else { continue };
        if group.iter().any(|(part, _)| part != first) {
            let of = |wanted| group.iter().filter(move |(part, _)| *part == wanted);
            let edges = |wanted| of(wanted).flat_map(|(_, shape)| edges_of(shape));
            found.extend(overlaid(edges(Role::Ground), edges(Role::Away), edges(Role::Over)));
        } else if *first != Role::Away {
            found.extend(group.into_iter().map(|(_, shape)| shape));
        }
    }
    found
}
