//! Clearing removes all copper that its tools reach, at any stepover, and nothing of the design.

use super::*;
use crate::geometry::{CombineRule, area_mm2, combine, island_area_mm2};

/// A job that clears `board` with a mill of 0.8 mm, and perhaps one of 0.2 mm.
fn clearing(board: &Board, stepover_percent: f64, further: &[&str]) -> Work {
    let mut work = only(board, "clear", |operation| {
        operation.bit = "m".to_owned();
        if let OperationKind::Clear(clear) = &mut operation.action {
            clear.stepover_percent = stepover_percent;
            clear.further = further.iter().map(|name| (*name).to_owned()).collect();
        }
    });
    work.bits.extend([mill("m", 0.8), mill("thin", 0.2)]);
    work
}

/// Islands with rings that end on ridges, islands near the edge of the board, a notch that only a narrow tool
/// enters.
fn picture() -> Board {
    let copper = [
        boxed(2.0, 2.0, 5.0, 4.0),
        circle(at(9.0, 4.6), mm(2.0)),
        boxed(6.3, 8.0, 13.0, 9.4),
        boxed(0.15, 6.0, 1.2, 8.0),
        boxed(14.0, 1.0, 15.0, 5.0),
        boxed(15.5, 1.0, 16.5, 5.0),
    ];
    Board { outline: union(&[boxed(0.0, 0.0, 18.13, 11.71)]), ..with_copper(&copper) }
}

/// Uncleared area of the board outside the design that a tool of `width` can reach. The tool's centre may be
/// up to 1 mm outside the board.
fn reachable_left(board: &Board, planned: &Planned, width: f64) -> f64 {
    let mut left = board.outline.clone();
    for task in planned.parts.iter().flat_map(|part| &part.tasks) {
        let toolpaths: Vec<Path> = task.toolpaths.iter().map(|way| way.path.clone()).collect();
        left = combine(&left, &sweep(&toolpaths, task.bit.diameter), CombineRule::Difference);
    }
    let too_near = grow(&board.copper[0].region, mm(width / 2.0 + 0.002));
    let open = combine(&grow(&board.outline, mm(1.0)), &too_near, CombineRule::Difference);
    let reached = combine(&left, &grow(&open, mm(width / 2.0 - 0.003)), CombineRule::Intersection);
    reached.islands.iter().map(island_area_mm2).filter(|area| *area > 2e-4).sum()
}

#[test]
fn clearing_reaches_everything_at_every_stepover() {
    let board = picture();
    for stepover in [30.0, 50.0, 60.0, 75.0, 90.0, 100.0] {
        let work = clearing(&board, stepover, &[]);
        let (planned, _) = planned(&board, &work);
        assert!(least_clearance(&planned, &work) > -0.0025, "{stepover} %");
        let left = reachable_left(&board, &planned, 0.8);
        assert!(left < 1e-9, "{left} mm² are left at {stepover} %");
    }
}

#[test]
fn further_tool_clears_only_what_the_previous_one_left() {
    let board = picture();
    let work = clearing(&board, 30.0, &["thin"]);
    let (planned, _) = planned(&board, &work);
    assert!(least_clearance(&planned, &work) > -0.0025);
    let left = reachable_left(&board, &planned, 0.2);
    assert!(left < 1e-9, "{left} mm² are left");
    let length = |task: &BitTask| task.toolpaths.iter().map(|way| way.path.length_mm()).sum::<f64>();
    let [wide, thin] = planned.parts[0].tasks.as_slice() else { panic!("two bits") };
    // The notch of 0.5 × 4 mm is five toolpaths wide.
    assert!(length(thin) > 20.0 && length(thin) < length(wide) / 4.0, "{} mm", length(thin));
    assert!(area_mm2(&board.outline) > 200.0);
}
