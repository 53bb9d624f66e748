//! Tests of the carved board during a playback. A time must give the same result from any starting point,
//! with at most one checkpoint of work. Faults on the way must be found.

use annulus_core::chance::Chance;
use annulus_core::geometry::{Bounds, Point};
use annulus_core::job::{Bit, Command, Cutter, Leg, Mark, Program};
use annulus_core::machine::virtual_drill;
use annulus_core::motion::timeline;
use annulus_core::sim::{Carving, Fault, Playback, Stock, ToolRoom, nearest, warnings};
use annulus_core::units::Length;
use std::sync::Arc;

fn um(um: i64) -> Length {
    Length::from_um(um)
}

fn leg(mark: Mark, commands: Vec<Command>) -> Leg {
    Leg { mark, commands }
}

fn rapid(x: f64, y: f64) -> Command {
    Command::Rapid { to: Point::from_mm(x, y) }
}

fn plunge(to: i64) -> Command {
    Command::Plunge { to: um(to), feed_um_per_s: 5_000, gate: None }
}

fn mill(x: f64, y: f64, height: i64) -> Command {
    Command::Mill { to: Point::from_mm(x, y), height: um(height), feed_um_per_s: 10_000 }
}

fn up() -> Command {
    Command::Retract { to: um(2_000) }
}

/// Rows of a mill, a circle of a V-bit, holes.
fn program() -> Program {
    let bit = |diameter, cutter| Bit {
        diameter: um(diameter),
        name: String::new(),
        cutter,
        handling: Default::default(),
    };
    let vee = Cutter::Vee { tip: um(100), angle_mdeg: 60_000 };
    let (to, center) = (Point::from_mm(20.0, 10.0), Point::from_mm(14.0, 10.0));
    let round = Command::MillArc { to, height: um(-150), center, ccw: true, feed_um_per_s: 10_000 };
    let mut rows = vec![rapid(2.0, 2.0), plunge(-200)];
    for row in 0..24 {
        let (y, there) = (2.0 + 0.7 * f64::from(row), row % 2 == 0);
        rows.extend([
            mill(if there { 28.0 } else { 2.0 }, y, -200),
            mill(if there { 28.0 } else { 2.0 }, y + 0.7, -200),
        ]);
    }
    rows.push(up());
    let change = |bit| leg(Mark::ToolChange(bit), vec![Command::AwaitBit { bit }]);
    Program {
        name: String::new(),
        machine: String::new(),
        origin: Point::default(),
        bits: vec![bit(800, Cutter::Mill), bit(3_000, vee), bit(900, Cutter::Drill)],
        spindles: 1,
        safe_height: um(2_000),
        legs: vec![
            change(0),
            leg(Mark::Toolpath(0), rows),
            change(1),
            leg(Mark::Toolpath(1), vec![rapid(20.0, 10.0), plunge(-150), round, up()]),
            change(2),
            leg(Mark::Hole(0), vec![rapid(5.0, 25.0), plunge(-2_100), up()]),
            leg(Mark::Hole(1), vec![rapid(25.0, 25.0), plunge(-2_100), up()]),
        ],
        accepted: Vec::new(),
    }
}

fn playback(program: &Program) -> Arc<Playback> {
    Arc::new(Playback::new(timeline(program, &virtual_drill()).unwrap()))
}

fn carving(program: &Program) -> Carving {
    let bounds = Bounds::of(Point::default()).with(Point::from_mm(30.0, 30.0));
    let stock = Stock::new(bounds, um(1_600)).unwrap().with_points(130.0);
    Carving::new(playback(program), program.bits.clone(), stock)
}

#[test]
fn every_playback_time_gives_the_same_stock() {
    let program = program();
    let total_s = playback(&program).total_s();
    let mut cursor = carving(&program);
    assert!(!cursor.seek(total_s, 100_000), "the whole is more than a frame's work");
    while !cursor.seek(total_s, 400_000) {}
    assert!(cursor.checkpoints() > 2, "{} checkpoints", cursor.checkpoints());
    let whole = cursor.stock().removed_mm3();
    let mut chance = Chance::new(7);
    let mut before = (0.0, 0.0);
    for number in 0..40 {
        let t_s = if number % 8 == 0 { before.0 } else { chance.between(0.0, total_s) };
        // One checkpoint and one path segment must be enough from any starting point.
        assert!(cursor.seek(t_s, 3_000_000), "{t_s} s is too far");
        let mut fresh = carving(&program);
        assert!(fresh.seek(t_s, u64::MAX));
        let (found, expected) = (cursor.stock().removed_mm3(), fresh.stock().removed_mm3());
        assert!((found - expected).abs() <= 1e-3 * whole, "{t_s} s: {found} is not {expected} mm³");
        if t_s >= before.0 {
            assert!(found >= before.1 - 1e-3 * whole, "at {t_s} s less is cut than at {} s", before.0);
        }
        before = (t_s, found);
    }
    assert!(cursor.seek(0.0, 0) && cursor.stock().removed_mm3() == 0.0, "nothing is cut at the beginning");
    assert!((whole - carved_whole(&program)).abs() < 1e-3 * whole);
}

#[test]
fn explored_times_are_cheap_and_equal() {
    let program = program();
    let total_s = playback(&program).total_s();
    let mut cursor = carving(&program);
    assert!(cursor.seek(1.0, u64::MAX));
    let here = cursor.stock().clone();
    let mut calls = 1;
    while !cursor.explore(50_000) {
        calls += 1;
    }
    assert!(calls > 3, "{calls} calls are more than a call's work");
    assert_eq!((cursor.stock(), cursor.at_s()), (&here, 1.0), "nobody sees it");
    // These times were never shown. After `explore` they must be cheap to reach.
    for share in [1.0, 0.9, 0.35, 0.6, 0.1] {
        assert!(cursor.seek(share * total_s, 3_000_000), "{share} is too far");
        let mut fresh = carving(&program);
        assert!(fresh.seek(share * total_s, u64::MAX));
        let (found, expected) = (cursor.stock().removed_mm3(), fresh.stock().removed_mm3());
        assert!(
            (found - expected).abs() <= 1e-3 * expected.max(1.0),
            "{share}: {found} is not {expected} mm³"
        );
    }
    assert!(cursor.explore(0), "nothing is left");
}

/// Carves a whole program by its commands, without the playback's times.
fn carved_whole(program: &Program) -> f64 {
    let bounds = Bounds::of(Point::default()).with(Point::from_mm(30.0, 30.0));
    let mut stock = Stock::new(bounds, um(1_600)).unwrap().with_points(130.0);
    for cut in annulus_core::sim::cuts(program) {
        stock.carve(&cut.way, &program.bits[cut.bit as usize], 0.0, 1.0);
    }
    stock.removed_mm3()
}

#[test]
fn hole_has_the_drill_point_when_drilled() {
    let program = program();
    let playback = playback(&program);
    let mut cursor = carving(&program);
    let through_s = playback.time_of_hole(0).unwrap();
    assert!(cursor.seek(through_s - 0.3, u64::MAX));
    let depth = |cursor: &Carving, x: f64| cursor.stock().depth_mm([x, 25.0]).unwrap();
    let (middle, aside) = (depth(&cursor, 5.01), depth(&cursor, 5.31));
    assert!(middle > 0.2 && middle < 2.1, "{middle} mm on the way down");
    let point = 0.3 / libm::tan(65.0_f64.to_radians());
    assert!(
        (middle - aside - point).abs() < 0.03,
        "{middle} and {aside}: the point is {point} mm high there"
    );
    assert!(cursor.seek(through_s, u64::MAX));
    assert!(cursor.stock().is_through([5.3, 25.0]) && !cursor.stock().is_through([25.0, 25.0]));
}

#[test]
fn position_and_playback_time_find_each_other() {
    let program = program();
    let playback = playback(&program);
    let line = playback.timeline();
    for place in [[10.0, 2.0], [28.0, 9.3], [14.0, 16.0], [5.0, 25.0]] {
        let (at_s, away_mm) = nearest(&line.moves, &line.mm_per_step, place).unwrap();
        assert!(away_mm < 0.02, "{place:?}: {away_mm} mm away");
        let [x, y, z] = playback.at(at_s).unwrap().position_mm;
        let off = libm::hypot(x - place[0], y - place[1]);
        assert!(off < 1.0 && z < 0.5, "{place:?}: the head is {off} mm away at {at_s} s, {z} mm high");
    }
}

fn room(travel: Option<Bounds>, deepest: i64) -> ToolRoom {
    ToolRoom {
        travel,
        deepest: um(deepest),
        pins: 0..0,
        deepest_pin: um(deepest),
        lowest: um(2_000),
        zones: Vec::new(),
    }
}

#[test]
fn clamp_zones_and_low_rapids_give_warnings() {
    let good = program();
    let zone =
        |x: f64, y: f64, size: f64| Bounds::of(Point::from_mm(x, y)).with(Point::from_mm(x + size, y + size));
    let told = |program: &Program, zones: Vec<Bounds>| {
        let room = ToolRoom { zones, ..room(None, 4_600) };
        warnings(&playback(program), &program.bits, &room)
    };
    assert_eq!(told(&good, vec![zone(40.0, 40.0, 5.0)]), [], "nobody goes there");
    // The mill of 0.8 mm cuts at X 2. A clamp 0.3 mm away is within its radius, one at 0.5 mm is not.
    let cut = told(&good, vec![zone(0.7, 10.0, 1.0)]);
    assert_eq!((cut[0].fault, cut[0].leg), (Fault::Clamp, 1), "{cut:?}");
    assert!(cut[0].depth_mm > 0.19, "{cut:?}");
    assert_eq!(told(&good, vec![zone(0.5, 10.0, 1.0)]), []);
    // The V-bit of 3 mm circles (14, 10) with radius 6 mm.
    let mut round = good.clone();
    round.legs[1].commands = vec![rapid(2.0, 2.0), plunge(-200), up()];
    let arc = told(&round, vec![zone(14.0, 17.2, 1.0)]);
    assert_eq!(arc.iter().map(|one| (one.fault, one.leg)).collect::<Vec<_>>(), [(Fault::Clamp, 3)]);
    assert_eq!(told(&round, vec![zone(13.5, 17.7, 1.0), zone(13.5, 10.5, 1.0)]), []);
    // The rapid between the holes at Y 25 crosses a clamp zone.
    let over = told(&good, vec![zone(14.0, 24.5, 1.0)]);
    assert!(
        over.iter().all(|one| (one.fault, one.leg) == (Fault::Clamp, 6) && one.depth_mm < 0.0),
        "{over:?}"
    );
    let mut low = good;
    low.legs[1].commands.pop();
    low.legs[1].commands.extend([Command::Retract { to: um(500) }, rapid(20.0, 20.0), up()]);
    let told = told(&low, Vec::new());
    assert_eq!(told.iter().map(|one| (one.fault, one.leg)).collect::<Vec<_>>(), [(Fault::Low, 1)]);
    assert!((told[0].depth_mm + 0.5).abs() < 0.01, "{told:?}");
}

#[test]
fn backlash_takeup_moves_nothing_in_the_board() {
    let program = program();
    let mut machine = virtual_drill();
    (machine.x.backlash, machine.y.backlash) = (um(60), um(80));
    let playback = Playback::new(timeline(&program, &machine).unwrap());
    assert_eq!(warnings(&playback, &program.bits, &room(None, 4_600)), []);
}

#[test]
fn warnings_have_their_time_and_leg() {
    let good = program();
    let travel = Bounds::of(Point::from_mm(-1.0, -1.0)).with(Point::from_mm(40.0, 40.0));
    let found = |program: &Program, travel, deepest| {
        let playback = playback(program);
        let told = warnings(&playback, &program.bits, &room(travel, deepest));
        assert!(told.windows(2).all(|two| two[0].at_s <= two[1].at_s));
        told.iter().map(|one| (one.fault, one.leg)).collect::<Vec<_>>()
    };
    assert_eq!(found(&good, Some(travel), 4_600), []);
    let mut drill_mills = good.clone();
    drill_mills.bits[0].cutter = Cutter::Drill;
    let narrow = Bounds::of(Point::from_mm(-1.0, -1.0)).with(Point::from_mm(29.0, 24.0));
    let outside = found(&good, Some(narrow), 4_600);
    assert!(!outside.is_empty() && outside.iter().all(|one| one.0 == Fault::Outside), "{outside:?}");
    let reached = annulus_core::sim::reach(&good).unwrap().with(Point::default());
    assert_eq!(found(&good, Some(reached), 4_600), [], "the last half of a step is not outside");
    assert_eq!(found(&good, None, 2_000), [(Fault::TooDeep, 5), (Fault::TooDeep, 6)]);
    let pinned = |deepest_pin| {
        let room = ToolRoom { pins: 0..1, deepest_pin: um(deepest_pin), ..room(None, 2_000) };
        let told = warnings(&playback(&good), &good.bits, &room);
        told.iter().map(|one| (one.fault, one.leg)).collect::<Vec<_>>()
    };
    assert_eq!(pinned(2_200), [(Fault::TooDeep, 6)], "a hole for a pin goes into the bed");
    assert_eq!(pinned(2_050), [(Fault::TooDeep, 5), (Fault::TooDeep, 6)]);
    assert_eq!(found(&drill_mills, None, 4_600), [(Fault::WrongTool, 1)]);
    let mut dragged = good;
    dragged.legs[6].commands.insert(2, rapid(26.0, 25.0));
    if let Ok(line) = timeline(&dragged, &virtual_drill()) {
        let told = warnings(&Playback::new(line), &dragged.bits, &room(None, 4_600));
        assert!(told.iter().any(|one| (one.fault, one.leg) == (Fault::RapidInMaterial, 6)), "{told:?}");
    }
}
