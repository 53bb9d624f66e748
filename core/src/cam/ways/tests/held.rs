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
