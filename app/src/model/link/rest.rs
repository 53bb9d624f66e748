//! The state of a stopped machine in words, and whether its main button starts or resumes a job.

use crate::said::key;
use annulus_core::control::{State, Trust};
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
