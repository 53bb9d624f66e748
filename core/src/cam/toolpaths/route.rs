//! The order of toolpaths, where closed ones are entered, which way round open ones go, and which follow each other without
//! the bit coming up.
//!
//! ```text
//!   ●┄┄▶ ╭──╮   ┄┄▶ ────▶┄┄┄▶ ╭──╮      closed toolpaths are entered at the corner nearest to where the bit comes from,
//!        ╰──╯                 ╰──╯      open toolpaths at their nearer end
//!        └──────┘ a short link that keeps off the copper: the bit stays down
//! ```
//!
//! First the order by the search of tours over one place of each toolpath, then the entries one after the other, then the
//! order again over the entries found; the shorter result counts. Equal input gives equal output.
//!
//! Comes in: paths. Goes out: paths in order, turned and joined. Does not know operations.

use super::super::order::{straight_mm, straight_rapid};
use super::super::tour::{self, Effort};
use super::cut::{self, Area};
use crate::geometry::{Path, PathSegment, Point, path_bounds};
use crate::units::Length;
use std::collections::BTreeSet;

/// Most kicks of the search; toolpaths are many and are planned again while a slider moves.
const MOST_KICKS: u64 = 200;
/// At most so many corners of a closed toolpath are looked at as its entry.
const ENTRIES: usize = 48;
/// A link is looked at every so many mm.
const LOOK_MM: f64 = 0.02;

/// How toolpaths are put in order.
pub(super) struct Rules<'a> {
    /// Where the bit comes from.
    pub(super) start: Point,
    /// How far closed toolpaths go on beyond their start.
    pub(super) overlap: Length,
    /// Whether open toolpaths may be run through backwards.
    pub(super) both_ways: bool,
    /// Toolpaths nearer than this are joined, if the link stays farther from the copper than the second length.
    pub(super) link: Option<(Length, Length, &'a Area)>,
    /// Seed of the search.
    pub(super) seed: u64,
}

/// `paths` in order.
pub(super) fn arranged(paths: Vec<Path>, rules: &Rules<'_>) -> Vec<Path> {
    if paths.is_empty() {
        return paths;
    }
    let canonical: Vec<Path> = {
        let mut sorted: Vec<Path> = paths.iter().map(Path::from_its_left).collect();
        sorted.sort_unstable();
        sorted
    };
    let first: Vec<Point> = canonical.iter().map(|path| path.start).collect();
    let once = walked(&canonical, &ordered(&first, rules), rules);
    let entries: Vec<Point> = once.entries();
    let twice = walked(&canonical, &ordered(&entries, rules), rules);
    let best = if twice.travel < once.travel { twice } else { once };
    joined(best.paths, rules)
}

/// The order of places, as a path from the start.
fn ordered(places: &[Point], rules: &Rules<'_>) -> Vec<u32> {
    let mut used = BTreeSet::new();
    let mut points = vec![rules.start];
    for &place in places {
        let mut apart = place;
        while !used.insert(apart) {
            apart.x += Length::from_nm(1);
        }
        points.push(apart);
    }
    let effort = Effort { kicks: (places.len() as u64).min(MOST_KICKS), seed: rules.seed };
    let found = tour::open(&points, &straight_rapid(&points), effort, &mut |_| true).unwrap_or_default();
    found.into_iter().filter(|&node| node != 0).map(|node| node - 1).collect()
}

/// Toolpaths in order, each from where it is entered.
struct Walk {
    paths: Vec<Path>,
    /// For every path, which of the given ones it is.
    numbers: Vec<u32>,
    travel: f64,
}

impl Walk {
    /// Where each of the given toolpaths was entered.
    fn entries(&self) -> Vec<Point> {
        let mut places: Vec<(u32, Point)> =
            self.numbers.iter().copied().zip(self.paths.iter().map(|path| path.start)).collect();
        places.sort_unstable();
        places.into_iter().map(|(_, at)| at).collect()
    }
}

fn walked(paths: &[Path], order: &[u32], rules: &Rules<'_>) -> Walk {
    let mut walk = Walk { paths: Vec::with_capacity(paths.len()), numbers: Vec::new(), travel: 0.0 };
    let mut here = rules.start;
    for &number in order {
        let Some(path) = paths.get(number as usize) else { continue };
        let entered = entered(path, here, rules);
        walk.travel += straight_mm(here, entered.start);
        here = entered.end();
        walk.paths.push(entered);
        walk.numbers.push(number);
    }
    walk
}

/// `path` from its place nearest to `here`, with its overlap.
fn entered(path: &Path, here: Point, rules: &Rules<'_>) -> Path {
    if !path.is_closed() {
        let turned = rules.both_ways && straight_mm(here, path.end()) < straight_mm(here, path.start);
        return if turned { path.reversed() } else { path.clone() };
    }
    let turned = match path.segments.as_slice() {
        [PathSegment::Arc { centre, clockwise, .. }] => circle_from(path.start, *centre, *clockwise, here),
        segments => {
            let stride = segments.len().div_ceil(ENTRIES);
            let corners = path.corners().enumerate().take(segments.len()).step_by(stride.max(1));
            let nearest = corners.min_by(|a, b| straight_mm(here, a.1).total_cmp(&straight_mm(here, b.1)));
            cut::started_at(path, nearest.map_or(0, |(index, _)| index))
        }
    };
    // Where a link would do but for the corners being far apart, the toolpath is entered between two of them.
    let reach = rules.link.map_or(0.0, |(reach, ..)| reach.mm());
    if straight_mm(here, turned.start) <= reach || reach == 0.0 {
        return extended(turned, rules.overlap);
    }
    if !path_bounds(path).grown(Length::from_mm(reach)).contains(here) {
        return extended(turned, rules.overlap);
    }
    let near = cut::started_near(path, here);
    extended(if straight_mm(here, near.start) <= reach { near } else { turned }, rules.overlap)
}

/// A full circle begun at whichever of four places is nearest.
fn circle_from(start: Point, centre: Point, clockwise: bool, here: Point) -> Path {
    let (dx, dy) = (start.x - centre.x, start.y - centre.y);
    let quarters = [(dx, dy), (-dy, dx), (-dx, -dy), (dy, -dx)];
    let places = quarters.map(|(x, y)| Point::new(centre.x + x, centre.y + y));
    let nearest = places.into_iter().min_by(|a, b| straight_mm(here, *a).total_cmp(&straight_mm(here, *b)));
    let to = nearest.unwrap_or(start);
    Path { start: to, segments: vec![PathSegment::Arc { to, centre, clockwise }] }
}

/// A closed path that goes on beyond its start, at most once more round.
fn extended(mut path: Path, by: Length) -> Path {
    let more = if by > Length::ZERO { cut::between(&path, 0.0, by.mm().min(path.length_mm())) } else { None };
    path.segments.extend(more.into_iter().flat_map(|more| more.segments));
    path
}

/// Neighbours in order joined where a short link is allowed.
fn joined(paths: Vec<Path>, rules: &Rules<'_>) -> Vec<Path> {
    let Some((reach, keep, copper)) = rules.link else { return paths };
    let mut out: Vec<Path> = Vec::with_capacity(paths.len());
    for path in paths {
        match out.last_mut() {
            Some(last) if may_link(last.end(), path.start, reach, keep, copper) => {
                if last.end() != path.start {
                    last.segments.push(PathSegment::Line { to: path.start });
                }
                last.segments.extend(path.segments);
            }
            _ => out.push(path),
        }
    }
    out
}

fn may_link(from: Point, to: Point, reach: Length, keep: Length, copper: &Area) -> bool {
    let length = straight_mm(from, to);
    if length > reach.mm() {
        return false;
    }
    let looks = (length / LOOK_MM) as u32 + 1;
    let free = |look: u32| {
        let share = f64::from(look) / f64::from(looks);
        let at = cut::point_on(from, PathSegment::Line { to }, share);
        // Where looks are nearer to each other than to any copper, no step leads into it.
        let outside = look > 0 && keep.mm() > LOOK_MM || !copper.contains(at);
        outside && copper.index().nearest(at, keep).is_none()
    };
    (0..=looks).all(free)
}
