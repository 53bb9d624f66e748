//! From a plan to a program: each bit is asked for, each hole becomes a leg.
//!
//! ```text
//!  safe  ●──rapid──●            ●──rapid──
//!  ______          │            │           board's surface, Z = 0
//!                  ▼ plunge     ▲ retract
//!                  ●───dwell────●           −(thickness + breakthrough + point of the bit)
//! ```
//!
//! Comes in: a board, its plan, the machine. Goes out: a [`Program`]. Does not know how fast anything goes.

use super::usual::POINT_DEG;
use super::{Plan, rack};
use crate::board::Board;
use crate::geometry::Point;
use crate::job::{Command, Gate, Input, Leg, Mark, Otherwise, Program};
use crate::machine::{Machine, StrokeEnd};
use crate::units::Length;

/// A duration in whole µs, never negative.
pub(super) fn micros(us: f64) -> u32 {
    libm::round(us) as u32
}

/// The program of `plan` on `machine`.
pub fn lower(board: &Board, plan: &Plan, machine: &Machine) -> Program {
    let bits = plan.bits.iter().map(|bit| rack::drill(bit.bit));
    // Every change of bits turns the spindle on again once the bit is in.
    let mut legs = vec![Leg { mark: Mark::Prepare, commands: vec![Command::Spindle { rpm: 0 }] }];
    for (index, bit) in (0..).zip(&plan.bits) {
        legs.push(change(index, machine));
        for &hole in &bit.holes {
            if let Some(meant) = board.holes.get(hole as usize) {
                let at = Point::new(meant.at.x - plan.origin.x, meant.at.y - plan.origin.y);
                legs.push(Leg { mark: Mark::Hole(hole), commands: stroke(at, bit.bit, machine) });
            }
        }
    }
    let home = vec![Command::Spindle { rpm: 0 }, Command::Rapid { to: Point::default() }];
    legs.push(Leg { mark: Mark::Finish, commands: home });
    Program {
        name: board.name.clone(),
        machine: machine.fingerprint(),
        origin: plan.origin,
        bits: bits.collect(),
        spindles: plan.spindles,
        safe_height: machine.process.safe_height,
        legs,
        accepted: plan.accepted.clone(),
    }
}

fn spindle_on(machine: &Machine) -> Vec<Command> {
    let process = &machine.process;
    let mut commands = vec![Command::Spindle { rpm: process.spindle_rpm }];
    if process.spin_up_ms > 0.0 {
        commands.push(Command::Dwell { us: micros(process.spin_up_ms * 1e3) });
    }
    commands
}

fn change(bit: u32, machine: &Machine) -> Leg {
    let mut commands =
        vec![Command::Spindle { rpm: 0 }, Command::Rapid { to: Point::default() }, Command::AwaitBit { bit }];
    commands.extend(spindle_on(machine));
    Leg { mark: Mark::ChangeBit(bit), commands }
}

/// One stroke of the drill of `diameter` at `at`, in work coordinates.
fn stroke(at: Point, diameter: Length, machine: &Machine) -> Vec<Command> {
    let process = &machine.process;
    let gate = (machine.stroke_end == StrokeEnd::Sensor).then(|| Gate {
        input: Input::ZBottom,
        deadline_us: micros(machine.longest_drilling_s * 1e6),
        otherwise: Otherwise::Alarm,
    });
    let to = Length::ZERO - rack::through(process, process.breakthrough, diameter, POINT_DEG);
    let feed_um_per_s = micros(process.feed_mm_per_s * 1e3).max(1);
    let mut commands = vec![Command::Rapid { to: at }, Command::Plunge { to, feed_um_per_s, gate }];
    if process.dwell_bottom_ms > 0.0 {
        commands.push(Command::Dwell { us: micros(process.dwell_bottom_ms * 1e3) });
    }
    commands.push(Command::Retract { to: process.safe_height });
    commands
}
