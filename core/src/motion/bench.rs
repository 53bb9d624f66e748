//! Boards of holes for benchmarks and tests of motion and steps.

use crate::geometry::Point;
use crate::job::{Command, Leg, Mark, Program};
use crate::machine::Machine;
use crate::units::Length;

/// A board with `holes` holes scattered over 80 × 60 mm, for `machine`. Deterministic.
pub fn board(machine: &Machine, holes: u32) -> Program {
    let place = |index: u32| {
        let scattered = index.wrapping_mul(0x9E37_79B1);
        let (x, y) = (i64::from(scattered >> 16), i64::from(scattered & 0xFFFF));
        Point::new(Length::from_nm(x * 80_000_000 / 65_536), Length::from_nm(y * 60_000_000 / 65_536))
    };
    holes_at(machine, (0..holes).map(place))
}

/// A board with a hole at each of `places`, drilled in order with the process parameters of `machine`, ending
/// at the zero.
pub fn holes_at(machine: &Machine, places: impl Iterator<Item = Point>) -> Program {
    let process = &machine.process;
    let bottom = Length::ZERO - process.board_thickness - process.breakthrough;
    let feed_um_per_s = libm::round(process.feed_mm_per_s * 1e3) as u32;
    let hole = |(index, to): (usize, Point)| {
        let plunge = Command::Plunge { to: bottom, feed_um_per_s, gate: None };
        let retract = Command::Retract { to: process.safe_height };
        Leg { mark: Mark::Hole(index as u32), commands: vec![Command::Rapid { to }, plunge, retract] }
    };
    let spindle = |rpm| Command::Spindle { rpm };
    let spin_up = Command::Dwell { us: libm::ceil(process.spin_up_ms * 1e3) as u32 };
    let prepare = Leg { mark: Mark::Prepare, commands: vec![spindle(process.spindle_rpm), spin_up] };
    let finish =
        Leg { mark: Mark::Finish, commands: vec![spindle(0), Command::Rapid { to: Point::default() }] };
    Program {
        name: String::new(),
        machine: String::new(),
        origin: Point::default(),
        bits: Vec::new(),
        spindles: u8::MAX,
        safe_height: process.safe_height,
        legs: std::iter::once(prepare).chain(places.enumerate().map(hole)).chain([finish]).collect(),
        accepted: Vec::new(),
    }
}
