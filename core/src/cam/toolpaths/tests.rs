//! Toolpaths and programs of small boards: copper that stays is never cut, every island is isolated, gaps are
//! opened or reported, tabs hold. Holes and slots are made, and equal boards give equal programs.

mod briefed;
mod clear;
mod follows;
mod held;
mod holes;
mod inlets;
mod kept;
mod links;
mod program;
mod slivers;

use super::cut::{self, Area};
use super::*;
use crate::board::{Copper, Face, Hole, Slot};
use crate::cam::work::{
    Clear, CutDirection, CutOut, CutSide, Holes, Isolate, LocalIsolation, MillHoles, Remedy, Zero,
};
use crate::chance::Chance;
use crate::geometry::{Bounds, PathSegment, Region, circle, grow, rectangle, sweep, union, winding};
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
        copper: vec![Copper { face: Face::Top, region, nets, ..Copper::default() }],
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

fn planned(board: &Board, work: &Work) -> (Planned, Vec<Diagnostic>) {
    let options = PlanOptions { seed: 1, iterations: Some(200), ..PlanOptions::default() };
    let rapid_time = |a: Point, b: Point| a.distance_mm(b);
    let means = Means { options: &options, rapid_time: &rapid_time };
    plan_work(board, work, &virtual_drill(), &means, &mut |_| true).unwrap()
}

fn only(board: &Board, word: &str, change: impl FnOnce(&mut Operation)) -> Work {
    let machine = virtual_drill();
    let mut work = Work::default_for(board, &machine);
    let mut operation = Operation::usual(word, Face::Top).unwrap();
    change(&mut operation);
    work.operations = vec![operation];
    work
}

fn mill(name: &str, width: f64) -> Bit {
    Bit { diameter: mm(width), name: name.to_owned(), cutter: Cutter::Mill, handling: Default::default() }
}

fn isolation(board: &Board, width: f64, change: impl FnOnce(&mut Isolate)) -> Work {
    let mut work = only(board, "isolate", |operation| {
        operation.bit = "m".to_owned();
        if let OperationKind::Isolate(isolate) = &mut operation.action {
            change(isolate);
        }
    });
    work.bits.extend([mill("m", width), mill("thin", width / 2.0)]);
    work
}

/// Smallest distance of any isolation cut from copper: never below zero except for rounding.
fn least_clearance(planned: &Planned, work: &Work) -> f64 {
    let copper = Area::of(&planned.board.copper[0].region);
    let mut least = f64::MAX;
    for part in &planned.parts {
        let operation = &work.operations[part.operation as usize];
        for task in &part.tasks {
            let half = task.bit.width_at(operation.depth).mm() / 2.0;
            for piece in task.toolpaths.iter().flat_map(|way| cut::cut_at(&way.path, &[])) {
                let looks = ((piece.end_mm - piece.begin_mm) / 0.05) as u32 + 2;
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

fn encloses(toolpaths: &[Path], point: Point) -> bool {
    toolpaths.iter().any(|way| way.is_closed() && winding(way, point) != 0)
}

fn inside(island: &crate::geometry::Island) -> Point {
    let core = grow(&Region { islands: vec![island.clone()] }, mm(-0.02));
    core.islands[0].outer.start
}

#[test]
fn pads_one_cut_apart_share_a_toolpath() {
    let single = |board: &Board| isolation(board, 0.2, |isolate| isolate.passes = 1);
    let milled = |board: &Board| {
        let (planned, _) = planned(board, &single(board));
        (planned.toolpaths().count(), planned.toolpaths_mm(), planned)
    };
    let round = |x: f64| boxed(x, 0.0, x + 1.0, 1.0);
    let (_, alone, _) = milled(&with_copper(&[round(0.0)]));
    // Starts of pads, number of shared sides, distance relative to the cut's width.
    let rows: [(&[f64], f64); 5] = [
        (&[0.0, 1.2], 1.0),
        (&[0.0, 1.2, 2.4], 2.0),
        (&[0.0, 1.199, 2.4], 2.0), // 1 µm off
        (&[0.0, 1.21, 2.42], 0.0),
        (&[0.0, 1.2, 2.41], 1.0),
    ];
    for (places, shared) in rows {
        let pads: Vec<Path> = places.iter().map(|x| round(*x)).collect();
        let board = with_copper(&pads);
        let (count, length, planned) = milled(&board);
        // If pads share a stretch, a link in the mouth of the gap would be too near to the copper.
        let expected = if shared > 0.0 { 1..=places.len() } else { 1..=1 };
        assert!(expected.contains(&count), "{places:?}: {count} toolpaths");
        // A closed toolpath that starts with a plunge overlaps its start by 0.5 mm; one that a link reaches
        // doesn't.
        let most = places.len() as f64 * alone - shared * 1.5 + 0.1;
        let least = most - 0.2 - (places.len() - 1) as f64 * 0.5;
        assert!((least..most).contains(&length), "{places:?}: {length} not {least} to {most}");
        assert!(least_clearance(&planned, &single(&board)) > -0.0021);
        // The merged cut clears the area of both toolpaths, except for the micrometres that they are nearer.
        let cut = sweep(&planned.toolpaths().map(|way| way.path.clone()).collect::<Vec<_>>(), mm(0.2));
        let whole = grow(&board.copper[0].region, mm(0.197));
        let left = crate::geometry::combine(
            &whole,
            &union(&[pads, cut.paths().cloned().collect()].concat()),
            crate::geometry::CombineRule::Difference,
        );
        let left = grow(&grow(&left, mm(-0.003)), mm(0.003));
        assert!(left.is_empty(), "{places:?}: {left:?}");
    }
}

#[test]
fn pad_in_a_pour_one_cut_away_is_cut_around_once() {
    let pour = crate::geometry::even_odd(&[boxed(-3.0, -3.0, 3.0, 3.0), circle(at(0.0, 0.0), mm(1.4))]);
    let pad = circle(at(0.0, 0.0), mm(1.0));
    let mut board = with_copper(&[pad]);
    let region = Region { islands: [pour.islands, board.copper[0].region.islands.clone()].concat() };
    board.copper[0].nets = vec![None; region.islands.len()];
    board.copper[0].region = region;
    let (planned, _) = planned(&board, &isolation(&board, 0.2, |isolate| isolate.passes = 1));
    assert_eq!(planned.toolpaths().count(), 2, "round the pour, and once between pour and pad");
}

#[test]
fn isolation_cuts_no_copper_and_encloses_every_island() {
    let board = coupon();
    for (direction, passes) in
        [(CutDirection::Climb, 1), (CutDirection::Conventional, 1), (CutDirection::Climb, 3)]
    {
        let work = isolation(&board, 0.2, |isolate| {
            (isolate.passes, isolate.direction, isolate.loop_overlap) = (passes, direction, Length::ZERO);
        });
        let (planned, _) = planned(&board, &work);
        let clearance = least_clearance(&planned, &work);
        assert!(clearance > -0.0025, "{passes} passes come {clearance} mm too near");
        if passes > 1 {
            continue;
        }
        let toolpaths: Vec<Path> = planned.toolpaths().map(|way| way.path.clone()).collect();
        let copper = &planned.board.copper[0].region;
        assert!(copper.islands.len() > 8);
        for island in &copper.islands {
            let place = inside(island);
            assert!(encloses(&toolpaths, place), "nothing goes round {place:?}");
            let round = toolpaths.iter().find(|way| winding(way, place) != 0).unwrap();
            let climbs = winding(round, place) < 0;
            assert_eq!(climbs, direction == CutDirection::Climb);
        }
    }
}

#[test]
fn gap_opens_only_if_the_tool_fits() {
    for (gap, opens) in [(0.2, true), (0.21, true), (0.19, false)] {
        let board = with_copper(&[boxed(0.0, 0.0, 2.0, 5.0), boxed(2.0 + gap, 0.0, 4.0, 5.0)]);
        let work = isolation(&board, 0.2, |isolate| isolate.passes = 1);
        let (planned, _) = planned(&board, &work);
        let place = at(2.0 + gap / 2.0, 2.5);
        let passes = |(from, segment): (Point, PathSegment)| {
            let share = cut::nearest_share(from, segment, place);
            cut::point_on(from, segment, share).distance_mm(place) < 0.02
        };
        let through = planned.toolpaths().any(|way| way.path.pieces().any(passes));
        assert_eq!(through, opens, "gap {gap}");
    }
}

#[test]
fn thin_tool_cuts_only_gaps_the_thick_one_leaves() {
    let board =
        with_copper(&[boxed(0.0, 0.0, 2.0, 5.0), boxed(2.15, 0.0, 4.0, 5.0), boxed(6.0, 0.0, 7.0, 5.0)]);
    let work = isolation(&board, 0.2, |isolate| {
        isolate.passes = 1;
        isolate.further = vec!["thin".to_owned()];
    });
    let (planned, _) = planned(&board, &work);
    let tasks = &planned.parts[0].tasks;
    assert_eq!(tasks.len(), 2);
    let thin: f64 = tasks[1].toolpaths.iter().map(|way| way.path.length_mm()).sum();
    assert!(thin > 9.5 && thin < 12.0, "twice along the gap of 5 mm, not {thin} mm");
    for way in &tasks[1].toolpaths {
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
fn voronoi_cuts_once_midway() {
    let board = with_copper(&[boxed(0.0, 0.0, 2.0, 5.0), boxed(3.0, 0.0, 5.0, 5.0)]);
    let work = isolation(&board, 0.2, |isolate| isolate.voronoi = true);
    let (planned, _) = planned(&board, &work);
    assert_eq!(planned.toolpaths().count(), 1);
    let way = &planned.toolpaths().next().unwrap().path;
    assert!((way.length_mm() - 7.0).abs() < 0.2, "{}", way.length_mm());
    assert!(way.corners().all(|corner| (corner.x.mm() - 2.5).abs() < 0.003), "{way:?}");
}

#[test]
fn every_remedy_opens_its_gap() {
    let board = with_copper(&[boxed(0.0, 0.0, 2.0, 5.0), boxed(2.15, 0.0, 4.0, 5.0)]);
    for remedy in [Remedy::Bit("thin".to_owned()), Remedy::Centred] {
        let cure = LocalIsolation { from: at(2.0, 2.5), to: at(2.15, 2.5), with: remedy.clone() };
        let work = isolation(&board, 0.2, |isolate| (isolate.passes, isolate.cures) = (1, vec![cure]));
        let (planned, diagnostics) = planned(&board, &work);
        let cured = &planned.parts[0].tasks[1];
        let length: f64 = cured.toolpaths.iter().map(|way| way.path.length_mm()).sum();
        if remedy == Remedy::Centred {
            assert!((length - 5.0).abs() < 0.3, "{length}");
            // Along the middle from one end of the gap to the other, and a little around its mouths.
            let middle = cured.toolpaths[0].path.corners().filter(|at| (at.x.mm() - 2.075).abs() < 0.002);
            assert!(middle.count() >= 2, "{:?}", cured.toolpaths[0].path);
            let taken = diagnostics.iter().find(|diagnostic| diagnostic.code == "cam.cure_takes").unwrap();
            assert!(taken.message("en").contains("0.025"), "{}", taken.message("en"));
        } else {
            assert!(length > 9.5, "{length}");
            assert_eq!(cured.bit.name, "thin");
        }
    }
    let nowhere = LocalIsolation { from: at(9.0, 9.0), to: at(9.1, 9.0), with: Remedy::Centred };
    let work = isolation(&board, 0.2, |isolate| (isolate.passes, isolate.cures) = (1, vec![nowhere]));
    assert!(planned(&board, &work).1.iter().any(|diagnostic| diagnostic.code == "cam.cure_without_gap"));
}

#[test]
fn v_bit_remedy_cuts_as_deep_as_its_gap_allows() {
    let board = with_copper(&[boxed(0.0, 0.0, 2.0, 5.0), boxed(2.12, 0.0, 4.0, 5.0)]);
    let sharp = Bit {
        diameter: mm(3.0),
        name: "sharp".to_owned(),
        cutter: Cutter::Vee { tip: mm(0.06), angle_mdeg: 60_000 },
        handling: Default::default(),
    };
    // At 0.2 mm the operation's own tool cuts 0.207 mm, the sharp one 0.291 mm. At 0.05 mm, which is
    // certainly through, they cut 0.127 and 0.118 mm.
    let least = |bit: &Bit| (mm(0.05), bit.width_at(mm(0.05)));
    for (remedy, wanted) in [
        (Remedy::Bit("sharp".to_owned()), sharp.fitting(mm(0.12), mm(0.05)).unwrap()),
        (Remedy::Centred, least(&usual())),
    ] {
        let cure = LocalIsolation { from: at(2.0, 2.5), to: at(2.12, 2.5), with: remedy.clone() };
        let mut work = only(&board, "isolate", |operation| {
            operation.depth = mm(0.2);
            if let OperationKind::Isolate(isolate) = &mut operation.action {
                (isolate.passes, isolate.cures) = (1, vec![cure]);
            }
        });
        work.bits.push(sharp.clone());
        let (planned, diagnostics) = planned(&board, &work);
        let cured = &planned.parts[0].tasks[1];
        assert!(
            cured.toolpaths.iter().all(|way| way.depths == [wanted.0]),
            "{remedy:?}: {:?}",
            cured.toolpaths[0].depths
        );
        assert!(wanted.0 < mm(0.06), "{wanted:?}");
        let taken = diagnostics.iter().find(|diagnostic| diagnostic.code == "cam.cure_takes");
        assert_eq!(taken.is_some(), remedy == Remedy::Centred);
        assert!(taken.is_none_or(|taken| taken.message("en").contains("0.003")), "{diagnostics:?}");
    }
}

/// The default V-bit for isolation.
fn usual() -> Bit {
    crate::cam::usual::usual_bits().remove(0)
}

#[test]
fn shallow_remedy_has_its_own_depth() {
    let board = with_copper(&[boxed(0.0, 0.0, 2.0, 5.0), boxed(2.15, 0.0, 4.0, 5.0)]);
    let cure = LocalIsolation { from: at(2.0, 2.5), to: at(2.15, 2.5), with: Remedy::Depth(mm(0.05)) };
    let work = only(&board, "isolate", |operation| {
        operation.depth = mm(0.2);
        if let OperationKind::Isolate(isolate) = &mut operation.action {
            (isolate.passes, isolate.cures) = (1, vec![cure]);
        }
    });
    let (planned, _) = planned(&board, &work);
    let tasks = &planned.parts[0].tasks;
    assert_eq!(tasks[0].toolpaths.len(), 1, "0.207 mm wide at 0.2 mm depth does not fit");
    assert!(tasks[1].toolpaths.iter().all(|way| way.depths == [mm(0.05)]));
    assert_eq!(tasks[0].bit, tasks[1].bit);
}

#[test]
fn remedy_cuts_a_neck_reachable_from_both_sides_only() {
    // Round ends of 0.127 mm tracks, 0.136 mm apart. The tool, 0.143 mm wide, gets so near from both sides
    // that all of the gap is cut, but can't pass.
    let track = |from: Point, to: Point| Path::through(&[from, to]).unwrap();
    let shapes = [track(at(0.0, 0.0), at(3.0, 0.0)), track(at(3.263, 0.0), at(6.0, 0.0))];
    let outlines: Vec<Path> =
        shapes.iter().flat_map(|track| crate::geometry::stroke(track, mm(0.127))).collect();
    let board = with_copper(&outlines);
    let (from, to) = (at(3.0635, 0.0), at(3.1995, 0.0));
    let least = 0.005;
    for remedy in [Remedy::Depth(mm(0.05)), Remedy::Centred] {
        let cure = LocalIsolation { from, to, with: remedy.clone() };
        let work = only(&board, "isolate", |operation| {
            if let OperationKind::Isolate(isolate) = &mut operation.action {
                (isolate.passes, isolate.cures) = (1, vec![cure]);
            }
        });
        let (planned, diagnostics) = planned(&board, &work);
        assert!(
            diagnostics.iter().all(|diagnostic| diagnostic.code != "cam.cure_without_gap"),
            "{remedy:?}: {diagnostics:?}"
        );
        let cured = planned.parts[0].tasks.get(1).unwrap_or_else(|| panic!("{remedy:?}: nothing is cured"));
        // A path through the neck crosses the line between both ends.
        let crosses = cured.toolpaths.iter().any(|way| {
            let below = way.path.corners().any(|at| at.y.mm() < -least);
            below && way.path.corners().any(|at| at.y.mm() > least)
        });
        assert!(crosses, "{remedy:?}: {:?}", cured.toolpaths);
    }
}

#[test]
fn passes_of_one_contour_are_cut_without_retract() {
    let board = with_copper(&[circle(at(5.0, 5.0), mm(3.0)), circle(at(15.0, 5.0), mm(3.0))]);
    let work = isolation(&board, 0.2, |isolate| isolate.passes = 4);
    assert_eq!(planned(&board, &work).0.toolpaths().count(), 2);
}

#[test]
fn clearing_leaves_only_the_copper_picture() {
    let board = Board {
        outline: union(&[boxed(0.0, 0.0, 12.0, 8.0)]),
        ..with_copper(&[boxed(3.0, 3.0, 6.0, 5.0), circle(at(9.0, 4.0), mm(1.5))])
    };
    let mut work = only(&board, "clear", |operation| {
        operation.bit = "m".to_owned();
        if let OperationKind::Clear(clear) = &mut operation.action {
            *clear = Clear { stepover_percent: 60.0, ..clear.clone() };
        }
    });
    work.bits.push(mill("m", 0.8));
    let (planned, _) = planned(&board, &work);
    assert!(least_clearance(&planned, &work) > -0.0025);
    let toolpaths: Vec<Path> = planned.toolpaths().map(|way| way.path.clone()).collect();
    assert!(toolpaths.len() < 16, "{} starts", toolpaths.len());
    let cut = sweep(&toolpaths, mm(0.8));
    let left = crate::geometry::combine(&board.outline, &cut, crate::geometry::CombineRule::Difference);
    let copper = crate::geometry::area_mm2(&board.copper[0].region);
    let area = crate::geometry::area_mm2(&left);
    assert!((area - copper).abs() < 0.02 * copper, "{area} mm² are left of {copper} mm²");
}

#[test]
fn program_ignores_order_and_start_of_contours() {
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
