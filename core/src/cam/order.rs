//! Order of one tool's holes: as in the file, the shortest closed tour, or the least machine time.
//!
//! ```text
//!  shortest   a closed tour, opened at the rapid that makes the approach cheapest
//!
//!       zero ┄┄┄▶ o───o            holes at one position are one stop,
//!                 ┊   │            they are drilled one after the other
//!                 o───o
//!
//!  fastest    a path from the current position, ending anywhere, measured in seconds
//! ```

use super::{HoleOrder, tour};
use crate::geometry::Point;
use std::cell::Cell;
use tour::Effort;

const REMEMBERED: usize = 1 << 16;

fn way(from: Point, stops: impl IntoIterator<Item = Point>, cost: impl Fn(Point, Point) -> f64) -> f64 {
    let walk = |(here, sum): (Point, f64), to: Point| (to, sum + cost(here, to));
    stops.into_iter().fold((from, 0.0), walk).1
}

/// Straight distance in mm.
///
/// The square root of IEEE 754 is exact on every target, so the compiler's own is as repeatable as any.
pub(super) fn straight_mm(a: Point, b: Point) -> f64 {
    let (dx, dy) = ((a.x - b.x).mm(), (a.y - b.y).mm());
    (dx * dx + dy * dy).sqrt()
}

/// Orders `holes` (numbers with their positions, in file order), starting at `from`. `None` if `tick`
/// returned false. Never longer than the file order, in the metric of `order` with the return to `from`.
pub(super) fn arrange(
    holes: &[(u32, Point)],
    from: Point,
    order: HoleOrder,
    rapid_time: &dyn Fn(Point, Point) -> f64,
    effort: Effort,
    tick: &mut dyn FnMut(u64) -> bool,
) -> Option<Vec<u32>> {
    let in_file: Vec<u32> = holes.iter().map(|(hole, _)| *hole).collect();
    let (places, stops) = stops(holes);
    let (tour, cost): (Vec<u32>, &dyn Fn(Point, Point) -> f64) = match order {
        HoleOrder::File => return Some(in_file),
        HoleOrder::Shortest => (shortest(&places, &stops, from, effort, tick)?, &straight_mm),
        HoleOrder::Fastest => (fastest(&places, from, rapid_time, effort, tick)?, rapid_time),
    };
    let before = way(from, holes.iter().map(|(_, at)| *at).chain([from]), cost);
    let after = way(from, tour.iter().map(|&stop| places[stop as usize]).chain([from]), cost);
    // The search is a heuristic and may end worse than the file's own order.
    if before <= after {
        return Some(in_file);
    }
    Some(tour.iter().flat_map(|&stop| stops[stop as usize].iter().copied()).collect())
}

/// The shortest ring found, or the file's if that is shorter, opened.
fn shortest(
    places: &[Point],
    stops: &[Vec<u32>],
    from: Point,
    effort: Effort,
    tick: &mut dyn FnMut(u64) -> bool,
) -> Option<Vec<u32>> {
    let ring = tour::closed(places, &straight_rapid(places), effort, tick)?;
    // The order of the file is often good already; the search must not lose to it.
    let by_first_hole = file_ring(stops);
    let length = |ring: &[u32]| ring_length(places, ring);
    let ring = if length(&by_first_hole) <= length(&ring) { by_first_hole } else { ring };
    Some(opened(places, ring, from))
}

fn fastest(
    places: &[Point],
    from: Point,
    rapid_time: &dyn Fn(Point, Point) -> f64,
    effort: Effort,
    tick: &mut dyn FnMut(u64) -> bool,
) -> Option<Vec<u32>> {
    let mut points = vec![from];
    points.extend_from_slice(places);
    let rapid = remembered(|a, b| rapid_time(points[a as usize], points[b as usize]));
    let path = tour::open(&points, &rapid, effort, tick)?;
    // Node 0 is the start, which is no stop.
    Some(path.into_iter().filter(|&node| node != 0).map(|node| node - 1).collect())
}

/// `rapid` with a cache: the search repeats a few queries, and times are expensive.
fn remembered(rapid: impl Fn(u32, u32) -> f64) -> impl Fn(u32, u32) -> f64 {
    let slots = vec![Cell::new((u32::MAX, u32::MAX, 0.0)); REMEMBERED];
    move |a, b| {
        // The cost is equal in both directions, so one slot serves both.
        let (a, b) = (a.min(b), a.max(b));
        // Odd factors spread neighbouring numbers over the slots.
        let mixed = a.wrapping_mul(0x9E37_79B9) ^ b.wrapping_mul(0x85EB_CA6B);
        let slot = &slots[(mixed >> 16) as usize % REMEMBERED];
        let (from, to, known) = slot.get();
        if (from, to) == (a, b) {
            return known;
        }
        let cost = rapid(a, b);
        slot.set((a, b, cost));
        cost
    }
}

/// [`straight_mm`] between positions by index, with precomputed coordinates in mm.
pub(super) fn straight_rapid(places: &[Point]) -> impl Fn(u32, u32) -> f64 + use<> {
    let mm: Vec<(f64, f64)> = places.iter().map(|at| (at.x.mm(), at.y.mm())).collect();
    move |a, b| {
        let ((ax, ay), (bx, by)) = (mm[a as usize], mm[b as usize]);
        let (dx, dy) = (ax - bx, ay - by);
        (dx * dx + dy * dy).sqrt()
    }
}

/// Distinct positions, ascending, and the holes at each.
fn stops(holes: &[(u32, Point)]) -> (Vec<Point>, Vec<Vec<u32>>) {
    let mut sorted = holes.to_vec();
    // Equal places become neighbours; they are one stop.
    sorted.sort_unstable_by_key(|&(hole, at)| (at, hole));
    let mut places: Vec<Point> = Vec::new();
    let mut stops: Vec<Vec<u32>> = Vec::new();
    for (hole, at) in sorted {
        if places.last() != Some(&at) {
            places.push(at);
            stops.push(Vec::new());
        }
        stops.last_mut().into_iter().for_each(|stop| stop.push(hole));
    }
    (places, stops)
}

/// The stops in the order of their first holes.
fn file_ring(stops: &[Vec<u32>]) -> Vec<u32> {
    let mut ring: Vec<u32> = (0..stops.len() as u32).collect();
    ring.sort_unstable_by_key(|&stop| stops[stop as usize].first());
    ring
}

fn ring_length(places: &[Point], ring: &[u32]) -> f64 {
    let at = |index: usize| places[ring[index] as usize];
    ring.last().map_or(0.0, |_| way(at(ring.len() - 1), (0..ring.len()).map(at), straight_mm))
}

/// The ring opened, and perhaps reversed, so that approach and path together are shortest.
fn opened(places: &[Point], mut ring: Vec<u32>, from: Point) -> Vec<u32> {
    let n = ring.len();
    let at = |index: usize| places[ring[index % n] as usize];
    let saved = |first: usize, last: usize| straight_mm(at(first), at(last)) - straight_mm(from, at(first));
    let mut best = (f64::NEG_INFINITY, 0, false);
    for index in 0..n {
        for (value, turned) in [(saved(index, index + n - 1), false), (saved(index, index + 1), true)] {
            if value > best.0 {
                best = (value, index, turned);
            }
        }
    }
    let (_, first, turned) = best;
    if turned {
        ring.rotate_left((first + 1) % n.max(1));
        ring.reverse();
    } else {
        ring.rotate_left(first);
    }
    ring
}
