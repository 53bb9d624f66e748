//! Slivers between grooves: too thin ones are removed, wider strips stay, and no copper of a net is touched.

use super::*;
use crate::geometry::{CombineRule, area_mm2, combine};

/// Two pads 5 mm long on a board, `near` apart at their lower ends and `far` at their upper ends.
fn facing(near: f64, far: f64) -> Board {
    let corners = [at(2.0 + near, 0.0), at(4.5, 0.0), at(4.5, 5.0), at(2.0 + far, 5.0), at(2.0 + near, 0.0)];
    let slanted = Path::through(&corners).unwrap();
    with_copper(&[boxed(0.0, 0.0, 2.0, 5.0), slanted])
}

/// Area left between the two pads, in mm², and length of the toolpaths in mm.
fn left(board: &Board, passes: u32, slivers: bool) -> (f64, f64) {
    let work = isolation(board, 0.2, |isolate| (isolate.passes, isolate.slivers) = (passes, slivers));
    let (planned, _) = planned(board, &work);
    assert!(least_clearance(&planned, &work) > -0.0025);
    let toolpaths: Vec<Path> = planned.toolpaths().map(|way| way.path.clone()).collect();
    let between = union(&[boxed(2.05, 0.2, 2.6, 4.8)]);
    let bare = combine(&between, &sweep(&toolpaths, mm(0.2)), CombineRule::Difference);
    (area_mm2(&combine(&bare, &board.copper[0].region, CombineRule::Difference)), planned.toolpaths_mm())
}

#[test]
fn sliver_between_two_grooves_is_cut_if_thin() {
    // The gap at both ends; number of passes; remaining area of the strip of 4.6 mm, in mm².
    let rows = [
        (0.43, 0.43, 1, 0.0),
        (0.5, 0.5, 1, 0.1 * 4.6),
        (0.43, 0.43, 2, 0.0),
        // From 0 at 0 mm to 0.2 mm at 5 mm: thin up to 1.3 mm.
        (0.4, 0.6, 1, 0.428),
    ];
    for (near, far, passes, stays) in rows {
        let board = facing(near, far);
        let (area, with) = left(&board, passes, true);
        assert!((area - stays).abs() < 0.015, "{near} {far} {passes}: {area} mm² stay");
        let (before, without) = left(&board, passes, false);
        assert!(before > stays + 0.01 || with - without < 1e-6, "{near} {far}: {before} mm² before");
        // The tool runs along the strip and back: faster than a retract.
        assert!(with - without < 11.0, "{near} {far}: {with} mm instead of {without} mm");
    }
}

#[test]
fn short_sliver_is_a_detour_and_no_extra_toolpath() {
    let board = with_copper(&[circle(at(5.0, 5.0), mm(3.0)), circle(at(8.43, 5.0), mm(3.0))]);
    let toolpaths = |slivers| {
        let work = isolation(&board, 0.2, |isolate| (isolate.passes, isolate.slivers) = (1, slivers));
        let (planned, _) = planned(&board, &work);
        assert!(least_clearance(&planned, &work) > -0.0025);
        (planned.toolpaths().count(), planned.toolpaths_mm())
    };
    let ((plain, short), (cleaned, long)) = (toolpaths(false), toolpaths(true));
    // A link or the toolpath along the sliver joins both rings.
    assert_eq!((plain, cleaned), (1, 1));
    assert!(long - short > 0.3 && long - short < 2.0, "{short} mm, then {long} mm");
}

#[test]
fn v_grooves_leave_nothing_between_passes() {
    // 0.143 mm wide at the surface and 0.124 mm at the underside of the copper: passes that touch above do
    // not below.
    let board = with_copper(&[circle(at(5.0, 5.0), mm(3.0))]);
    let work = only(&board, "isolate", |operation| {
        if let OperationKind::Isolate(isolate) = &mut operation.action {
            (isolate.passes, isolate.overlap_percent) = (3, 0.0);
        }
    });
    let (planned, _) = planned(&board, &work);
    let toolpaths: Vec<Path> = planned.toolpaths().map(|way| way.path.clone()).collect();
    let below = planned.parts[0].tasks[0].bit.width_at(work.operations[0].depth - mm(0.035));
    let cut = sweep(&toolpaths, below);
    assert_eq!(cut.islands.len(), 1);
    assert_eq!(cut.islands[0].holes.len(), 1, "one ring without gaps");
}
