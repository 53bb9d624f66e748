//! Groups boxes that overlap, so that each group can be processed separately.
//!
//! ```text
//!    ┌──┐      ┌───┐            two groups: the first two boxes meet, the third meets none
//!    │ ┌┼─┐    │   │
//!    └─┼┘ │    └───┘
//!      └──┘
//! ```
//!
//! If this takes more than a fixed number of comparisons for each box, all boxes become one group.

/// Left, low, right, high.
pub(super) type Extent = [i32; 4];

const MOST_COMPARISONS: usize = 600;

pub(super) const NOTHING: Extent = [i32::MAX, i32::MAX, i32::MIN, i32::MIN];

pub(super) fn with([left, low, right, high]: Extent, x: i32, y: i32) -> Extent {
    [left.min(x), low.min(y), right.max(x), high.max(y)]
}

pub(super) fn root(parents: &mut [usize], of: usize) -> usize {
    let mut at = of;
    while let Some(&parent) = parents.get(at)
        && parent != at
    {
        let grand = parents.get(parent).copied().unwrap_or(parent);
        if let Some(slot) = parents.get_mut(at) {
            *slot = grand;
        }
        at = grand;
    }
    at
}

pub(super) fn unite(parents: &mut [usize], one: usize, two: usize) {
    let (a, b) = (root(parents, one), root(parents, two));
    if let Some(slot) = parents.get_mut(a.max(b)) {
        *slot = a.min(b);
    }
}

pub(super) fn groups(parents: &mut [usize]) -> Vec<Vec<usize>> {
    let mut members: Vec<(usize, usize)> =
        (0..parents.len()).map(|index| (root(parents, index), index)).collect();
    members.sort_unstable();
    let by_root = members.chunk_by(|a, b| a.0 == b.0);
    by_root.map(|group| group.iter().map(|&(_, index)| index).collect()).collect()
}

pub(super) fn clusters(extents: &[Extent]) -> Vec<Vec<usize>> {
    let mut parents: Vec<usize> = (0..extents.len()).collect();
    let mut order: Vec<(Extent, usize)> =
        extents.iter().enumerate().map(|(index, &extent)| (extent, index)).collect();
    order.sort_unstable();
    let mut open: Vec<(Extent, usize)> = Vec::new();
    let mut budget = extents.len().saturating_mul(MOST_COMPARISONS);
    for (extent, index) in order {
        let [left, low, right, high] = extent;
        if left > right {
            continue;
        }
        open.retain(|(other, _)| other[2] >= left);
        for &(other, number) in &open {
            if other[1] <= high && low <= other[3] {
                unite(&mut parents, index, number);
            }
        }
        open.push((extent, index));
        let Some(rest) = budget.checked_sub(open.len()) else {
            return vec![(0..extents.len()).collect()];
        };
        budget = rest;
    }
    groups(&mut parents)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn meeting_boxes_form_one_cluster() {
        let extents =
            [[0, 0, 2, 2], [9, 9, 9, 9], [2, 2, 4, 4], [5, 0, 6, 9], NOTHING, [4, 3, 4, 9], [6, 9, 9, 9]];
        assert_eq!(clusters(&extents), vec![vec![0, 2, 5], vec![1, 3, 6], vec![4]]);
        assert_eq!(with(with(NOTHING, 3, 4), 1, 9), [1, 4, 3, 9]);
        // Many disjoint bars with one X range: given up, one group.
        let bars: Vec<Extent> = (0..2_000).map(|row| [0, 2 * row, 10, 2 * row]).collect();
        assert_eq!(clusters(&bars).len(), 1);
        assert_eq!(clusters(&bars[..1_000]).len(), 1_000);
    }
}
