//! A tour: nodes around a ring, with fast reversal of any stretch.
//!
//! ```text
//!  before   … a  [b c d e]  f …          reverse(b, e)
//!  after    … a  [e d c b]  f …
//! ```
//!
//! The shorter of the stretch and its complement is reversed in memory. Reversing the complement gives the
//! ring in the opposite direction, which `backwards` records.

/// An order of the nodes 0 … n − 1 around a ring.
#[derive(Clone, Debug)]
pub(crate) struct Ring {
    order: Vec<u32>,
    place: Vec<u32>,
    backwards: bool,
}

impl Ring {
    pub(crate) fn new(order: Vec<u32>) -> Self {
        let mut place = vec![0; order.len()];
        for (at, &node) in order.iter().enumerate() {
            place[node as usize] = at as u32;
        }
        Self { order, place, backwards: false }
    }

    pub(crate) fn len(&self) -> usize {
        self.order.len()
    }

    fn step(&self, node: u32, up: bool) -> u32 {
        let at = self.place[node as usize] as usize;
        let last = self.order.len() - 1;
        let to = match (up, at) {
            (true, at) if at == last => 0,
            (true, at) => at + 1,
            (false, 0) => last,
            (false, at) => at - 1,
        };
        self.order[to]
    }

    pub(crate) fn next(&self, node: u32) -> u32 {
        self.step(node, !self.backwards)
    }

    pub(crate) fn prev(&self, node: u32) -> u32 {
        self.step(node, self.backwards)
    }

    pub(crate) fn mirror(&mut self) {
        self.backwards = !self.backwards;
    }

    /// Number of nodes from `from` to `to`, without `from`.
    pub(crate) fn ahead(&self, from: u32, to: u32) -> usize {
        let (from, to) = (self.place[from as usize] as usize, self.place[to as usize] as usize);
        let (low, high) = if self.backwards { (to, from) } else { (from, to) };
        if high >= low { high - low } else { high + self.order.len() - low }
    }

    /// The node `count` steps after `node`; `count` < n.
    pub(crate) fn further(&self, node: u32, count: usize) -> u32 {
        let (at, n) = (self.place[node as usize] as usize, self.order.len());
        let to = if self.backwards { at + n - count } else { at + count };
        self.order[if to >= n { to - n } else { to }]
    }

    pub(crate) fn reverse(&mut self, first: u32, last: u32) {
        let n = self.order.len();
        let length = self.ahead(first, last) + 1;
        let (mut low, mut high) = (self.place[first as usize] as usize, self.place[last as usize] as usize);
        if self.backwards {
            (low, high) = (high, low);
        }
        let mut swaps = length / 2;
        if 2 * length > n {
            (low, high) = (if high + 1 == n { 0 } else { high + 1 }, if low == 0 { n - 1 } else { low - 1 });
            swaps = (n - length) / 2;
            self.backwards = !self.backwards;
        }
        if swaps > 0 && low < high {
            let stretch = &mut self.order[low..=high];
            stretch.reverse();
            (low as u32..).zip(stretch).for_each(|(at, &mut node)| self.place[node as usize] = at);
            return;
        }
        for _ in 0..swaps {
            let (a, b) = (self.order[low], self.order[high]);
            self.order[low] = b;
            self.order[high] = a;
            self.place[b as usize] = low as u32;
            self.place[a as usize] = high as u32;
            low = if low + 1 == n { 0 } else { low + 1 };
            high = if high == 0 { n - 1 } else { high - 1 };
        }
    }

    /// The nodes in order, starting with `first`.
    pub(crate) fn from(&self, first: u32) -> Vec<u32> {
        let mut out = Vec::with_capacity(self.len());
        let mut node = first;
        for _ in 0..self.len() {
            out.push(node);
            node = self.next(node);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::Chance;

    #[test]
    fn ring_reversal_equals_reversal_in_a_list() {
        let mut chance = Chance::new(7);
        for n in 1..40_u32 {
            let mut ring = Ring::new((0..n).collect());
            let mut plain: Vec<u32> = (0..n).collect();
            for turn in 0..60 {
                let (a, b) = (chance.below(n as usize), chance.below(n as usize));
                let (low, high) = (a.min(b), a.max(b));
                let (first, last) = (plain[low], plain[high]);
                ring.reverse(first, last);
                plain[low..=high].reverse();
                assert_eq!(ring.from(plain[0]), plain, "n {n} turn {turn}");
                assert_eq!(ring.ahead(plain[low], plain[high]), high - low);
                assert_eq!(ring.further(plain[low], high - low), plain[high]);
                assert_eq!(ring.prev(plain[0]), plain[n as usize - 1]);
            }
        }
    }
}
