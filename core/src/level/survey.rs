//! Order of the points of a measurement, and which points need another touch because they differ from their
//! neighbours.
//!
//! ```text
//!  first pass   every point once, in alternating directions row by row
//!  again        points that differ from their neighbours, and those with two different results
//!  done         median of the touches: two of three outvote a bad touch
//! ```
//!
//! A step in the board is touched twice and accepted. Dust, a slipped bit or a late contact is outvoted. A
//! point with a different height at every touch is refused. This module moves nothing.

use super::grid::ProbeGrid;
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::geometry::Point;
use crate::units::Length;

/// A point is touched again if it differs from its neighbours by more than this. The difference must also
/// exceed [`USUAL_FACTOR`] times the median of this board.
const STANDS_OUT: Length = Length::from_um(50);
const USUAL_FACTOR: i64 = 4;
/// Two touches of one point agree if they differ by at most this.
const SAME: Length = Length::from_um(20);
const MOST: usize = 5;

#[derive(Clone, Debug, PartialEq)]
pub struct Survey {
    grid: ProbeGrid,
    touched: Vec<Vec<Length>>,
    to_do: Vec<usize>,
    again: usize,
    looked: bool,
}

impl Survey {
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

    pub fn grid(&self) -> &ProbeGrid {
        &self.grid
    }

    /// Next point to probe; none when all heights are known.
    pub fn next(&self) -> Option<Point> {
        self.to_do.last().map(|index| self.grid.nth(*index))
    }

    pub fn next_index(&self) -> Option<usize> {
        self.to_do.last().copied()
    }

    /// All remaining points in order, as known now.
    pub fn to_do(&self) -> impl Iterator<Item = Point> + '_ {
        self.to_do.iter().rev().map(|index| self.grid.nth(*index))
    }

    /// Touches done, and the number expected, as known now.
    pub fn progress(&self) -> (usize, usize) {
        let done = self.touched.iter().map(Vec::len).sum();
        (done, done + self.to_do.len())
    }

    /// Number of points touched more than once.
    pub fn touched_again(&self) -> usize {
        self.again
    }

    /// Current height of each point: the median of its touches.
    pub fn heights(&self) -> Vec<Option<Length>> {
        self.touched.iter().map(|touches| middle(touches)).collect()
    }

    /// Records the height of the next point.
    pub fn touch(&mut self, height: Length) -> Result<(), Diagnostic> {
        let Some(index) = self.to_do.pop() else { return Ok(()) };
        let at = self.grid.nth(index);
        let place = |why: Diagnostic| why.with("x", short(at.x)).with("y", short(at.y));
        if !(-super::FURTHEST..=super::FURTHEST).contains(&height) {
            return Err(place(error!("level.too_far", ..)).with("mm", short(height)));
        }
        self.touched[index].push(height);
        if !self.to_do.is_empty() {
            return Ok(());
        }
        // After the first pass, touch outliers again; later, only undecided points.
        self.to_do = if self.looked { self.undecided() } else { self.outliers() };
        self.looked = true;
        self.again = self.touched.iter().filter(|touches| touches.len() > 1).count();
        self.again += self.to_do.iter().filter(|index| self.touched[**index].len() == 1).count();
        let unsteady = self.to_do.iter().find(|index| self.touched[**index].len() >= MOST);
        if let Some(index) = unsteady {
            let at = self.grid.nth(*index);
            let why = error!("level.unsteady", x = short(at.x), y = short(at.y), ..);
            let [low, high] = [self.touched[*index].iter().min(), self.touched[*index].iter().max()];
            let apart = high.copied().unwrap_or_default() - low.copied().unwrap_or_default();
            return Err(why.with("mm", short(apart)));
        }
        Ok(())
    }

    /// The heights of all points, once no point remains.
    pub fn done(&self) -> Option<Vec<Length>> {
        if self.to_do.is_empty() { self.heights().into_iter().collect() } else { None }
    }

    /// Points that differ from their neighbours, in reverse order.
    fn outliers(&self) -> Vec<usize> {
        let heights: Vec<Length> = self.heights().into_iter().map(Option::unwrap_or_default).collect();
        let apart: Vec<Length> = (0..heights.len()).map(|index| self.apart(&heights, index)).collect();
        let mut sorted = apart.clone();
        sorted.sort_unstable();
        let usual = sorted.get(sorted.len() / 2).copied().unwrap_or_default();
        let limit = STANDS_OUT.max(usual * USUAL_FACTOR);
        (0..apart.len()).rev().filter(|index| apart[*index] > limit).collect()
    }

    /// Difference between a point and the value expected from its neighbours: the smaller of the results
    /// along X and along Y.
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

    /// In a grid of 2 × 2, the expected value of a point is the mean of the others.
    fn corner(&self, heights: &[Length], index: usize) -> Length {
        let sum: i64 = heights.iter().map(|height| height.nm()).sum();
        let others = (sum - heights[index].nm()) / (heights.len() as i64 - 1).max(1);
        (heights[index] - Length::from_nm(others)).abs()
    }

    /// Points without two agreeing touches.
    fn undecided(&self) -> Vec<usize> {
        let agrees = |touches: &[Length]| {
            let mut sorted = touches.to_vec();
            sorted.sort_unstable();
            touches.len() < 2 || sorted.windows(2).any(|pair| pair[1] - pair[0] <= SAME)
        };
        (0..self.touched.len()).rev().filter(|index| !agrees(&self.touched[*index])).collect()
    }
}

/// The value on which two touches agree; else the median.
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
