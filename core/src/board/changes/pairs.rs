//! Matches the features of two boards, including moved ones.
//!
//! ```text
//!   1  same position, same size     ─▶ a pair
//!   2  same position, other size    ─▶ a pair
//!   3  the rest                     ─▶ pairs by the most frequent offset: a part moves all its holes
//! ```

use crate::geometry::Point;
use crate::units::Length;
use std::collections::BTreeMap;

/// Positions nearer than this, and sizes that differ less, are equal: files round.
pub(super) const SAME: Length = Length::from_um(5);

/// A single feature may have moved this far; a group with one offset may have moved this far times its count.
const ALONE_MM: f64 = 5.0;

/// Limit of pairs to compare. Above it nothing counts as moved: features are removed and added.
const MOST_WEIGHED: usize = 1_000_000;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Thing {
    pub(super) at: Point,
    /// Offsets of its further points.
    pub(super) shape: Vec<Point>,
    pub(super) size: Option<Length>,
}

/// True if two positions are equal.
pub(super) fn near(a: Point, b: Point) -> bool {
    (a.x - b.x).abs() <= SAME && (a.y - b.y).abs() <= SAME
}

impl Thing {
    fn same_shape(&self, other: &Self) -> bool {
        let shapes = self.shape.iter().zip(&other.shape);
        self.shape.len() == other.shape.len() && shapes.into_iter().all(|(a, b)| near(*a, *b))
    }

    pub(super) fn same_size(&self, other: &Self) -> bool {
        match (self.size, other.size) {
            (Some(a), Some(b)) => (a - b).abs() <= SAME,
            (a, b) => a == b,
        }
    }
}

/// Features by position, in cells a little larger than the tolerance.
struct Cells(BTreeMap<(i64, i64), Vec<usize>>);

const CELL_NM: i64 = 2 * SAME.nm();

fn cell(at: Point) -> (i64, i64) {
    (at.x.nm().div_euclid(CELL_NM), at.y.nm().div_euclid(CELL_NM))
}

impl Cells {
    fn of(things: &[Thing]) -> Self {
        let mut cells: BTreeMap<_, Vec<usize>> = BTreeMap::new();
        for (number, thing) in things.iter().enumerate() {
            cells.entry(cell(thing.at)).or_default().push(number);
        }
        Self(cells)
    }

    fn around(&self, at: Point) -> impl Iterator<Item = usize> {
        let (x, y) = cell(at);
        let cells = (x - 1..=x + 1).flat_map(move |x| (y - 1..=y + 1).map(move |y| (x, y)));
        cells.filter_map(|cell| self.0.get(&cell)).flatten().copied()
    }
}

pub(super) fn found(before: &[Thing], now: &[Thing], shift: Point) -> usize {
    let cells = Cells::of(now);
    let is_there = |thing: &&Thing| {
        let at = Point::new(thing.at.x + shift.x, thing.at.y + shift.y);
        let here = |number: usize| {
            now.get(number)
                .is_some_and(|other| near(at, other.at) && thing.same_size(other) && thing.same_shape(other))
        };
        cells.around(at).any(here)
    };
    before.iter().filter(is_there).count()
}

/// Pairs of indices into `before` and `now`, in the order of `before`.
pub(super) fn pairs(before: &[Thing], now: &[Thing]) -> Vec<(usize, usize)> {
    let mut partner: Vec<Option<usize>> = vec![None; before.len()];
    let mut taken = vec![false; now.len()];
    let cells = Cells::of(now);
    for with_size in [true, false] {
        for (number, thing) in before.iter().enumerate() {
            let fits = |other: &usize| {
                let free = taken.get(*other) == Some(&false);
                let like = now.get(*other).is_some_and(|other| {
                    near(thing.at, other.at)
                        && thing.same_shape(other)
                        && (!with_size || thing.same_size(other))
                });
                free && like
            };
            if partner[number].is_none()
                && let Some(other) = cells.around(thing.at).find(fits)
            {
                (partner[number], taken[other]) = (Some(other), true);
            }
        }
    }
    moved(before, now, &mut partner, &mut taken);
    partner.into_iter().enumerate().filter_map(|(number, other)| Some((number, other?))).collect()
}

/// Finds partners for unmatched features by the most frequent offsets.
fn moved(before: &[Thing], now: &[Thing], partner: &mut [Option<usize>], taken: &mut [bool]) {
    let left: Vec<usize> = (0..before.len()).filter(|number| partner[*number].is_none()).collect();
    let free: Vec<usize> = (0..now.len()).filter(|number| !taken[*number]).collect();
    if left.len().saturating_mul(free.len()) > MOST_WEIGHED {
        return;
    }
    let mut offsets: BTreeMap<(i64, i64), Vec<(usize, usize)>> = BTreeMap::new();
    for &number in &left {
        for &other in &free {
            let (from, to) = (&before[number], &now[other]);
            if from.same_size(to) && from.same_shape(to) {
                let way = cell(Point::new(to.at.x - from.at.x, to.at.y - from.at.y));
                offsets.entry(way).or_default().push((number, other));
            }
        }
    }
    // The most frequent offset first, then the shortest.
    let mut offsets: Vec<_> = offsets.into_values().collect();
    let far_mm = |pairs: &[(usize, usize)]| {
        pairs.first().map_or(0.0, |(number, other)| before[*number].at.distance_mm(now[*other].at))
    };
    offsets.sort_by(|a, b| b.len().cmp(&a.len()).then(far_mm(a).total_cmp(&far_mm(b))));
    for way in offsets {
        let believed_mm = ALONE_MM * way.len() as f64;
        if far_mm(&way) > believed_mm {
            continue;
        }
        for (number, other) in way {
            if partner[number].is_none() && !taken[other] {
                (partner[number], taken[other]) = (Some(other), true);
            }
        }
    }
}
