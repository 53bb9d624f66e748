//! Chords of an arc joined to longer ones where nothing else comes near, so that the overlay has less to do.
//!
//! ```text
//!        ┌───┬───┬───┐
//!        │ ╭─·─·─╮   │      the cells that the box of some chords covers hold nothing but their own arc:
//!        ├─·─┼───┼─·─┤      a single chord in their place meets what they met, nothing,
//!        │╱  │   │  ╲│      and takes nothing in that was outside
//!        └───┴───┴───┘
//! ```
//!
//! Comes in: outlines of edges on whole nanometres. Goes out: the same outlines of fewer edges, which cross each other
//! in the same places. An edge still knows its circle, so the arc comes back whole. Exact. Knows no paths.

use super::sheet::{Edge, Pile, Tag};
use i_overlay::i_float::int::point::IntPoint;

/// Cells for every edge, about.
const CELLS_PER_EDGE: i64 = 4;
/// Cells are no smaller, in nm.
const SMALLEST_CELL_NM: i64 = 10_000;
/// The box of chords that are joined covers no more cells.
const MOST_CELLS: i64 = 2_048;
/// What a cell holds: nothing, this, or the number of the one arc in it.
const MANY: u32 = u32::MAX;

/// The plane in square cells, each of which knows which arc passes through it alone.
struct Cells {
    left: i64,
    low: i64,
    side: i64,
    columns: i64,
    rows: i64,
    holds: Vec<u32>,
}

/// Chords of one arc in a row, or one straight edge.
fn runs(outline: &[Edge]) -> impl Iterator<Item = &[Edge]> {
    outline.chunk_by(|a, b| a.data == b.data && a.data != Tag::STRAIGHT)
}

fn whole(point: IntPoint<i32>) -> (i64, i64) {
    (i64::from(point.x), i64::from(point.y))
}

/// Left, low, right, high of edges that follow each other.
fn extent<'a>(edges: impl Iterator<Item = &'a Edge>) -> Option<[i64; 4]> {
    let corners = edges.flat_map(|edge| [whole(edge.a), whole(edge.b)]);
    corners.map(|(x, y)| [x, y, x, y]).reduce(|all, next| {
        [all[0].min(next[0]), all[1].min(next[1]), all[2].max(next[2]), all[3].max(next[3])]
    })
}

impl Cells {
    /// Empty cells over all edges; none where there are no edges.
    fn over(piles: &[&Pile]) -> Option<Self> {
        let count: usize = piles.iter().map(|pile| pile.edges.len()).sum();
        let [left, low, right, high] = extent(piles.iter().flat_map(|pile| &pile.edges))?;
        let (width, height) = (right - left + 1, high - low + 1);
        let wanted = i64::try_from(count).unwrap_or(i64::MAX / 8) * CELLS_PER_EDGE;
        let side = libm::sqrt(width as f64 * height as f64 / wanted as f64) as i64;
        // A long and narrow area has at most as many columns, or rows, as cells are wanted.
        let side = side.max(width / wanted).max(height / wanted).max(SMALLEST_CELL_NM);
        let (columns, rows) = (width / side + 1, height / side + 1);
        let holds = vec![0; usize::try_from(columns * rows).ok()?];
        Some(Self { left, low, side, columns, rows, holds })
    }

    fn column(&self, x: i64) -> i64 {
        ((x - self.left) / self.side).clamp(0, self.columns - 1)
    }

    fn row(&self, y: i64) -> i64 {
        ((y - self.low) / self.side).clamp(0, self.rows - 1)
    }

    /// A row of cells in columns `from` to `to`.
    fn strip(&mut self, row: i64, from: i64, to: i64) -> &mut [u32] {
        let at = |column: i64| usize::try_from(row * self.columns + column).unwrap_or(usize::MAX);
        let (first, last) = (at(from), at(to));
        self.holds.get_mut(first..=last).unwrap_or_default()
    }

    /// Says that `owner` passes through the cells that an edge passes through.
    fn mark(&mut self, edge: &Edge, owner: u32) {
        let (a, b) = if edge.a.y <= edge.b.y { (edge.a, edge.b) } else { (edge.b, edge.a) };
        let ((ax, ay), (bx, by)) = (whole(a), whole(b));
        let (first, last) = (self.row(ay), self.row(by));
        for row in first..=last {
            // Where it enters and leaves the row, a nanometre more for rounding.
            let across = |y: i64| if first == last { ax } else { ax + (bx - ax) * (y - ay) / (by - ay) };
            let bottom = self.low + row * self.side;
            let from = if row == first { ax } else { across(bottom) };
            let to = if row == last { bx } else { across(bottom + self.side) };
            let (from, to) = (self.column(from.min(to) - 1), self.column(from.max(to) + 1));
            for cell in self.strip(row, from, to) {
                *cell = if *cell == 0 || *cell == owner { owner } else { MANY };
            }
        }
    }

    /// Whether no other than `owner` passes through the cells of a box, which are not too many.
    fn holds_only(&mut self, [left, low, right, high]: [i64; 4], owner: u32) -> bool {
        let (from, to, first, last) = (self.column(left), self.column(right), self.row(low), self.row(high));
        (to - from + 1) * (last - first + 1) <= MOST_CELLS
            && (first..=last)
                .all(|row| self.strip(row, from, to).iter().all(|&cell| cell == owner || cell == 0))
    }

    /// The chords `run` of the arc `owner`, joined where it is alone.
    fn join(&mut self, run: &[Edge], owner: u32, joined: &mut Vec<Edge>) {
        let (Some(first), Some(last)) = (run.first(), run.last()) else { return };
        let alone = |cells: &mut Self| extent(run.iter()).is_some_and(|all| cells.holds_only(all, owner));
        if run.len() == 1 {
            joined.push(*first);
        } else if is_flat(run) && alone(self) {
            joined.push(Edge { b: last.b, ..*first });
        } else {
            let (one, other) = run.split_at(run.len() / 2);
            self.join(one, owner, joined);
            self.join(other, owner, joined);
        }
    }
}

/// Whether chords of an arc turn by less than a quarter from the first to the last.
fn is_flat(run: &[Edge]) -> bool {
    let way = |edge: &Edge| {
        let ((ax, ay), (bx, by)) = (whole(edge.a), whole(edge.b));
        ((bx - ax) as f64, (by - ay) as f64)
    };
    let ahead = |one: &Edge, other: &Edge| {
        let (one, other) = (way(one), way(other));
        one.0 * other.0 + one.1 * other.1 > 0.0
    };
    // More than three quarters are ahead again, but half of them is not.
    match (run.first(), run.get(run.len() / 2), run.last()) {
        (Some(first), Some(middle), Some(last)) => ahead(first, middle) && ahead(first, last),
        _ => false,
    }
}

/// Outlines that are laid over each other, of fewer edges.
pub(super) fn coarse<const COUNT: usize>(piles: [&Pile; COUNT]) -> [Pile; COUNT] {
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
