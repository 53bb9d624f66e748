//! Improves tours by Lin and Kernighan's moves (Operations Research 21, 1973) in the chained form of Martin,
//! Otto and Felten. Local search to a local optimum, a small kick, local search around the kick; undo it if
//! the tour got longer.
//!
//! ```text
//!  one link of a move: rapid (t1,t2) is open, t2 finds a near t3, t4 is just before t3 and becomes t2
//!
//!    t1 → t2 … t4 → t3 … ⟲           t1 → t4 … t2 → t3 … ⟲
//!        └── reverse ──┘      ⇒          now (t1,t4) is open
//!
//!  the move without reversal: t4 is directly after t3, t5 and t6 are between t2 and t3
//!
//!    t1 → [t2 … t5][t6 … t3] → t4    ⇒    t1 → [t6 … t3][t2 … t5] → t4
//! ```

use super::ring::Ring;
use crate::chance::Chance;

/// Links tried at each depth of a move; at most 5.
const BREADTH: [usize; DEPTH] = [5, 3, 1];

const DEPTH: usize = 3;

/// Smaller gains are rounding.
pub(crate) const EPSILON: f64 = 1e-9;

/// The cost of a rapid that must stay: so cheap that no move gains by removing it.
pub(crate) const FIXED: f64 = -1e12;

/// Longest stretch to reverse: on very large rings longer ones cost more time than they gain.
const LONGEST_TURN: usize = 50_000;

/// Number of rapids between near nodes that separate the ends of a kick. Only small kicks can be repaired
/// with a gain.
const WALK: u32 = 3;

/// The path from t2 around to t1 after the links of a move. Every link reverses a front piece of it, so a
/// list of lengths is enough. Nothing is reversed in memory until the move is known to gain.
///
/// ```text
///   ring             t2 a b c d e … t1
///   reverse front 3  b a t2 c d e … t1        rank(t2) = 2, node_at(0) = b
/// ```
#[derive(Clone, Copy)]
struct Path {
    first: u32,
    depth: usize,
    turns: [usize; DEPTH],
}

impl Path {
    fn new(first: u32) -> Self {
        Self { first, depth: 0, turns: [0; DEPTH] }
    }

    fn lengths(&self) -> &[usize] {
        &self.turns[..self.depth]
    }

    fn turned(mut self, length: usize) -> Self {
        self.turns[self.depth] = length;
        self.depth += 1;
        self
    }

    fn rank(&self, ring: &Ring, node: u32) -> usize {
        let turn = |rank, &length: &usize| if rank < length { length - 1 - rank } else { rank };
        self.lengths().iter().fold(ring.ahead(self.first, node), turn)
    }

    fn node_at(&self, ring: &Ring, rank: usize) -> u32 {
        let turn = |rank, &length: &usize| if rank < length { length - 1 - rank } else { rank };
        ring.further(self.first, self.lengths().iter().rev().fold(rank, turn))
    }
}

pub(crate) struct Search<'a, C: Fn(u32, u32) -> f64> {
    pub(crate) ring: Ring,
    near: &'a [Vec<(f64, u32)>],
    cost: C,
    queue: Vec<u32>,
    queued: Vec<bool>,
    turns: Vec<(u32, u32, bool)>,
    mirrored: bool,
}

impl<'a, C: Fn(u32, u32) -> f64> Search<'a, C> {
    /// A search that starts with `ring`. `near` has for every node its near nodes with the cost of the rapid,
    /// cheapest first.
    pub(crate) fn new(ring: Ring, near: &'a [Vec<(f64, u32)>], cost: C) -> Self {
        let n = ring.len();
        Self {
            ring,
            near,
            cost,
            queue: Vec::new(),
            queued: vec![false; n],
            turns: Vec::new(),
            mirrored: false,
        }
    }

    /// Processes every node, in the order of the ring; false if `go_on` cancelled.
    pub(crate) fn settle(&mut self, go_on: &mut dyn FnMut() -> bool) -> bool {
        let mut all = self.ring.from(0);
        // The queue is taken from its end; reversed, the nodes come in the order of the ring.
        all.reverse();
        all.into_iter().for_each(|node| self.look_again(node));
        let mut looked = 0_u32;
        while self.improve_next().is_some() {
            self.turns.clear();
            looked = looked.wrapping_add(1);
            // Asking costs time, so only at every 1,024th node.
            if looked & 0x3FF == 0 && !go_on() {
                return false;
            }
        }
        true
    }

    /// One kick and the repair around it, undone if the tour got longer. Returns the gain, 0 or more.
    pub(crate) fn kick(&mut self, chance: &mut Chance) -> f64 {
        let n = self.ring.len();
        if n < 5 {
            return 0.0;
        }
        self.turns.clear();
        let Some([a, b, c]) = self.three_near(chance) else { return 0.0 };
        let (a2, b2, c2) = (self.ring.next(a), self.ring.next(b), self.ring.next(c));
        let cut = [(a, a2), (b, b2), (c, c2)].map(|(from, to)| self.rapid(from, to));
        // The rapid that must stay may not be cut.
        if cut.contains(&FIXED) {
            return 0.0;
        }
        let mut gain = cut.iter().sum::<f64>() - self.rapid(a, b2) - self.rapid(c, a2) - self.rapid(b, c2);
        self.swap_stretches(a2, b, b2, c);
        [a, a2, b, b2, c, c2].into_iter().for_each(|node| self.look_again(node));
        while let Some(more) = self.improve_next() {
            gain += more;
        }
        if gain < 0.0 {
            self.undo(0);
            return 0.0;
        }
        gain
    }

    /// Three different nodes near each other, in the order of the ring.
    fn three_near(&self, chance: &mut Chance) -> Option<[u32; 3]> {
        let a = chance.below(self.ring.len()) as u32;
        let mut walk = || {
            (0..WALK).fold(a, |at, _| {
                let near = &self.near[at as usize];
                near.get(chance.below(near.len())).map_or(at, |&(_, to)| to)
            })
        };
        let (b, c) = (walk(), walk());
        let (b, c) = if self.ring.ahead(a, b) <= self.ring.ahead(a, c) { (b, c) } else { (c, b) };
        let far = self.ring.ahead(a, c);
        (a != b && b != c && far.min(self.ring.len() - far) <= LONGEST_TURN).then_some([a, b, c])
    }

    fn rapid(&self, a: u32, b: u32) -> f64 {
        (self.cost)(a, b)
    }

    fn look_again(&mut self, node: u32) {
        if !self.queued[node as usize] {
            self.queued[node as usize] = true;
            self.queue.push(node);
        }
    }

    fn turn(&mut self, first: u32, last: u32) {
        self.ring.reverse(first, last);
        self.turns.push((first, last, self.mirrored));
    }

    fn undo(&mut self, keep: usize) {
        while self.turns.len() > keep {
            if let Some((first, last, mirrored)) = self.turns.pop() {
                // In a mirrored ring the ends of a stretch are exchanged.
                let (first, last) = if mirrored == self.mirrored { (last, first) } else { (first, last) };
                self.ring.reverse(first, last);
            }
        }
    }

    fn swap_stretches(&mut self, a: u32, b: u32, c: u32, d: u32) {
        self.turn(a, d);
        self.turn(d, c);
        self.turn(b, a);
    }

    /// Takes the next queued node, and improves around it until nothing more is found. `None` if the queue is
    /// empty.
    fn improve_next(&mut self) -> Option<f64> {
        let node = self.queue.pop()?;
        self.queued[node as usize] = false;
        let mut gained = 0.0;
        let mut failed = 0;
        // One failure for each direction of the ring.
        while failed < 2 {
            match self.improve_forward(node) {
                Some(gain) => (gained, failed) = (gained + gain, 0),
                None => failed += 1,
            }
            self.ring.mirror();
            self.mirrored = !self.mirrored;
        }
        Some(gained)
    }

    /// Tries to replace the rapid from `t1` to the node after it.
    fn improve_forward(&mut self, t1: u32) -> Option<f64> {
        let t2 = self.ring.next(t1);
        let open = self.rapid(t1, t2);
        let gain = self.deepen(t1, open, Path::new(t2)).or_else(|| self.swap(t1, t2, open))?;
        self.look_again(t1);
        Some(gain)
    }

    /// Searches links that close with a gain, and applies them. `open` is the gain before adding the rapid
    /// from the first node of `path` back to `t1`. Without a gain nothing is reversed.
    fn deepen(&mut self, t1: u32, open: f64, path: Path) -> Option<f64> {
        let t2 = path.node_at(&self.ring, 0);
        let (links, count) = self.links(t1, t2, open, path);
        for &(value, t3, t4) in &links[..count] {
            let length = path.rank(&self.ring, t4) + 1;
            if length.min(self.ring.len() - length) > LONGEST_TURN {
                continue;
            }
            let gain = value - self.rapid(t4, t1);
            let deeper = path.turned(length);
            let found = if gain > EPSILON {
                deeper.lengths().iter().for_each(|&length| self.turn_front(t1, length));
                Some(gain)
            } else if deeper.depth < DEPTH {
                self.deepen(t1, value, deeper)
            } else {
                None
            };
            if found.is_some() {
                [t4, t3, t2].into_iter().for_each(|node| self.look_again(node));
                return found;
            }
        }
        None
    }

    fn turn_front(&mut self, t1: u32, length: usize) {
        self.turn(self.ring.next(t1), self.ring.further(t1, length));
    }

    /// The best links (gain with the ring open at t4, t3, t4), best first.
    fn links(&self, t1: u32, t2: u32, open: f64, path: Path) -> ([(f64, u32, u32); 5], usize) {
        let breadth = BREADTH[path.depth];
        let mut best = [(0.0, 0, 0); 5];
        let mut count = 0;
        for &(rapid, t3) in &self.near[t2 as usize] {
            // The list is sorted by cost: the rest is no better.
            if open - rapid <= EPSILON {
                break;
            }
            let rank = path.rank(&self.ring, t3);
            if t3 == t1 || rank < 2 {
                continue;
            }
            let t4 = path.node_at(&self.ring, rank - 1);
            let value = open - rapid + self.rapid(t4, t3);
            let place = best[..count].partition_point(|other| other.0 >= value);
            if value <= EPSILON || place >= breadth {
                continue;
            }
            count = (count + 1).min(breadth);
            best.copy_within(place..count - 1, place + 1);
            best[place] = (value, t3, t4);
        }
        (best, count)
    }

    /// The move without reversal, and its variant that reverses both stretches.
    fn swap(&mut self, t1: u32, t2: u32, open: f64) -> Option<f64> {
        let near = self.near;
        for &(hop23, t3) in &near[t2 as usize] {
            if open - hop23 <= EPSILON {
                break;
            }
            if t3 == t1 {
                continue;
            }
            let t4 = self.ring.next(t3);
            let length = self.ring.ahead(t2, t3);
            if length > LONGEST_TURN {
                continue;
            }
            let missing = open - hop23 + self.rapid(t3, t4);
            for &(hop45, t5) in &near[t4 as usize] {
                if missing - hop45 <= EPSILON {
                    break;
                }
                if self.ring.ahead(t2, t5) > length {
                    continue;
                }
                if let Some(gain) = self.swap_at([t1, t2, t3, t4, t5], missing - hop45) {
                    return Some(gain);
                }
            }
        }
        None
    }

    fn swap_at(&mut self, [t1, t2, t3, t4, t5]: [u32; 5], missing: f64) -> Option<f64> {
        let mut done = None;
        if t5 != t3 {
            let t6 = self.ring.next(t5);
            let gain = missing + self.rapid(t5, t6) - self.rapid(t6, t1);
            if gain > EPSILON {
                self.swap_stretches(t2, t5, t6, t3);
                done = Some((gain, t6));
            }
        }
        if t5 != t2 && done.is_none() {
            let t6 = self.ring.prev(t5);
            let gain = missing + self.rapid(t5, t6) - self.rapid(t6, t1);
            if gain > EPSILON {
                self.turn(t2, t6);
                self.turn(t5, t3);
                done = Some((gain, t6));
            }
        }
        let (gain, t6) = done?;
        [t6, t5, t4, t3, t2].into_iter().for_each(|node| self.look_again(node));
        Some(gain)
    }
}
