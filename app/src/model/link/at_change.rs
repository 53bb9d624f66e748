//! While a tool is changed by hand: what the machine itself tells of whether a hand may go to the spindle (C3).
//!
//! Comes in: the status, the job. Goes out: rows, each so or not so. Moves nothing, and holds nobody back: a person looks as well.

use annulus_core::job::{Command, Program};
use annulus_core::pins::SpindleState;
use annulus_core::units::NM_PER_MM;
use annulus_core::wire::Status;

/// What is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChangeCheck {
    /// The spindle does not turn.
    SpindleOff,
    /// The tip is over the board, at the height of rapids or above.
    Up,
    /// The head is where the program changes tools.
    AtPlace,
}

/// How far from a place the head counts as there, and how far below a height as up: a step of a coarse machine, mm.
const NEAR_MM: f64 = 0.05;

/// The rows for `status`, which is of `program` where that is known; the second says whether it is so. Where the program changes the tool
/// wherever the head stands, its place is no row.
pub fn change_rows(status: &Status, program: Option<&Program>) -> Vec<(ChangeCheck, bool)> {
    let turns = status.spindle_rpm > 0
        || matches!(status.spindle, SpindleState::Off { rpm: 1.. } | SpindleState::Lost { .. })
        || matches!(status.spindle, SpindleState::Reaching { .. } | SpindleState::AtSpeed { .. });
    let mut rows = vec![(ChangeCheck::SpindleOff, !turns)];
    let Some(program) = program else { return rows };
    let safe_mm = program.safe_height.nm() as f64 / NM_PER_MM as f64;
    rows.push((ChangeCheck::Up, status.work_mm[2] > safe_mm - NEAR_MM));
    let leg = status.leg.and_then(|leg| program.legs.get(leg as usize));
    if let Some(place_mm) = leg.and_then(|leg| place_mm(&leg.commands)) {
        let is_there = (0..2).all(|axis| (status.work_mm[axis] - place_mm[axis]).abs() < NEAR_MM);
        rows.push((ChangeCheck::AtPlace, is_there));
    }
    rows
}

/// Where the head goes before the bit is awaited, work mm; none where it goes nowhere, or none is.
fn place_mm(commands: &[Command]) -> Option<[f64; 2]> {
    let awaited = commands.iter().position(|command| matches!(command, Command::AwaitBit { .. }))?;
    let to = commands.get(..awaited)?.iter().rev().find_map(|command| match command {
        Command::Rapid { to } => Some(*to),
        _ => None,
    })?;
    Some([to.x, to.y].map(|at| at.nm() as f64 / NM_PER_MM as f64))
}
