//! A handmade milling program: a pecked hole, a rounded square, a helix bore, a ramp with a tab, and a hole
//! milled straight down.

use annulus_core::geometry::Point;
use annulus_core::job::{Bit, Command, Cutter, Leg, Mark, Program};
use annulus_core::machine::Machine;
use annulus_core::units::Length;

pub(crate) const WAYS: u32 = 3;

pub(crate) const HOLES: [(f64, f64); 2] = [(5.0, 5.0), (30.0, 5.0)];

const MILLED: u32 = 12_000;

fn um(um: i64) -> Length {
    Length::from_um(um)
}

fn plunge(to_um: i64) -> Command {
    Command::Plunge { to: um(to_um), feed_um_per_s: 5_000, gate: None }
}

fn mill(x: f64, y: f64, height_um: i64) -> Command {
    Command::Mill { to: Point::from_mm(x, y), height: um(height_um), feed_um_per_s: MILLED }
}

fn arc(to: (f64, f64), center: (f64, f64), height_um: i64) -> Command {
    let (to, center) = (Point::from_mm(to.0, to.1), Point::from_mm(center.0, center.1));
    Command::MillArc { to, height: um(height_um), center, ccw: true, feed_um_per_s: MILLED }
}

fn change(bit: u32, machine: &Machine) -> Leg {
    let process = &machine.process;
    let commands = vec![
        Command::Spindle { rpm: 0 },
        Command::Rapid { to: Point::default() },
        Command::AwaitBit { bit },
        Command::Spindle { rpm: process.spindle_rpm },
        Command::Dwell { us: (process.spin_up_ms * 1e3) as u32 },
    ];
    Leg { mark: Mark::ToolChange(bit), commands }
}

#[allow(clippy::too_many_lines, reason = "a table of moves")]
pub(crate) fn milling(machine: &Machine) -> Program {
    let top = Command::Retract { to: machine.process.safe_height };
    let to = |x: f64, y: f64| Command::Rapid { to: Point::from_mm(x, y) };
    let (peck, drill) = (HOLES[0], HOLES[1]);
    let pecked = vec![
        to(peck.0, peck.1),
        plunge(-700),
        Command::Retract { to: um(500) },
        plunge(-1_400),
        Command::Retract { to: um(-300) },
        plunge(-2_000),
        top,
    ];
    let square = vec![
        to(11.0, 10.0),
        plunge(-200),
        mill(19.0, 10.0, -200),
        arc((20.0, 11.0), (19.0, 11.0), -200),
        mill(20.0, 19.0, -200),
        arc((19.0, 20.0), (19.0, 19.0), -200),
        mill(11.0, 20.0, -200),
        arc((10.0, 19.0), (11.0, 19.0), -200),
        mill(10.0, 11.0, -200),
        arc((11.0, 10.0), (11.0, 11.0), -200),
        top,
    ];
    let turn = |height_um| arc((26.5, 15.0), (25.0, 15.0), height_um);
    let mut bore = vec![to(26.5, 15.0), plunge(0)];
    bore.extend([-500, -1_000, -1_500, -2_000, -2_000].map(turn));
    bore.push(top);
    let tab = vec![
        to(10.0, 30.0),
        plunge(0),
        mill(16.0, 30.0, -1_200),
        Command::Retract { to: um(-400) },
        mill(18.0, 30.0, -400),
        plunge(-1_200),
        mill(24.0, 30.0, -1_200),
        top,
    ];
    let milled = vec![to(drill.0, drill.1), plunge(-2_000), top];
    let finish = vec![Command::Spindle { rpm: 0 }, Command::Rapid { to: Point::default() }];
    let leg = |mark, commands| Leg { mark, commands };
    Program {
        name: "milled by hand".to_owned(),
        machine: machine.fingerprint(),
        origin: Point::default(),
        bits: vec![
            Bit {
                diameter: um(800),
                name: "0.8 mm".to_owned(),
                cutter: Cutter::Drill,
                handling: Default::default(),
            },
            Bit {
                diameter: um(1_000),
                name: "1 mm mill".to_owned(),
                cutter: Cutter::Mill,
                handling: Default::default(),
            },
        ],
        spindles: 1,
        safe_height: machine.process.safe_height,
        legs: vec![
            leg(Mark::Prepare, vec![Command::Spindle { rpm: 0 }]),
            change(0, machine),
            leg(Mark::Hole(0), pecked),
            change(1, machine),
            leg(Mark::Toolpath(0), square),
            leg(Mark::Toolpath(1), bore),
            leg(Mark::Toolpath(2), tab),
            leg(Mark::Hole(1), milled),
            leg(Mark::Finish, finish),
        ],
        accepted: Vec::new(),
    }
}
