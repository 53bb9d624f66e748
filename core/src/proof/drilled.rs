//! The holes that programs make, against those of the board: which are missing, made twice, beside their place (N8 N9).
//!
//! ```text
//!    ◯ board    ● program      ◉ made      ◯  missing      ◉● twice      ◯ ● shifted: one beside its place, and none on it
//! ```
//!
//! Comes in: boards as they lie, each with its programs; their holes in the same order. Goes out: counts and places. What no hole
//! of the board asks for (pins, mouse-bites) is nobody's fault. Does not look at copper.

use super::replay::replay;
use crate::board::{Board, COPPER_THICKNESS};
use crate::geometry::{Bounds, Point};
use crate::job::{Mark, Program};
use crate::units::Length;
use std::collections::BTreeMap;

/// A hole is made where one is drilled as near as this to its place, in mm.
const NEAR_MM: f64 = 0.05;
/// A hole made as near as this to a place where none is made is meant for it, in mm; or as near as the hole is wide.
const BESIDE_MM: f64 = 0.6;

/// What became of the holes of a board.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drilled {
    /// Holes that nothing makes; none where the programs make no hole at all.
    pub missing: Vec<Point>,
    /// Holes that are made more than once with a tool of one size.
    pub doubled: Vec<Point>,
    /// Holes that are made beside their place.
    pub shifted: Vec<Point>,
}

/// A hole that a program makes: where, and how wide its tool is, in nm.
type Made = (Point, i64);

/// Compares the holes of boards with those that their programs make.
pub fn drilled(sides: &[(&Board, &[Program])]) -> Drilled {
    let mut out = Drilled::default();
    let Some((first, _)) = sides.first() else { return out };
    let mut made: Vec<Vec<Made>> = sides.iter().map(|(_, programs)| holes_of(programs)).collect();
    if made.iter().all(Vec::is_empty) {
        return out;
    }
    let wanted: Vec<usize> = (0..first.holes.len()).filter(|hole| is_wanted(first, *hole)).collect();
    let mut open = Vec::new();
    for &hole in &wanted {
        let mut tools: BTreeMap<i64, u32> = BTreeMap::new();
        for ((board, _), made) in sides.iter().zip(&mut made) {
            let Some(at) = board.holes.get(hole).map(|hole| hole.at) else { continue };
            made.retain(|(place, tool)| {
                let here = place.distance_mm(at) <= NEAR_MM;
                if here {
                    *tools.entry(*tool).or_default() += 1;
                }
                !here
            });
        }
        let at = first.holes.get(hole).map(|hole| hole.at).unwrap_or_default();
        if tools.is_empty() {
            open.push((hole, at));
        } else if tools.values().any(|count| *count > 1) {
            out.doubled.push(at);
        }
    }
    for (hole, at) in open {
        let beside = sides.iter().zip(&mut made).any(|((board, _), made)| take_beside(board, hole, made));
        if beside { out.shifted.push(at) } else { out.missing.push(at) }
    }
    out
}

/// Whether a hole has a size, and is the first one of its place and size: files tell some twice.
fn is_wanted(board: &Board, hole: usize) -> bool {
    let Some(own) = board.holes.get(hole) else { return false };
    let same = |other: &&crate::board::Hole| {
        other.diameter == own.diameter && other.at.distance_mm(own.at) <= NEAR_MM
    };
    own.diameter.is_some() && !board.holes.iter().take(hole).any(|other| same(&other))
}

/// Takes the nearest of the holes made beside the place of a hole, if there is one.
fn take_beside(board: &Board, hole: usize, made: &mut Vec<Made>) -> bool {
    let Some(hole) = board.holes.get(hole) else { return false };
    let reach = hole.diameter.map_or(0.0, Length::mm).max(BESIDE_MM);
    let distances = made.iter().map(|(place, _)| place.distance_mm(hole.at)).enumerate();
    let nearest = distances.min_by(|a, b| a.1.total_cmp(&b.1));
    let Some((index, _)) = nearest.filter(|(_, distance)| *distance <= reach) else { return false };
    made.swap_remove(index);
    true
}

/// Every hole that programs make, once for each leg that makes it.
fn holes_of(programs: &[Program]) -> Vec<Made> {
    let mut made = Vec::new();
    for (index, program) in (0..).zip(programs) {
        let mut legs: BTreeMap<u32, (Bounds, i64)> = BTreeMap::new();
        for cut in replay(program, index, COPPER_THICKNESS).cuts {
            if !matches!(cut.mark, Mark::Hole(_)) || cut.through.is_none() {
                continue;
            }
            for at in cut.path.flattened(0.01) {
                let (bounds, _) = legs.entry(cut.leg).or_insert((Bounds::of(at), cut.surface.nm()));
                *bounds = bounds.with(at);
            }
        }
        let middle = |bounds: &Bounds| {
            let half = |low: Length, high: Length| Length::from_nm((low.nm() + high.nm()) / 2);
            Point::new(half(bounds.min.x, bounds.max.x), half(bounds.min.y, bounds.max.y))
        };
        made.extend(legs.values().map(|(bounds, tool)| (middle(bounds), *tool)));
    }
    made
}
