//! The board stays where it is as long as it is needed: tabs by hand, zones, panels, pins, depths, and the order of things.

use super::*;
use crate::cam::parameters::assign;

/// The codes, weights and sentences of `work` on `board`.
fn told(board: &Board, work: &Work) -> Vec<(String, Weight, String)> {
    let remarks = planned(board, work).1;
    remarks.iter().map(|remark| (remark.code.clone(), remark.weight, remark.message("en"))).collect()
}

fn count(told: &[(String, Weight, String)], code: &str, weight: Weight) -> usize {
    told.iter().filter(|(own, heavy, _)| own == code && *heavy == weight).count()
}

/// The work that cuts `board` out with these settings.
fn cutting(board: &Board, settings: &str) -> Work {
    let mut work = only(board, "cut_out", |_| {});
    set(&mut work, settings);
    work
}

fn set(work: &mut Work, settings: &str) {
    for pair in settings.split(';').filter(|pair| !pair.is_empty()) {
        let (key, value) = pair.split_once('=').unwrap();
        assign(work, key, value).unwrap();
    }
}

#[test]
fn copies_without_a_gap_are_told() {
    let board = coupon();
    for (panel, missing) in [
        ("setup.columns=2;setup.gap=0", Some("between 1 contours")),
        ("setup.columns=3;setup.rows=2;setup.gap=0", Some("between 5 contours")),
        ("setup.columns=2;setup.gap=1.4", Some("between 1 contours")),
        ("setup.columns=3;setup.rows=2", None),
    ] {
        let all = told(&board, &cutting(&board, panel));
        assert_eq!(
            count(&all, "cam.contours_merged", Weight::Loss),
            usize::from(missing.is_some()),
            "{all:?}"
        );
        assert!(
            missing.is_none_or(|missing| all.iter().any(|(_, _, said)| said.contains(missing))),
            "{all:?}"
        );
    }
}

#[test]
fn a_cut_that_runs_into_pins_is_told() {
    let board = coupon();
    for (settings, hit) in [
        ("setup.pairs=1;setup.pin_margin=0", true),
        ("setup.pairs=1;setup.pin_margin=2", true),
        ("setup.pairs=2;setup.pin_margin=3", true),
        ("setup.pairs=2;setup.pin_margin=3.2", false),
        ("setup.pairs=1;setup.pin_margin=2.4;cut_out.side=on", false),
        ("setup.pairs=1;setup.pin_margin=2.2;cut_out.side=on", true),
        ("setup.pairs=1", false),
        ("setup.pin_margin=0", false),
    ] {
        let all = told(&board, &cutting(&board, settings));
        assert_eq!(count(&all, "cam.pins_hit", Weight::Loss), usize::from(hit), "{settings}: {all:?}");
    }
    let all = told(&board, &cutting(&board, "setup.pairs=2;setup.pin_margin=2"));
    assert!(all.iter().any(|(_, _, said)| said.contains("4 alignment pins")), "{all:?}");
}

#[test]
fn more_tabs_than_there_is_room_for_are_a_loss() {
    let board = coupon();
    let all = told(&board, &cutting(&board, "cut_out.tabs=40"));
    assert_eq!(count(&all, "cam.no_room_for_tabs", Weight::Loss), 1, "{all:?}");
    assert_eq!(told(&board, &cutting(&board, "cut_out.tabs=0")), Vec::new());
}

#[test]
fn depths_that_end_in_the_board_or_far_below_it_are_told() {
    let board = coupon();
    let mut work = Work::default_for(&board, &virtual_drill());
    assert_eq!(count(&told(&board, &work), "cam.not_through", Weight::Doubt), 0);
    set(&mut work, "operation.depth=0.5");
    let all = told(&board, &work);
    assert_eq!(count(&all, "cam.not_through", Weight::Doubt), 3, "{all:?}");
    let mut work = only(&board, "drill", |operation| {
        if let Action::Drill(drill) = &mut operation.action {
            drill.holes = Holes::Alignment;
        }
    });
    for (settings, doubts) in
        [("setup.pairs=1", 0), ("setup.pin_depth=9", 0), ("setup.pin_depth=30", 1), ("setup.pin_depth=11", 1)]
    {
        set(&mut work, settings);
        let all = told(&board, &work);
        assert_eq!(count(&all, "cam.far_below", Weight::Doubt), doubts, "{settings}: {all:?}");
    }
}

#[test]
fn a_board_cut_out_before_all_else_is_done_is_a_loss() {
    let machine = virtual_drill();
    let mut board = coupon();
    let early = |board: &Board, work: &Work| count(&told(board, work), "cam.cut_out_too_early", Weight::Loss);
    let mut work = Work::default_for(&board, &machine);
    assert_eq!(early(&board, &work), 0);
    work.operations.rotate_right(1);
    assert_eq!(early(&board, &work), 1);
    // Scored only, it stays in its place.
    work.operations[0].depth = mm(1.0);
    assert_eq!(early(&board, &work), 0);
    work.operations[0].depth = Length::ZERO;
    work.operations.iter_mut().skip(1).for_each(|operation| operation.on = false);
    assert_eq!(early(&board, &work), 0);

    board.copper.push(Copper { face: Face::Bottom, ..board.copper[0].clone() });
    let mut work = Work::default_for(&board, &machine);
    for (cut_out, early_at) in [(Face::Top, None), (Face::Bottom, Some(Face::Bottom))] {
        work.operations.last_mut().unwrap().face = cut_out;
        for face in [Face::Bottom, Face::Top] {
            work.setup.face = face;
            assert_eq!(early(&board, &work), usize::from(early_at == Some(face)), "{cut_out:?} {face:?}");
        }
    }
}
