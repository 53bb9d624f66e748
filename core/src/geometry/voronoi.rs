//! Lines midway between islands: cuts along them take the least from each island.
//!
//! ```text
//!    ███   ┊   ███      samples on all edges ─▶ Delaunay ─▶ for each side between two islands the midline,
//!    ███   ┊   ███      moved to equal distance from the true edges ─▶ chains ─▶ inside `within`
//!    ┄┄┄┄┄┄┴┄┄┄┄┄┄
//!      ████████
//! ```
//!
//! Tolerance: within 2 µm of the simplified line, each corner of it within 1 µm of midway. At points where
//! three islands meet, and at bends sharper than the sample spacing (0.01 to 0.1 mm), the samples decide.

use super::index::{Entry, Index, point};
use super::nearest::{Piece, nearest_pair};
use super::overlay::{Spot, apart, spot};
use super::{Bounds, Path, Point, Region};
use crate::units::Length;
use spade::{DelaunayTriangulation, HasPosition, Point2, Triangulation};
use std::collections::BTreeMap;

const WIDEST_NM: f64 = 100_000.0;
const DENSEST_NM: f64 = 10_000.0;
/// Limit of samples, about; with more, the distance increases.
const MOST_SAMPLES: f64 = 300_000.0;
/// Corners nearer than this, in nm, to the line without them are dropped.
const SIMPLE_NM: f64 = 1_500.0;
/// Length of pieces, in nm, in which a line is checked for leaving the area.
const LOOK_NM: f64 = 100_000.0;
const FRAME: u32 = u32::MAX;

#[derive(Clone, Copy, Debug)]
struct Sample {
    at: Spot,
    island: u32,
    edge: usize,
}

impl HasPosition for Sample {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        Point2::new(self.at.0, self.at.1)
    }
}

/// Distance of samples on an edge: half of its distance to the nearest other island.
fn spacing(entry: &Entry, index: &Index, coarsest: f64) -> f64 {
    let room = entry.bounds().grown(Length::from_nm(2 * WIDEST_NM as i64));
    let others = index.entries_in(room).filter(|other| other.edge.island != entry.edge.island);
    let nearest = others.fold(2.0 * WIDEST_NM, |least, other| {
        let (p, q) = nearest_pair(&entry.piece, &other.piece);
        least.min(apart(p, q))
    });
    (nearest / 2.0).clamp(DENSEST_NM.max(coarsest), WIDEST_NM.max(coarsest))
}

/// Samples along one edge, without its end, which belongs to the next edge.
fn sample(entry: &Entry, gap: f64, samples: &mut Vec<Sample>) {
    let path = Path { start: entry.start(), segments: vec![entry.segment()] };
    let corners: Vec<Spot> = path.flattened(5e-4).into_iter().map(spot).collect();
    for (a, b) in corners.iter().zip(corners.iter().skip(1)) {
        let count = libm::ceil(apart(*a, *b) / gap).max(1.0) as u32;
        samples.extend((0..count).map(|step| {
            let share = f64::from(step) / f64::from(count);
            let at = (a.0 + (b.0 - a.0) * share, a.1 + (b.1 - a.1) * share);
            Sample { at: entry.piece.nearest(at), island: entry.edge.island, edge: entry.number() }
        }));
    }
}

/// Points so distant that no line midway to them is near.
fn frame(bounds: Bounds) -> Vec<Sample> {
    let ((left, low), (right, high)) = (spot(bounds.min), spot(bounds.max));
    let far = 3.0 * (right - left + high - low).max(1e6);
    let middle = ((left + right) / 2.0, (low + high) / 2.0);
    let corner =
        |x: f64, y: f64| Sample { at: (middle.0 + x * far, middle.1 + y * far), island: FRAME, edge: 0 };
    vec![corner(-1.0, -1.0), corner(1.0, -1.02), corner(1.03, 1.0), corner(-1.01, 1.04)]
}

struct Node {
    at: Spot,
    edges: Vec<usize>,
}

fn midway(mut at: Spot, one: &[&Piece], two: &[&Piece]) -> Spot {
    let nearest = |at: Spot, pieces: &[&Piece]| {
        pieces.iter().map(|piece| piece.nearest(at)).min_by(|a, b| apart(*a, at).total_cmp(&apart(*b, at)))
    };
    for _ in 0..4 {
        let (Some(p), Some(q)) = (nearest(at, one), nearest(at, two)) else { return at };
        let (to_p, to_q) = (apart(at, p), apart(at, q));
        if to_p < 1.0 || to_q < 1.0 {
            return ((p.0 + q.0) / 2.0, (p.1 + q.1) / 2.0);
        }
        let slope = ((at.0 - p.0) / to_p - (at.0 - q.0) / to_q, (at.1 - p.1) / to_p - (at.1 - q.1) / to_q);
        let steep = slope.0 * slope.0 + slope.1 * slope.1;
        if steep < 0.05 {
            return at;
        }
        let by = (to_p - to_q) / steep;
        at = (at.0 - slope.0 * by, at.1 - slope.1 * by);
    }
    at
}

/// An edge and its neighbours: one of them has the true nearest point.
fn pieces_about<'a>(entries: &'a [Entry], sample: &Sample) -> Vec<&'a Piece> {
    let from = sample.edge.saturating_sub(1);
    let about = entries.get(from..).unwrap_or_default().iter().take(3);
    about.filter(|entry| entry.edge.island == sample.island).map(|entry| &entry.piece).collect()
}

/// The net of lines midway between islands.
fn net(samples: Vec<Sample>, entries: &[Entry]) -> Vec<Node> {
    let Ok(mesh) = DelaunayTriangulation::<Sample>::bulk_load(samples) else { return Vec::new() };
    let mut numbers: BTreeMap<usize, usize> = BTreeMap::new();
    let mut nodes: Vec<Node> = Vec::new();
    let mut links: Vec<[usize; 2]> = Vec::new();
    for side in mesh.undirected_edges() {
        let [a, b] = side.vertices().map(|vertex| *vertex.data());
        if a.island == b.island || a.island == FRAME || b.island == FRAME {
            continue;
        }
        let side = side.as_directed();
        let faces = [side.face().as_inner(), side.rev().face().as_inner()];
        let [Some(left), Some(right)] = faces else { continue };
        let ends = [left, right].map(|face| {
            *numbers.entry(face.fix().index()).or_insert_with(|| {
                let centre = face.circumcenter();
                let corners = face.vertices().map(|vertex| *vertex.data());
                let others = corners.iter().filter(|corner| corner.island != a.island);
                let simple = others.clone().all(|corner| corner.island == b.island);
                let rough = (centre.x, centre.y);
                let at = if simple {
                    midway(rough, &pieces_about(entries, &a), &pieces_about(entries, &b))
                } else {
                    rough
                };
                nodes.push(Node { at, edges: Vec::new() });
                nodes.len() - 1
            })
        });
        links.push(ends);
    }
    for [one, two] in links {
        if let Some(node) = nodes.get_mut(one) {
            node.edges.push(two);
        }
        if let Some(node) = nodes.get_mut(two) {
            node.edges.push(one);
        }
    }
    nodes
}

/// The net split into rings, and chains between forks and ends.
fn chains(mut nodes: Vec<Node>) -> Vec<Vec<Spot>> {
    let forks: Vec<usize> =
        (0..nodes.len()).filter(|&at| nodes.get(at).is_some_and(|n| n.edges.len() != 2)).collect();
    let mut chains = Vec::new();
    for start in forks.into_iter().chain(0..nodes.len()) {
        while let Some(first) = nodes.get_mut(start).and_then(|node| node.edges.pop()) {
            let mut chain = vec![start];
            let (mut last, mut at) = (start, first);
            loop {
                chain.push(at);
                let Some(node) = nodes.get_mut(at) else { break };
                let fork = node.edges.len() != 2;
                if let Some(back) = node.edges.iter().position(|&way| way == last) {
                    node.edges.remove(back);
                }
                if fork || at == start {
                    break;
                }
                let Some(next) = node.edges.pop() else { break };
                (last, at) = (at, next);
            }
            chains.push(chain.iter().filter_map(|&at| nodes.get(at)).map(|node| node.at).collect());
        }
    }
    chains
}

/// The parts of a chain in the area.
fn inside(chain: &[Spot], area: &Index) -> Vec<Vec<Spot>> {
    let is_in = |at: Spot| area.island_at(point(at)).is_some();
    let between = |a: Spot, b: Spot, share: f64| (a.0 + (b.0 - a.0) * share, a.1 + (b.1 - a.1) * share);
    let mut parts: Vec<Vec<Spot>> = vec![Vec::new()];
    let mut add = |at: Spot, fresh: bool| {
        if fresh {
            parts.push(Vec::new());
        }
        if let Some(part) = parts.last_mut() {
            part.push(at);
        }
    };
    let Some(&start) = chain.first() else { return Vec::new() };
    let mut was_in = is_in(start);
    if was_in {
        add(start, false);
    }
    for (&a, &b) in chain.iter().zip(chain.iter().skip(1)) {
        let looks = libm::ceil(apart(a, b) / LOOK_NM).clamp(1.0, 10_000.0) as u32;
        for look in 0..looks {
            let part = |look: u32| between(a, b, f64::from(look) / f64::from(looks));
            let (from, to) = (part(look), part(look + 1));
            let now_in = is_in(to);
            if was_in != now_in {
                let (mut low, mut high) = (0.0, 1.0);
                for _ in 0..24 {
                    let middle = (low + high) / 2.0;
                    if is_in(between(from, to, middle)) == was_in { low = middle } else { high = middle }
                }
                add(between(from, to, if was_in { low } else { high }), !was_in);
            }
            if now_in {
                add(to, false);
            }
            was_in = now_in;
        }
    }
    parts.retain(|part| part.len() > 1);
    parts
}

/// Drops corners that are nearly on the line of the others.
fn simplified(chain: &[Spot]) -> Vec<Spot> {
    let Some((&first, &last)) = chain.first().zip(chain.last()) else { return Vec::new() };
    let mut keep = vec![false; chain.len()];
    let mut work = vec![(0, chain.len() - 1)];
    // A ring has no line from end to end, so halve it first.
    if first == last && chain.len() > 3 {
        let middle = chain.len() / 2;
        work = vec![(0, middle), (middle, chain.len() - 1)];
    }
    while let Some((from, to)) = work.pop() {
        let (Some(&a), Some(&b)) = (chain.get(from), chain.get(to)) else { continue };
        for end in [from, to] {
            if let Some(slot) = keep.get_mut(end) {
                *slot = true;
            }
        }
        let line = Piece { from: a, to: b, bow: None };
        let inner = chain.iter().enumerate().take(to).skip(from + 1);
        let off = inner.map(|(at, &corner)| (apart(line.nearest(corner), corner), at));
        let worst = off.max_by(|one, two| one.0.total_cmp(&two.0));
        if let Some((off, at)) = worst
            && off > SIMPLE_NM
        {
            work.extend([(from, at), (at, to)]);
        }
    }
    chain.iter().zip(keep).filter(|(_, keep)| *keep).map(|(at, _)| *at).collect()
}

/// The lines midway between different islands of `region`, clipped to `within`, in canonical order.
pub fn voronoi(region: &Region, within: &Region) -> Vec<Path> {
    let (Some(bounds), Some(area)) = (region.bounds(), within.bounds()) else { return Vec::new() };
    let index = Index::of(region);
    let length: f64 = region.paths().map(Path::length_mm).sum();
    let coarsest = length * 1e6 / MOST_SAMPLES;
    let mut samples = frame(bounds.with(area.min).with(area.max));
    for entry in index.entries() {
        sample(entry, spacing(entry, &index, coarsest), &mut samples);
    }
    let area = Index::of(within);
    let chains = chains(net(samples, index.entries()));
    let parts = chains.iter().flat_map(|chain| inside(chain, &area));
    let path = |part: Vec<Spot>| {
        let corners: Vec<Point> = simplified(&part).into_iter().map(point).collect();
        let mut path = Path::through(&corners)?;
        let mut at = path.start;
        path.segments.retain(|segment| {
            let moves = segment.to() != at;
            at = segment.to();
            moves
        });
        (!path.segments.is_empty()).then(|| path.from_its_left())
    };
    let mut paths: Vec<Path> = parts.filter_map(path).collect();
    paths.iter_mut().filter(|path| path.end() < path.start).for_each(|path| *path = path.reversed());
    paths.sort();
    paths
}

#[cfg(test)]
mod tests {
    use super::super::{circle, rectangle, union};
    use super::*;

    fn at(x: f64, y: f64) -> Point {
        Point::from_mm(x, y)
    }

    fn mm(value: f64) -> Length {
        Length::from_mm(value)
    }

    #[test]
    fn voronoi_lines_run_midway() {
        let pads = [(0.0, 0.0), (4.0, 0.0), (0.0, 4.0), (4.0, 4.0)].map(|(x, y)| circle(at(x, y), mm(2.0)));
        let region = union(&pads);
        let within = union(&[rectangle(Bounds { min: at(-2.0, -2.0), max: at(6.0, 6.0) })]);
        let lines = voronoi(&region, &within);
        let length: f64 = lines.iter().map(Path::length_mm).sum();
        assert!((length - 16.0).abs() < 0.02, "{length} {lines:?}");
        for corner in lines.iter().flat_map(Path::corners) {
            let off = (corner.x - mm(2.0)).abs().min((corner.y - mm(2.0)).abs());
            assert!(off <= Length::from_um(1), "{corner:?}");
        }
        assert!(voronoi(&union(&pads[..1]), &within).is_empty());
    }

    #[test]
    fn pad_in_a_ring_gets_a_ring() {
        let mut region =
            super::super::even_odd(&[circle(at(0.0, 0.0), mm(6.0)), circle(at(0.0, 0.0), mm(4.0))]);
        region.islands.extend(union(&[circle(at(0.0, 0.0), mm(2.0))]).islands);
        let lines = voronoi(&region, &union(&[circle(at(0.0, 0.0), mm(5.0))]));
        assert_eq!(lines.len(), 1);
        assert!(lines[0].is_closed());
        for corner in lines[0].corners() {
            assert!((corner.distance_mm(at(0.0, 0.0)) - 1.5).abs() < 1e-3, "{corner:?}");
        }
        assert!(lines[0].segments.len() < 200, "{}", lines[0].segments.len());
    }
}
