//! Programs of small boards: holes, slots, tabs, mouse-bites, sides, zones; and keys of parts.

use super::*;

pub(super) fn deepest(leg: &crate::job::Leg) -> Length {
    let heights = leg.commands.iter().filter_map(|command| match command {
        Command::Plunge { to, .. } => Some(*to),
        Command::Mill { height, .. } | Command::MillArc { height, .. } => Some(*height),
        _ => None,
    });
    heights.min().unwrap_or_default()
}

#[test]
fn every_leg_has_its_operation() {
    let board = coupon();
    let mut work = Work::default_for(&board, &virtual_drill());
    // The drilling again, deeper, so that holes have two legs; and mouse-bites, which are no holes of the
    // board.
    let drill =
        work.operations.iter().find(|operation| matches!(operation.action, OperationKind::Drill(_))).unwrap();
    work.operations.push(Operation { depth: mm(4.0), ..drill.clone() });
    for operation in &mut work.operations {
        if let OperationKind::CutOut(cut_out) = &mut operation.action {
            cut_out.bites = true;
        }
    }
    let (planned, _) = planned(&board, &work);
    let program = lower_work(&planned, &work, &virtual_drill());
    let told: Vec<u32> =
        (0..program.legs.len() as u32).filter_map(|leg| planned.operation_at(&program, leg)).collect();
    let count = |part: &PlannedOperation| {
        part.tasks.iter().map(|task| task.drill_cycles.len() + task.toolpaths.len()).sum()
    };
    let meant: Vec<u32> =
        planned.parts.iter().flat_map(|part| std::iter::repeat_n(part.operation, count(part))).collect();
    assert_eq!(told, meant);
    assert!(meant.windows(2).filter(|pair| pair[0] != pair[1]).count() >= 4, "{meant:?}");
    for (leg, index) in program.legs.iter().zip(0..) {
        let does = matches!(leg.mark, Mark::Hole(_) | Mark::Toolpath(_));
        assert_eq!(planned.operation_at(&program, index).is_some(), does);
    }
    assert_eq!(planned.operation_at(&program, u32::MAX), None);
}

#[test]
fn default_job_covers_the_whole_board() {
    let board = coupon();
    let machine = virtual_drill();
    let work = Work::default_for(&board, &machine);
    let words: Vec<_> = work.operations.iter().map(|operation| operation.action.word()).collect();
    assert_eq!(words, ["isolate", "drill", "mill_holes", "cut_out"]);
    let (planned, diagnostics) = planned(&board, &work);
    assert!(diagnostics.iter().all(|diagnostic| diagnostic.severity < Severity::Error), "{diagnostics:?}");
    let program = lower_work(&planned, &work, &machine);
    let holes: Vec<_> = program.legs.iter().filter(|leg| matches!(leg.mark, Mark::Hole(_))).collect();
    assert_eq!(holes.len(), 3);
    for (name, called) in [("amp", "amp-top"), ("", "top")] {
        let mut planned = planned.clone();
        planned.board.name = name.to_owned();
        assert_eq!(lower_work(&planned, &work, &machine).name, called);
    }
    let names: Vec<_> = program.bits.iter().map(|bit| bit.name.as_str()).collect();
    // The last mill for holes is also the mill that cuts out, so it is loaded once. Tools have their titles
    // as in files.
    assert_eq!(names, ["V-bit 30°, tip 0.1", "drill 0.8", "drill 1", "end mill 0.8", "end mill 1.5"]);
    assert!(program.bits.iter().all(|bit| bit.name == bit.title("en")), "{names:?}");
    let toolpaths = program.legs.iter().filter(|leg| matches!(leg.mark, Mark::Toolpath(_))).count();
    assert_eq!(toolpaths, planned.toolpaths().count());
    // Every leg that descends also retracts, and the last path is the outer contour.
    for leg in program.legs.iter().filter(|leg| deepest(leg) < Length::ZERO) {
        assert_eq!(leg.commands.last(), Some(&Command::Retract { to: program.safe_height }));
    }
    let last = planned.toolpaths().last().unwrap();
    assert!(last.path.length_mm() > 100.0);
    assert_eq!(deepest(&program.legs[program.legs.len() - 2]), mm(-2.1));
}

#[test]
fn bored_holes_and_slots_have_their_size() {
    let board = coupon();
    let work = only(&board, "mill_holes", |_| {});
    let (planned, _) = planned(&board, &work);
    assert_eq!((planned.parts[0].holes.as_slice(), planned.parts[0].slots.as_slice()), (&[3][..], &[0][..]));
    let [wide, thin] = planned.parts[0].tasks.as_slice() else { panic!("two bits") };
    let cut =
        sweep(&wide.toolpaths.iter().map(|way| way.path.clone()).collect::<Vec<_>>(), wide.bit.diameter);
    let area = crate::geometry::area_mm2(&cut);
    assert!((area - 6.25 * std::f64::consts::PI).abs() < 0.02, "{area}: nothing is left in the middle");
    assert!(
        wide.toolpaths.len() >= 2 && wide.toolpaths[0].path.length_mm() < wide.toolpaths[1].path.length_mm()
    );
    assert!(wide.toolpaths.iter().all(|way| way.entry == EntryMove::Helix));
    let bounds =
        sweep(&thin.toolpaths.iter().map(|way| way.path.clone()).collect::<Vec<_>>(), thin.bit.diameter)
            .bounds()
            .unwrap();
    assert!((bounds.max.y - bounds.min.y).mm() > 0.999 && (bounds.max.x - bounds.min.x).mm() > 3.999);
    assert!((bounds.max.y - bounds.min.y).mm() < 1.001 && (bounds.max.x - bounds.min.x).mm() < 4.001);
}

#[test]
fn slot_is_milled_if_slightly_narrower_than_the_mill() {
    for (width, made) in [(0.7874, 1), (0.751, 1), (0.749, 0)] {
        let mut board = coupon();
        board.slots[0].width = Some(mm(width));
        let (planned, diagnostics) = planned(&board, &only(&board, "mill_holes", |_| {}));
        assert_eq!(planned.parts[0].slots.len(), made, "{width}");
        assert_eq!(
            diagnostics.iter().any(|diagnostic| diagnostic.code == "cam.slots_missing"),
            made == 0,
            "{width}"
        );
        let thin = planned.parts[0].tasks.iter().filter(|task| task.bit.diameter == mm(0.8));
        let length: f64 = thin.flat_map(|task| &task.toolpaths).map(|way| way.path.length_mm()).sum();
        assert!((length - 3.0 * made as f64).abs() < 1e-6, "{width}: once along the middle, not {length} mm");
    }
}

#[test]
fn features_without_a_fitting_tool_are_reported_by_size() {
    let mut board = coupon();
    board.slots[0].width = Some(mm(0.3));
    board.holes.extend([hole(5.0, 1.0, 0.2), hole(6.0, 1.0, 0.22), hole(7.0, 1.0, 0.2)]);
    let work = Work::default_for(&board, &virtual_drill());
    let rapid_time = |a: Point, b: Point| a.distance_mm(b);
    let mut options = PlanOptions { iterations: Some(0), ..PlanOptions::default() };
    let plan = |options: &PlanOptions| {
        plan_work(&board, &work, &virtual_drill(), &Means { options, rapid_time: &rapid_time }, &mut |_| true)
    };
    let (planned, diagnostics) = plan(&options).unwrap();
    let errors: Vec<_> =
        diagnostics.iter().filter(|diagnostic| diagnostic.is_unacknowledged(&options.accept)).collect();
    let codes: Vec<_> = errors.iter().map(|error| error.code.clone()).collect();
    assert_eq!(codes, ["cam.holes_missing", "cam.holes_missing", "cam.slots_missing"], "{errors:?}");
    let said = errors[0].message("en");
    assert!(said.contains("2 holes of 0.2 mm") && said.contains("X 5.000 Y 1.000"), "{said}");
    assert!(errors.iter().all(|error| !error.message("en").contains("cam.")), "{errors:?}");
    assert_eq!(planned.accepted, Vec::<String>::new());
    // Everything else is made.
    let made: Vec<u32> = planned.parts.iter().flat_map(|part| part.holes.iter().copied()).collect();
    assert_eq!(made, [0, 1, 2, 3]);
    options.accept = codes;
    options.accept.dedup();
    let (planned, diagnostics) = plan(&options).unwrap();
    assert_eq!(planned.accepted, options.accept);
    assert!(!diagnostics.iter().any(|diagnostic| diagnostic.is_unacknowledged(&options.accept)));
}

#[test]
fn job_with_nothing_left_is_refused_with_missing_sizes() {
    let board = Board { holes: vec![hole(5.0, 1.0, 0.2)], ..Board::default() };
    let work = Work::default_for(&board, &virtual_drill());
    let rapid_time = |a: Point, b: Point| a.distance_mm(b);
    let options = PlanOptions::default();
    let means = Means { options: &options, rapid_time: &rapid_time };
    let why = plan_work(&board, &work, &virtual_drill(), &means, &mut |_| true).unwrap_err();
    let codes: Vec<_> = why.iter().map(|diagnostic| diagnostic.code.as_str()).collect();
    assert_eq!(codes, ["cam.holes_missing", "cam.nothing_to_do"]);
}

#[test]
fn inner_contours_too_narrow_for_tools_are_skipped() {
    let island = boxed(0.0, 0.0, 30.0, 20.0);
    let wide = boxed(14.0, 8.0, 18.0, 12.0);
    let narrow = [boxed(5.0, 5.0, 5.5, 7.0), boxed(25.0, 5.0, 25.5, 7.0)];
    let round = circle(at(5.0, 15.0), mm(0.6));
    let all: Vec<Path> = [island, wide, round].into_iter().chain(narrow).collect();
    let outline = crate::geometry::even_odd(&all);
    let of_cut_outs = |holes: Vec<Hole>| {
        let board = Board { outline: outline.clone(), holes, ..Board::default() };
        let (planned, diagnostics) = planned(&board, &only(&board, "cut_out", |_| {}));
        assert_eq!(planned.toolpaths().count(), 2, "the wide one and the outer one");
        let told = |diagnostic: &Diagnostic| {
            (diagnostic.code == "cam.cut_outs_missing").then(|| diagnostic.message("en"))
        };
        diagnostics.iter().filter_map(told).collect::<Vec<_>>()
    };
    let told = of_cut_outs(vec![hole(5.0, 15.0, 0.6)]);
    assert!(told.len() == 1 && told[0].contains("2 inner contours, 0.5 mm, will be missing"), "{told:?}");
    assert!(told[0].contains("X 5.250 Y 6.000"), "{told:?}");
    assert_eq!(of_cut_outs(Vec::new()).len(), 2, "the round one has no hole that makes it");
}

#[test]
fn boards_too_close_together_are_reported() {
    let outline = union(&[boxed(0.0, 0.0, 10.0, 10.0), boxed(11.0, 0.0, 20.0, 10.0)]);
    let board = Board { outline, ..Board::default() };
    let (planned, diagnostics) = planned(&board, &only(&board, "cut_out", |_| {}));
    assert_eq!(planned.toolpaths().count(), 1);
    assert!(diagnostics.iter().any(|diagnostic| diagnostic.code == "cam.contours_merged"), "{diagnostics:?}");
}

#[test]
fn tabs_hold_the_board_in_every_pass() {
    let board = coupon();
    let work = only(&board, "cut_out", |_| {});
    let (planned, _) = planned(&board, &work);
    let [inner, outer] = planned.parts[0].tasks[0].toolpaths.as_slice() else { panic!("inner and outer") };
    assert!(inner.tabs.is_empty() && inner.path.length_mm() < outer.path.length_mm());
    assert_eq!(outer.tabs.len(), 4);
    let held: f64 = outer.tabs.iter().map(|tab| tab.1 - tab.0).sum();
    assert!((held - 4.0 * 3.5).abs() < 1e-6, "{held}");
    // The tool centre is outside the outline by its radius.
    let bounds = crate::geometry::path_bounds(&outer.path);
    assert!((bounds.min.x.mm() + 0.75).abs() < 0.003 && (bounds.max.y.mm() - 20.75).abs() < 0.003);
    let program = lower_work(&planned, &work, &virtual_drill());
    let leg = program.legs.iter().rfind(|leg| matches!(leg.mark, Mark::Toolpath(_))).unwrap();
    let over: f64 = over_tabs(&program, leg);
    // In its last lap the tool is at tab height or above over four tabs.
    assert!(over > 0.99 * held, "{over} of {held} mm");
}

/// Length of the last lap, in mm, that is not deeper than a tab.
fn over_tabs(program: &Program, leg: &crate::job::Leg) -> f64 {
    let mut here = program.start_of_leg(0);
    let (mut shallow, mut since_bottom) = (0.0, Vec::new());
    for command in &leg.commands {
        match *command {
            Command::Rapid { to } => here = to,
            Command::Mill { to, height, .. } | Command::MillArc { to, height, .. } => {
                since_bottom.push((here.distance_mm(to), height));
                here = to;
            }
            _ => {}
        }
    }
    // Corners of the contour are arcs about the outline's corners; their chords are near enough.
    let mut lap = 0.0;
    for (length, height) in since_bottom.into_iter().rev() {
        if lap > 104.0 {
            break;
        }
        lap += length;
        if height >= mm(-1.0) {
            shallow += length;
        }
    }
    shallow
}

#[test]
fn mouse_bites_are_on_the_edge_and_tabs_are_not_cut() {
    let board = coupon();
    let work = only(&board, "cut_out", |operation| {
        if let OperationKind::CutOut(cut_out) = &mut operation.action {
            *cut_out = CutOut { bites: true, ..cut_out.clone() };
        }
    });
    let (planned, _) = planned(&board, &work);
    let [bites, cut] = planned.parts[0].tasks.as_slice() else { panic!("drill and mill") };
    assert_eq!(cut.toolpaths.len(), 1 + 4);
    assert!(bites.drill_cycles.len() >= 4 * 3, "{}", bites.drill_cycles.len());
    let process = virtual_drill().process;
    assert!(bites.depth > process.board_thickness + process.breakthrough, "the point goes through too");
    let edge = Area::of(&board.outline);
    for stroke in &bites.drill_cycles {
        assert!(edge.index().nearest(stroke.at, mm(0.003)).is_some(), "{:?}", stroke.at);
    }
}

#[test]
fn placed_tabs_stay_in_position() {
    let board = coupon();
    let work = only(&board, "cut_out", |operation| {
        if let OperationKind::CutOut(cut_out) = &mut operation.action {
            cut_out.tab_at = vec![at(15.0, 0.0), at(30.0, 10.0)];
            cut_out.side = CutSide::Outside;
        }
    });
    let (planned, _) = planned(&board, &work);
    let outer = planned.toolpaths().last().unwrap();
    let middles: Vec<Point> = outer
        .tabs
        .iter()
        .map(|tab| cut::between(&outer.path, 0.0, (tab.0 + tab.1) / 2.0).unwrap().end())
        .collect();
    assert_eq!(middles.len(), 2);
    assert!(middles.iter().any(|place| place.distance_mm(at(15.0, -0.75)) < 0.06), "{middles:?}");
    assert!(middles.iter().any(|place| place.distance_mm(at(30.75, 10.0)) < 0.06), "{middles:?}");
}

#[test]
fn bottom_is_mirrored_and_its_pins_coincide() {
    let machine = virtual_drill();
    let mut board = coupon();
    board.copper[0].face = Face::Bottom;
    board.copper.push(Copper { face: Face::Top, ..board.copper[0].clone() });
    let mut work = Work::default_for(&board, &machine);
    assert_eq!(work.faces(), [Face::Bottom, Face::Top]);
    let (top, _) = planned(&board, &work);
    work.setup.face = Face::Bottom;
    let (bottom, _) = planned(&board, &work);
    assert_eq!(bottom.parts[0].holes, [4, 5]);
    let pins: Vec<Point> = bottom.parts[0].tasks[0].drill_cycles.iter().map(|stroke| stroke.at).collect();
    assert!(pins.iter().all(|pin| pin.x < Length::ZERO || pin.x > mm(30.0)));
    assert!(top.parts.iter().all(|part| part.holes.iter().all(|hole| *hole < 4)), "pins are drilled once");
    assert_eq!(bottom.board.holes[0].at, at(27.0, 3.0));
    assert_eq!(bottom.origin, top.origin);
    let program = lower_work(&bottom, &work, &machine);
    assert_eq!(deepest(&program.legs[2]).mm().round(), -8.0, "through the board and into the bed");
}

#[test]
fn no_toolpath_enters_an_exclusion_zone() {
    let board = coupon();
    let zone = Bounds::of(at(-5.0, -5.0)).with(at(8.0, 8.0));
    let mut work = isolation(&board, 0.2, |isolate| isolate.passes = 1);
    work.setup.exclusions = vec![zone];
    let (planned, diagnostics) = planned(&board, &work);
    assert!(diagnostics.iter().any(|diagnostic| diagnostic.code == "cam.zone_in_the_way"));
    for way in planned.toolpaths() {
        for point in way.path.flattened(1e-3) {
            assert!(!zone.grown(mm(0.095)).contains(point), "{point:?}");
        }
    }
    assert!(planned.toolpaths().any(|way| !way.path.is_closed()), "contours across the edge are cut open");
}

#[test]
fn tabs_in_a_zone_are_reported_and_others_stay() {
    let board = coupon();
    let zone = Bounds::of(at(12.0, -4.0)).with(at(18.0, 4.0));
    for bites in [false, true] {
        let mut work = only(&board, "cut_out", |operation| {
            if let OperationKind::CutOut(cut_out) = &mut operation.action {
                cut_out.tab_at = vec![at(15.0, 0.0), at(30.0, 10.0), at(5.0, 0.0)];
                cut_out.bites = bites;
            }
        });
        work.setup.exclusions = vec![zone];
        let (planned, diagnostics) = planned(&board, &work);
        let told: Vec<_> =
            diagnostics.iter().filter(|diagnostic| diagnostic.code == "cam.tab_in_zone").collect();
        assert_eq!(told.len(), 1, "{diagnostics:?}");
        let text = told[0].message("en");
        assert!(text.contains("-0.75"), "{text}");
        let middle = |way: &Toolpath, tab: &(f64, f64)| {
            cut::between(&way.path, 0.0, (tab.0 + tab.1) / 2.0).unwrap().end()
        };
        let found: Vec<Point> =
            planned.toolpaths().flat_map(|way| way.tabs.iter().map(move |tab| middle(way, tab))).collect();
        if bites {
            assert!(found.is_empty());
            let drill_cycles = &planned.parts[0].tasks[0].drill_cycles;
            assert!(drill_cycles.len() > 4 && drill_cycles.iter().all(|stroke| !zone.contains(stroke.at)));
            continue;
        }
        assert_eq!(found.len(), 2, "{found:?}");
        for wanted in [at(30.75, 10.0), at(5.0, -0.75)] {
            assert!(found.iter().any(|place| place.distance_mm(wanted) < 0.2), "{wanted:?} {found:?}");
        }
    }
}

#[test]
fn hole_in_a_zone_is_an_error_and_zero_is_configurable() {
    let board = coupon();
    let mut work = only(&board, "drill", |_| {});
    work.setup.exclusions = vec![Bounds::of(at(0.0, 0.0)).with(at(5.0, 5.0))];
    let machine = virtual_drill();
    let rapid_time = |a: Point, b: Point| a.distance_mm(b);
    let options = PlanOptions { iterations: Some(200), ..PlanOptions::default() };
    let means = Means { options: &options, rapid_time: &rapid_time };
    let (planned, diagnostics) = plan_work(&board, &work, &machine, &means, &mut |_| true).unwrap();
    let told = diagnostics
        .iter()
        .filter(|diagnostic| diagnostic.code == "cam.holes_in_zone" && diagnostic.is_unacknowledged(&[]));
    assert_eq!(told.count(), 1, "{diagnostics:?}");
    assert_eq!(planned.parts[0].left_holes, [0]);
    assert!(
        planned.parts[0]
            .tasks
            .iter()
            .flat_map(|task| &task.drill_cycles)
            .all(|stroke| stroke.at != at(3.0, 3.0))
    );
    work.setup.alignment.pairs = 1;
    for (zero, face, corner) in [
        (Zero::Board, Face::Top, at(0.0, 0.0)),
        (Zero::Blank, Face::Top, at(-5.5, 0.0)),
        (Zero::File, Face::Top, at(0.0, 0.0)),
        (Zero::File, Face::Bottom, at(30.0, 0.0)),
    ] {
        (work.setup.zero, work.setup.face) = (zero, face);
        assert_eq!(PlacedBoard::of(&board, &work).origin, corner, "{zero:?} {face:?}");
    }
}

#[test]
fn engraving_follows_lines_and_joins_meeting_ones() {
    let mut board = coupon();
    let strokes = vec![
        Path::through(&[at(1.0, 1.0), at(2.0, 1.0)]).unwrap(),
        Path::through(&[at(3.0, 2.0), at(2.0, 1.0)]).unwrap(),
        Path {
            start: at(9.0, 1.0),
            segments: vec![PathSegment::Arc { to: at(10.0, 2.0), centre: at(9.0, 2.0), clockwise: false }],
        },
    ];
    board.legend = vec![crate::board::Legend { face: Face::Top, strokes, flashes: 2, source: 0 }];
    let work = only(&board, "engrave", |_| {});
    let (planned, diagnostics) = planned(&board, &work);
    let left = diagnostics.iter().find(|diagnostic| diagnostic.code == "cam.legend_flashes").unwrap();
    assert!(left.message("en").contains('2'), "{}", left.message("en"));
    assert_eq!(planned.toolpaths().count(), 2);
    assert!((planned.toolpaths_mm() - 1.0 - 2.0_f64.sqrt() - std::f64::consts::FRAC_PI_2).abs() < 1e-5);
}

#[test]
fn part_key_depends_only_on_inputs_of_its_part() {
    let machine = virtual_drill();
    let board = coupon();
    let work = Work::default_for(&board, &machine);
    let mut other = work.clone();
    other.operations[1].depth += mm(0.01);
    other.operations[0].name = "renamed".to_owned();
    other.operations[0].feed_mm_per_s = Some(1.0);
    other.operations[0].plunge_mm_per_s = Some(1.0);
    other.operations[0].spindle_rpm = Some(1_000);
    let mut turning = machine.clone();
    turning.rack.iter_mut().for_each(|tool| tool.spindle_rpm += 1_000);
    assert_eq!(key(&work, 0, &machine), key(&other, 0, &turning));
    assert_ne!(key(&work, 1, &machine), key(&other, 1, &machine));
    other.bits[0].diameter += mm(0.1);
    assert_ne!(key(&work, 0, &machine), key(&other, 0, &machine));
    assert_eq!(key(&work, 3, &machine), key(&other, 3, &machine));
}

#[test]
fn cached_part_reports_new_names_and_speeds() {
    let machine = virtual_drill();
    let board = coupon();
    let options = PlanOptions { iterations: Some(200), ..PlanOptions::default() };
    let rapid_time = |a: Point, b: Point| a.distance_mm(b);
    let means = Means { options: &options, rapid_time: &rapid_time };
    let work = only(&board, "drill", |operation| operation.depth = mm(1.0));
    let mut other = work.clone();
    other.operations[0].name = "Holes".to_owned();
    other.operations[0].plunge_mm_per_s = Some(1e4);
    other.operations[0].spindle_rpm = Some(3_000);
    let part =
        plan_operation(&PlacedBoard::of(&board, &work), &work, 0, &machine, &means, &mut |_| true).unwrap();
    for job in [&work, &other] {
        let scene = PlacedBoard::of(&board, job);
        let kept = assemble(scene, job, &machine, &means, vec![part.clone()]).unwrap();
        assert_eq!(kept, plan_work(&board, job, &machine, &means, &mut |_| true).unwrap());
    }
    let (_, found) = plan_work(&board, &other, &machine, &means, &mut |_| true).unwrap();
    let said = |code: &str| found.iter().any(|found| found.code == code);
    assert!(said("cam.not_through") && said("cam.plunge_bounded") && said("job.bit_breaks"), "{found:?}");
}

#[test]
fn path_parts_are_on_their_side_of_the_area() {
    let area = Area::of(&union(&[circle(at(0.0, 0.0), mm(4.0)), boxed(1.0, -1.0, 6.0, 1.0)]));
    let mut chance = Chance::new(9);
    for _ in 0..200 {
        let mut place = || at(chance.below(1200) as f64 * 0.01 - 5.0, chance.below(800) as f64 * 0.01 - 4.0);
        let (a, b, c) = (place(), place(), place());
        let half = circle(a, Length::from_mm(2.0 * a.distance_mm(b)));
        for path in [Path::through(&[a, b, c, a]).unwrap(), half] {
            let (ins, outs) = (cut::parts(&path, &area, true), cut::parts(&path, &area, false));
            let length = |parts: &[Path]| parts.iter().map(Path::length_mm).sum::<f64>();
            assert!((length(&ins) + length(&outs) - path.length_mm()).abs() < 1e-3, "{path:?}");
            for (parts, wanted) in [(&ins, true), (&outs, false)] {
                for part in parts.iter().filter(|part| part.length_mm() > 0.01) {
                    let middle = cut::between(part, 0.0, part.length_mm() / 2.0).unwrap().end();
                    let edge = area.index().nearest(middle, mm(1e-4)).is_some();
                    assert!(edge || area.contains(middle) == wanted, "{middle:?} of {path:?}");
                }
            }
        }
    }
}

#[test]
fn long_toolpath_dwells_repeatedly() {
    let board = coupon();
    let work = only(&board, "cut_out", |operation| operation.feed_mm_per_s = Some(0.3));
    let (planned, _) = planned(&board, &work);
    let program = lower_work(&planned, &work, &virtual_drill());
    let leg = program.legs.iter().rfind(|leg| matches!(leg.mark, Mark::Toolpath(_))).unwrap();
    let rests = leg.commands.iter().filter(|command| matches!(command, Command::Dwell { .. })).count();
    // More than four laps of 106 mm at 0.3 mm/s are over 1400 s.
    assert!((5..20).contains(&rests), "{rests}");
}

#[test]
fn drill_uses_feed_and_speed_of_the_tool_list() {
    let board = coupon();
    let work = Work::default_for(&board, &virtual_drill());
    let (planned, _) = planned(&board, &work);
    let rack = [
        "T1 drill 0.8 down 3 rpm 9000",
        "T2 drill 1",
        "T3 mill 0.8 down 9 rpm 9",
        "T4 drill 3 down 400 rpm 90000",
    ];
    let lines = rack.map(str::to_owned).to_vec();
    let changes = [("rack.tools".to_owned(), crate::machine::Value::Texts(lines))];
    let machine = crate::machine::apply(&virtual_drill(), &changes).unwrap();
    // For each tool: the feed of its first plunge in µm/s, and its spindle speed.
    let done = |machine: &crate::machine::Machine| {
        let program = lower_work(&planned, &work, machine);
        let (mut bit, mut rpm, mut done) = (None, 0, Vec::new());
        for command in program.legs.iter().flat_map(|leg| &leg.commands) {
            match command {
                Command::AwaitBit { bit: next } => bit = program.bits.get(*next as usize),
                Command::Spindle { rpm: now } => rpm = *now,
                Command::Plunge { feed_um_per_s, .. } => {
                    done.extend(bit.take().map(|bit| (bit.name.clone(), *feed_um_per_s, rpm)));
                }
                _ => {}
            }
        }
        done
    };
    let (usual, own) = (done(&virtual_drill()), done(&machine));
    let changed: Vec<_> = usual.iter().zip(&own).filter(|(usual, own)| usual != own).collect();
    assert_eq!(
        changed,
        [(&("drill 0.8".to_owned(), 12_000, 30_000), &("drill 0.8".to_owned(), 3_000, 9_000))]
    );
    // No faster than the machine.
    let operation = Operation::usual("drill", Face::Top).unwrap();
    let bounded = crate::cam::suits::with_bit(&operation, &machine.rack[3].bit(), &machine);
    assert_eq!((bounded.plunge_mm_per_s, bounded.spindle_rpm), (50.0, 60_000));
}

#[test]
fn disabled_spindles_stay_up() {
    let off = crate::machine::Value::Numbers(vec![1.0, 0.0]);
    let six = crate::machine::six_spindles();
    let machine = crate::machine::apply(&six, &[("spindle.enabled".to_owned(), off)]).unwrap();
    let rows = [
        (&six, None, Some(0b11_1111)),
        (&machine, None, Some(0b11_1101)),
        (&machine, Some(0b100), Some(0b100)),
    ];
    for (machine, wanted, set) in rows {
        assert_eq!(crate::cam::spindles(wanted, machine).ok(), set);
    }
    let refused = crate::cam::spindles(Some(0b110), &machine).unwrap_err();
    assert_eq!(refused[0].code, "plan.no_such_spindle");
}
