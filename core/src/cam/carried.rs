//! Transfers a job to a new export of its board: its positions move with the board.
//!
//! ```text
//!   old job ─ old placement ▶ in the old files ─ shift ▶ in the new files ─ new placement ▶ new job
//! ```

use super::work::{Flip, Work};
use crate::board::{Board, Face};
use crate::geometry::{Bounds, Placement, Point};

/// `work`, made for `before`, for the board's new files, which are shifted by `shift`.
pub fn carried(work: &Work, before: &Board, now: &Board, shift: Point) -> Work {
    let mut carried = work.clone();
    let shifted = Placement::shifted(shift);
    for zone in &mut carried.setup.exclusions {
        *zone = Bounds { min: shifted.point(zone.min), max: shifted.point(zone.max) };
    }
    // A flip is its own inverse.
    let (old, new) = (turning(work, before), turning(work, now));
    let bottom = |at: Point| {
        let in_files = old.as_ref().map_or(at, |turning| turning.point(at));
        let moved = shifted.point(in_files);
        new.as_ref().map_or(moved, |turning| turning.point(moved))
    };
    for operation in &mut carried.operations {
        let face = operation.face;
        let place = |at: Point| if face == Face::Bottom { bottom(at) } else { shifted.point(at) };
        operation.action.places().into_iter().for_each(|at| *at = place(*at));
    }
    carried
}

/// How the board is flipped for its bottom side, with all copies and pins of the job.
fn turning(work: &Work, board: &Board) -> Option<Placement> {
    let setup = &work.setup;
    let (panel, pins, mirror_x) = (&setup.panel, &setup.alignment, setup.flip == Flip::LeftRight);
    let board = board.panelled(panel.columns, panel.rows, panel.gap);
    board.pinned(pins.pairs, pins.diameter, pins.margin, mirror_x).turning(mirror_x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cam::work::{LocalIsolation, Operation, OperationKind, Remedy};
    use crate::geometry::{rectangle, union};

    fn board(min: (f64, f64), max: (f64, f64)) -> Board {
        let outline = Bounds { min: Point::from_mm(min.0, min.1), max: Point::from_mm(max.0, max.1) };
        Board { outline: union(&[rectangle(outline)]), ..Board::default() }
    }

    fn work(face: Face) -> Work {
        let usual = |word| Operation::usual(word, face).unwrap();
        let (mut isolate, mut cut) = (usual("isolate"), usual("cut_out"));
        if let OperationKind::Isolate(one) = &mut isolate.action {
            let (from, to) = (Point::from_mm(3.0, 4.0), Point::from_mm(3.2, 4.0));
            one.cures = vec![LocalIsolation { from, to, with: Remedy::Centred }];
        }
        if let OperationKind::CutOut(one) = &mut cut.action {
            one.tab_at = vec![Point::from_mm(0.0, 7.0)];
        }
        let mut work = Work { operations: vec![isolate, cut], ..Work::default() };
        work.setup.exclusions = vec![Bounds { min: Point::from_mm(1.0, 1.0), max: Point::from_mm(2.0, 2.0) }];
        work
    }

    /// Start of the local isolation, position of the tab, corner of the excluded zone.
    fn places(work: &Work) -> [Point; 3] {
        let OperationKind::Isolate(isolate) = &work.operations[0].action else { panic!() };
        let OperationKind::CutOut(cut) = &work.operations[1].action else { panic!() };
        [isolate.cures[0].from, cut.tab_at[0], work.setup.exclusions[0].min]
    }

    #[test]
    fn job_positions_stay_fixed_on_the_board() {
        let before = board((0.0, 0.0), (40.0, 20.0));
        let by = Point::from_mm(100.0, -50.0);
        let elsewhere = before.placed(&Placement::shifted(by));
        let wider = board((0.0, 0.0), (46.0, 20.0));
        let at = |x, y| Point::from_mm(x, y);
        // A board seen from below is mirrored about its centre: if the centre moves, everything on it moves.
        let rows = [
            (Face::Top, &elsewhere, by, [at(103.0, -46.0), at(100.0, -43.0), at(101.0, -49.0)]),
            (Face::Top, &wider, at(0.0, 0.0), [at(3.0, 4.0), at(0.0, 7.0), at(1.0, 1.0)]),
            (Face::Bottom, &elsewhere, by, [at(103.0, -46.0), at(100.0, -43.0), at(101.0, -49.0)]),
            (Face::Bottom, &wider, at(0.0, 0.0), [at(9.0, 4.0), at(6.0, 7.0), at(1.0, 1.0)]),
        ];
        for (face, now, shift, expected) in rows {
            assert_eq!(places(&carried(&work(face), &before, now, shift)), expected, "{face:?}");
            assert_eq!(carried(&work(face), &before, &before, Point::default()), work(face));
        }
    }
}
