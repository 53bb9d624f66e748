//! The faces that the edges of a net enclose, and the edges that enclose nothing.
//!
//! ```text
//!       ┌─────┬─────┐
//!       │  1  │  2  │───      two faces share an edge; the line on the right encloses nothing
//!       └─────┴─────┘
//! ```

use super::split::{Net, heading, reach_mm};
use crate::geometry::{Path, PathSegment, Point, path_area_mm2};

const LEAST_AREA_MM2: f64 = 1e-6;

/// Cells connected by their edges.
#[derive(Clone, Debug, Default)]
pub(super) struct Piece {
    /// Enclosed areas, each counter-clockwise; neighbours share edges.
    pub(super) cells: Vec<Path>,
    /// The outer edge of all cells, clockwise.
    pub(super) rim: Path,
}

#[derive(Debug, Default)]
pub(super) struct Faces {
    pub(super) pieces: Vec<Piece>,
    /// Numbers of the edges with a cell on both sides.
    pub(super) shared: Vec<usize>,
    /// Numbers of the edges that enclose nothing.
    pub(super) loose: Vec<usize>,
}

/// A direction along an edge: twice its number, plus one for the reverse.
type Half = usize;

/// The faces of `net` without the edges in `drop`.
pub(super) fn faces(net: &Net, drop: &[usize]) -> Faces {
    let mut used = vec![true; net.edges.len()];
    for &edge in drop {
        if let Some(flag) = used.get_mut(edge) {
            *flag = false;
        }
    }
    // An edge with the same face on both sides is a bridge or a dead end.
    let cycles = cycles(net, &used);
    let sides = sides(&cycles, net.edges.len());
    let mut loose = Vec::new();
    for (edge, [left, right]) in sides.iter().enumerate() {
        if left == right && used.get(edge).is_some_and(|&used| used) {
            loose.push(edge);
        }
    }
    for &edge in &loose {
        if let Some(flag) = used.get_mut(edge) {
            *flag = false;
        }
    }
    gather(net, &used, loose)
}

/// The pieces of the used edges, after dead ends were removed.
fn gather(net: &Net, used: &[bool], loose: Vec<usize>) -> Faces {
    let cycles = cycles(net, used);
    let roots = roots(net, used);
    let mut pieces: Vec<(usize, Piece)> = Vec::new();
    let mut is_cell = Vec::with_capacity(cycles.len());
    for cycle in &cycles {
        let path = path(net, cycle);
        let area = path_area_mm2(&path);
        is_cell.push(area > 0.0);
        let node = cycle.first().and_then(|&half| net.edges.get(half / 2)).map_or(0, |edge| edge.a);
        let root = roots.get(node).copied().unwrap_or(node);
        let at = pieces.iter().position(|(other, _)| *other == root).unwrap_or_else(|| {
            pieces.push((root, Piece::default()));
            pieces.len() - 1
        });
        let Some((_, piece)) = pieces.get_mut(at) else { continue };
        if area > LEAST_AREA_MM2 {
            piece.cells.push(path);
        } else if area < 0.0 {
            piece.rim = path;
        }
    }
    let both = |[left, right]: &[Option<usize>; 2]| {
        let cell = |face: &Option<usize>| face.is_some_and(|face| is_cell.get(face) == Some(&true));
        cell(left) && cell(right)
    };
    let sides = sides(&cycles, net.edges.len());
    let shared = sides.iter().enumerate().filter(|(_, faces)| both(faces)).map(|(edge, _)| edge).collect();
    let pieces = pieces.into_iter().map(|(_, piece)| piece);
    Faces { pieces: pieces.filter(|piece| !piece.cells.is_empty()).collect(), shared, loose }
}

/// The cycle along each edge, forwards and backwards.
fn sides(cycles: &[Vec<Half>], edges: usize) -> Vec<[Option<usize>; 2]> {
    let mut sides = vec![[None; 2]; edges];
    for (cycle, halves) in cycles.iter().enumerate() {
        for half in halves {
            if let Some(side) = sides.get_mut(half / 2).and_then(|sides| sides.get_mut(half % 2)) {
                *side = Some(cycle);
            }
        }
    }
    sides
}

/// A number for each node, equal if edges connect them.
fn roots(net: &Net, used: &[bool]) -> Vec<usize> {
    let mut roots: Vec<usize> = (0..net.nodes.len()).collect();
    let root = |roots: &mut Vec<usize>, mut node: usize| {
        while let Some(&up) = roots.get(node).filter(|&&up| up != node) {
            let next = roots.get(up).copied().unwrap_or(up);
            if let Some(own) = roots.get_mut(node) {
                *own = next;
            }
            node = next;
        }
        node
    };
    for edge in net.edges.iter().zip(used).filter(|(_, used)| **used).map(|(edge, _)| edge) {
        let (a, b) = (root(&mut roots, edge.a), root(&mut roots, edge.b));
        if let Some(own) = roots.get_mut(a.max(b)) {
            *own = a.min(b);
        }
    }
    (0..roots.len()).map(|node| root(&mut roots, node)).collect()
}

/// All cycles, each with its face on the left.
fn cycles(net: &Net, used: &[bool]) -> Vec<Vec<Half>> {
    let turns = turns(net, used);
    let mut seen = vec![false; 2 * net.edges.len()];
    let mut cycles = Vec::new();
    for start in 0..seen.len() {
        if !used.get(start / 2).is_some_and(|&used| used) {
            continue;
        }
        let (mut cycle, mut half) = (Vec::new(), start);
        while let Some(flag) = seen.get_mut(half).filter(|flag| !**flag) {
            *flag = true;
            cycle.push(half);
            half = turns.get(half).copied().unwrap_or(start);
        }
        if !cycle.is_empty() {
            cycles.push(cycle);
        }
    }
    cycles
}

/// For each half edge the one that continues it with the sharpest left turn.
fn turns(net: &Net, used: &[bool]) -> Vec<Half> {
    let mut leaving: Vec<Vec<Half>> = vec![Vec::new(); net.nodes.len()];
    for (index, edge) in net.edges.iter().enumerate().filter(|(index, _)| used.get(*index) == Some(&true)) {
        for (node, half) in [(edge.a, 2 * index), (edge.b, 2 * index + 1)] {
            if let Some(row) = leaving.get_mut(node) {
                row.push(half);
            }
        }
    }
    let mut turns = vec![0; 2 * net.edges.len()];
    for mut halves in leaving {
        let away = |half: &Half| way(net, *half);
        let reach = halves.iter().filter_map(away).map(|(from, segment)| reach_mm(from, segment));
        let near = 0.5 * reach.fold(f64::INFINITY, f64::min);
        let angle = |half: &Half| away(half).map_or(0.0, |(from, segment)| heading(from, segment, near));
        halves.sort_by(|a, b| angle(a).total_cmp(&angle(b)).then(a.cmp(b)));
        // After arriving against a half edge, leave by its clockwise neighbour.
        let before = halves.last().into_iter().chain(&halves);
        for (half, next) in halves.iter().zip(before) {
            if let Some(turn) = turns.get_mut(half ^ 1) {
                *turn = *next;
            }
        }
    }
    turns
}

pub(super) fn way(net: &Net, half: Half) -> Option<(Point, PathSegment)> {
    let edge = net.edges.get(half / 2)?;
    if half.is_multiple_of(2) {
        return Some((edge.from, edge.segment));
    }
    let back = match edge.segment {
        PathSegment::Line { .. } => PathSegment::Line { to: edge.from },
        PathSegment::Arc { centre, clockwise, .. } => {
            PathSegment::Arc { to: edge.from, centre, clockwise: !clockwise }
        }
    };
    Some((edge.segment.to(), back))
}

/// A cycle as a closed path; parts of one stroke are joined again.
fn path(net: &Net, cycle: &[Half]) -> Path {
    let stroke = |half: &Half| net.edges.get(half / 2).map(|edge| (edge.stroke, half % 2));
    let fresh = |at: usize| {
        let before = if at == 0 { cycle.last() } else { cycle.get(at - 1) };
        before.and_then(&stroke) != cycle.get(at).and_then(&stroke)
    };
    let begin = (0..cycle.len()).filter(|&at| fresh(at)).min_by_key(|&at| cycle.get(at).map(&stroke));
    let begin = begin.unwrap_or(0);
    let halves = cycle.iter().cycle().skip(begin).take(cycle.len()).copied();
    let mut path = Path::default();
    let mut last = None;
    for half in halves {
        let Some((from, segment)) = way(net, half) else { continue };
        let own = stroke(&half);
        let tail = net.edges.get(half / 2).map_or(0, |edge| if half % 2 == 0 { edge.a } else { edge.b });
        let head = net.edges.get(half / 2).map_or(0, |edge| if half % 2 == 0 { edge.b } else { edge.a });
        let node = |node: usize, else_at: Point| net.nodes.get(node).copied().unwrap_or(else_at);
        let is_line = matches!(segment, PathSegment::Line { .. });
        if path.segments.is_empty() {
            path.start = if is_line { node(tail, from) } else { from };
        }
        let segment = if is_line { PathSegment::Line { to: node(head, segment.to()) } } else { segment };
        match path.segments.last_mut().filter(|_| last == own) {
            Some(before) => *before = longer(*before, segment.to()),
            None => {
                if !is_line && path.end() != from {
                    path.segments.push(PathSegment::Line { to: from });
                }
                path.segments.push(segment);
            }
        }
        last = own;
    }
    if path.end() != path.start {
        path.segments.push(PathSegment::Line { to: path.start });
    }
    path
}

fn longer(segment: PathSegment, to: Point) -> PathSegment {
    match segment {
        PathSegment::Line { .. } => PathSegment::Line { to },
        PathSegment::Arc { centre, clockwise, .. } => PathSegment::Arc { to, centre, clockwise },
    }
}
