//! The banner of a machine that is stopped or pauses, and its main button.

use super::line::status;
use crate::model::link::rest::{pause_words, rest_words, resumes};
use annulus_core::control::{State, Trust};
use annulus_core::wire::InterruptedJob;

#[test]
fn ready_machine_reports_its_position_trust() {
    let rows = [
        (Trust::Trusted, true, true, None),
        (Trust::Trusted, true, false, Some(["page.state.ready", "page.state.homed_is"])),
        (Trust::Trusted, false, true, Some(["page.state.ready", "page.state.by_zero_is"])),
        (Trust::Lost, true, false, Some(["page.state.unknown", "page.state.unlocked_is"])),
        (Trust::Lost, true, true, Some(["page.state.unknown", "page.state.unlocked_is"])),
        (Trust::Lost, false, false, Some(["page.state.unknown", "page.state.no_zero_is"])),
        (Trust::Lost, false, true, Some(["page.state.unknown", "page.state.doubted_zero_is"])),
        (Trust::Suspect, false, true, Some(["page.state.unknown", "page.state.doubted_zero_is"])),
    ];
    for (trust, homes, has_zero, words) in rows {
        let mut now = status(State::Ready, None);
        (now.trust, now.zero_mm) = (trust, has_zero.then_some([1.0, 2.0]));
        assert_eq!(rest_words(&now, homes), words, "{trust:?}, homes {homes}, zero {has_zero}");
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
