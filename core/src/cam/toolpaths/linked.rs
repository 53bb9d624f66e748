//! Closed toolpaths joined by short links, so that the tool moves to a neighbour without a retract.
//!
//! ```text
//!   ╭────────╮╭──────╮       Each pair of neighbours has one shortest link. The shortest links that join all
//!   │   1    ╞╡  2   │       toolpaths form a tree. The tool mills 1 as far as a link, crosses it, mills 2
//!   ╰───╥────╯╰──────╯       once round, returns and continues on 1.
//!     ╭─╨──╮
//!     │ 3  │                  A link runs in what the toolpaths at its ends cut, or across a narrow strip of copper
//!     ╰────╯                  that belongs to no net.
//! ```
//!
//! All toolpaths are of one tool at one depth. A toolpath that runs forwards and back is joined like a closed
//! one; if nothing joins it, it runs forwards only. Other open toolpaths stay as they are.

use super::cut::{self, Area};
use super::refit::SHORT_MM;
use crate::geometry::{Bounds, Path, PathSegment, Point, Segments};
use crate::units::Length;
use std::collections::BTreeMap;

/// Joined toolpaths of one pass are at most this long, in mm: a job resumed after a stop repeats its toolpath from the start.
pub(super) const LONGEST_MM: f64 = 1_000.0;
/// Toolpaths up to this length, in mm, may make a joined one twice as long.
const BRANCH_MM: f64 = 50.0;
/// The least distance between two checks along a link, in mm.
const LEAST_LOOK_MM: f64 = 0.0005;
/// From each place, links to this many of the nearest toolpaths are tried.
const NEIGHBOURS: usize = 4;

pub(super) struct Links<'a> {
    pub(super) reach: Length,
    /// Joined toolpaths are at most this long, in mm, or twice as long with short branches.
    pub(super) longest_mm: f64,
    pub(super) spacing: Length,
    /// Every point of a link is farther from the copper than this.
    pub(super) min_distance: Length,
    /// Every point of a link is at most this far from the copper.
    pub(super) max_distance: Length,
    pub(super) copper: &'a Area,
    pub(super) closed: Option<&'a Area>,
}

/// A point on a toolpath: the segment, the share of its length, and the coordinates.
#[derive(Clone, Copy, Debug)]
struct Place {
    segment: u32,
    share: f64,
    at: Point,
}

#[derive(Clone, Copy, Debug)]
struct Link {
    ends: [(u32, Place); 2],
    mm: f64,
}

/// One step along a toolpath: a segment, or the branch after a link.
enum Step {
    Go(PathSegment),
    Visit(usize),
}

pub(super) fn linked(paths: Vec<Path>, links: &Links<'_>) -> Vec<Path> {
    let (closed, mut out): (Vec<Path>, Vec<Path>) =
        paths.into_iter().partition(|path| path.is_closed() && !path.segments.is_empty());
    let mut rounds: Vec<(Path, Option<Path>)> = closed.into_iter().map(round).collect();
    rounds.sort_unstable();
    let (mut closed, single): (Vec<Path>, Vec<Option<Path>>) = rounds.into_iter().unzip();
    let tree = tree(&closed, shortest(&closed, links), links);
    let mut at_path: Vec<Vec<usize>> = vec![Vec::new(); closed.len()];
    for (number, link) in tree.iter().enumerate() {
        for (path, _) in link.ends {
            if let Some(own) = at_path.get_mut(path as usize) {
                own.push(number);
            }
        }
    }
    let mut done = vec![false; closed.len()];
    for (root, single) in single.into_iter().enumerate() {
        if done.get(root).copied().unwrap_or(true) {
            continue;
        }
        let is_alone = at_path.get(root).is_none_or(Vec::is_empty);
        match single.filter(|_| is_alone) {
            Some(open) => out.push(open),
            None => out.push(tour_of(root, &mut closed, &tree, &at_path, &mut done)),
        }
    }
    out
}

/// An open toolpath up to `longest_mm` run forwards and back, so that it can be joined. Others as they are.
pub(super) fn along_and_back(path: Path, longest_mm: f64) -> Path {
    if path.is_closed() || path.length_mm() > longest_mm {
        return path;
    }
    let back = path.reversed();
    let mut both = path.clone().min(back.clone());
    both.segments.extend(path.max(back).segments);
    both
}

/// The first half of a toolpath that runs forwards and back; none for others.
fn along_only(path: &Path) -> Option<Path> {
    let half = path.segments.len() / 2;
    let segments = path.segments.get(..half).filter(|_| half > 0 && path.reversed() == *path)?;
    Some(Path { start: path.start, segments: segments.to_vec() })
}

/// A closed toolpath from its leftmost corner. For one that runs forwards and back also its first half, to
/// use if nothing joins it.
fn round(path: Path) -> (Path, Option<Path>) {
    match along_only(&path) {
        Some(single) => (path, Some(single)),
        None => (path.from_its_left(), None),
    }
}

fn shortest(paths: &[Path], links: &Links<'_>) -> Vec<Link> {
    let segments = Segments::of(paths);
    let mut best: BTreeMap<(u32, u32), Link> = BTreeMap::new();
    for (number, path) in (0..).zip(paths) {
        for place in places(path, links.spacing) {
            for (other, there, mm) in neighbours(&segments, number, place.at, links.reach) {
                let pair = (number.min(other), number.max(other));
                let better = best.get(&pair).is_none_or(|known| mm < known.mm);
                if better && links.allow(place.at, there.at) {
                    best.insert(pair, Link { ends: [(number, place), (other, there)], mm });
                }
            }
        }
    }
    drop(segments);
    let mut found: Vec<((u32, u32), Link)> = best.into_iter().collect();
    found.sort_by(|a, b| a.1.mm.total_cmp(&b.1.mm).then(a.0.cmp(&b.0)));
    found.into_iter().map(|(_, link)| link).collect()
}

/// The nearest places on other toolpaths than `own` within `reach` of a point, one for each toolpath, with their distances in mm.
fn neighbours(segments: &Segments<'_>, own: u32, from: Point, reach: Length) -> Vec<(u32, Place, f64)> {
    let mut near: Vec<(u32, Place, f64)> = Vec::new();
    for (other, segment, start, piece) in segments.meeting(Bounds::of(from).grown(reach)) {
        if other == own {
            continue;
        }
        let share = at_an_end(start, piece, cut::nearest_share(start, piece, from));
        let at = cut::point_on(start, piece, share);
        let found = (other, Place { segment, share, at }, from.distance_mm(at));
        match near.iter_mut().find(|(known, ..)| *known == other) {
            Some(known) if found.2 < known.2 => *known = found,
            Some(_) => {}
            None => near.push(found),
        }
    }
    near.retain(|(.., mm)| *mm <= reach.mm());
    near.sort_by(|a, b| a.2.total_cmp(&b.2).then(a.0.cmp(&b.0)));
    near.truncate(NEIGHBOURS);
    near
}

/// A share of a segment, moved to an end of the segment if splitting there would leave a short piece.
fn at_an_end(from: Point, segment: PathSegment, share: f64) -> f64 {
    let length = cut::length(from, segment);
    match share * length {
        before if before < SHORT_MM && share <= 0.5 => 0.0,
        before if length - before < SHORT_MM => 1.0,
        _ => share,
    }
}

impl Links<'_> {
    pub(super) fn may_join(&self, one_mm: f64, other_mm: f64) -> bool {
        let branches = if one_mm.min(other_mm) <= BRANCH_MM { 2.0 } else { 1.0 };
        one_mm + other_mm <= self.longest_mm * branches
    }

    /// Whether the tool may move straight from one point to another.
    pub(super) fn allow(&self, from: Point, to: Point) -> bool {
        let open = |closed: &Area| {
            !closed.contains(from) && closed.index().edges_in(Bounds::of(from).with(to)).is_empty()
        };
        from.distance_mm(to) <= self.reach.mm() && self.closed.is_none_or(open) && self.is_clear(from, to)
    }

    /// True if a line's distance from the copper stays between the two limits. A point with excess distance
    /// has that much room in every direction, so the next check is that much further along.
    fn is_clear(&self, from: Point, to: Point) -> bool {
        if self.min_distance <= Length::ZERO || self.copper.contains(from) {
            return false;
        }
        let mm = from.distance_mm(to);
        let mut along = 0.0;
        loop {
            let share = if along < mm { along / mm } else { 1.0 };
            let at = cut::point_on(from, PathSegment::Line { to }, share);
            let near = self.copper.index().nearest(at, self.max_distance);
            let excess = near.map(|near| near.distance - self.min_distance);
            let Some(room) = excess.filter(|room| *room > Length::ZERO) else { return false };
            if along >= mm {
                return true;
            }
            along += room.mm().max(LEAST_LOOK_MM);
        }
    }
}

/// The points of a toolpath from which links are searched: its corners, and points between them no farther apart than `spacing`.
fn places(path: &Path, spacing: Length) -> Vec<Place> {
    let mut found = Vec::new();
    for (segment, (from, piece)) in (0..).zip(path.pieces()) {
        let count = (cut::length(from, piece) / spacing.mm().max(SHORT_MM)) as usize + 1;
        found.extend((0..count).map(|look| {
            let share = look as f64 / count as f64;
            Place { segment, share, at: if look == 0 { from } else { cut::point_on(from, piece, share) } }
        }));
    }
    found
}

/// The links that form trees, chosen from the shortest on; skips a link that would make a joined toolpath too long.
fn tree(paths: &[Path], found: Vec<Link>, links: &Links<'_>) -> Vec<Link> {
    let mut leader: Vec<usize> = (0..paths.len()).collect();
    let mut length: Vec<f64> = paths.iter().map(Path::length_mm).collect();
    let mut kept = Vec::new();
    for link in found {
        let [a, b] = link.ends.map(|(path, _)| find_leader(&mut leader, path as usize));
        let [long, other] = [a, b].map(|path| length.get(path).copied().unwrap_or_default());
        if a == b || !links.may_join(long, other) {
            continue;
        }
        if let (Some(own), Some(sum)) = (leader.get_mut(b), length.get_mut(a)) {
            (*own, *sum) = (a, long + other + 2.0 * link.mm);
            kept.push(link);
        }
    }
    kept
}

fn find_leader(leader: &mut [usize], mut path: usize) -> usize {
    while let Some(&next) = leader.get(path).filter(|next| **next != path) {
        let after = leader.get(next).copied().unwrap_or(next);
        if let Some(own) = leader.get_mut(path) {
            *own = after;
        }
        path = next;
    }
    path
}

/// The toolpath through `root` and all toolpaths joined to it; these are taken from `paths`.
fn tour_of(
    root: usize,
    paths: &mut [Path],
    tree: &[Link],
    at_path: &[Vec<usize>],
    done: &mut [bool],
) -> Path {
    let mut out =
        Path { start: paths.get(root).map(|path| path.start).unwrap_or_default(), segments: Vec::new() };
    let own = |path: usize| at_path.get(path).map(Vec::as_slice).unwrap_or_default();
    let mut steps = |path: usize, entry: Option<(usize, Place)>| {
        let ends = own(path).iter().filter(|link| entry.is_none_or(|(came, _)| came != **link));
        let ends = ends.filter_map(|link| Some((*link, end_on(tree.get(*link)?, path)?)));
        let route = paths.get_mut(path).map(std::mem::take)?;
        Some(steps(&route, entry.map(|(_, place)| place), ends.collect()))
    };
    let mut open: Vec<(std::vec::IntoIter<Step>, Point, usize)> = Vec::new();
    open.extend(steps(root, None).map(|steps| (steps.into_iter(), out.start, root)));
    mark(done, root);
    while let Some((mut rest, back, path)) = open.pop() {
        match rest.next() {
            None => line_to(&mut out, back),
            Some(Step::Go(segment)) => {
                out.segments.push(segment);
                open.push((rest, back, path));
            }
            Some(Step::Visit(link)) => {
                open.push((rest, back, path));
                let Some(found) = tree.get(link) else { continue };
                let Some((other, place)) = found.ends.into_iter().find(|(end, _)| *end as usize != path)
                else {
                    continue;
                };
                let other = other as usize;
                let from = out.end();
                mark(done, other);
                if let Some(steps) = steps(other, Some((link, place))) {
                    line_to(&mut out, place.at);
                    open.push((steps.into_iter(), from, other));
                }
            }
        }
    }
    out.segments.shrink_to_fit();
    out
}

fn mark(done: &mut [bool], path: usize) {
    if let Some(done) = done.get_mut(path) {
        *done = true;
    }
}

fn line_to(out: &mut Path, to: Point) {
    if out.end() != to {
        out.segments.push(PathSegment::Line { to });
    }
}

/// The point at which a link meets one of its two toolpaths.
fn end_on(link: &Link, path: usize) -> Option<Place> {
    link.ends.iter().find(|(end, _)| *end as usize == path).map(|(_, place)| *place)
}

fn steps(path: &Path, entry: Option<Place>, mut ends: Vec<(usize, Place)>) -> Vec<Step> {
    ends.sort_by(|a, b| {
        (a.1.segment.cmp(&b.1.segment)).then(a.1.share.total_cmp(&b.1.share)).then(a.0.cmp(&b.0))
    });
    let mut steps = Vec::new();
    let mut first = 0;
    let mut ends = ends.into_iter().peekable();
    for (number, (from, segment)) in (0..).zip(path.pieces()) {
        let mut stops: Vec<(f64, Option<usize>)> = Vec::new();
        while let Some((link, place)) = ends.next_if(|(_, place)| place.segment == number) {
            stops.push((place.share, Some(link)));
        }
        if let Some(entry) = entry.filter(|entry| entry.segment == number) {
            let at = stops.partition_point(|(share, _)| *share < entry.share);
            stops.insert(at, (entry.share, None));
        }
        let shares: Vec<f64> = stops.iter().map(|(share, _)| *share).collect();
        let mut stops = stops.into_iter().peekable();
        for (_, part, begin, end) in cut::parted(from, segment, &shares) {
            // A stop too near to an end of a part belongs to that end.
            while let Some((_, stop)) = stops.next_if(|(share, _)| *share <= (begin + end) / 2.0) {
                match stop {
                    Some(link) => steps.push(Step::Visit(link)),
                    None => first = steps.len(),
                }
            }
            steps.push(Step::Go(part));
        }
        for (_, stop) in stops {
            match stop {
                Some(link) => steps.push(Step::Visit(link)),
                None => first = steps.len(),
            }
        }
    }
    let turn = first.min(steps.len());
    steps.rotate_left(turn);
    steps
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{circle, union};

    #[test]
    fn neighbouring_toolpaths_are_linked_clear_of_copper() {
        let mm = Length::from_mm;
        let round = |x: f64, diameter: f64| circle(Point::from_mm(x, 0.0), mm(diameter));
        let line = |y: f64, to: f64| {
            let line = Path::through(&[Point::from_mm(0.0, y), Point::from_mm(to, y)]);
            along_and_back(line.expect("two places"), 10.0)
        };
        let copper = Area::of(&union(&[round(0.0, 1.0), round(1.2, 1.0)]));
        // The toolpaths, the longest link, the number of toolpaths left, their total length.
        let rings = 2.0 * 1.14 * std::f64::consts::PI;
        let rows = [
            (vec![round(0.0, 1.14), round(1.2, 1.14)], 0.1, 1, rings + 2.0 * 0.06),
            (vec![round(0.0, 1.14), round(1.2, 1.14)], 0.05, 2, rings),
            (vec![round(0.0, 1.14), line(0.65, 1.0)], 0.1, 1, rings / 2.0 + 2.0 + 2.0 * 0.08),
            (vec![round(0.0, 1.14), line(0.65, 12.0)], 0.1, 2, rings / 2.0 + 12.0),
            (vec![round(0.0, 1.14), line(0.0, 0.1)], 0.8, 2, rings / 2.0 + 0.1),
        ];
        for (row, (paths, reach, count, expected)) in rows.into_iter().enumerate() {
            let links = Links {
                reach: mm(reach),
                longest_mm: LONGEST_MM,
                spacing: mm(reach),
                min_distance: mm(0.068),
                max_distance: mm(20.0),
                copper: &copper,
                closed: None,
            };
            let mut backwards = paths.clone();
            backwards.reverse();
            let joined = linked(paths, &links);
            let length: f64 = joined.iter().map(Path::length_mm).sum();
            assert_eq!(joined.len(), count, "row {row}");
            assert!((length - expected).abs() < 0.01, "row {row}: {length} not {expected}");
            assert_eq!(linked(backwards, &links), joined, "row {row}: the order does not matter");
        }
    }
}
