//! Near neighbours: a k-d tree, robust against any clustering, and lists of near nodes made with it.
//!
//! ```text
//!            |  x          each node's list holds the few nearest nodes of each quadrant,
//!     x   x  | x           filled up with the nearest of all: across a gap between clusters
//!   ─────────o───────      a candidate always exists
//!        x   |   x
//! ```

use crate::geometry::Point;

/// Squared distance in nm², as a float: good for comparing.
fn square(a: Point, b: Point) -> f64 {
    let (dx, dy) = ((a.x - b.x).nm() as f64, (a.y - b.y).nm() as f64);
    dx * dx + dy * dy
}

/// A search tree over points: the middle of every range is the splitting node, alternating X and Y.
pub(crate) struct Tree<'a> {
    points: &'a [Point],
    nodes: Vec<u32>,
}

impl<'a> Tree<'a> {
    /// Over the `points` with the numbers `nodes`.
    pub(crate) fn new(points: &'a [Point], mut nodes: Vec<u32>) -> Self {
        fn split(points: &[Point], nodes: &mut [u32], by_x: bool) {
            if nodes.len() < 2 {
                return;
            }
            let middle = nodes.len() / 2;
            nodes.select_nth_unstable_by_key(middle, |&node| {
                let at = points[node as usize];
                (if by_x { at.x } else { at.y }, node)
            });
            let (low, high) = nodes.split_at_mut(middle);
            split(points, low, !by_x);
            split(points, &mut high[1..], !by_x);
        }
        split(points, &mut nodes, true);
        Self { points, nodes }
    }

    /// The `count` nearest to node `of`, without itself, nearest first; ties by number. With a quadrant (0 …
    /// 3), only nodes in it.
    pub(crate) fn nearest(&self, of: u32, count: usize, quadrant: Option<u8>) -> Vec<u32> {
        let mut found =
            Found { of, at: self.points[of as usize], count, quadrant, best: Vec::with_capacity(count + 1) };
        self.visit(&self.nodes, true, &mut found);
        found.best.into_iter().map(|(_, node)| node).collect()
    }

    fn visit(&self, nodes: &[u32], by_x: bool, found: &mut Found) {
        let Some(&node) = nodes.get(nodes.len() / 2) else { return };
        let (low, high) = (&nodes[..nodes.len() / 2], &nodes[nodes.len() / 2 + 1..]);
        let here = self.points[node as usize];
        found.offer(node, here);
        let side = if by_x { found.at.x - here.x } else { found.at.y - here.y }.nm() as f64;
        let (near, far, far_is_high) = if side < 0.0 { (low, high, true) } else { (high, low, false) };
        self.visit(near, !by_x, found);
        if side * side <= found.limit() && (side == 0.0 || found.may_lie(by_x, far_is_high)) {
            self.visit(far, !by_x, found);
        }
    }
}

struct Found {
    of: u32,
    at: Point,
    count: usize,
    quadrant: Option<u8>,
    best: Vec<(f64, u32)>,
}

impl Found {
    fn limit(&self) -> f64 {
        if self.best.len() < self.count { f64::INFINITY } else { self.best.last().map_or(-1.0, |&(d, _)| d) }
    }

    /// True if the half plane beyond a splitting line overlaps the quadrant.
    fn may_lie(&self, by_x: bool, beyond_is_high: bool) -> bool {
        self.quadrant.is_none_or(|quadrant| {
            let wants_high = quadrant & (if by_x { 1 } else { 2 }) != 0;
            wants_high == beyond_is_high
        })
    }

    fn offer(&mut self, node: u32, here: Point) {
        let inside = match self.quadrant {
            None => true,
            Some(0) => here.x < self.at.x && here.y <= self.at.y,
            Some(1) => here.x >= self.at.x && here.y < self.at.y,
            Some(2) => here.x <= self.at.x && here.y > self.at.y,
            Some(_) => here.x > self.at.x && here.y >= self.at.y,
        };
        if node == self.of || !inside {
            return;
        }
        let entry = (square(self.at, here), node);
        if self.best.len() == self.count && self.best.last().is_some_and(|&last| last <= entry) {
            return;
        }
        let place = self.best.partition_point(|&other| other < entry);
        self.best.insert(place, entry);
        self.best.truncate(self.count);
    }
}

/// For every point: up to `quadrant` nearest of each quadrant, filled up with the nearest of all to `count`.
pub(crate) fn lists(points: &[Point], quadrant: usize, count: usize) -> Vec<Vec<u32>> {
    let tree = Tree::new(points, (0..points.len() as u32).collect());
    let list = |node: u32| {
        let mut near = Vec::with_capacity(count);
        for side in 0..4 {
            near.extend(tree.nearest(node, quadrant, Some(side)));
        }
        for other in tree.nearest(node, count, None) {
            if near.len() >= count {
                break;
            }
            if !near.contains(&other) {
                near.push(other);
            }
        }
        near
    };
    (0..points.len() as u32).map(list).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::Chance;

    #[test]
    fn tree_search_equals_brute_force() {
        let mut chance = Chance::new(3);
        for n in 1..60_usize {
            let spread = 1 + chance.below(12);
            let points: Vec<Point> = (0..n)
                .map(|_| Point::from_mm(chance.below(spread) as f64, chance.below(spread) as f64))
                .collect();
            let tree = Tree::new(&points, (0..n as u32).collect());
            for of in 0..n as u32 {
                for quadrant in [None, Some(0), Some(1), Some(2), Some(3)] {
                    let mut probe =
                        Found { of, at: points[of as usize], count: n, quadrant, best: Vec::new() };
                    for other in 0..n as u32 {
                        probe.offer(other, points[other as usize]);
                    }
                    let all: Vec<u32> = probe.best.iter().map(|&(_, node)| node).take(4).collect();
                    assert_eq!(tree.nearest(of, 4, quadrant), all, "n {n} of {of} quadrant {quadrant:?}");
                }
            }
        }
    }
}
