//! The steps back to the job after an alarm.

use super::line;
use crate::model::link::way_back::{BackMark, BackStep, way_back};
use annulus_core::control::{State, Trust};

#[test]
fn recovery_shows_one_current_step_and_skips_done_ones() {
    let (done, now, later) = (BackMark::Done, BackMark::Now, BackMark::Later);
    let steps = [BackStep::Read, BackStep::Lift, BackStep::Home, BackStep::Tool, BackStep::Resume];
    let lost = [BackStep::Read, BackStep::Home, BackStep::Tool, BackStep::Resume];
    let rows = [
        // state, trust, height, expected steps, expected marks
        (State::Alarm, Trust::Trusted, 7.0, &steps[..], vec![now, done, done, later, later]),
        (State::Ready, Trust::Trusted, 7.0, &steps, vec![done, done, done, now, now]),
        (State::Ready, Trust::Trusted, -1.0, &steps, vec![done, now, done, later, later]),
        // Without a trusted position the height is unknown: homing raises the tool.
        (State::Alarm, Trust::Suspect, -1.0, &lost, vec![now, later, later, later]),
        (State::NotHomed, Trust::Suspect, -1.0, &lost, vec![done, now, later, later]),
        (State::NotHomed, Trust::Suspect, 3.0, &lost, vec![done, now, later, later]),
        (State::NotHomed, Trust::Lost, -9.0, &lost, vec![done, now, later, later]),
        // No job to resume.
        (State::NotHomed, Trust::Lost, -9.0, &lost[..2], vec![done, now]),
        (State::Ready, Trust::Trusted, 7.0, &steps[..3], vec![done, done, done]),
    ];
    for (state, trust, height_mm, steps, marks) in rows {
        let mut status = line::status(state, None);
        (status.trust, status.work_mm[2]) = (trust, height_mm);
        let is_broken_off = steps.contains(&BackStep::Resume);
        let wanted: Vec<_> = steps.iter().copied().zip(marks).collect();
        assert_eq!(way_back(&status, true, is_broken_off, false), wanted, "{state:?} {trust:?} {height_mm}");
    }
}

#[test]
fn checked_tool_is_marked_but_not_required_to_resume() {
    let status = line::status(State::Ready, None);
    let mark = |has_looked, step| {
        let steps = way_back(&status, true, true, has_looked);
        steps.into_iter().find(|(own, _)| *own == step).unwrap().1
    };
    assert_eq!(mark(false, BackStep::Tool), mark(false, BackStep::Resume));
    assert_eq!(mark(true, BackStep::Tool), BackMark::Done);
    assert_eq!(mark(true, BackStep::Resume), mark(false, BackStep::Resume));
}

#[test]
fn recovery_without_homing_asks_for_zero() {
    let (done, now, later) = (BackMark::Done, BackMark::Now, BackMark::Later);
    let mut status = line::status(State::Ready, None);
    status.trust = Trust::Lost;
    let steps = [BackStep::Read, BackStep::Zero, BackStep::Tool, BackStep::Resume];
    let wanted: Vec<_> = steps.into_iter().zip([done, now, later, later]).collect();
    assert_eq!(way_back(&status, false, true, false), wanted);
    (status.trust, status.work_mm[2]) = (Trust::Trusted, 5.0);
    let steps = [BackStep::Read, BackStep::Lift, BackStep::Zero, BackStep::Tool, BackStep::Resume];
    let wanted: Vec<_> = steps.into_iter().zip([done, done, done, now, now]).collect();
    assert_eq!(way_back(&status, false, true, false), wanted);
}
