//! The board stays in place while it is needed: user-placed tabs, zones, panels, pins, depths, order.

use super::*;
use crate::cam::parameters::assign;

fn told(board: &Board, work: &Work) -> Vec<(String, Severity, String)> {
    let diagnostics = planned(board, work).1;
    diagnostics
        .iter()
        .map(|diagnostic| (diagnostic.code.clone(), diagnostic.severity, diagnostic.message("en")))
        .collect()
}

fn count(told: &[(String, Severity, String)], code: &str, severity: Severity) -> usize {
    told.iter().filter(|(own, heavy, _)| own == code && *heavy == severity).count()
}

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

fn held(planned: &Planned) -> Vec<f64> {
    let outer = planned.toolpaths().filter(|way| way.path.length_mm() > 30.0);
    outer.map(|way| way.tabs.iter().map(|tab| tab.1 - tab.0).sum()).collect()
}

#[test]
fn placed_tabs_are_on_every_copy_and_only_the_nearest_contour() {
    let board = coupon();
    for (panel, copies) in [
        ("", 1),
        ("setup.columns=2", 2),
        ("setup.rows=3", 3),
        ("setup.columns=2;setup.rows=2", 4),
        ("setup.columns=2;setup.face=bottom;operation.face=bottom", 2),
    ] {
        for (tabs, wide) in [
            ("15,-0.5,15,20.5", 7.0),
            ("30.5,10", 3.5),
            ("-0.5,7,30.5,10,15,20.5", 10.5),
            // Given for the first two copies of a row: one tab.
            (if copies % 2 == 0 { "10,20,43,20" } else { "10,20" }, 3.5),
        ] {
            let work = cutting(&board, &format!("{panel};cut_out.tab_at={tabs}"));
            let (planned, diagnostics) = planned(&board, &work);
            let held = held(&planned);
            assert_eq!(held.len(), copies, "{panel}");
            assert!(held.iter().all(|own| (own - wide).abs() < 1e-6), "{panel} {tabs}: {held:?}");
            assert!(
                diagnostics.iter().all(|diagnostic| diagnostic.severity < Severity::Error),
                "{panel} {tabs}: {diagnostics:?}"
            );
        }
    }
}

#[test]
fn unreachable_tab_and_contour_without_tab_are_errors() {
    let board = coupon();
    let far = told(&board, &cutting(&board, "cut_out.tab_at=15,-9"));
    assert_eq!(count(&far, "cam.tab_out_of_reach", Severity::Error), 1, "{far:?}");
    assert_eq!(count(&far, "cam.cut_free", Severity::Error), 1, "{far:?}");
    assert!(far.iter().any(|(_, _, said)| said.contains("15.00, -9.00")), "{far:?}");
    let outline = union(&[boxed(0.0, 0.0, 10.0, 10.0), boxed(20.0, 0.0, 30.0, 10.0)]);
    let two = Board { outline, ..Board::default() };
    let one = told(&two, &cutting(&two, "cut_out.tab_at=5,0"));
    assert_eq!(count(&one, "cam.cut_free", Severity::Error), 1, "{one:?}");
    let both = told(&two, &cutting(&two, "cut_out.tab_at=5,0,25,0"));
    assert_eq!(both, Vec::new());
}

#[test]
fn uncut_stretch_shorter_than_the_tool_holds_nothing() {
    let board = coupon();
    for (zone, short, long) in [
        ("10,-3,10.3,-1.498", 1, 0),
        ("10,-3,14,1", 0, 1),
        ("10,-3,10.3,-1.498,20,-3,24,1", 1, 1),
        ("10,-3,10.3,-1.6", 0, 0),
    ] {
        let work = cutting(&board, &format!("cut_out.tabs=0;setup.exclusions={zone}"));
        let all = told(&board, &work);
        assert_eq!(count(&all, "cam.zone_too_short", Severity::Warning), short, "{zone}: {all:?}");
        assert_eq!(count(&all, "cam.zone_in_the_way", Severity::Warning), long, "{zone}: {all:?}");
    }
    // A tab in the zone is still needed, and still made on both sides of the zone.
    let work = cutting(&board, "cut_out.tab_at=10.15,0;setup.exclusions=10,-3,10.3,-1.498");
    let (planned, diagnostics) = planned(&board, &work);
    assert!(!diagnostics.iter().any(|diagnostic| diagnostic.code == "cam.tab_in_zone"), "{diagnostics:?}");
    let held = held(&planned);
    assert!(held.len() == 1 && held[0] > 2.5, "{held:?}");
}

#[test]
fn copies_without_a_gap_are_an_error() {
    let board = coupon();
    for (panel, missing) in [
        ("setup.columns=2;setup.gap=0", Some("between 1 contour ")),
        ("setup.columns=3;setup.rows=2;setup.gap=0", Some("between 5 contours")),
        ("setup.columns=2;setup.gap=1.4", Some("between 1 contour ")),
        ("setup.columns=3;setup.rows=2", None),
    ] {
        let all = told(&board, &cutting(&board, panel));
        assert_eq!(
            count(&all, "cam.contours_merged", Severity::Error),
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
fn cut_through_alignment_pins_is_an_error() {
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
        assert_eq!(count(&all, "cam.pins_hit", Severity::Error), usize::from(hit), "{settings}: {all:?}");
    }
    let all = told(&board, &cutting(&board, "setup.pairs=2;setup.pin_margin=2"));
    assert!(all.iter().any(|(_, _, said)| said.contains("alignment pins (4)")), "{all:?}");
}

#[test]
fn too_many_tabs_are_an_error() {
    let board = coupon();
    let all = told(&board, &cutting(&board, "cut_out.tabs=40"));
    assert_eq!(count(&all, "cam.no_room_for_tabs", Severity::Error), 1, "{all:?}");
    let none = told(&board, &cutting(&board, "cut_out.tabs=0"));
    assert_eq!((count(&none, "cam.no_tabs", Severity::Warning), none.len()), (1, 1), "{none:?}");
}

#[test]
fn depths_within_or_far_below_the_board_are_warnings() {
    let board = coupon();
    let mut work = Work::default_for(&board, &virtual_drill());
    assert_eq!(count(&told(&board, &work), "cam.not_through", Severity::Warning), 0);
    set(&mut work, "operation.depth=0.5");
    let all = told(&board, &work);
    assert_eq!(count(&all, "cam.not_through", Severity::Warning), 3, "{all:?}");
    for (depth, warnings) in [("4.6", 0), ("4.7", 1), ("9", 1)] {
        let all = told(&board, &cutting(&board, &format!("operation.depth={depth}")));
        assert_eq!(count(&all, "cam.far_below", Severity::Warning), warnings, "{depth}: {all:?}");
    }
    let mut work = only(&board, "drill", |operation| {
        if let OperationKind::Drill(drill) = &mut operation.action {
            drill.holes = Holes::Alignment;
        }
    });
    for (settings, warnings) in
        [("setup.pairs=1", 0), ("setup.pin_depth=9", 0), ("setup.pin_depth=30", 1), ("setup.pin_depth=11", 1)]
    {
        set(&mut work, settings);
        let all = told(&board, &work);
        assert_eq!(count(&all, "cam.far_below", Severity::Warning), warnings, "{settings}: {all:?}");
    }
}

#[test]
fn board_cut_out_too_early_is_an_error() {
    let machine = virtual_drill();
    let mut board = coupon();
    let early =
        |board: &Board, work: &Work| count(&told(board, work), "cam.cut_out_too_early", Severity::Error);
    let mut work = Work::default_for(&board, &machine);
    assert_eq!(early(&board, &work), 0);
    work.operations.rotate_right(1);
    assert_eq!(early(&board, &work), 1);
    // A board that is only scored stays in place.
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

#[test]
fn tabs_that_hold_nothing_are_an_error() {
    let board = coupon();
    let rows = [
        ("cut_out.tab_width=0", Some(("cam.tabs_hold_nothing", Severity::Error))),
        ("cut_out.tab_width=0.05;cut_out.tab_at=15,0", Some(("cam.tabs_hold_nothing", Severity::Error))),
        ("cut_out.tab_height=0", Some(("cam.tabs_hold_nothing", Severity::Error))),
        ("cut_out.tab_width=0;cut_out.tabs=0", Some(("cam.no_tabs", Severity::Warning))),
        ("cut_out.depth=1.5;cut_out.tabs=0", Some(("cam.not_through", Severity::Warning))),
        ("cut_out.tab_height=0;cut_out.bites=yes", None),
        ("cut_out.tab_height=1.7", Some(("cam.tabs_too_high", Severity::Warning))),
        ("cut_out.tab_height=1.6", None),
        ("cut_out.bites=yes;cut_out.bite_pitch=0.1", Some(("cam.bites_cut_through", Severity::Error))),
        ("cut_out.bites=yes;cut_out.bite_pitch=0.5", Some(("cam.bites_cut_through", Severity::Error))),
        ("cut_out.bite_pitch=0.1", None),
        ("cut_out.bites=yes;cut_out.bite_pitch=0.7", None),
    ];
    for (settings, said) in rows {
        let all = told(&board, &cutting(&board, settings));
        let found: Vec<_> = all.iter().map(|(code, severity, _)| (code.as_str(), *severity)).collect();
        assert_eq!(found, Vec::from_iter(said), "{settings}: {all:?}");
        assert!(all.iter().all(|(code, _, said)| !said.contains(code) && !said.contains('{')), "{all:?}");
    }
}

#[test]
fn zone_off_the_board_is_a_warning_at_its_given_position() {
    let board = coupon();
    for (settings, beside) in [
        ("setup.exclusions=50,50,60,60", Some("50.00, 50.00")),
        ("setup.exclusions=50,50,60,60,0,0,2,2", Some("50.00, 50.00")),
        ("setup.exclusions=50,5,60,8;setup.face=bottom;operation.face=bottom", Some("50.00, 5.00")),
        ("setup.exclusions=50,5,60,8;setup.columns=2", None),
        ("setup.exclusions=-3,5,-1,8", None),
        ("", None),
    ] {
        let all = told(&board, &cutting(&board, settings));
        let zones: Vec<_> = all.iter().filter(|(code, ..)| code == "cam.zone_beside").collect();
        assert_eq!(zones.len(), usize::from(beside.is_some()), "{settings}: {all:?}");
        for (_, severity, said) in zones {
            assert_eq!(*severity, Severity::Warning);
            assert!(said.contains(beside.unwrap_or_default()) && !said.contains('{'), "{said}");
        }
    }
}
