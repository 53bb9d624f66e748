//! What the benchmark of motion and steps works on: a board of many holes.
//!
//! Comes in: a machine, a number of holes. Goes out: the program of a board. Knows no clock.

use crate::geometry::Point;
use crate::job::{Command, Leg, Mark, Program};
use crate::machine::Machine;
use crate::units::Length;

/// A board of `holes` holes scattered over 80 × 60 mm, for `machine`: the same board every time.
pub fn board(machine: &Machine, holes: u32) -> Program {
    let process = &machine.process;
    let bottom = Length::ZERO - process.board_thickness - process.breakthrough;
    let feed_um_per_s = libm::round(process.feed_mm_per_s * 1e3) as u32;
    let hole = |index: u32| {
        let scattered = index.wrapping_mul(0x9E37_79B1);
        let (x, y) = (i64::from(scattered >> 16), i64::from(scattered & 0xFFFF));
        let to =
            Point::new(Length::from_nm(x * 80_000_000 / 65_536), Length::from_nm(y * 60_000_000 / 65_536));
        let retract = Command::Retract { to: process.safe_height };
        let plunge = Command::Plunge { to: bottom, feed_um_per_s, gate: None };
        Leg { mark: Mark::Hole(index), commands: vec![Command::Rapid { to }, plunge, retract] }
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
        legs: std::iter::once(prepare).chain((0..holes).map(hole)).chain([finish]).collect(),
        accepted: Vec::new(),
    }
}
