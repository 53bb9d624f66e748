//! The banner of a machine that is stopped or pauses, and its main button.

use super::line::status;
use crate::model::link::rest::{pause_words, rest_words, resumes};
use annulus_core::control::{State, Trust};
use annulus_core::wire::InterruptedJob;

#[test]
fn ready_machine_reports_its_position_trust() {
    let rows = [
        // trust, homes, X and Y zero, Z zero
        (Trust::Trusted, true, true, true, None),
        (Trust::Trusted, true, true, false, Some(["no_z_zero", "homed_no_z_is"])),
        (Trust::Trusted, true, false, true, Some(["no_work_zero", "homed_is"])),
        (Trust::Trusted, true, false, false, Some(["no_work_zero", "homed_is"])),
        (Trust::Trusted, false, true, true, Some(["ready", "by_zero_is"])),
        (Trust::Trusted, false, true, false, Some(["no_z_zero", "by_zero_no_z_is"])),
        (Trust::Lost, true, false, true, Some(["unknown", "unlocked_is"])),
        (Trust::Lost, true, true, true, Some(["unknown", "unlocked_is"])),
        (Trust::Lost, false, false, true, Some(["unknown", "only_z_is"])),
        (Trust::Lost, false, false, false, Some(["unknown", "no_zero_is"])),
        (Trust::Lost, false, true, false, Some(["unknown", "doubted_zero_is"])),
        (Trust::Suspect, false, true, true, Some(["unknown", "doubted_zero_is"])),
    ];
    for (trust, homes, has_plane, has_height, words) in rows {
        let mut now = status(State::Ready, None);
        (now.trust, now.zero_mm) = (trust, has_plane.then_some([1.0, 2.0]));
        now.needs_z_zero = !has_height;
        let words = words.map(|words| words.map(|word| format!("page.state.{word}")));
        let found = rest_words(&now, homes).map(|words| words.map(str::to_owned));
        assert_eq!(found, words, "{trust:?}, homes {homes}, X and Y {has_plane}, Z {has_height}");
        now.state = State::Running;
        assert_eq!(rest_words(&now, homes), None);
    }
    let sentence = annulus_core::locale::lookup("en", "page.state.no_zero_is").unwrap();
    assert!(sentence.starts_with("No homing, no work zero."), "{sentence}");
}

#[test]
fn pause_text_matches_the_paused_path() {
    let rows = [
        (State::Pausing, false, false, None, None),
        (State::Pausing, true, false, None, Some("page.state.pausing_path")),
        (State::Pausing, false, true, None, Some("page.state.pausing_path")),
        (State::Paused, false, false, None, None),
        (State::Paused, true, false, Some(false), Some("page.state.paused_path")),
        (State::Paused, true, false, Some(true), Some("page.state.paused_lifted")),
        (State::Paused, true, true, None, Some("page.state.paused_there")),
        (State::Running, true, false, None, None),
    ];
    for (state, mills, plans, on_path, words) in rows {
        let mut now = status(state, Some("k"));
        (now.toolpath, now.paused_on_path) = (mills.then_some(3), on_path);
        assert_eq!(pause_words(&now, plans), words, "{state:?}, mills {mills}, plans {plans}, {on_path:?}");
    }
}

#[test]
fn interrupted_job_is_resumed_before_a_start() {
    let offer = InterruptedJob {
        job: "k".to_owned(),
        name: "a".to_owned(),
        next_leg: 7,
        holes_done: 3,
        holes_total: 9,
        toolpaths_done: 0,
        toolpaths_total: 0,
    };
    assert!(resumes(Some(&offer), Some("k")));
    assert!(resumes(Some(&offer), None), "no board is open");
    assert!(!resumes(Some(&offer), Some("another")));
    assert!(!resumes(None, Some("k")));
}
