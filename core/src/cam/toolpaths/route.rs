//! Order of toolpaths, entry points of closed ones, direction of open ones, and links without a retract.
//!
//! ```text
//!   ●┄┄▶ ╭──╮   ┄┄▶ ────▶┄┄┄▶ ╭──╮      closed toolpaths are entered at the corner nearest to the tool,
//!        ╰──╯                 ╰──╯      open toolpaths at their nearer end
//!        └──────┘ a short link away from the copper: the tool stays down
//! ```
//!
//! First the order by the search of tours over one place of each toolpath, then the entries one after the other, then the
//! order again over the entries found. Then each entry moves to where the way from the toolpath before and to the one after is
//! shortest. The shortest result counts. Equal input gives equal output.

use super::super::order::{straight_mm, straight_rapid};
use super::super::tour::{self, Effort};
use super::cut;
use super::linked::Links;
use crate::geometry::{Path, PathSegment, Point, path_bounds};
use crate::units::Length;
use std::collections::BTreeSet;

/// Limit of kicks of the search: there are many toolpaths, planned again while the user moves a slider.
const MOST_KICKS: u64 = 200;
/// Rounds in which entries move to where the way from the toolpath before and to the one after is shortest.
const SETTLING: usize = 4;

/// How toolpaths are put in order.
pub(super) struct Rules<'a> {
    pub(super) start: Point,
    /// How far closed toolpaths continue beyond their start.
    pub(super) overlap: Length,
    /// Whether open toolpaths may be reversed.
    pub(super) both_ways: bool,
    pub(super) link: Option<&'a Links<'a>>,
    pub(super) seed: u64,
}

pub(super) fn arranged(paths: Vec<Path>, rules: &Rules<'_>) -> Vec<Path> {
    if paths.is_empty() {
        return paths;
    }
    let mut canonical: Vec<Path> = paths.into_iter().map(Path::from_its_left).collect();
    canonical.sort_unstable();
    let first: Vec<Point> = canonical.iter().map(|path| path.start).collect();
    let mut best = walked(&canonical, ordered(&first, rules), rules);
    for _ in 0..2 {
        let again = settled(walked(&canonical, ordered(&best.entries(), rules), rules), &canonical, rules);
        if again.travel < best.travel {
            best = again;
        }
    }
    joined(run(canonical, best, rules), rules)
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

#[derive(Clone, Copy)]
enum Entry {
    Start,
    End,
    Corner(usize),
    OnCircle(Point),
    /// Between two corners, nearest to this place.
    Near(Point),
}

struct Step {
    /// Which of the given toolpaths.
    number: u32,
    entry: Entry,
    start: Point,
    end: Point,
}

impl Step {
    fn new(number: u32, path: &Path, entry: Entry, rules: &Rules<'_>) -> Self {
        let entered = entered(path, entry, rules);
        Self { number, entry, start: entered.start, end: entered.end() }
    }
}

struct Walk {
    steps: Vec<Step>,
    travel: f64,
}

impl Walk {
    fn new(steps: Vec<Step>, rules: &Rules<'_>) -> Self {
        let mut here = rules.start;
        let hops = steps.iter().map(|step| straight_mm(std::mem::replace(&mut here, step.end), step.start));
        let travel = hops.sum();
        Self { steps, travel }
    }

    fn entries(&self) -> Vec<Point> {
        let mut places: Vec<(u32, Point)> = self.steps.iter().map(|step| (step.number, step.start)).collect();
        places.sort_unstable();
        places.into_iter().map(|(_, at)| at).collect()
    }
}

fn walked(paths: &[Path], order: Vec<u32>, rules: &Rules<'_>) -> Walk {
    let mut steps: Vec<Step> = Vec::with_capacity(paths.len());
    let mut here = rules.start;
    for number in order {
        let Some(path) = paths.get(number as usize) else { continue };
        let step = Step::new(number, path, nearest(path, here, rules), rules);
        here = step.end;
        steps.push(step);
    }
    Walk::new(steps, rules)
}

/// The same order, each toolpath entered where the way from the one before and to the one after is shortest. Those that a link
/// joins stay.
fn settled(walk: Walk, paths: &[Path], rules: &Rules<'_>) -> Walk {
    let reach = rules.link.map_or(-1.0, |links| links.reach.mm());
    let mut steps = walk.steps;
    for _ in 0..SETTLING {
        let mut before = rules.start;
        for index in 0..steps.len() {
            let after = steps.get(index + 1).map(|step| step.start);
            let Some(own) = steps.get_mut(index) else { continue };
            let is_joined = straight_mm(before, own.start) <= reach
                || after.is_some_and(|after| straight_mm(own.end, after) <= reach);
            if let Some(path) = paths.get(own.number as usize).filter(|_| !is_joined) {
                let way = |at: Point, end: Point| {
                    straight_mm(before, at) + after.map_or(0.0, |after| straight_mm(end, after))
                };
                let better = Step::new(own.number, path, shortest(path, rules, &way), rules);
                if way(better.start, better.end) < way(own.start, own.end) {
                    *own = better;
                }
            }
            before = own.end;
        }
    }
    Walk::new(steps, rules)
}

/// The toolpaths in the order of `walk`, each from where it is entered.
fn run(mut paths: Vec<Path>, walk: Walk, rules: &Rules<'_>) -> Vec<Path> {
    let enter = |step: Step| {
        let path = std::mem::take(paths.get_mut(step.number as usize)?);
        Some(entered(&path, step.entry, rules))
    };
    walk.steps.into_iter().filter_map(enter).collect()
}

fn shortest(path: &Path, rules: &Rules<'_>, way: &dyn Fn(Point, Point) -> f64) -> Entry {
    if !path.is_closed() {
        let backwards = rules.both_ways && way(path.end(), path.start) < way(path.start, path.end());
        return if backwards { Entry::End } else { Entry::Start };
    }
    entries(path)
        .min_by(|a, b| way(a.1, a.1).total_cmp(&way(b.1, b.1)))
        .map_or(Entry::Start, |(entry, _)| entry)
}

fn nearest(path: &Path, here: Point, rules: &Rules<'_>) -> Entry {
    if !path.is_closed() {
        let backwards = rules.both_ways && straight_mm(here, path.end()) < straight_mm(here, path.start);
        return if backwards { Entry::End } else { Entry::Start };
    }
    let nearest = entries(path).min_by(|a, b| straight_mm(here, a.1).total_cmp(&straight_mm(here, b.1)));
    let (corner, at) = nearest.unwrap_or((Entry::Start, path.start));
    // If a link would do but the corners are far apart, the toolpath is entered between two of them.
    let reach = rules.link.map_or(0.0, |links| links.reach.mm());
    let is_circle = matches!(corner, Entry::OnCircle(_));
    if is_circle || reach == 0.0 || straight_mm(here, at) <= reach {
        return corner;
    }
    if !path_bounds(path).grown(Length::from_mm(reach)).contains(here) {
        return corner;
    }
    if straight_mm(here, cut::started_near(path, here).start) <= reach { Entry::Near(here) } else { corner }
}

/// The places at which a closed toolpath may be entered: its corners, or four places of a full circle.
fn entries(path: &Path) -> Box<dyn Iterator<Item = (Entry, Point)> + '_> {
    match path.segments.as_slice() {
        [PathSegment::Arc { centre, .. }] => {
            Box::new(quarters(path.start, *centre).into_iter().map(|at| (Entry::OnCircle(at), at)))
        }
        segments => {
            let corners = path.corners().enumerate().take(segments.len());
            Box::new(corners.map(|(corner, at)| (Entry::Corner(corner), at)))
        }
    }
}

/// `path` from its entry on; a closed one with its overlap.
fn entered(path: &Path, entry: Entry, rules: &Rules<'_>) -> Path {
    let turned = match (entry, path.segments.as_slice()) {
        (Entry::Start, _) if !path.is_closed() => return path.clone(),
        (Entry::End, _) => return path.reversed(),
        (Entry::OnCircle(at), [PathSegment::Arc { centre, clockwise, .. }]) => {
            circle_at(at, *centre, *clockwise)
        }
        (Entry::Corner(corner), _) => cut::started_at(path, corner),
        (Entry::Near(at), _) => cut::started_near(path, at),
        (Entry::Start | Entry::OnCircle(_), _) => cut::started_at(path, 0),
    };
    extended(turned, rules.overlap)
}

/// The four places at which a full circle may begin.
fn quarters(start: Point, centre: Point) -> [Point; 4] {
    let (dx, dy) = (start.x - centre.x, start.y - centre.y);
    [(dx, dy), (-dy, dx), (-dx, -dy), (dy, -dx)].map(|(x, y)| Point::new(centre.x + x, centre.y + y))
}

fn circle_at(to: Point, centre: Point, clockwise: bool) -> Path {
    Path { start: to, segments: vec![PathSegment::Arc { to, centre, clockwise }] }
}

/// A closed path continued beyond its start, by at most one more turn.
fn extended(mut path: Path, by: Length) -> Path {
    let more = if by > Length::ZERO { cut::between(&path, 0.0, by.mm().min(path.length_mm())) } else { None };
    path.segments.extend(more.into_iter().flat_map(|more| more.segments));
    path
}

/// Neighbours in order joined where a short link is allowed.
fn joined(paths: Vec<Path>, rules: &Rules<'_>) -> Vec<Path> {
    let Some(links) = rules.link else { return paths };
    let mut out: Vec<Path> = Vec::with_capacity(paths.len());
    let mut so_far = 0.0;
    for path in paths {
        let own = path.length_mm();
        match out.last_mut() {
            Some(last) if links.may_join(so_far, own) && links.allow(last.end(), path.start) => {
                so_far += own + last.end().distance_mm(path.start);
                if last.end() != path.start {
                    last.segments.push(PathSegment::Line { to: path.start });
                }
                last.segments.extend(path.segments);
            }
            last => {
                if let Some(last) = last {
                    last.segments.shrink_to_fit();
                }
                out.push(path);
                so_far = own;
            }
        }
    }
    out
}
