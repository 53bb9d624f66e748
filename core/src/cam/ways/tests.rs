//! Ways and programs of small boards: copper that stays is never cut, every island is enclosed, gaps are opened or told,
//! tabs hold, holes and slots are made, and equal boards give equal programs.

use super::cut::{self, Area};
use super::*;
use crate::board::{Copper, Face, Hole, Slot};
use crate::cam::tour::Chance;
use crate::cam::work::{Clear, Cure, CutOut, CutSide, Direction, Holes, Isolate, Remedy};
use crate::geometry::{Bounds, Region, Segment, circle, grow, rectangle, sweep, union, winding};
use crate::job::{Command, Mark, Program};
use crate::machine::virtual_drill;

fn mm(value: f64) -> Length {
    Length::from_mm(value)
}

fn at(x: f64, y: f64) -> Point {
    Point::from_mm(x, y)
}

fn boxed(x0: f64, y0: f64, x1: f64, y1: f64) -> Path {
    rectangle(Bounds::of(at(x0, y0)).with(at(x1, y1)))
}

fn with_copper(paths: &[Path]) -> Board {
    let region = union(paths);
    let nets = vec![None; region.islands.len()];
    Board {
        name: "coupon".to_owned(),
        copper: vec![Copper { face: Face::Top, region, nets, source: 0 }],
        ..Board::default()
    }
}

fn hole(x: f64, y: f64, size: f64) -> Hole {
    Hole { at: at(x, y), diameter: Some(mm(size)), plated: None, source: 0, tool_code: 1, line: 1 }
}

/// Pads and tracks on 30 × 20 mm, a few holes, one too large for a drill, a slot.
fn coupon() -> Board {
    let mut chance = Chance::new(5);
    let mut paths = Vec::new();
    for row in 0..4 {
        for column in 0..6 {
            let (x, y) = (3.0 + 4.5 * f64::from(column), 3.0 + 4.5 * f64::from(row));
            let size = 1.2 + chance.below(10) as f64 * 0.1;
            paths.push(if (row + column) % 2 == 0 {
                circle(at(x, y), mm(size))
            } else {
                boxed(x - size / 2.0, y - size / 2.0, x + size / 2.0, y + size / 2.0)
            });
            if column % 3 == 0 {
                let track = Path::through(&[at(x, y), at(x + 2.0, y + 0.7), at(x + 4.5, y)]).unwrap();
                paths.extend(sweep(&[track], mm(0.4)).paths().cloned());
            }
        }
    }
    let holes = vec![hole(3.0, 3.0, 0.8), hole(12.0, 3.0, 0.8), hole(7.5, 7.5, 1.0), hole(21.0, 12.0, 5.0)];
    let slot = Slot {
        path: vec![at(24.0, 17.0), at(27.0, 17.0)],
        width: Some(mm(1.0)),
        plated: None,
        source: 0,
        tool_code: 2,
        line: 9,
    };
    let outline = crate::geometry::even_odd(&[boxed(0.0, 0.0, 30.0, 20.0), boxed(14.0, 8.5, 17.0, 11.5)]);
    Board { holes, slots: vec![slot], outline, ..with_copper(&paths) }
}

fn planned(board: &Board, work: &Work) -> (Planned, Vec<Remark>) {
    let options = PlanOptions { seed: 1, iterations: Some(200), ..PlanOptions::default() };
    let hop_time = |a: Point, b: Point| a.distance_mm(b);
    let means = Means { options: &options, hop_time: &hop_time };
    plan_work(board, work, &virtual_drill(), &means, &mut |_| true).unwrap()
}

fn only(board: &Board, word: &str, change: impl FnOnce(&mut Operation)) -> Work {
    let machine = virtual_drill();
    let mut work = Work::default_for(board, &machine);
    let mut operation = Operation::usual(word, Face::Top, &machine).unwrap();
    change(&mut operation);
    work.operations = vec![operation];
    work
}

fn mill(name: &str, width: f64) -> Bit {
    Bit { diameter: mm(width), name: name.to_owned(), cutter: Cutter::Mill }
}

/// The work that isolates `board` with a mill of `width`.
fn isolation(board: &Board, width: f64, change: impl FnOnce(&mut Isolate)) -> Work {
    let mut work = only(board, "isolate", |operation| {
        operation.bit = "m".to_owned();
        if let Action::Isolate(isolate) = &mut operation.action {
            change(isolate);
        }
    });
    work.bits.extend([mill("m", width), mill("thin", width / 2.0)]);
    work
}

/// The nearest that any way of isolation comes to copper, less half of the cut: never below zero but for rounding.
fn least_clearance(planned: &Planned, work: &Work) -> f64 {
    let copper = Area::of(&planned.board.copper[0].region);
    let mut least = f64::MAX;
    for part in &planned.parts {
        let operation = &work.operations[part.operation as usize];
        for task in &part.tasks {
            let half = task.bit.width_at(operation.depth).mm() / 2.0;
            for piece in task.ways.iter().flat_map(|way| cut::cut_at(&way.path, &[])) {
                let looks = ((piece.end - piece.begin) / 0.05) as u32 + 2;
                for look in 0..=looks {
                    let place = cut::point_on(piece.from, piece.segment, f64::from(look) / f64::from(looks));
                    assert!(!copper.contains(place), "the bit's middle is in copper at {place:?}");
                    let near = copper.index().nearest(place, mm(half));
                    least = least.min(near.map_or(f64::MAX, |near| near.distance.mm() - half));
                }
            }
        }
    }
    least
}

fn encloses(ways: &[Path], point: Point) -> bool {
    ways.iter().any(|way| way.is_closed() && winding(way, point) != 0)
}

/// A place inside of an island.
fn inside(island: &crate::geometry::Island) -> Point {
    let core = grow(&Region { islands: vec![island.clone()] }, mm(-0.02));
    core.islands[0].outer.start
}

#[test]
fn isolation_never_cuts_copper_and_encloses_every_island() {
    let board = coupon();
    for (direction, passes) in [(Direction::Climb, 1), (Direction::Conventional, 1), (Direction::Climb, 3)] {
        let work = isolation(&board, 0.2, |isolate| {
            (isolate.passes, isolate.direction, isolate.loop_overlap) = (passes, direction, Length::ZERO);
        });
        let (planned, _) = planned(&board, &work);
        let clearance = least_clearance(&planned, &work);
        assert!(clearance > -0.0025, "{passes} passes come {clearance} mm too near");
        if passes > 1 {
            continue;
        }
        let ways: Vec<Path> = planned.ways().map(|way| way.path.clone()).collect();
        let copper = &planned.board.copper[0].region;
        assert!(copper.islands.len() > 8);
        for island in &copper.islands {
            let place = inside(island);
            assert!(encloses(&ways, place), "nothing goes round {place:?}");
            let round = ways.iter().find(|way| winding(way, place) != 0).unwrap();
            let climbs = winding(round, place) < 0;
            assert_eq!(climbs, direction == Direction::Climb);
        }
    }
}

#[test]
fn a_gap_as_wide_as_the_bit_is_open_and_a_narrower_one_is_not() {
    for (gap, opens) in [(0.2, true), (0.21, true), (0.19, false)] {
        let board = with_copper(&[boxed(0.0, 0.0, 2.0, 5.0), boxed(2.0 + gap, 0.0, 4.0, 5.0)]);
        let work = isolation(&board, 0.2, |isolate| isolate.passes = 1);
        let (planned, _) = planned(&board, &work);
        assert_eq!(planned.ways().count(), if opens { 2 } else { 1 }, "gap {gap}");
    }
}

#[test]
fn a_thin_bit_goes_only_where_the_thick_one_did_not_fit() {
    let board =
        with_copper(&[boxed(0.0, 0.0, 2.0, 5.0), boxed(2.15, 0.0, 4.0, 5.0), boxed(6.0, 0.0, 7.0, 5.0)]);
    let work = isolation(&board, 0.2, |isolate| {
        isolate.passes = 1;
        isolate.further = vec!["thin".to_owned()];
    });
    let (planned, _) = planned(&board, &work);
    let tasks = &planned.parts[0].tasks;
    assert_eq!(tasks.len(), 2);
    let thin: f64 = tasks[1].ways.iter().map(|way| way.path.length_mm()).sum();
    assert!(thin > 9.5 && thin < 12.0, "twice along the gap of 5 mm, not {thin} mm");
    for way in &tasks[1].ways {
        let bounds = way.path.bounds_for_test();
        assert!(bounds.min.x > mm(1.9) && bounds.max.x < mm(2.25), "{bounds:?}");
    }
    assert!(least_clearance(&planned, &work) > -0.0025);
}

impl Path {
    fn bounds_for_test(&self) -> Bounds {
        crate::geometry::path_bounds(self)
    }
}

#[test]
fn cures_open_a_gap_each_in_its_way() {
    let board = with_copper(&[boxed(0.0, 0.0, 2.0, 5.0), boxed(2.15, 0.0, 4.0, 5.0)]);
    for remedy in [Remedy::Bit("thin".to_owned()), Remedy::Centred] {
        let cure = Cure { from: at(2.0, 2.5), to: at(2.15, 2.5), with: remedy.clone() };
        let work = isolation(&board, 0.2, |isolate| (isolate.passes, isolate.cures) = (1, vec![cure]));
        let (planned, remarks) = planned(&board, &work);
        let cured = &planned.parts[0].tasks[1];
        let length: f64 = cured.ways.iter().map(|way| way.path.length_mm()).sum();
        if remedy == Remedy::Centred {
            assert!((length - 5.0).abs() < 0.3, "{length}");
            let middle = cured.ways[0].path.start.x.mm();
            assert!((middle - 2.075).abs() < 0.002, "{middle}");
            let taken = remarks.iter().find(|remark| remark.code == "cam.cure_takes").unwrap();
            assert!(taken.message("en").contains("0.025"), "{}", taken.message("en"));
        } else {
            assert!(length > 9.5, "{length}");
            assert_eq!(cured.bit.name, "thin");
        }
    }
    let nowhere = Cure { from: at(9.0, 9.0), to: at(9.1, 9.0), with: Remedy::Centred };
    let work = isolation(&board, 0.2, |isolate| (isolate.passes, isolate.cures) = (1, vec![nowhere]));
    assert!(planned(&board, &work).1.iter().any(|remark| remark.code == "cam.cure_without_gap"));
}

#[test]
fn a_shallow_cure_has_its_own_depth() {
    let board = with_copper(&[boxed(0.0, 0.0, 2.0, 5.0), boxed(2.15, 0.0, 4.0, 5.0)]);
    let cure = Cure { from: at(2.0, 2.5), to: at(2.15, 2.5), with: Remedy::Depth(mm(0.05)) };
    let work = only(&board, "isolate", |operation| {
        operation.depth = mm(0.2);
        if let Action::Isolate(isolate) = &mut operation.action {
            (isolate.passes, isolate.cures) = (1, vec![cure]);
        }
    });
    let (planned, _) = planned(&board, &work);
    let tasks = &planned.parts[0].tasks;
    assert_eq!(tasks[0].ways.len(), 1, "0.207 mm wide at 0.2 mm depth does not fit");
    assert!(tasks[1].ways.iter().all(|way| way.depths == [mm(0.05)]));
    assert_eq!(tasks[0].bit, tasks[1].bit);
}

#[test]
fn passes_of_one_contour_are_cut_without_coming_up_between() {
    let board = with_copper(&[circle(at(5.0, 5.0), mm(3.0)), circle(at(15.0, 5.0), mm(3.0))]);
    let work = isolation(&board, 0.2, |isolate| isolate.passes = 4);
    assert_eq!(planned(&board, &work).0.ways().count(), 2);
}

#[test]
fn clearing_leaves_nothing_but_the_picture() {
    let board = Board {
        outline: union(&[boxed(0.0, 0.0, 12.0, 8.0)]),
        ..with_copper(&[boxed(3.0, 3.0, 6.0, 5.0), circle(at(9.0, 4.0), mm(1.5))])
    };
    let mut work = only(&board, "clear", |operation| {
        operation.bit = "m".to_owned();
        if let Action::Clear(clear) = &mut operation.action {
            *clear = Clear { stepover_percent: 60.0, ..clear.clone() };
        }
    });
    work.bits.push(mill("m", 0.8));
    let (planned, _) = planned(&board, &work);
    assert!(least_clearance(&planned, &work) > -0.0025);
    let ways: Vec<Path> = planned.ways().map(|way| way.path.clone()).collect();
    assert!(ways.len() < 16, "{} starts", ways.len());
    let cut = sweep(&ways, mm(0.8));
    let left = crate::geometry::combine(&board.outline, &cut, crate::geometry::Rule::Difference);
    let copper = crate::geometry::area_mm2(&board.copper[0].region);
    let area = crate::geometry::area_mm2(&left);
    assert!((area - copper).abs() < 0.02 * copper, "{area} mm² are left of {copper} mm²");
}

#[test]
fn the_order_and_the_starts_of_contours_do_not_matter() {
    let board = coupon();
    let mut other = board.clone();
    let region = &mut other.copper[0].region;
    region.islands.reverse();
    for island in &mut region.islands {
        let turns = island.outer.segments.len() / 2;
        island.outer = cut::started_at(&island.outer, turns);
    }
    let work = Work::default_for(&board, &virtual_drill());
    let program = |board: &Board| lower_work(&planned(board, &work).0, &work, &virtual_drill());
    assert_eq!(program(&board), program(&other));
}

fn deepest(leg: &crate::job::Leg) -> Length {
    let heights = leg.commands.iter().filter_map(|command| match command {
        Command::Plunge { to, .. } => Some(*to),
        Command::Mill { height, .. } | Command::MillArc { height, .. } => Some(*height),
        _ => None,
    });
    heights.min().unwrap_or_default()
}

#[test]
fn the_default_job_does_all_there_is_to_do() {
    let board = coupon();
    let machine = virtual_drill();
    let work = Work::default_for(&board, &machine);
    let words: Vec<_> = work.operations.iter().map(|operation| operation.action.word()).collect();
    assert_eq!(words, ["isolate", "drill", "bore", "cut_out"]);
    let (planned, remarks) = planned(&board, &work);
    assert!(remarks.iter().all(|remark| remark.weight < Weight::Loss), "{remarks:?}");
    let program = lower_work(&planned, &work, &machine);
    let holes: Vec<_> = program.legs.iter().filter(|leg| matches!(leg.mark, Mark::Hole(_))).collect();
    assert_eq!(holes.len(), 3);
    let names: Vec<_> = program.bits.iter().map(|bit| bit.name.as_str()).collect();
    assert_eq!(names, ["V 30°", "0.8 mm", "1 mm", "Mill 1.5 mm", "Mill 0.8 mm", "Mill 1.5 mm"]);
    let ways = program.legs.iter().filter(|leg| matches!(leg.mark, Mark::Way(_))).count();
    assert_eq!(ways, planned.ways().count());
    // Every leg that goes down comes up again, and the last way is the outer contour.
    for leg in program.legs.iter().filter(|leg| deepest(leg) < Length::ZERO) {
        assert_eq!(leg.commands.last(), Some(&Command::Retract { to: program.safe_height }));
    }
    let last = planned.ways().last().unwrap();
    assert!(last.path.length_mm() > 100.0);
    assert_eq!(deepest(&program.legs[program.legs.len() - 2]), mm(-2.1));
}

#[test]
fn bored_holes_and_slots_have_their_size() {
    let board = coupon();
    let work = only(&board, "bore", |_| {});
    let (planned, _) = planned(&board, &work);
    assert_eq!((planned.parts[0].holes.as_slice(), planned.parts[0].slots.as_slice()), (&[3][..], &[0][..]));
    let [wide, thin] = planned.parts[0].tasks.as_slice() else { panic!("two bits") };
    let cut = sweep(&wide.ways.iter().map(|way| way.path.clone()).collect::<Vec<_>>(), wide.bit.diameter);
    let area = crate::geometry::area_mm2(&cut);
    assert!((area - 6.25 * std::f64::consts::PI).abs() < 0.02, "{area}: nothing is left in the middle");
    assert!(wide.ways.len() >= 2 && wide.ways[0].path.length_mm() < wide.ways[1].path.length_mm());
    assert!(wide.ways.iter().all(|way| way.entry == Entry::Helix));
    let bounds = sweep(&thin.ways.iter().map(|way| way.path.clone()).collect::<Vec<_>>(), thin.bit.diameter)
        .bounds()
        .unwrap();
    assert!((bounds.max.y - bounds.min.y).mm() > 0.999 && (bounds.max.x - bounds.min.x).mm() > 3.999);
    assert!((bounds.max.y - bounds.min.y).mm() < 1.001 && (bounds.max.x - bounds.min.x).mm() < 4.001);
}

#[test]
fn what_no_bit_fits_is_a_loss_until_it_is_seen() {
    let mut board = coupon();
    board.slots[0].width = Some(mm(0.3));
    let work = Work::default_for(&board, &virtual_drill());
    let hop_time = |a: Point, b: Point| a.distance_mm(b);
    let mut options = PlanOptions { iterations: Some(0), ..PlanOptions::default() };
    let plan = |options: &PlanOptions| {
        plan_work(&board, &work, &virtual_drill(), &Means { options, hop_time: &hop_time }, &mut |_| true)
    };
    let losses = plan(&options).unwrap_err();
    let codes: Vec<_> = losses.iter().map(|loss| loss.code.clone()).collect();
    assert_eq!(codes, ["cam.too_narrow_to_bore", "plan.slots_not_drilled"]);
    assert!(losses.iter().all(|loss| !loss.message("en").contains("cam.")), "{losses:?}");
    options.accept = codes;
    let (planned, _) = plan(&options).unwrap();
    assert_eq!(planned.accepted, options.accept);
}

#[test]
fn tabs_hold_the_board_in_every_pass() {
    let board = coupon();
    let work = only(&board, "cut_out", |_| {});
    let (planned, _) = planned(&board, &work);
    let [inner, outer] = planned.parts[0].tasks[0].ways.as_slice() else { panic!("inner and outer") };
    assert!(inner.tabs.is_empty() && inner.path.length_mm() < outer.path.length_mm());
    assert_eq!(outer.tabs.len(), 4);
    let held: f64 = outer.tabs.iter().map(|tab| tab.1 - tab.0).sum();
    assert!((held - 4.0 * 3.5).abs() < 1e-6, "{held}");
    // The bit's middle runs outside of the outline by its radius.
    let bounds = crate::geometry::path_bounds(&outer.path);
    assert!((bounds.min.x.mm() + 0.75).abs() < 0.003 && (bounds.max.y.mm() - 20.75).abs() < 0.003);
    let program = lower_work(&planned, &work, &virtual_drill());
    let leg = program.legs.iter().rfind(|leg| matches!(leg.mark, Mark::Way(_))).unwrap();
    let over: f64 = over_tabs(&program, leg);
    // At its last lap the bit is at tab height or above over four tabs.
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
fn mouse_bites_are_drilled_on_the_edge_and_tabs_are_not_cut() {
    let board = coupon();
    let work = only(&board, "cut_out", |operation| {
        if let Action::CutOut(cut_out) = &mut operation.action {
            *cut_out = CutOut { bites: true, ..cut_out.clone() };
        }
    });
    let (planned, _) = planned(&board, &work);
    let [bites, cut] = planned.parts[0].tasks.as_slice() else { panic!("drill and mill") };
    assert_eq!(cut.ways.len(), 1 + 4);
    assert!(bites.strokes.len() >= 4 * 3, "{}", bites.strokes.len());
    let edge = Area::of(&board.outline);
    for stroke in &bites.strokes {
        assert!(edge.index().nearest(stroke.at, mm(0.003)).is_some(), "{:?}", stroke.at);
    }
}

#[test]
fn tabs_by_hand_are_where_they_were_put() {
    let board = coupon();
    let work = only(&board, "cut_out", |operation| {
        if let Action::CutOut(cut_out) = &mut operation.action {
            cut_out.tab_at = vec![at(15.0, 0.0), at(30.0, 10.0)];
            cut_out.side = CutSide::Outside;
        }
    });
    let (planned, _) = planned(&board, &work);
    let outer = planned.ways().last().unwrap();
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
fn the_bottom_is_mirrored_and_pins_fall_on_pins() {
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
    let pins: Vec<Point> = bottom.parts[0].tasks[0].strokes.iter().map(|stroke| stroke.at).collect();
    assert!(pins.iter().all(|pin| pin.x < Length::ZERO || pin.x > mm(30.0)));
    assert!(top.parts.iter().all(|part| part.holes.iter().all(|hole| *hole < 4)), "pins are drilled once");
    assert_eq!(bottom.board.holes[0].at, at(27.0, 3.0));
    assert_eq!(bottom.origin, top.origin);
    let program = lower_work(&bottom, &work, &machine);
    assert_eq!(deepest(&program.legs[2]).mm().round(), -8.0, "through the board and into the bed");
}

#[test]
fn no_way_enters_an_exclusion_zone() {
    let board = coupon();
    let zone = Bounds::of(at(-5.0, -5.0)).with(at(8.0, 8.0));
    let mut work = isolation(&board, 0.2, |isolate| isolate.passes = 1);
    work.setup.exclusions = vec![zone];
    let (planned, remarks) = planned(&board, &work);
    assert!(remarks.iter().any(|remark| remark.code == "cam.zone_in_the_way"));
    for way in planned.ways() {
        for point in way.path.flattened(1e-3) {
            assert!(!zone.grown(mm(0.095)).contains(point), "{point:?}");
        }
    }
    assert!(planned.ways().any(|way| !way.path.is_closed()), "contours across the edge are cut open");
}

#[test]
fn pecks_come_up_between() {
    let board = coupon();
    let work = only(&board, "drill", |operation| {
        if let Action::Drill(drill) = &mut operation.action {
            (drill.peck, drill.holes) = (mm(0.9), Holes::Board);
        }
    });
    let options = PlanOptions {
        iterations: Some(0),
        accept: vec!["plan.no_bit".to_owned(), "plan.slots_not_drilled".to_owned()],
        ..PlanOptions::default()
    };
    let hop_time = |a: Point, b: Point| a.distance_mm(b);
    let means = Means { options: &options, hop_time: &hop_time };
    let (planned, _) = plan_work(&board, &work, &virtual_drill(), &means, &mut |_| true).unwrap();
    let program = lower_work(&planned, &work, &virtual_drill());
    let leg = program.legs.iter().find(|leg| matches!(leg.mark, Mark::Hole(_))).unwrap();
    let plunges = leg.commands.iter().filter(|command| matches!(command, Command::Plunge { .. })).count();
    // 1.6 + 0.5 + 0.4 / tan 65° = 2.287 mm in steps of at most 0.9 mm.
    assert_eq!(plunges, 3);
    assert!((deepest(leg).mm() + 2.2865).abs() < 1e-3, "{:?}", deepest(leg));
}

#[test]
fn engraving_follows_the_lines_and_joins_what_meets() {
    let mut board = coupon();
    let strokes = vec![
        Path::through(&[at(1.0, 1.0), at(2.0, 1.0)]).unwrap(),
        Path::through(&[at(3.0, 2.0), at(2.0, 1.0)]).unwrap(),
        Path {
            start: at(9.0, 1.0),
            segments: vec![Segment::Arc { to: at(10.0, 2.0), centre: at(9.0, 2.0), clockwise: false }],
        },
    ];
    board.legend = vec![crate::board::Legend { face: Face::Top, strokes, source: 0 }];
    let work = only(&board, "engrave", |_| {});
    let (planned, _) = planned(&board, &work);
    assert_eq!(planned.ways().count(), 2);
    assert!((planned.milled_mm() - 1.0 - 2.0_f64.sqrt() - std::f64::consts::FRAC_PI_2).abs() < 1e-5);
}

#[test]
fn a_key_changes_with_what_its_part_depends_on_and_only_then() {
    let machine = virtual_drill();
    let board = coupon();
    let work = Work::default_for(&board, &machine);
    let mut other = work.clone();
    other.operations[1].feed_mm_per_s += 1.0;
    other.operations[0].name = "renamed".to_owned();
    assert_eq!(key(&work, 0, &machine), key(&other, 0, &machine));
    assert_ne!(key(&work, 1, &machine), key(&other, 1, &machine));
    other.bits[0].diameter += mm(0.1);
    assert_ne!(key(&work, 0, &machine), key(&other, 0, &machine));
    assert_eq!(key(&work, 3, &machine), key(&other, 3, &machine));
}

#[test]
fn parts_of_a_path_lie_on_their_side() {
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
