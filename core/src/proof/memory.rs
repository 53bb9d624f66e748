//! Estimates the memory to plan and prove a board, before starting.
//!
//! ```text
//!   edges of the copper, edges of what the tools sweep ─▶ bytes ─▶ above the limit: refused with a message
//! ```
//!
//! Computed, not measured: equal on all machines, except for the limit.

use crate::board::Board;
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::geometry::{Path, PathSegment, Point, chords};
use crate::job::{Command, Program};
use crate::units::Length;

/// Limit for planning and proving, in bytes: a page has 4 GB for everything.
pub const MOST_BYTES: u64 = if usize::BITS == 32 { 1_500_000_000 } else { 4_000_000_000 };

const CHORD_ERROR_MM: f64 = 0.001;
/// Bytes for each straight edge of the copper, including default toolpaths and their result: 132 measured with
/// 100,000 pads, and a third more.
const BYTES_PER_COPPER_EDGE: u64 = 175;
/// Bytes for each straight edge of a toolpath: its two sides, and the result.
const BYTES_PER_CUT_EDGE: u64 = 67;

/// Error if `board` with its `programs` (default ones if there are none) is too large.
pub fn too_large(board: &Board, programs: &[Program]) -> Option<Diagnostic> {
    too_large_for(board, programs, MOST_BYTES)
}

fn too_large_for(board: &Board, programs: &[Program], most: u64) -> Option<Diagnostic> {
    let needed = bytes(board, programs);
    let gigabytes = |bytes: u64| format!("{:.1}", bytes as f64 / 1e9);
    let told = || error!("proof.too_large", needed = gigabytes(needed), most = gigabytes(most));
    (needed > most).then(told)
}

/// Estimated bytes: the larger of the estimates from the copper and from the programs.
fn bytes(board: &Board, programs: &[Program]) -> u64 {
    let sides = board.copper.iter().map(|copper| copper.region.paths().map(edges).sum::<u64>());
    let copper = sides.max().unwrap_or_default() * BYTES_PER_COPPER_EDGE;
    let cut: u64 = programs.iter().map(cut_edges).sum();
    copper.max(cut * BYTES_PER_CUT_EDGE)
}

fn edges(path: &Path) -> u64 {
    path.pieces().map(|(from, segment)| edges_of(from, segment)).sum()
}

/// Number of straight edges that a segment becomes.
fn edges_of(from: Point, segment: PathSegment) -> u64 {
    let PathSegment::Arc { to, centre, clockwise } = segment else { return 1 };
    let radius = from.distance_mm(centre).max(CHORD_ERROR_MM);
    let step = 2.0 * libm::acos((1.0 - CHORD_ERROR_MM / radius).clamp(-1.0, 1.0));
    libm::ceil(chords::turn(from, to, centre, clockwise) / step.max(1e-3)) as u64
}

fn cut_edges(program: &Program) -> u64 {
    let (mut at, mut height, mut sum) = (Point::default(), program.safe_height, 0);
    for command in program.legs.iter().flat_map(|leg| &leg.commands) {
        let (to, next) = match *command {
            Command::Rapid { to } => (to, height),
            Command::Plunge { to, .. } | Command::Retract { to } => (at, to),
            Command::Mill { to, height, .. } | Command::MillArc { to, height, .. } => (to, height),
            _ => continue,
        };
        let segment = match *command {
            Command::MillArc { center, ccw, .. } => PathSegment::Arc { to, centre: center, clockwise: !ccw },
            _ => PathSegment::Line { to },
        };
        if height.min(next) < Length::ZERO {
            sum += edges_of(at, segment);
        }
        (at, height) = (to, next);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::{Copper, Face};
    use crate::geometry::{Island, Region, circle};

    #[test]
    fn board_too_large_is_refused_by_its_edges() {
        let pad = |number: i32| {
            let outer = circle(Point::from_mm(f64::from(number), 0.0), Length::from_mm(0.8));
            Island { outer, holes: Vec::new() }
        };
        let board = |pads: i32| {
            let region = Region { islands: (0..pads).map(pad).collect() };
            Board {
                copper: vec![Copper { face: Face::Top, region, ..Copper::default() }],
                ..Board::default()
            }
        };
        let one = bytes(&board(1), &[]);
        assert!((2_500..25_000).contains(&one), "{one}");
        assert_eq!(bytes(&board(100), &[]), 100 * one);
        assert_eq!(too_large_for(&board(100), &[], 100 * one), None);
        let told = too_large_for(&board(101), &[], 100 * one).unwrap();
        assert_eq!(told.code, "proof.too_large");
        assert!(told.message("en").contains("GB"), "{}", told.message("en"));
    }
}
