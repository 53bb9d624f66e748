//! Touching a board: which place comes next, and which are touched again because they do not fit to what lies around them.
//!
//! ```text
//!  first pass   every place once, there and back row by row
//!  again        places that stand out from their neighbours, and those that were touched twice with two results
//!  done         the middle of what was touched: one bad touch of three is outvoted
//! ```
//!
//! Comes in: heights. Goes out: the next place, at last the heights of all. A step in the board is touched twice and believed; dust,
//! a bit that slipped or a contact that came late is outvoted; what gives another height every time is refused. Moves nothing.

use super::grid::ProbeGrid;
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::units::Length;

/// A place that stands out by more than this, and by more than four times what is usual on this board, is touched again.
const STANDS_OUT: Length = Length::from_um(50);
const USUAL_FACTOR: i64 = 4;
/// Two touches of one place that differ by less say the same.
const SAME: Length = Length::from_um(20);
/// Touches of one place, at most.
const MOST: usize = 5;

/// A survey in work.
#[derive(Clone, Debug, PartialEq)]
pub struct Survey {
    grid: ProbeGrid,
    touched: Vec<Vec<Length>>,
    /// Places that are still to be touched, the next one last.
    to_do: Vec<usize>,
    /// How many places are touched more than once.
    again: usize,
    looked: bool,
}

impl Survey {
    /// Of every place of `grid`.
    pub fn new(grid: ProbeGrid) -> Self {
        let columns = usize::from(grid.columns);
        let mut to_do: Vec<usize> = (0..grid.count())
            .map(|index| {
                let (row, column) = (index / columns, index % columns);
                row * columns + if row % 2 == 1 { columns - 1 - column } else { column }
            })
            .collect();
        to_do.reverse();
        Self { grid, touched: vec![Vec::new(); grid.count()], to_do, again: 0, looked: false }
    }

    /// The places.
    pub fn grid(&self) -> &ProbeGrid {
        &self.grid
    }

    /// Where to touch next; none when all is known.
    pub fn next(&self) -> Option<Point> {
        self.to_do.last().map(|index| self.grid.nth(*index))
    }

    /// The number of the place that is next.
    pub fn next_index(&self) -> Option<usize> {
        self.to_do.last().copied()
    }

    /// All places that are still to be touched, as far as is known now, in their order.
    pub fn to_do(&self) -> impl Iterator<Item = Point> + '_ {
        self.to_do.iter().rev().map(|index| self.grid.nth(*index))
    }

    /// Touches that are done, and how many there will be as far as is known.
    pub fn progress(&self) -> (usize, usize) {
        let done = self.touched.iter().map(Vec::len).sum();
        (done, done + self.to_do.len())
    }

    /// How many places had to be touched more than once.
    pub fn touched_again(&self) -> usize {
        self.again
    }

    /// The height of each place as far as it is known: the middle of its touches.
    pub fn heights(&self) -> Vec<Option<Length>> {
        self.touched.iter().map(|touches| middle(touches)).collect()
    }

    /// The next place was touched at `height`.
    pub fn touch(&mut self, height: Length) -> Result<(), Diagnostic> {
        let Some(index) = self.to_do.pop() else { return Ok(()) };
        let at = self.grid.nth(index);
        let place = |why: Diagnostic| why.with("x", short(at.x)).with("y", short(at.y));
        if !(-super::FURTHEST..=super::FURTHEST).contains(&height) {
            return Err(place(Diagnostic::error("level.too_far")).with("mm", short(height)));
        }
        self.touched[index].push(height);
        if !self.to_do.is_empty() {
            return Ok(());
        }
        self.to_do = if self.looked { self.undecided() } else { self.outliers() };
        self.looked = true;
        self.again = self.touched.iter().filter(|touches| touches.len() > 1).count();
        self.again += self.to_do.iter().filter(|index| self.touched[**index].len() == 1).count();
        let unsteady = self.to_do.iter().find(|index| self.touched[**index].len() >= MOST);
        if let Some(index) = unsteady {
            let at = self.grid.nth(*index);
            let why = Diagnostic::error("level.unsteady").with("x", short(at.x)).with("y", short(at.y));
            let [low, high] = [self.touched[*index].iter().min(), self.touched[*index].iter().max()];
            let apart = high.copied().unwrap_or_default() - low.copied().unwrap_or_default();
            return Err(why.with("mm", short(apart)));
        }
        Ok(())
    }

    /// The heights of all places, once nothing is left to be touched.
    pub fn done(&self) -> Option<Vec<Length>> {
        if self.to_do.is_empty() { self.heights().into_iter().collect() } else { None }
    }

    /// Places that stand out from their neighbours, the first one last.
    fn outliers(&self) -> Vec<usize> {
        let heights: Vec<Length> = self.heights().into_iter().map(Option::unwrap_or_default).collect();
        let apart: Vec<Length> = (0..heights.len()).map(|index| self.apart(&heights, index)).collect();
        let mut sorted = apart.clone();
        sorted.sort_unstable();
        let usual = sorted.get(sorted.len() / 2).copied().unwrap_or_default();
        let limit = STANDS_OUT.max(usual * USUAL_FACTOR);
        (0..apart.len()).rev().filter(|index| apart[*index] > limit).collect()
    }

    /// How far a place is from what its neighbours lead one to expect: the least of what they say along X and along Y.
    fn apart(&self, heights: &[Length], index: usize) -> Length {
        let columns = usize::from(self.grid.columns);
        let rows = usize::from(self.grid.rows);
        let (column, row) = (index % columns, index / columns);
        let along = |at: usize, count: usize, step: usize| {
            let height = |offset: isize| heights[index.saturating_add_signed(offset * step as isize)];
            let expected = match (at, count) {
                (_, 2) => return None,
                (0, _) => height(1) * 2 - height(2),
                (at, count) if at + 1 == count => height(-1) * 2 - height(-2),
                _ => Length::from_nm((height(-1) + height(1)).nm() / 2),
            };
            Some((heights[index] - expected).abs())
        };
        let both = [along(column, columns, 1), along(row, rows, columns)];
        both.into_iter().flatten().min().unwrap_or_else(|| self.corner(heights, index))
    }

    /// Of four places alone, each is what the others lead one to expect.
    fn corner(&self, heights: &[Length], index: usize) -> Length {
        let sum: i64 = heights.iter().map(|height| height.nm()).sum();
        let others = (sum - heights[index].nm()) / (heights.len() as i64 - 1).max(1);
        (heights[index] - Length::from_nm(others)).abs()
    }

    /// Places whose touches do not agree yet: no two of them say the same.
    fn undecided(&self) -> Vec<usize> {
        let agrees = |touches: &[Length]| {
            let mut sorted = touches.to_vec();
            sorted.sort_unstable();
            touches.len() < 2 || sorted.windows(2).any(|pair| pair[1] - pair[0] <= SAME)
        };
        (0..self.touched.len()).rev().filter(|index| !agrees(&self.touched[*index])).collect()
    }
}

/// What two touches agree on; else the middle of them.
fn middle(touches: &[Length]) -> Option<Length> {
    let mut sorted = touches.to_vec();
    sorted.sort_unstable();
    let agreed =
        sorted.windows(2).min_by_key(|pair| pair[1] - pair[0]).filter(|pair| pair[1] - pair[0] <= SAME);
    match (agreed, sorted.len()) {
        (_, 0) => None,
        (Some(pair), _) => Some(Length::from_nm((pair[0] + pair[1]).nm() / 2)),
        (None, count) => Some(sorted[count / 2]),
    }
}

fn short(length: Length) -> String {
    format!("{:.3}", length.mm())
}
