//! Depth of holes, and holes that need a report: those outside the board.

use super::program::deepest;
use super::*;
use crate::cam::BitOrder;

fn said<'a>(diagnostics: &'a [Diagnostic], code: &str) -> Vec<&'a Diagnostic> {
    diagnostics.iter().filter(|diagnostic| diagnostic.code == code).collect()
}

fn arg<'a>(diagnostic: &'a Diagnostic, name: &str) -> &'a str {
    diagnostic.args.iter().find(|(own, _)| own == name).map_or("", |(_, value)| value)
}

/// The plan of `work` with this number of iterations; holes without a drill are left out.
fn drills(board: &Board, work: &Work, iterations: u64) -> Planned {
    let options = PlanOptions {
        iterations: Some(iterations),
        accept: vec!["plan.no_bit".to_owned(), "plan.slots_not_drilled".to_owned()],
        ..PlanOptions::default()
    };
    let rapid_time = |a: Point, b: Point| a.distance_mm(b);
    let means = Means { options: &options, rapid_time: &rapid_time };
    plan_work(board, work, &virtual_drill(), &means, &mut |_| true).unwrap().0
}

#[test]
fn holes_off_the_board_are_an_error_and_drilled_if_accepted() {
    // Position, size, and whether it is reported. The coupon is 30 × 20 mm with a cut-out of 14 … 17 × 8.5 …
    // 11.5.
    let rows = [
        (at(3.0, 6.0), 0.8, false),
        (at(30.0, 5.0), 0.8, false), // castellated
        (at(30.3, 5.0), 0.8, false), // half of it
        (at(30.5, 5.0), 0.8, true),
        (at(15.5, 10.0), 0.8, false), // in the cut-out: a hole drawn twice
        (at(50.0, 10.0), 0.8, true),
        (at(50.0, 10.0), 5.0, true),
        (at(-3.0, 10.0), 5.0, true),
        (at(-2.0, 10.0), 5.0, false),
    ];
    for (place, size, told) in rows {
        let mut board = coupon();
        board.holes.push(Hole { at: place, ..hole(0.0, 0.0, size) });
        let work = Work::default_for(&board, &virtual_drill());
        let (planned, diagnostics) = planned(&board, &work);
        let errors = said(&diagnostics, "cam.holes_outside");
        assert_eq!(errors.len(), usize::from(told), "{place:?} {size}: {diagnostics:?}");
        for error in errors {
            assert!(error.is_unacknowledged(&[]));
            assert_eq!(arg(error, "count"), "1");
            assert_eq!(arg(error, "x"), format!("{:.3}", place.x.mm()));
            assert!(!error.message("en").contains("cam."), "{}", error.message("en"));
        }
        let made = planned.parts.iter().any(|part| part.holes.contains(&4));
        assert!(made, "accepted, it is made: {place:?} {size}");
    }
}

#[test]
fn slots_off_the_board_are_reported_but_pins_are_not() {
    let mut board = coupon();
    board.slots[0].path = vec![at(28.0, 17.0), at(33.0, 17.0)];
    let bore = only(&board, "mill_holes", |_| {});
    let (_, diagnostics) = planned(&board, &bore);
    assert_eq!(said(&diagnostics, "cam.holes_outside").len(), 1, "{diagnostics:?}");
    board.outline = Region::default();
    assert!(said(&planned(&board, &bore).1, "cam.holes_outside").is_empty());

    let board = coupon();
    let mut pins = only(&board, "drill", |operation| {
        if let OperationKind::Drill(drill) = &mut operation.action {
            drill.holes = Holes::Alignment;
        }
    });
    pins.setup.alignment.pairs = 1;
    let (planned, diagnostics) = planned(&board, &pins);
    assert_eq!(planned.parts[0].holes.len(), 2, "{diagnostics:?}");
    assert!(said(&diagnostics, "cam.holes_outside").is_empty(), "{diagnostics:?}");
}

fn drill_cycles(planned: &Planned) -> usize {
    planned.parts.iter().flat_map(|part| &part.tasks).map(|task| task.drill_cycles.len()).sum()
}

#[test]
fn duplicate_hole_is_made_once() {
    let mut board = coupon();
    let (first, bored) =
        (Hole { source: 1, ..board.holes[1].clone() }, Hole { source: 1, ..board.holes[3].clone() });
    // As listed by two files, and by one with sizes rounded differently; one hole is next to another, and
    // stays.
    board.holes.extend([first.clone(), bored, Hole { diameter: Some(mm(0.81)), ..first }]);
    board.holes.push(Hole { at: at(12.0, 3.01), source: 1, ..board.holes[1].clone() });
    board.slots.push(Slot { path: vec![at(27.0, 17.0), at(24.0, 17.0)], ..board.slots[0].clone() });
    let plain = planned(&coupon(), &Work::default_for(&coupon(), &virtual_drill())).0;
    let (planned, diagnostics) = planned(&board, &Work::default_for(&board, &virtual_drill()));
    assert_eq!(drill_cycles(&planned), drill_cycles(&plain) + 1);
    assert_eq!(planned.toolpaths().count(), plain.toolpaths().count());
    let notes = said(&diagnostics, "cam.holes_twice");
    let counts: Vec<_> = notes.iter().map(|note| (arg(note, "operation"), arg(note, "count"))).collect();
    assert_eq!(counts.len(), 2, "{counts:?}");
    assert!(counts.iter().all(|row| ["2", "2"].contains(&row.1)), "{counts:?}");
    assert!(notes.iter().all(|note| note.severity == Severity::Note && !note.message("en").contains("cam.")));
    // No report of a feature left out.
    assert!(!diagnostics.iter().any(|diagnostic| diagnostic.severity == Severity::Error), "{diagnostics:?}");
}

#[test]
fn duplicate_operation_drills_again_only_if_deeper() {
    let board = coupon();
    for (first, second, count) in [(0.0, 0.0, 3), (0.0, 0.3, 3), (0.3, 0.0, 6), (0.3, 0.3, 3)] {
        let mut work = only(&board, "drill", |operation| operation.depth = mm(first));
        let again = Operation { depth: mm(second), ..work.operations[0].clone() };
        work.operations.push(again);
        let (planned, diagnostics) = planned(&board, &work);
        assert_eq!(drill_cycles(&planned), count, "{first} {second}");
        assert_eq!(said(&diagnostics, "cam.holes_twice").len(), usize::from(count == 3), "{diagnostics:?}");
        let empty =
            planned.parts.iter().flat_map(|part| &part.tasks).filter(|task| task.drill_cycles.is_empty());
        assert_eq!(empty.count(), 0, "no bit is put in for nothing");
    }
}

#[test]
fn duplicate_boring_is_milled_again_only_if_deeper() {
    let board = coupon();
    let once = planned(&board, &only(&board, "mill_holes", |_| {})).0.toolpaths().count();
    // Depths of both, the second's tool, and the second's remaining work: all, the 5 mm hole, or nothing.
    let rows = [
        (0.0, 0.0, "end mill 1.5", 0),
        (0.0, 0.5, "end mill 1.5", 0),
        (0.0, 0.0, "Mill 2.0 mm", 0), // another mill finds the holes already made
        (0.5, 0.0, "end mill 1.5", once),
    ];
    for (first, second, bit, left) in rows {
        let mut work = only(&board, "mill_holes", |operation| operation.depth = mm(first));
        work.bits.push(mill("Mill 2.0 mm", 2.0));
        let again = Operation { depth: mm(second), bit: bit.to_owned(), ..work.operations[0].clone() };
        work.operations.push(again);
        let (planned, diagnostics) = planned(&board, &work);
        assert_eq!(planned.toolpaths().count(), once + left, "{first} {second} {bit}");
        let notes = said(&diagnostics, "cam.holes_twice");
        let counts: Vec<_> = notes.iter().map(|note| arg(note, "count")).collect();
        assert_eq!(counts, if left == 0 { vec!["2"] } else { vec![] }, "{first} {second} {bit}");
        let named = |note: &&Diagnostic| note.message("en").starts_with("Mill holes and slots: 2 holes");
        assert!(notes.iter().all(named), "an operation without a name is called as the page calls it");
        assert!(planned.parts[1].tasks.iter().all(|task| !task.toolpaths.is_empty()), "no bit for nothing");
        assert_eq!(
            (planned.parts[1].holes.len(), planned.parts[1].slots.len()),
            (1, 1),
            "they count as made"
        );
        assert!(
            !diagnostics.iter().any(|diagnostic| diagnostic.severity == Severity::Error),
            "{diagnostics:?}"
        );
    }
}

#[test]
fn thin_mill_bores_where_a_zone_blocks_a_wide_one() {
    let board = coupon();
    let mut work = only(&board, "mill_holes", |operation| {
        operation.bit = "wide".to_owned();
        operation.action = OperationKind::MillHoles(MillHoles {
            slots: true,
            holes: false,
            direction: CutDirection::Climb,
            further: Vec::new(),
        });
    });
    // 20 µm over the slot of 1 mm on each side, which is within the tolerance of a tool's width.
    work.bits.push(mill("wide", 1.04));
    work.setup.exclusions = vec![Bounds::of(at(24.0, 17.51)).with(at(27.0, 19.0))];
    work.operations.push(Operation { bit: "end mill 0.8".to_owned(), ..work.operations[0].clone() });
    let (planned, diagnostics) = planned(&board, &work);
    let toolpaths =
        |part: &PlannedOperation| part.tasks.iter().map(|task| task.toolpaths.len()).sum::<usize>();
    assert_eq!(toolpaths(&planned.parts[0]), 0, "{diagnostics:?}");
    assert_ne!(toolpaths(&planned.parts[1]), 0, "{diagnostics:?}");
    assert!(said(&diagnostics, "cam.holes_twice").is_empty(), "{diagnostics:?}");
}

#[test]
fn loaded_tool_goes_first_on_request() {
    /// Order of tools, the loaded one, the tools in order of use, the report.
    type Row = (BitOrder, Option<f64>, [f64; 2], Option<&'static str>);
    let board = coupon();
    let work = only(&board, "drill", |_| {});
    let rows: [Row; 5] = [
        (BitOrder::Ascending, Some(1.0), [0.8, 1.0], None),
        (BitOrder::LoadedFirst, Some(1.0), [1.0, 0.8], None),
        (BitOrder::LoadedFirst, Some(0.8), [0.8, 1.0], None),
        (BitOrder::LoadedFirst, Some(3.2), [0.8, 1.0], Some("plan.loaded_not_used")),
        (BitOrder::LoadedFirst, None, [0.8, 1.0], Some("plan.loaded_not_said")),
    ];
    for (group, loaded, expected, code) in rows {
        let loaded = loaded.map(mm);
        let options = PlanOptions { group, loaded, iterations: Some(20), ..PlanOptions::default() };
        let rapid_time = |a: Point, b: Point| a.distance_mm(b);
        let means = Means { options: &options, rapid_time: &rapid_time };
        let (planned, diagnostics) =
            plan_work(&board, &work, &virtual_drill(), &means, &mut |_| true).expect("a plan");
        let bits: Vec<Length> =
            planned.parts.iter().flat_map(|part| &part.tasks).map(|task| task.bit.diameter).collect();
        assert_eq!(bits, expected.map(mm), "{group:?} {loaded:?}");
        let told: Vec<_> = diagnostics.iter().filter(|one| one.code.starts_with("plan.loaded")).collect();
        assert_eq!(told.first().map(|one| one.code.as_str()), code, "{group:?} {loaded:?}");
        assert!(told.len() < 2);
    }
}

#[test]
fn drill_cycles_are_deeper_by_the_tool_point() {
    let board = coupon();
    let process = virtual_drill().process;
    let through = process.board_thickness + process.breakthrough;
    let depth = |text: &str, size: f64| {
        let mut work = only(&board, "drill", |_| {});
        for pair in text.split(';').filter(|pair| !pair.is_empty()) {
            let (key, value) = pair.split_once('=').unwrap();
            crate::cam::parameters::assign(&mut work, key, value).unwrap();
        }
        let planned = drills(&board, &work, 10);
        let task = planned.parts[0].tasks.iter().find(|task| task.bit.diameter == mm(size)).unwrap();
        (task.depth - through).mm()
    };
    // Half of the diameter over the tangent of half of the angle.
    for (text, size, height) in [
        ("", 1.0, 0.233_154),
        ("", 0.8, 0.186_523),
        ("drill.point=90", 1.0, 0.5),
        ("drill.point=180", 1.0, 0.0),
        ("drill.point=180;drill.points=0.8 90", 1.0, 0.0),
        ("drill.point=180;drill.points=0.8 90", 0.8, 0.4),
    ] {
        let found = depth(text, size);
        assert!((found - height).abs() < 2e-6, "{text} {size}: {found}");
    }
}

#[test]
fn peck_drilling_retracts_between_plunges() {
    let board = coupon();
    let work = only(&board, "drill", |operation| {
        if let OperationKind::Drill(drill) = &mut operation.action {
            (drill.peck, drill.holes) = (mm(0.9), Holes::Board);
        }
    });
    let planned = drills(&board, &work, 0);
    let program = lower_work(&planned, &work, &virtual_drill());
    let leg = program.legs.iter().find(|leg| matches!(leg.mark, Mark::Hole(_))).unwrap();
    let plunges = leg.commands.iter().filter(|command| matches!(command, Command::Plunge { .. })).count();
    // 1.6 + 0.5 + 0.4 / tan 65° = 2.287 mm in steps of at most 0.9 mm.
    assert_eq!(plunges, 3);
    assert!((deepest(leg).mm() + 2.2865).abs() < 1e-3, "{:?}", deepest(leg));
}
