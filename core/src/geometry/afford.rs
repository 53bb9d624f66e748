//! Estimates the cost of overlaying outlines before doing it: number of edges, and how often they meet.
//!
//! ```text
//!   ┌──┬──┬──┐    edges are sorted into cells, and each is compared with the others of its cells:
//!   │ ╲│╱ │  │    3,000 long random edges meet about a million times, and become as many pieces
//!   ├──╳──┼──┤
//!   │ ╱│╲ │──│    an edge costs 1, a meeting 2, 24 compared pairs 1; each doubling of exposures adds 1/8
//!   └──┴──┴──┘
//! ```
//!
//! The cost is counted, not timed, so it is the same on every machine.

use super::Path;
use super::clusters::{NOTHING, with};
use super::grid::Grid;
use super::overlay::{Edge, Overlay, Pile};

const EDGES_PER_CELL: f64 = 2.0;
/// Mean number of rows or columns that an edge crosses, about.
const CELLS_PER_EDGE: f64 = 3.0;
const SMALLEST_CELL_NM: f64 = 2_000.0;
/// An edge this near to a cell, in nm, counts as in it.
const NEAR_NM: i64 = 1;
/// Compared pairs that cost as much as one pass over an edge.
const PAIRS: u64 = 24;
/// The cost of a doubling of exposures is 1 over this.
const EIGHTHS: u32 = 8;
/// A cell with more edges is swept, left to right or upwards.
const FEW: usize = 12;

/// Remaining work, in passes over an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fuel {
    left: u64,
}

impl Fuel {
    pub const fn new(steps: u64) -> Self {
        Self { left: steps }
    }

    /// Takes an amount; if there is not enough, takes everything and returns false.
    pub const fn spend(&mut self, steps: u64) -> bool {
        match self.left.checked_sub(steps) {
            Some(left) => {
                self.left = left;
                true
            }
            None => {
                self.left = 0;
                false
            }
        }
    }

    pub const fn left(&self) -> u64 {
        self.left
    }
}

/// Charges the cost of overlaying a pile with itself `doublings` times; repetitions cost less. The error is
/// an outline at which the fuel ran out.
pub(super) fn afford(pile: &Pile, doublings: u32, fuel: &mut Fuel) -> Result<(), usize> {
    // In eighths of a pass over an edge.
    let more = u64::from(EIGHTHS + doublings);
    let cost = more * pile.edges.len() as u64 / u64::from(EIGHTHS);
    let outline = |edge: usize| pile.ends.partition_point(|&end| end <= edge);
    if !fuel.spend(cost) {
        return Err(pile.ends.len().saturating_sub(1));
    }
    let each = 2 * more / u64::from(EIGHTHS);
    meetings(&pile.edges, each, fuel).map(|_| ()).map_err(outline)
}

/// True if a path does not touch itself, so that it surrounds its area once. `None` if the fuel isn't enough
/// to find out and to overlay the result.
pub(super) fn is_simple(path: &Path, fuel: &mut Fuel) -> Option<bool> {
    let mut overlay = Overlay::with_room(usize::try_from(fuel.left()).unwrap_or(usize::MAX));
    overlay.path(path);
    if overlay.is_full() {
        return None;
    }
    let edges = overlay.take().edges;
    fuel.spend(2 * edges.len() as u64).then_some(())?;
    if meetings(&edges, 4, fuel).ok()? > 0 {
        return Some(false);
    }
    let mut places: Vec<(i32, i32)> = edges.iter().map(|edge| (edge.a.x, edge.a.y)).collect();
    places.sort_unstable();
    Some(places.windows(2).all(|pair| pair.first() != pair.last()))
}

struct Cells {
    grid: Grid,
    /// Start of each cell's edges in `edges`.
    starts: Vec<u32>,
    edges: Vec<u32>,
}

impl Cells {
    fn of(edges: &[Edge]) -> Self {
        let ends = edges.iter().flat_map(|edge| [edge.a, edge.b]);
        let extent = ends.fold(NOTHING, |extent, end| with(extent, end.x, end.y));
        let [left, low, right, high] = extent.map(f64::from);
        let count = edges.len() as f64;
        let length: f64 =
            edges.iter().map(|edge| f64::max(gap(edge.a.x, edge.b.x), gap(edge.a.y, edge.b.y))).sum();
        let (width, height, wanted) = (right - left, high - low, f64::max(count / EDGES_PER_CELL, 1.0));
        let side = libm::sqrt(width * height / wanted)
            .max(width.max(height) / wanted)
            .max(length / (count * CELLS_PER_EDGE))
            .max(SMALLEST_CELL_NM);
        let grid = Grid::over(extent, side, NEAR_NM);
        let mut starts = vec![0_u32; usize::try_from(grid.columns * grid.rows).unwrap_or(0) + 1];
        let places = |row: i64, from: i64, to: i64| {
            (from..=to).filter_map(move |column| usize::try_from(row * grid.columns + column).ok())
        };
        for edge in edges {
            grid.pass(edge, |row, from, to| {
                places(row, from, to)
                    .for_each(|place| starts.get_mut(place).into_iter().for_each(|slot| *slot += 1));
            });
        }
        let mut sum = 0;
        for slot in &mut starts {
            sum += *slot;
            *slot = sum;
        }
        // Fill backwards: each end index becomes a start index.
        let mut listed = vec![0_u32; sum as usize];
        for (number, edge) in edges.iter().enumerate().rev() {
            grid.pass(edge, |row, from, to| {
                for place in places(row, from, to) {
                    let Some(slot) = starts.get_mut(place) else { continue };
                    *slot -= 1;
                    if let Some(entry) = listed.get_mut(*slot as usize) {
                        *entry = number as u32;
                    }
                }
            });
        }
        Self { grid, starts, edges: listed }
    }

    fn at(&self, (x, y): (f64, f64)) -> usize {
        let place = self.grid.row(y as i64) * self.grid.columns + self.grid.column(x as i64);
        usize::try_from(place).unwrap_or(usize::MAX)
    }
}

/// Number of meetings of edges other than end to end; each costs `each`. The error is an edge at which the
/// fuel ran out.
fn meetings(edges: &[Edge], each: u64, fuel: &mut Fuel) -> Result<u64, usize> {
    if edges.is_empty() {
        return Ok(0);
    }
    let cells = Cells::of(edges);
    let (mut found, mut looked) = (0, 0);
    let mut inside: Vec<(u32, &Edge)> = Vec::new();
    for (cell, ends) in cells.starts.windows(2).enumerate() {
        let &[start, end] = ends else { continue };
        let listed = cells.edges.get(start as usize..end as usize).unwrap_or_default();
        inside.clear();
        inside.extend(listed.iter().filter_map(|&number| Some((number, edges.get(number as usize)?))));
        let swept = inside.len() > FEW;
        let across = is_flat(&inside);
        let span = |edge: &Edge| {
            let (a, b) = if across { (edge.a.y, edge.b.y) } else { (edge.a.x, edge.b.x) };
            (a.min(b), a.max(b))
        };
        if swept {
            inside.sort_unstable_by_key(|(number, edge)| (span(edge).0, *number));
        }
        for (index, &(number, one)) in inside.iter().enumerate() {
            let end = span(one).1;
            for (_, other) in inside.iter().skip(index + 1) {
                if swept && span(other).0 > end {
                    break;
                }
                looked += 1;
                if meeting(one, other).is_some_and(|place| cells.at(place) == cell) {
                    found += 1;
                    if !fuel.spend(each) {
                        return Err(number as usize);
                    }
                }
            }
            if looked >= PAIRS {
                if !fuel.spend(looked / PAIRS) {
                    return Err(number as usize);
                }
                looked %= PAIRS;
            }
        }
    }
    Ok(found)
}

/// True if edges are flat rather than steep. An upward sweep then compares fewer of them.
fn is_flat(edges: &[(u32, &Edge)]) -> bool {
    let sum = |gap: &dyn Fn(&Edge) -> f64| edges.iter().map(|(_, edge)| gap(edge)).sum::<f64>();
    sum(&|edge| gap(edge.a.y, edge.b.y)) < sum(&|edge| gap(edge.a.x, edge.b.x))
}

fn gap(one: i32, other: i32) -> f64 {
    (f64::from(one) - f64::from(other)).abs()
}

/// Meeting point of two edges, if not end to end. Overlapping edges meet at an end of one of them; equal
/// edges count as one.
fn meeting(one: &Edge, other: &Edge) -> Option<(f64, f64)> {
    let [p, q, r, s] = [one.a, one.b, other.a, other.b];
    let apart = |p: i32, q: i32, r: i32, s: i32| p.max(q) < r.min(s) || r.max(s) < p.min(q);
    if apart(p.x, q.x, r.x, s.x) || apart(p.y, q.y, r.y, s.y) {
        return None;
    }
    let [p, q, r, s] = [p, q, r, s].map(|point| (f64::from(point.x), f64::from(point.y)));
    let side =
        |a: (f64, f64), b: (f64, f64), c: (f64, f64)| (b.0 - a.0) * (c.1 - a.1) - (b.1 - a.1) * (c.0 - a.0);
    let (at_p, at_q, at_r, at_s) = (side(r, s, p), side(r, s, q), side(p, q, r), side(p, q, s));
    if at_p * at_q > 0.0 || at_r * at_s > 0.0 {
        return None;
    }
    if at_p == 0.0 && at_q == 0.0 {
        return lying(p, q, r, s);
    }
    let shared = p == r || p == s || q == r || q == s;
    match (at_p == 0.0, at_q == 0.0) {
        _ if shared => None,
        (true, _) => Some(p),
        (_, true) => Some(q),
        _ => {
            let share = at_p / (at_p - at_q);
            Some((p.0 + (q.0 - p.0) * share, p.1 + (q.1 - p.1) * share))
        }
    }
}

/// Of two edges on one line, an end of one inside the other.
fn lying(p: (f64, f64), q: (f64, f64), r: (f64, f64), s: (f64, f64)) -> Option<(f64, f64)> {
    let dot =
        |a: (f64, f64), b: (f64, f64), c: (f64, f64)| (b.0 - a.0) * (c.0 - a.0) + (b.1 - a.1) * (c.1 - a.1);
    let within = |a, b, c| dot(c, a, b) < 0.0;
    [(r, s, p), (r, s, q), (p, q, r), (p, q, s)]
        .into_iter()
        .find(|&(a, b, c)| within(a, b, c))
        .map(|(_, _, c)| c)
}

#[cfg(test)]
mod tests {
    use super::super::{PathSegment, Point, circle};
    use super::*;
    use crate::units::Length;

    fn polygon(corners: &[(f64, f64)]) -> Path {
        let points: Vec<Point> = corners.iter().map(|&(x, y)| Point::from_mm(x, y)).collect();
        let segments = points[1..].iter().chain([&points[0]]).map(|&to| PathSegment::Line { to }).collect();
        Path { start: points[0], segments }
    }

    fn pile(outlines: &[Path]) -> Pile {
        let mut overlay = Overlay::default();
        outlines.iter().for_each(|outline| overlay.path(outline));
        overlay.take()
    }

    fn found(outlines: &[Path]) -> u64 {
        meetings(&pile(outlines).edges, 2, &mut Fuel::new(1_000_000)).unwrap()
    }

    #[test]
    fn crossings_are_counted_once() {
        let square = |x: f64, y: f64| polygon(&[(x, y), (x + 4.0, y), (x + 4.0, y + 4.0), (x, y + 4.0)]);
        for (outlines, wanted) in [
            (vec![square(0.0, 0.0)], 0),
            (vec![square(0.0, 0.0), square(0.0, 0.0)], 0),
            (vec![square(0.0, 0.0), square(9.0, 0.0)], 0),
            (vec![square(0.0, 0.0), square(2.0, 2.0)], 2),
            // One side overlaps another, and two sides end on it.
            (vec![square(0.0, 0.0), polygon(&[(1.0, 4.0), (3.0, 4.0), (2.0, 6.0)])], 3),
            (vec![polygon(&[(0.0, 0.0), (4.0, 4.0), (4.0, 0.0), (0.0, 4.0)])], 1),
        ] {
            assert_eq!(found(&outlines), wanted, "{outlines:?}");
        }
        // A hundred circles, each pair meets twice.
        let ring = (0..100)
            .map(|index| circle(Point::from_mm(0.01 * f64::from(index), 0.0), Length::from_um(2_000)));
        let count = found(&ring.collect::<Vec<_>>());
        assert!((9_900..10_200).contains(&count), "{count}");
    }

    #[test]
    fn exhausted_budget_names_its_outline() {
        let bar = |y: f64| polygon(&[(0.0, y), (100.0, y + 1.0), (0.0, y + 0.1)]);
        let row: Vec<Path> = (0..50).map(|index| bar(2.0 * f64::from(index))).collect();
        let mut fuel = Fuel::new(100_000);
        assert_eq!(afford(&pile(&row), 0, &mut fuel), Ok(()));
        let spent = 100_000 - fuel.left();
        assert!((150..1_500).contains(&spent), "{spent}");
        assert_eq!(afford(&pile(&row), 0, &mut Fuel::new(spent)), Ok(()));
        assert!(afford(&pile(&row), 0, &mut Fuel::new(spent - 1)).is_err());
        assert_eq!(afford(&pile(&row), 8, &mut Fuel::new(299)), Err(49));
        // One more outline that meets all of them.
        let more = [row, vec![polygon(&[(1.0, -1.0), (2.0, -1.0), (2.0, 99.0)])]].concat();
        assert!(afford(&pile(&more), 0, &mut Fuel::new(spent + 10)).is_err_and(|outline| outline <= 50));
    }
}
