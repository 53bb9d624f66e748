//! A good first tour by greedy fragments: the cheapest rapids between near nodes first, if they make neither
//! a fork nor a ring. Further rounds join the remaining pieces at their ends.
//!
//! ```text
//!  round 1   o──o──o   o──o     o──o──o──o
//!  round 2   o──o──o───o──o─────o──o──o──o
//! ```

use super::near::Tree;
use crate::geometry::Point;

const NONE: u32 = u32::MAX;

/// Near ends considered for each open end when pieces are joined.
const ENDS: usize = 6;

struct Pieces {
    links: Vec<[u32; 2]>,
    group: Vec<u32>,
    joined: usize,
}

impl Pieces {
    fn new(n: usize) -> Self {
        Self { links: vec![[NONE; 2]; n], group: (0..n as u32).collect(), joined: 0 }
    }

    fn find(&mut self, mut node: u32) -> u32 {
        while self.group[node as usize] != node {
            let up = self.group[self.group[node as usize] as usize];
            self.group[node as usize] = up;
            node = up;
        }
        node
    }

    fn is_open(&self, node: u32) -> bool {
        self.links[node as usize][1] == NONE
    }

    fn join(&mut self, a: u32, b: u32) {
        if !self.is_open(a) || !self.is_open(b) {
            return;
        }
        let (left, right) = (self.find(a), self.find(b));
        if left == right {
            return;
        }
        self.group[left.max(right) as usize] = left.min(right);
        for (from, to) in [(a, b), (b, a)] {
            let links = &mut self.links[from as usize];
            links[usize::from(links[0] != NONE)] = to;
        }
        self.joined += 1;
    }

    fn take(&mut self, mut rapids: Vec<(f64, u32, u32)>) {
        rapids.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        for (_, a, b) in rapids {
            self.join(a, b);
        }
    }

    fn walk(&self) -> Vec<u32> {
        let mut order = Vec::with_capacity(self.links.len());
        let mut node = (0..self.links.len() as u32).find(|&node| self.is_open(node)).unwrap_or(0);
        let mut before = NONE;
        while node != NONE && order.len() < self.links.len() {
            order.push(node);
            let [a, b] = self.links[node as usize];
            let after = if a == before { b } else { a };
            before = node;
            node = after;
        }
        order
    }
}

pub(crate) fn greedy(points: &[Point], near: &[Vec<u32>], cost: &impl Fn(u32, u32) -> f64) -> Vec<u32> {
    let n = points.len();
    let mut pieces = Pieces::new(n);
    let rapids = |lists: &mut dyn Iterator<Item = (u32, &Vec<u32>)>| {
        let mut rapids = Vec::new();
        for (a, list) in lists {
            rapids.extend(list.iter().map(|&b| (cost(a.min(b), a.max(b)), a.min(b), a.max(b))));
        }
        rapids
    };
    pieces.take(rapids(&mut (0..).zip(near)));
    while pieces.joined + 1 < n {
        let ends: Vec<u32> = (0..n as u32).filter(|&node| pieces.is_open(node)).collect();
        let tree = Tree::new(points, ends.clone());
        let lists: Vec<Vec<u32>> = ends.iter().map(|&end| tree.nearest(end, ENDS, None)).collect();
        pieces.take(rapids(&mut ends.iter().copied().zip(&lists)));
    }
    pieces.walk()
}
