//! The way back after an alarm, by rows.

use super::line;
use crate::model::link::way_back::{BackMark, BackStep, way_back};
use annulus_core::control::{State, Trust};

#[test]
fn the_way_back_has_one_step_at_a_time_and_leaves_out_what_is_done() {
    let (done, now, later) = (BackMark::Done, BackMark::Now, BackMark::Later);
    let rows = [
        // state, trust, height, a job to be taken up: read, lift, home, tool, resume
        (State::Alarm, Trust::Trusted, 7.0, true, vec![now, done, done, later, later]),
        (State::Ready, Trust::Trusted, 7.0, true, vec![done, done, done, now, now]),
        (State::Alarm, Trust::Suspect, -1.0, true, vec![now, later, later, later, later]),
        (State::Ready, Trust::Trusted, -1.0, true, vec![done, now, done, later, later]),
        // Only a place that is known says when the bit is out: otherwise homing, which goes up first, is not kept waiting for it.
        (State::NotHomed, Trust::Suspect, -1.0, true, vec![done, now, now, later, later]),
        // What was not seen is not ticked: a height over a board whose place is not known is none. Homing takes the bit up.
        (State::NotHomed, Trust::Suspect, 3.0, true, vec![done, now, now, later, later]),
        (State::NotHomed, Trust::Lost, -9.0, true, vec![done, now, now, later, later]),
        (State::NotHomed, Trust::Lost, 9.0, true, vec![done, now, now, later, later]),
        (State::NotHomed, Trust::Lost, -9.0, false, vec![done, now, now]),
        (State::Ready, Trust::Trusted, 7.0, false, vec![done, done, done]),
    ];
    let names = [BackStep::Read, BackStep::Lift, BackStep::Home, BackStep::Tool, BackStep::Resume];
    for (state, trust, height_mm, is_broken_off, marks) in rows {
        let mut status = line::status(state, None);
        (status.trust, status.work_mm[2]) = (trust, height_mm);
        let steps = way_back(&status, is_broken_off, false);
        let wanted: Vec<_> = names.into_iter().zip(marks).collect();
        assert_eq!(steps, wanted, "{state:?} {trust:?} {height_mm}");
    }
}

#[test]
fn a_bit_that_somebody_looked_at_is_ticked_and_the_job_can_go_on_before_that_too() {
    let status = line::status(State::Ready, None);
    let mark = |has_looked, step| {
        let steps = way_back(&status, true, has_looked);
        steps.into_iter().find(|(own, _)| *own == step).unwrap().1
    };
    assert_eq!(mark(false, BackStep::Tool), mark(false, BackStep::Resume));
    assert_eq!(mark(true, BackStep::Tool), BackMark::Done);
    assert_eq!(mark(true, BackStep::Resume), mark(false, BackStep::Resume));
}
