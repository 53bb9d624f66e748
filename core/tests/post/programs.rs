//! Random programs that drill and mill, generated from a seed.

use annulus_core::chance::Chance;
use annulus_core::geometry::Point;
use annulus_core::job::{Bit, Command, Cutter, Leg, Mark, Program};
use annulus_core::units::Length;
use std::f64::consts::TAU;

fn some_place(chance: &mut Chance) -> Point {
    let grid = [1, 1_000, 635_000][chance.below(3)];
    let mut along = || Length::from_nm((chance.below(160_000_000) as i64 - 40_000_000) / grid * grid);
    Point::new(along(), along())
}

fn some_height(chance: &mut Chance) -> Length {
    Length::from_nm([-50_000, -100_000, -1_234_567, -(chance.below(1_800_000) as i64)][chance.below(4)])
}

fn some_feed(chance: &mut Chance) -> u32 {
    [1_000, 12_000, 16_667, 500 + chance.below(50_000) as u32][chance.below(4)]
}

pub(crate) fn home() -> Vec<Command> {
    vec![Command::Spindle { rpm: 0 }, Command::Rapid { to: Point::default() }]
}

pub(crate) fn change(bit: u32, rpm: u32, wait_us: u32) -> Leg {
    let mut commands = home();
    commands.extend([Command::AwaitBit { bit }, Command::Spindle { rpm }]);
    if wait_us > 0 {
        commands.push(Command::Dwell { us: wait_us });
    }
    Leg { mark: Mark::ToolChange(bit), commands }
}

/// A program around `legs`, with a drill, a mill and a V-bit.
pub(crate) fn program(legs: Vec<Leg>) -> Program {
    let bit = |um: i64, name: &str, cutter| Bit {
        diameter: Length::from_um(um),
        name: name.to_owned(),
        cutter,
        handling: Default::default(),
    };
    let vee = Cutter::Vee { tip: Length::from_um(100), angle_mdeg: 30_000 };
    let prepare = Leg { mark: Mark::Prepare, commands: vec![Command::Spindle { rpm: 0 }] };
    let finish = Leg { mark: Mark::Finish, commands: home() };
    let legs = std::iter::once(prepare).chain(legs).chain([finish]).collect();
    Program {
        name: "small-board.drl".to_owned(),
        machine: String::new(),
        origin: Point::from_mm(10.0, 20.0),
        bits: vec![
            bit(800, "0.8 mm", Cutter::Drill),
            bit(1_000, "1.0 mm", Cutter::Mill),
            bit(3_000, "30° (V)", vee),
        ],
        spindles: 1,
        safe_height: Length::from_um(2_000),
        legs,
        accepted: Vec::new(),
    }
}

fn hole(chance: &mut Chance, index: u32) -> Leg {
    let mut commands = vec![Command::Rapid { to: some_place(chance) }];
    let strokes = [1, 1, 1, 3][chance.below(4)];
    let (dwell, feed_um_per_s) = (chance.below(2) == 0, some_feed(chance));
    for stroke in 1..=strokes {
        let to = Length::from_um(-600 * stroke - i64::from(strokes == 1) * 1_500);
        commands.push(Command::Plunge { to, feed_um_per_s, gate: None });
        if dwell {
            commands.push(Command::Dwell { us: 1_000 * (1 + chance.below(900) as u32) });
        }
        let up = if stroke == strokes { 2_000 } else { 500 };
        commands.push(Command::Retract { to: Length::from_um(up) });
    }
    Leg { mark: Mark::Hole(index), commands }
}

/// An arc from `from` with any radius, direction and angle that differs from zero by three micrometres or
/// more.
pub(crate) fn arc(chance: &mut Chance, from: Point, height: Length, feed_um_per_s: u32) -> Command {
    let radius = chance.between(-2.9, 3.4);
    let radius = libm::exp(radius);
    let start = chance.between(0.0, TAU);
    let center = Point::new(
        from.x - Length::from_mm(radius * libm::cos(start)),
        from.y - Length::from_mm(radius * libm::sin(start)),
    );
    let ccw = chance.below(2) == 0;
    let turn = match chance.below(6) {
        0 => TAU,
        1 => TAU / 2.0,
        2 => TAU / 4.0,
        _ => chance.between(0.004 / radius, TAU - 0.004 / radius),
    };
    let end = if ccw { start + turn } else { start - turn };
    let to = if turn == TAU {
        from
    } else {
        Point::new(
            center.x + Length::from_mm(radius * libm::cos(end)),
            center.y + Length::from_mm(radius * libm::sin(end)),
        )
    };
    Command::MillArc { to, height, center, ccw, feed_um_per_s }
}

fn way(chance: &mut Chance, index: u32, flat: Option<Length>) -> Leg {
    let mut at = some_place(chance);
    let mut height = flat.unwrap_or_else(|| some_height(chance));
    let mut commands = vec![Command::Rapid { to: at }];
    // A path may also begin with a ramp.
    if flat.is_some() || chance.below(4) > 0 {
        commands.push(Command::Plunge { to: height, feed_um_per_s: some_feed(chance), gate: None });
    }
    for _ in 0..=chance.below(8) {
        if flat.is_none() && chance.below(4) == 0 {
            height = some_height(chance);
        }
        let feed_um_per_s = some_feed(chance);
        let next = match chance.below(3) {
            0 => Command::Mill { to: some_place(chance), height, feed_um_per_s },
            _ => arc(chance, at, height, feed_um_per_s),
        };
        if let Command::Mill { to, .. } | Command::MillArc { to, .. } = next {
            at = to;
        }
        commands.push(next);
        match chance.below(12) {
            0 => commands.push(Command::Dwell { us: 250_000 }),
            1 => commands.push(Command::Plunge { to: height, feed_um_per_s, gate: None }),
            _ => {}
        }
    }
    commands.push(Command::Retract { to: Length::from_um(2_000) });
    Leg { mark: Mark::Toolpath(index), commands }
}

/// Drilling and milling in random order; `flat` keeps all milling at one height.
pub(crate) fn random_program(seed: u64, flat: Option<Length>) -> Program {
    let mut chance = Chance::new(seed);
    let mut legs = Vec::new();
    for _ in 0..=chance.below(3) {
        let drills = chance.below(2) == 0;
        let bit = if drills { 0 } else { 1 + (chance.below(2) as u32) * u32::from(flat.is_none()) };
        let wait = [0, 1_500_000][chance.below(2)];
        legs.push(change(bit, [24_000, 30_000][chance.below(2)], wait));
        for index in 0..=chance.below(4) as u32 {
            if chance.below(10) == 0 {
                // A new speed without a new tool.
                let rpm = 10_000 + 1_000 * chance.below(9) as u32;
                legs.push(Leg { mark: Mark::Prepare, commands: vec![Command::Spindle { rpm }] });
            }
            legs.push(if drills { hole(&mut chance, index) } else { way(&mut chance, index, flat) });
        }
    }
    program(legs)
}

/// The small board of the golden files: two holes, one of them pecked, and a path with every kind of move.
pub(crate) fn small() -> Program {
    let at = Point::from_mm;
    let um = Length::from_um;
    let plunge = |to: i64| Command::Plunge { to: um(to), feed_um_per_s: 12_000, gate: None };
    let single = vec![
        Command::Rapid { to: at(12.7, 8.89) },
        plunge(-2_100),
        Command::Dwell { us: 100_000 },
        Command::Retract { to: um(2_000) },
    ];
    let pecked = vec![
        Command::Rapid { to: at(15.24, 8.89) },
        plunge(-1_000),
        Command::Retract { to: um(500) },
        plunge(-2_100),
        Command::Retract { to: um(2_000) },
    ];
    let (height, feed_um_per_s) = (um(-100), 10_000);
    let arc =
        |to: Point, center: Point, ccw, height| Command::MillArc { to, height, center, ccw, feed_um_per_s };
    let milled = vec![
        Command::Rapid { to: at(10.0, 10.0) },
        Command::Plunge { to: height, feed_um_per_s: 5_000, gate: None },
        Command::Mill { to: at(20.0, 10.0), height, feed_um_per_s },
        arc(at(25.0, 15.0), at(20.0, 15.0), true, height),
        arc(at(25.0, 5.0), at(25.0, 10.0), false, height),
        arc(at(20.0, 10.0), at(25.0, 10.0), false, height),
        arc(at(20.0, 10.0), at(20.5, 10.0), true, height),
        arc(at(20.0, 10.0), at(20.5, 10.0), true, um(-300)),
        arc(at(20.0, 10.0), at(20.5, 10.0), true, um(-300)),
        Command::Mill { to: at(10.0, 10.0), height: um(-300), feed_um_per_s },
        Command::Retract { to: um(2_000) },
    ];
    program(vec![
        change(0, 30_000, 1_500_000),
        Leg { mark: Mark::Hole(0), commands: single },
        Leg { mark: Mark::Hole(1), commands: pecked },
        change(1, 24_000, 0),
        Leg { mark: Mark::Toolpath(0), commands: milled },
    ])
}
