//! Sorts dark and clear pieces into as few exposures as possible.
//!
//! ```text
//!   file       ● ○ ● ○ ● ○        dark and clear alternate, but only the last two overlap others
//!   exposure   1 2 1 2 1 2 3      a piece that overlaps no other colour joins an earlier exposure
//! ```
//!
//! If two pieces may overlap, the later one is never in an earlier exposure, and pieces of different colour
//! never share one. Overlap is tested by grid cells, which can report too many.

use crate::geometry::{Bounds, Exposure, Path, path_bounds};
use crate::units::Length;

/// The outlines of one object, with the inside on the left.
pub(super) struct Piece {
    pub(super) clear: bool,
    pub(super) outlines: Vec<Path>,
}

/// Approximate numbers of grid cells, finest first; the first one within the work limit is used.
const SIZES_CELLS: [f64; 5] = [65_536.0, 4_096.0, 256.0, 16.0, 1.0];
/// Maximum number of cells per piece, on average.
const CELLS_PER_PIECE: u64 = 24;

/// The exposures, and for every outline in them the index of its piece.
pub(super) fn exposures(pieces: Vec<Piece>) -> (Vec<Exposure>, Vec<usize>) {
    let heights = heights(&pieces);
    let mut order: Vec<(u32, usize)> = heights.into_iter().zip(0..).collect();
    order.sort_unstable();
    let mut pieces: Vec<Option<Piece>> = pieces.into_iter().map(Some).collect();
    let (mut exposures, mut owners): (Vec<Exposure>, Vec<usize>) = (Vec::new(), Vec::new());
    let mut last = None;
    for (height, number) in order {
        let Some(mut piece) = pieces.get_mut(number).and_then(Option::take) else { continue };
        owners.extend(std::iter::repeat_n(number, piece.outlines.len()));
        match exposures.last_mut().filter(|_| last == Some(height)) {
            Some(exposure) => exposure.outlines.append(&mut piece.outlines),
            None => exposures.push(Exposure { clear: piece.clear, outlines: piece.outlines }),
        }
        last = Some(height);
    }
    (exposures, owners)
}

/// The exposure of every piece: even numbers are dark, odd ones clear.
fn heights(pieces: &[Piece]) -> Vec<u32> {
    if pieces.iter().all(|piece| !piece.clear) {
        return vec![0; pieces.len()];
    }
    let boxes: Vec<Option<Bounds>> = pieces.iter().map(bounds).collect();
    let all = boxes.iter().flatten().copied().reduce(|one, other| one.with(other.min).with(other.max));
    let Some(all) = all else { return vec![0; pieces.len()] };
    let most = CELLS_PER_PIECE * pieces.len() as u64;
    let work = |grid: &Grid| boxes.iter().flatten().map(|bounds| grid.cells(*bounds).1).sum::<u64>();
    let mut grids = SIZES_CELLS.into_iter().map(|count| Grid::over(all, count));
    let grid = grids.find(|grid| work(grid) <= most).unwrap_or_else(|| Grid::over(all, 1.0));
    let mut tops: Vec<u32> = vec![0; usize::try_from(grid.columns * grid.rows).unwrap_or(1)];
    let mut heights = Vec::with_capacity(pieces.len());
    for (piece, bounds) in pieces.iter().zip(&boxes) {
        let odd = u32::from(piece.clear);
        let Some(bounds) = *bounds else {
            heights.push(odd);
            continue;
        };
        let ([left, low, right, high], _) = grid.cells(bounds);
        let columns = grid.columns;
        let places =
            || (low..=high).flat_map(move |row| (left..=right).map(move |column| row * columns + column));
        let places = || places().filter_map(|place| usize::try_from(place).ok());
        let top = places().filter_map(|place| tops.get(place)).max().copied().unwrap_or(0);
        let height = if top % 2 == odd { top } else { top + 1 };
        for place in places() {
            tops.get_mut(place).into_iter().for_each(|slot| *slot = height);
        }
        heights.push(height);
    }
    heights
}

fn bounds(piece: &Piece) -> Option<Bounds> {
    let boxes = piece.outlines.iter().map(path_bounds);
    boxes.reduce(|one, other| one.with(other.min).with(other.max))
}

struct Grid {
    all: Bounds,
    /// Side of a cell, nm.
    side: i64,
    columns: i64,
    rows: i64,
}

impl Grid {
    fn over(all: Bounds, count: f64) -> Self {
        let (width, height) = ((all.max.x - all.min.x).nm() + 1, (all.max.y - all.min.y).nm() + 1);
        let side = libm::sqrt(width as f64 / count * height as f64).max(width.max(height) as f64 / count);
        let side = libm::ceil(side) as i64;
        Self { all, side, columns: width / side + 1, rows: height / side + 1 }
    }

    /// First column, first row, last column and last row of a box, and the number of cells.
    fn cells(&self, bounds: Bounds) -> ([i64; 4], u64) {
        let place = |value: Length, low: Length| (value - low).nm() / self.side;
        let column = |x: Length| place(x, self.all.min.x).clamp(0, self.columns - 1);
        let row = |y: Length| place(y, self.all.min.y).clamp(0, self.rows - 1);
        let [left, low, right, high] =
            [column(bounds.min.x), row(bounds.min.y), column(bounds.max.x), row(bounds.max.y)];
        ([left, low, right, high], ((right - left + 1) * (high - low + 1)).unsigned_abs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point, circle};

    fn piece(clear: bool, x: f64) -> Piece {
        Piece { clear, outlines: vec![circle(Point::from_mm(x, 0.0), Length::from_um(1_000))] }
    }

    #[test]
    fn separate_pieces_share_exposures() {
        let row = |index: i32| piece(index % 2 == 1, f64::from(index) * 2.0);
        let found = heights(&(0..1_000).map(row).collect::<Vec<_>>());
        assert!(found.iter().zip(0..).all(|(&height, index)| height == index % 2), "{found:?}");
        // All at one position: each needs a separate exposure.
        let pile: Vec<Piece> = (0..9).map(|index| piece(index % 2 == 1, 0.0)).collect();
        assert_eq!(heights(&pile), [0, 1, 2, 3, 4, 5, 6, 7, 8]);
        let (exposures, owners) =
            exposures(vec![piece(false, 0.0), piece(true, 0.0), piece(false, 9.0), piece(false, 0.5)]);
        assert_eq!(
            exposures.iter().map(|exposure| (exposure.clear, exposure.outlines.len())).collect::<Vec<_>>(),
            [(false, 2), (true, 1), (false, 1)]
        );
        assert_eq!(owners, [0, 2, 1, 3]);
    }
}
