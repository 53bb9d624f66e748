//! Groups islands that are so near to each other that work on one affects the other.
//!
//! ```text
//!    ▓▓▓ ▓▓▓         ▓▓▓        two families: only the first two islands are within the reach.
//!    ▓▓▓ ▓▓▓         ▓▓▓        Growing by half the reach merges islands of one family only
//! ```
//!
//! Islands farther apart than the reach may share a family; nearer ones always do.

use super::clusters::{groups, root, unite};
use super::measure::segment_bounds;
use super::nearest::{Piece, nearest_pair};
use super::overlay::apart;
use super::{Bounds, Island, Path, PathSegment, Point, Region};
use crate::units::Length;

struct Side {
    around: Bounds,
    island: usize,
    piece: (Point, PathSegment),
}

/// The islands of `region` by families, each in the order of the region: members of different families are
/// farther apart than `reach`.
pub fn families(region: &Region, reach: Length) -> Vec<Vec<Island>> {
    let mut sides: Vec<Side> = Vec::new();
    for (island, shape) in region.islands.iter().enumerate() {
        let pieces = shape.paths().flat_map(Path::pieces);
        sides.extend(pieces.map(|piece| Side { around: segment_bounds(piece.0, piece.1), island, piece }));
    }
    sides.sort_unstable_by_key(|side| side.around.min.x);
    let mut parents: Vec<usize> = (0..region.islands.len()).collect();
    // Sides to the left that extend to this one.
    let mut open: Vec<&Side> = Vec::new();
    for side in &sides {
        let room = side.around.grown(reach);
        open.retain(|other| other.around.max.x >= room.min.x);
        for other in open.iter().filter(|other| other.around.meets(room)) {
            let known = root(&mut parents, side.island) == root(&mut parents, other.island);
            if !known && is_near(side, other, reach) {
                unite(&mut parents, side.island, other.island);
            }
        }
        open.push(side);
    }
    let members =
        |group: &Vec<usize>| group.iter().filter_map(|&number| region.islands.get(number).cloned()).collect();
    groups(&mut parents).iter().map(members).collect()
}

fn is_near(one: &Side, other: &Side, reach: Length) -> bool {
    let [one, other] = [one, other].map(|side| Piece::of(side.piece.0, side.piece.1));
    let (p, q) = nearest_pair(&one, &other);
    apart(p, q) <= reach.nm() as f64
}

#[cfg(test)]
mod tests {
    use super::super::{circle, even_odd, rectangle, union};
    use super::*;

    #[test]
    fn islands_within_reach_form_one_family() {
        let at = Point::from_mm;
        let boxed = |x: f64, y: f64| rectangle(Bounds::of(at(x, y)).with(at(x + 1.0, y + 1.0)));
        let frame: [Path; 3] = [(-5.0, 30.0), (-4.0, 28.0), (7.0, 1.0)]
            .map(|(from, size)| rectangle(Bounds::of(at(from, from)).with(at(from + size, from + size))));
        // Two boxes 0.2 mm apart, a disc that meets neither; then all of it in the hole of a distant frame.
        let parts = [boxed(0.0, 0.0), boxed(1.2, 0.0), circle(at(4.0, 0.5), Length::from_mm(1.0))];
        let framed = even_odd(&[frame.as_slice(), parts.as_slice()].concat());
        let rows = [
            (union(&parts), 0.1, vec![1, 1, 1]),
            (union(&parts), 0.21, vec![2, 1]),
            (union(&parts), 1.4, vec![3]),
            (framed.clone(), 0.21, vec![1, 2, 1, 1]),
            (framed.clone(), 5.0, vec![4, 1]),
            (framed, 7.0, vec![5]),
        ];
        for (region, reach_mm, expected) in rows {
            let found = families(&region, Length::from_mm(reach_mm));
            let sizes: Vec<usize> = found.iter().map(Vec::len).collect();
            assert_eq!(sizes, expected, "{reach_mm}");
            let mut all: Vec<Island> = found.into_iter().flatten().collect();
            all.sort();
            assert_eq!(all, region.islands);
        }
        assert!(families(&Region::default(), Length::from_mm(1.0)).is_empty());
    }
}
