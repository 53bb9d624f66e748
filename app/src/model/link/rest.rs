//! The state of a stopped machine in words, whether its main button starts or resumes a job, and what it
//! reports during a manual tool change. Moves nothing and blocks nothing.

use crate::said::key;
use annulus_core::control::{State, Trust};
use annulus_core::job::{Command, Program};
use annulus_core::pins::SpindleState;
use annulus_core::units::NM_PER_MM;
use annulus_core::wire::{InterruptedJob, Status};

/// Keys of the state's name and sentence for an idle machine: what is known, and what a job still needs.
/// `homes`: homing is on. `None` if the machine is not idle, or if it homes and nothing is missing.
pub fn rest_words(status: &Status, homes: bool) -> Option<[&'static str; 2]> {
    if status.state != State::Ready {
        return None;
    }
    let (has_plane, has_height) = (status.zero_mm.is_some(), !status.needs_z_zero);
    let (unknown, no_z) = (key!("page.state.unknown"), key!("page.state.no_z_zero"));
    Some(match (status.trust, homes) {
        (Trust::Trusted, true) if !has_plane => {
            [key!("page.state.no_work_zero"), key!("page.state.homed_is")]
        }
        (Trust::Trusted, true) if !has_height => [no_z, key!("page.state.homed_no_z_is")],
        (Trust::Trusted, true) => return None,
        (Trust::Trusted, false) if !has_height => [no_z, key!("page.state.by_zero_no_z_is")],
        (Trust::Trusted, false) => [key!("page.state.ready"), key!("page.state.by_zero_is")],
        (_, true) => [unknown, key!("page.state.unlocked_is")],
        (_, false) if has_plane => [unknown, key!("page.state.doubted_zero_is")],
        (_, false) if has_height => [unknown, key!("page.state.only_z_is")],
        (_, false) => [unknown, key!("page.state.no_zero_is")],
    })
}

/// Key of the sentence for a pause, unless it is a pause at a hole. `plans`: the controller plans its own
/// motion.
pub fn pause_words(status: &Status, plans: bool) -> Option<&'static str> {
    let mills = status.toolpath.is_some();
    match (status.state, status.paused_on_path) {
        (State::Pausing, _) if plans || mills => Some(key!("page.state.pausing_path")),
        (State::Paused, _) if plans => Some(key!("page.state.paused_there")),
        (State::Paused, Some(true)) => Some(key!("page.state.paused_lifted")),
        (State::Paused, Some(false)) => Some(key!("page.state.paused_path")),
        _ => None,
    }
}

/// True if the main button resumes `interrupted` instead of starting the job on screen, `planned`.
pub fn resumes(interrupted: Option<&InterruptedJob>, planned: Option<&str>) -> bool {
    interrupted.is_some_and(|interrupted| planned.is_none_or(|planned| planned == interrupted.job))
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ChangeCheck {
    SpindleOff,
    /// The tool tip is above the board, at the height of rapids or higher.
    Up,
    AtHeight,
    AtPlace,
}

/// Tolerance of position and height, mm: one step of a coarse machine.
const NEAR_MM: f64 = 0.05;

/// During a manual tool change: what the machine reports about whether it is safe to reach for the spindle.
/// The user must check as well.
///
/// The checks for `status` and whether each holds. `program` is the program that `status` refers to, if
/// known. No `AtPlace` row if the program changes the tool at the current position.
pub fn change_rows(status: &Status, program: Option<&Program>) -> Vec<(ChangeCheck, bool)> {
    let turns = status.spindle_rpm > 0
        || matches!(status.spindle, SpindleState::Off { rpm: 1.. } | SpindleState::Lost { .. })
        || matches!(status.spindle, SpindleState::Reaching { .. } | SpindleState::AtSpeed { .. });
    let mut rows = vec![(ChangeCheck::SpindleOff, !turns)];
    if let Some(change) = &status.change {
        rows.extend([(ChangeCheck::AtHeight, change.is_up), (ChangeCheck::AtPlace, change.is_at_place)]);
        return rows;
    }
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

/// Position that the program moves to before it waits for the tool, work coordinates in mm.
fn place_mm(commands: &[Command]) -> Option<[f64; 2]> {
    let awaited = commands.iter().position(|command| matches!(command, Command::AwaitBit { .. }))?;
    let to = commands.get(..awaited)?.iter().rev().find_map(|command| match command {
        Command::Rapid { to } => Some(*to),
        _ => None,
    })?;
    Some([to.x, to.y].map(|at| at.nm() as f64 / NM_PER_MM as f64))
}
