//! Merges chords of an arc where nothing else is near, so that the overlay has fewer edges.
//!
//! ```text
//!        ┌───┬───┬───┐
//!        │ ╭─·─·─╮   │      the cells that the bounds of some chords cover hold only their own arc: a single
//!        ├─·─┼───┼─·─┤      chord in their place meets the same edges, none, and adds no area that
//!        │╱  │   │  ╲│      belongs to another outline
//!        └───┴───┴───┘
//! ```
//!
//! An edge still has its circle, so the arc is restored exactly.

use super::clusters::{Extent, NOTHING, with};
use super::grid::Grid;
use super::overlay::{Edge, Pile, Tag};
use std::ops::RangeInclusive;

/// Cells for each edge, about; up to four times as many.
const CELLS_PER_EDGE: f64 = 2.0;
const SMALLEST_CELL_NM: f64 = 10_000.0;
const MOST_CELLS: i64 = 2_048;
/// An edge this near to a cell, in nm, counts as in it.
const NEAR_NM: i64 = 1;
/// A cell holds 0 (nothing), this (several), or the number of its only arc.
const MANY: u32 = u32::MAX;

/// A grid that records which single arc crosses each cell.
struct Cells {
    grid: Grid,
    holds: Vec<u32>,
}

fn runs(outline: &[Edge]) -> impl Iterator<Item = &[Edge]> {
    outline.chunk_by(|a, b| a.data == b.data && a.data != Tag::STRAIGHT)
}

/// Cell indices of a row from column `from` to `to`.
fn strip(grid: &Grid, row: i64, from: i64, to: i64) -> RangeInclusive<usize> {
    let at = |column: i64| usize::try_from(row * grid.columns + column).unwrap_or(usize::MAX);
    at(from)..=at(to)
}

fn extent<'a>(edges: impl IntoIterator<Item = &'a Edge>) -> Extent {
    let ends = edges.into_iter().flat_map(|edge| [edge.a, edge.b]);
    ends.fold(NOTHING, |extent, end| with(extent, end.x, end.y))
}

impl Cells {
    /// Empty cells over all edges; `None` without edges.
    fn over(piles: &[&Pile]) -> Option<Self> {
        let count: usize = piles.iter().map(|pile| pile.edges.len()).sum();
        if count == 0 {
            return None;
        }
        let extent = extent(piles.iter().flat_map(|pile| &pile.edges));
        let [left, low, right, high] = extent.map(f64::from);
        let (width, height, wanted) = (right - left, high - low, count as f64 * CELLS_PER_EDGE);
        // A long and narrow area has at most as many columns, or rows, as cells are wanted.
        let side = libm::sqrt(width * height / wanted).max(width.max(height) / wanted).max(SMALLEST_CELL_NM);
        let grid = Grid::over(extent, side, NEAR_NM);
        let holds = vec![0; usize::try_from(grid.columns * grid.rows).ok()?];
        Some(Self { grid, holds })
    }

    fn mark(&mut self, edge: &Edge, owner: u32) {
        let Self { grid, holds } = self;
        grid.pass(edge, |row, from, to| {
            for cell in holds.get_mut(strip(grid, row, from, to)).unwrap_or_default() {
                *cell = if *cell == 0 || *cell == owner { owner } else { MANY };
            }
        });
    }

    /// True if only `owner` crosses the cells of a box, and these are not too many.
    fn holds_only(&self, extent: Extent, owner: u32) -> bool {
        let ((from, to), (first, last)) = self.grid.about(extent);
        let only = |cells: &[u32]| cells.iter().all(|&cell| cell == owner || cell == 0);
        (to - from + 1) * (last - first + 1) <= MOST_CELLS
            && (first..=last).all(|row| self.holds.get(strip(&self.grid, row, from, to)).is_some_and(only))
    }

    fn join(&self, run: &[Edge], owner: u32, joined: &mut Vec<Edge>) {
        let (Some(first), Some(last)) = (run.first(), run.last()) else { return };
        if run.len() == 1 {
            joined.push(*first);
        } else if is_flat(run) && self.holds_only(extent(run), owner) {
            joined.push(Edge { b: last.b, ..*first });
        } else {
            let (one, other) = run.split_at(run.len() / 2);
            self.join(one, owner, joined);
            self.join(other, owner, joined);
        }
    }
}

/// True if the chords turn by less than a quarter from first to last.
fn is_flat(run: &[Edge]) -> bool {
    let way =
        |edge: &Edge| (f64::from(edge.b.x) - f64::from(edge.a.x), f64::from(edge.b.y) - f64::from(edge.a.y));
    let ahead = |one: &Edge, other: &Edge| {
        let (one, other) = (way(one), way(other));
        one.0 * other.0 + one.1 * other.1 > 0.0
    };
    // After more than three quarters the last chord points forward again, but the middle one doesn't.
    match (run.first(), run.get(run.len() / 2), run.last()) {
        (Some(first), Some(middle), Some(last)) => ahead(first, middle) && ahead(first, last),
        _ => false,
    }
}

pub(super) fn simplify<const COUNT: usize>(piles: [&Pile; COUNT]) -> [Pile; COUNT] {
    let Some(mut cells) = Cells::over(&piles) else { return piles.map(Pile::clone) };
    for (owner, run) in (1..MANY).zip(piles.iter().flat_map(|pile| pile.outlines()).flat_map(runs)) {
        let owner = if run.len() == 1 { MANY } else { owner };
        run.iter().for_each(|edge| cells.mark(edge, owner));
    }
    let mut owners = 1..MANY;
    piles.map(|pile| {
        let mut joined = Pile::default();
        for outline in pile.outlines() {
            for (run, owner) in runs(outline).zip(&mut owners) {
                cells.join(run, owner, &mut joined.edges);
            }
            joined.ends.push(joined.edges.len());
        }
        joined
    })
}
