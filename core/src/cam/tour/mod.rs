//! Orders points: greedy start, Lin–Kernighan moves, kicks. The number of kicks is limited and the random
//! numbers are seeded, so equal input gives equal output everywhere; time is never used.

mod lin_kernighan;
mod near;
mod ring;
mod start;

use crate::chance::Chance;
use crate::geometry::Point;
use lin_kernighan::{FIXED, Search};
use ring::Ring;

/// Near nodes in each list: this many of each quadrant, filled up with the nearest of all.
const QUADRANT: usize = 2;
const NEAR: usize = 10;

#[derive(Clone, Copy, Debug)]
pub(crate) struct Effort {
    pub(crate) kicks: u64,
    pub(crate) seed: u64,
}

/// A short ring through all `points`, which must differ; `rapid` is the cost between two of them by index,
/// equal in both directions. Calls `tick` with the number of kicks; `None` if `tick` returned false.
pub(crate) fn closed(
    points: &[Point],
    rapid: &impl Fn(u32, u32) -> f64,
    effort: Effort,
    tick: &mut dyn FnMut(u64) -> bool,
) -> Option<Vec<u32>> {
    let near = near::lists(points, QUADRANT, NEAR);
    let ring = Ring::new(start::greedy(points, &near, rapid));
    // All rings through three points have the same length.
    if points.len() < 4 {
        return Some(ring.from(0));
    }
    let near = priced(&near, rapid);
    let mut search = Search::new(ring, &near, rapid);
    anneal(&mut search, effort, tick).then(|| search.ring.from(0))
}

/// A cheap path from the first of `points` through all others, ending anywhere; arguments as for [`closed`],
/// but the first point may equal another one.
///
/// The path is a ring with one additional node, the end. Every rapid to the end is free, and the rapid from
/// the end back to the first must stay.
pub(crate) fn open(
    points: &[Point],
    rapid: &impl Fn(u32, u32) -> f64,
    effort: Effort,
    tick: &mut dyn FnMut(u64) -> bool,
) -> Option<Vec<u32>> {
    let end = points.len() as u32;
    let rapid = |a: u32, b: u32| match (a.min(b), a.max(b)) {
        (0, b) if b == end => FIXED,
        (_, b) if b == end => 0.0,
        (a, b) => rapid(a, b),
    };
    let near = near::lists(points, QUADRANT, NEAR);
    let mut order = Ring::new(start::greedy(points, &near, &rapid)).from(0);
    order.push(end);
    let mut near = priced(&near, &rapid);
    // Any node but the first may be the last one, at no cost.
    near.iter_mut().skip(1).for_each(|list| list.insert(0, (0.0, end)));
    near.push(Vec::new());
    let mut search = Search::new(Ring::new(order), &near, rapid);
    if points.len() > 2 && !anneal(&mut search, effort, tick) {
        return None;
    }
    // The end is a neighbour of the first node, on one side or the other.
    if search.ring.next(0) == end {
        search.ring.mirror();
    }
    Some(search.ring.from(0).into_iter().filter(|&node| node != end).collect())
}

/// Lists of near nodes with the cost of the rapid, cheapest first.
fn priced(near: &[Vec<u32>], rapid: &impl Fn(u32, u32) -> f64) -> Vec<Vec<(f64, u32)>> {
    let price = |(from, list): (u32, &Vec<u32>)| {
        let mut list: Vec<_> = list.iter().map(|&to| (rapid(from, to), to)).collect();
        list.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        list
    };
    (0..).zip(near).map(price).collect()
}

/// To a local optimum, then kick by kick; false if cancelled.
fn anneal<C: Fn(u32, u32) -> f64>(
    search: &mut Search<'_, C>,
    effort: Effort,
    tick: &mut dyn FnMut(u64) -> bool,
) -> bool {
    if !search.settle(&mut || tick(0)) {
        return false;
    }
    let mut chance = Chance::new(effort.seed);
    for done in 0..effort.kicks {
        // Asking costs time, so only at every 256th kick.
        if done & 0xFF == 0 && !tick(done) {
            return false;
        }
        search.kick(&mut chance);
    }
    true
}
