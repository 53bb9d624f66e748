//! Tests of the carved board against known areas and depths, and against the tool itself at random places.

use annulus_core::chance::Chance;
use annulus_core::geometry::{Bounds, Point};
use annulus_core::job::{Bit, Command, Cutter, Leg, Mark, Program};
use annulus_core::sim::{Cut, Stock, TILE, cuts, reach};
use annulus_core::units::Length;
use core::f64::consts::{PI, TAU};

fn um(um: i64) -> Length {
    Length::from_um(um)
}

fn bit(diameter_um: i64, cutter: Cutter) -> Bit {
    Bit { diameter: um(diameter_um), name: String::new(), cutter, handling: Default::default() }
}

fn vee() -> Cutter {
    Cutter::Vee { tip: um(200), angle_mdeg: 60_000 }
}

fn stock(width: f64, height: f64) -> Stock {
    let bounds = Bounds::of(Point::from_mm(-1.0, -2.0)).with(Point::from_mm(width - 1.0, height - 2.0));
    Stock::new(bounds, um(1_600)).unwrap()
}

#[test]
fn flipped_stock_has_mirrored_depths() {
    let mut before = stock(10.03, 7.0);
    carved(
        &mut before,
        &program(bit(1_000, Cutter::Mill), vec![rapid(0.5, 0.0), plunge(-300), mill(3.0, 2.0, -300)]),
    );
    let low = Point::from_mm(5.0, 6.0);
    for mirror_x in [true, false] {
        let turned = before.flipped(mirror_x, low);
        let (size, old, new) =
            (before.cells().map(|cells| cells as f64 * before.cell_mm()), before.low_mm(), turned.low_mm());
        assert_eq!((turned.cells(), new), (before.cells(), [5.0, 6.0]));
        for [x, y] in [[1.0, 0.5], [0.5, 0.0], [3.2, 2.1], [2.0, 4.0], [0.1, 0.1]] {
            let (along, up) = (x - old[0], y - old[1]);
            let place = if mirror_x { [size[0] - along, up] } else { [along, size[1] - up] };
            let found = turned.depth_mm([new[0] + place[0], new[1] + place[1]]);
            assert_eq!(found, before.depth_mm([x, y]), "{x}, {y}");
        }
        assert_eq!(
            turned.flipped(mirror_x, Point::from_mm(-1.0, -2.0)),
            before,
            "turned twice it is as it was"
        );
    }
}

fn program(bit: Bit, commands: Vec<Command>) -> Program {
    Program {
        name: String::new(),
        machine: String::new(),
        origin: Point::default(),
        bits: vec![bit],
        spindles: 1,
        safe_height: um(2_000),
        legs: vec![Leg { mark: Mark::Toolpath(0), commands }],
        accepted: Vec::new(),
    }
}

fn carved(stock: &mut Stock, program: &Program) -> Vec<Cut> {
    let cuts = cuts(program);
    for cut in &cuts {
        stock.carve(&cut.way, &program.bits[cut.bit as usize], 0.0, 1.0);
    }
    cuts
}

fn rapid(x: f64, y: f64) -> Command {
    Command::Rapid { to: Point::from_mm(x, y) }
}

fn plunge(to: i64) -> Command {
    Command::Plunge { to: um(to), feed_um_per_s: 1_000, gate: None }
}

fn mill(x: f64, y: f64, height: i64) -> Command {
    Command::Mill { to: Point::from_mm(x, y), height: um(height), feed_um_per_s: 1_000 }
}

fn turn(at: (f64, f64), center: (f64, f64), height: i64) -> Command {
    let (to, center) = (Point::from_mm(at.0, at.1), Point::from_mm(center.0, center.1));
    Command::MillArc { to, height: um(height), center, ccw: true, feed_um_per_s: 1_000 }
}

#[test]
fn known_shapes_have_their_volumes() {
    let straight = |depth: i64| vec![rapid(3.0, 3.0), plunge(-depth), mill(13.0, 8.0, -depth)];
    let (length, wide) = (libm::hypot(10.0, 5.0), bit(3_175, vee()).width_at(um(500)).mm());
    // A V-bit cuts a groove with a trapezoid as its cross-section, and a truncated cone at the ends.
    let cone = PI * 0.5 / 3.0 * (0.25 * wide * wide + 0.05 * wide + 0.01);
    let circle = |depth: i64| vec![rapid(7.0, 5.0), plunge(-depth), turn((7.0, 5.0), (5.0, 5.0), -depth)];
    let ring = PI * (2.5 * 2.5 - 1.5 * 1.5);
    let ramp = vec![rapid(3.0, 3.0), plunge(0), mill(13.0, 3.0, -1_000)];
    let mut bore = vec![rapid(7.0, 5.0), plunge(0)];
    bore.extend([-500, -1_000, -1_500, -2_000, -2_000].map(|height| turn((7.0, 5.0), (5.0, 5.0), height)));
    let rows = [
        (bit(800, Cutter::Mill), straight(300), (0.8 * length + PI * 0.16) * 0.3),
        (bit(3_175, vee()), straight(500), 0.5 * (0.2 + wide) * length * 0.5 + cone),
        (bit(1_000, Cutter::Mill), circle(400), ring * 0.4),
        // A wedge with the half circle of the tool at its end.
        (bit(500, Cutter::Mill), ramp, 10.0 * 0.5 * 0.5 + PI * 0.0625),
        (bit(1_000, Cutter::Mill), bore, ring * 1.6),
        (bit(1_000, Cutter::Drill), vec![rapid(5.0, 5.0), plunge(-1_800)], PI * 0.25 * 1.6),
    ];
    for (bit, commands, volume) in rows {
        let mut stock = stock(20.0, 20.0);
        carved(&mut stock, &program(bit.clone(), commands));
        let found = stock.removed_mm3();
        assert!((found - volume).abs() < 0.015 * volume + 0.01, "{bit:?}: {found} instead of {volume} mm³");
    }
}

/// The cut of a mill or V-bit is as deep as its deepest pass over a place. The test samples the path at
/// random places.
#[test]
fn depth_is_the_deepest_pass_of_the_tool() {
    let mut looked = 0;
    for seed in 0..40 {
        let mut chance = Chance::new(seed);
        let bit = if chance.bits().is_multiple_of(2) {
            bit(200 + (chance.bits() & 0x3FF) as i64, Cutter::Mill)
        } else {
            bit(3_175, vee())
        };
        let mut commands = vec![rapid(5.0, 5.0), plunge(-200)];
        let mut at = (5.0, 5.0);
        for _ in 0..4 {
            let height = -((chance.bits() & 0x3FF) as i64);
            let (dx, dy) = (chance.between(-3.0, 3.0), chance.between(-3.0, 3.0));
            let center = (at.0 + 0.3 * dx, at.1 + 0.3 * dy);
            if chance.bits().is_multiple_of(2) {
                commands.push(turn(at, center, height));
            } else {
                at = ((at.0 + dx).clamp(2.0, 10.0), (at.1 + dy).clamp(2.0, 10.0));
                commands.push(mill(at.0, at.1, height));
            }
        }
        let program = program(bit.clone(), commands);
        let mut stock = stock(16.0, 16.0);
        let cuts = carved(&mut stock, &program);
        for _ in 0..40 {
            let tip = cuts[chance.bits() as usize % cuts.len()].way.at(chance.between(0.0, 1.0));
            let place = [tip[0] + chance.between(-0.8, 0.8), tip[1] + chance.between(-0.8, 0.8)];
            // Neighbouring places are compared because an edge may pass through a cell and ramps are cut in
            // pieces.
            let passed = |aside: f64, lower: f64| {
                let samples =
                    cuts.iter().flat_map(|cut| (0..=400).map(|part| cut.way.at(f64::from(part) / 400.0)));
                let depth = samples.map(|tip| {
                    let away = (libm::hypot(tip[0] - place[0], tip[1] - place[1]) + aside).max(0.0);
                    let depth = -tip[2] + lower;
                    let wide = bit.width_at(Length::from_mm(depth.max(0.0))).mm();
                    match bit.cutter {
                        Cutter::Vee { .. } if away <= 0.5 * wide => {
                            depth - (away - 0.1).max(0.0) / libm::tan(TAU / 12.0)
                        }
                        Cutter::Mill if away <= 0.5 * bit.diameter.mm() => depth,
                        _ => 0.0,
                    }
                });
                depth.fold(0.0, f64::max)
            };
            let found = stock.depth_mm(place).unwrap();
            let room = 1.5 * stock.cell_mm();
            let (least, most) = (passed(room, -0.01), passed(-room, 0.01));
            assert!(
                (least - 0.002..=most + 0.002).contains(&found),
                "seed {seed}: {found} mm at {place:?}, not within {least} … {most}"
            );
            looked += usize::from(found > 0.0);
        }
    }
    assert!(looked > 500, "{looked} places in cuts");
}

#[test]
fn split_cut_equals_the_whole_cut() {
    let mut commands = vec![rapid(7.0, 5.0), plunge(-500)];
    commands.extend([turn((7.0, 5.0), (5.0, 5.0), -500), mill(12.0, 9.0, -500), plunge(-1_600)]);
    let program = program(bit(800, Cutter::Mill), commands);
    let (mut whole, mut parts) = (stock(20.0, 20.0), stock(20.0, 20.0));
    for cut in carved(&mut whole, &program) {
        parts.carve(&cut.way, &program.bits[0], 0.0, 0.37);
        parts.carve(&cut.way, &program.bits[0], 0.37, 1.0);
    }
    assert!((whole.removed_mm3() - parts.removed_mm3()).abs() < 0.02, "{}", parts.removed_mm3());
    assert!(whole.is_through([12.0, 9.0]) && !whole.is_through([7.0, 5.0]) && !whole.is_through([60.0, 5.0]));
    let reached = reach(&program).unwrap();
    assert!(
        (reached.min.x.mm() - 3.0).abs() < 1e-6 && (reached.max.x.mm() - 12.0).abs() < 1e-6,
        "{reached:?}"
    );
}

#[test]
fn stock_size_is_limited_and_only_cut_tiles_use_memory() {
    let corner = |mm: f64| Bounds::of(Point::default()).with(Point::from_mm(mm, mm));
    let sizes = [(50.0, 0.025), (160.0, 0.05), (1_000.0, 0.4), (2_500.0, 0.8)];
    for (mm, cell) in sizes {
        assert_eq!(Stock::new(corner(mm), um(1_600)).unwrap().cell_mm(), cell, "{mm} mm");
    }
    for mm in [0.0, 1e5] {
        let why = Stock::new(corner(mm), um(1_600)).unwrap_err();
        assert!(why.code == "sim.no_stock" && !why.message("en").contains('{'), "{}", why.message("en"));
    }
    let mut stock = Stock::new(corner(100.0), um(1_600)).unwrap();
    carved(&mut stock, &program(bit(800, Cutter::Drill), vec![rapid(3.0, 3.0), plunge(-1_700)]));
    // Outside the board there is nothing to cut.
    carved(&mut stock, &program(bit(800, Cutter::Drill), vec![rapid(-3.0, 300.0), plunge(-1_700)]));
    let cut: Vec<_> = stock.tiles().filter(|tile| tile.depths_um.is_some()).collect();
    assert_eq!((cut.len(), cut[0].first), (4, [64, 64]), "the hole lies on a corner of four tiles");
    assert!(
        stock.tiles().count() == stock.cells().map(|cells| cells.div_ceil(TILE)).iter().product::<usize>()
    );
}
