//! Planning, proof and timing; changes during a request; answers to older requests.

use super::story::{Story, compare};
use crate::model::FrameEvent;
use annulus_core::geometry::{Bounds, Point};
use annulus_core::sim::Stock;
use annulus_core::units::Length;
use std::sync::Arc;

const MM: Length = Length::from_um(1_000);

#[test]
fn plan_is_proved_and_then_timed() {
    compare(
        &[
            ("open certain plan", "proving | board plan stale | toast-goes prove time"),
            ("open certain plan prove", "timing | board plan proof stale | "),
            ("open certain plan prove time", "nothing | board plan proof job | "),
            ("open certain plan prove-two time", "nothing | board plan proof job | "),
            // without a proof the plan is still timed
            ("open certain plan prove-refused", "timing | board plan stale | "),
            ("open certain plan prove-refused time", "nothing | board plan job | "),
            ("open certain plan prove time-refused", "nothing | board plan proof stale refused | "),
            ("open certain plan prove time-stopped", "nothing | board plan proof stale | "),
            // times and proof run in parallel, and both are awaited
            ("open certain plan time", "proving | board plan stale | "),
            ("open certain plan time time", "proving | board plan stale | "),
            ("open certain plan time prove", "nothing | board plan proof job | "),
            ("open certain plan time-refused prove", "nothing | board plan proof stale refused | "),
            ("open certain plan time prove-refused", "nothing | board plan job | "),
            ("open certain plan-refused", "nothing | board refused | "),
            ("open certain plan-stopped", "nothing | board | "),
            ("open certain plan prove time edit plan-refused", "nothing | board refused | "),
            ("open certain plan-refused edit plan", "resting | board plan stale | plan-rests"),
        ],
        Story::stands,
    );
}

#[test]
fn only_relevant_changes_cause_a_new_plan() {
    compare(
        &[
            ("open certain plan prove time edit", "planning | board plan proof job stale | plan keep-rests"),
            ("open certain plan prove time undo", "nothing | board plan proof job | "),
            (
                "open certain plan prove time edit plan prove time undo",
                "planning | board plan proof job stale | plan keep-rests",
            ),
            ("open certain plan prove time same", "nothing | board plan proof job | "),
            ("open certain plan prove time load-bit", "planning | board plan proof job stale | plan"),
            (
                "open certain plan prove time load-bit plan prove time load-bit",
                "nothing | board plan proof job | ",
            ),
            ("open certain plan prove time accept", "planning | board plan proof job stale | plan"),
            ("open certain plan prove time machine", "planning | board plan proof job stale | plan"),
            ("open certain plan prove time machine-again", "nothing | board plan proof job | "),
            ("open certain plan prove time mark", "nothing | board plan proof job | "),
            ("open certain plan prove time see-one", "nothing | board plan proof job | "),
            ("open certain plan prove time choose-last", "nothing | board plan proof job | "),
            (
                "open certain plan prove time bottom",
                "planning | board plan proof job stale | plan keep-rests",
            ),
            ("machine", "nothing |  | "),
            ("accept", "nothing |  | "),
        ],
        Story::stands,
    );
}

#[test]
fn rapid_changes_are_planned_but_only_the_last_is_proved() {
    compare(
        &[
            ("open certain plan prove time edit plan", "resting | board plan proof job stale | plan-rests"),
            // during the delay the worker is idle, so a change is planned at once
            (
                "open certain plan prove time edit plan edit",
                "planning | board plan proof job stale | plan keep-rests",
            ),
            (
                "open certain plan prove time edit plan edit plan-rested-before",
                "planning | board plan proof job stale | ",
            ),
            (
                "open certain plan prove time edit plan edit plan",
                "resting | board plan proof job stale | plan-rests",
            ),
            (
                "open certain plan prove time edit plan edit plan plan-rested-before",
                "resting | board plan proof job stale | ",
            ),
            (
                "open certain plan prove time edit plan plan-rested",
                "proving | board plan proof job stale | prove time",
            ),
            (
                "open certain plan prove time edit plan plan-rested plan-rested",
                "proving | board plan proof job stale | ",
            ),
            // the delay includes the time of planning
            (
                "open certain plan prove time edit soon plan",
                "resting | board plan proof job stale | plan-rests",
            ),
            (
                "open certain plan prove time edit soon soon plan",
                "proving | board plan proof job stale | prove time",
            ),
            (
                "open certain plan prove time edit soon soon edit plan plan",
                "resting | board plan proof job stale | plan-rests",
            ),
            // a plan cancelled during the delay is made with the next change
            (
                "open certain plan prove time edit plan cancel",
                "nothing | board plan proof job stale | call-off",
            ),
            (
                "open certain plan prove time edit plan cancel plan-rested",
                "nothing | board plan proof job stale | ",
            ),
        ],
        Story::stands,
    );
}

#[test]
fn changes_during_planning_are_planned_afterwards() {
    compare(
        &[
            ("open certain edit", "planning-again | board stale | keep-rests"),
            ("open certain edit edit edit", "planning-again | board stale | keep-rests"),
            // the plan in between is shown but not proved
            ("open certain edit plan", "planning | board plan stale | toast-goes plan"),
            ("open certain edit edit plan plan", "resting | board plan stale | plan-rests"),
            ("open certain plan edit", "planning-again | board plan stale | keep-rests"),
            ("open certain plan edit prove", "planning | board plan stale | end-timing plan"),
            ("open certain plan edit time prove", "planning | board plan stale | plan"),
            // the board's worker is idle while the times are awaited
            (
                "open certain plan prove edit",
                "planning | board plan proof stale | end-timing plan keep-rests",
            ),
            ("open certain plan prove edit time", "planning | board plan proof stale | "),
            ("open certain edit plan-refused", "planning | board stale refused | plan"),
            ("open certain edit plan-refused plan", "resting | board plan stale | plan-rests"),
            (
                "open certain plan prove time edit plan edit prove plan prove time",
                "nothing | board plan proof job | ",
            ),
            ("open certain machine plan plan prove time", "nothing | board plan proof job | "),
        ],
        Story::stands,
    );
}

#[test]
fn outdated_answers_are_dropped() {
    compare(
        &[
            ("open certain edit plan old-plan", "planning | board plan stale | "),
            ("open certain edit plan old-plan-refused", "planning | board plan stale | "),
            ("open certain plan prove time edit old-plan", "planning | board plan proof job stale | "),
            ("open certain plan edit prove prove", "planning | board plan stale | "),
            ("open certain plan prove edit time time", "planning | board plan proof stale | "),
            ("open certain plan plan", "proving | board plan stale | "),
            ("open certain plan prove time time", "nothing | board plan proof job | "),
            ("open certain plan prove time plan", "nothing | board plan proof job | "),
            ("open certain cancel plan", "nothing | board stale | "),
            ("open certain plan cancel prove", "nothing | board plan stale | "),
            ("open certain plan cancel time", "nothing | board plan stale | "),
            ("open certain open-other plan", "reading | board stale | "),
            ("open cancel certain", "nothing |  | "),
            ("open certain open-other certain old-plan", "planning | board stale | "),
        ],
        Story::stands,
    );
}

#[test]
fn cancelled_work_does_not_restart() {
    compare(
        &[
            ("open cancel", "nothing |  | call-off"),
            ("open-project cancel opened", "nothing |  | "),
            ("open certain cancel", "nothing | board stale | call-off"),
            ("open certain plan cancel", "nothing | board plan stale | call-off end-timing"),
            ("open certain plan time cancel", "nothing | board plan stale | call-off"),
            ("open certain plan prove cancel", "nothing | board plan proof stale | call-off end-timing"),
            ("open certain edit cancel", "nothing | board stale | call-off"),
            ("open certain edit cancel plan", "nothing | board stale | "),
            ("open certain cancel edit", "planning | board stale | plan keep-rests"),
            ("open certain plan prove time edit cancel", "nothing | board plan proof job stale | call-off"),
            (
                "open certain plan prove time edit cancel edit plan prove time",
                "nothing | board plan proof job | ",
            ),
            ("cancel", "nothing |  | call-off"),
        ],
        Story::stands,
    );
}

#[test]
fn worker_without_the_board_gets_the_files_once() {
    compare(
        &[
            ("open certain gone", "planning | board stale | read plan"),
            ("open certain gone certain", "planning | board stale | "),
            ("open certain gone certain plan", "proving | board plan stale | toast-goes prove time"),
            ("open certain gone certain gone", "nothing | board refused | "),
            ("open certain gone read-refused plan-refused", "nothing | board refused | "),
            ("open certain edit gone", "planning-again | board stale | read plan"),
            ("open certain edit gone certain plan plan", "resting | board plan stale | plan-rests"),
            ("open certain gone cancel certain plan", "nothing | board stale | "),
        ],
        Story::stands,
    );
}

#[test]
fn task_progress_is_shown_while_it_runs() {
    let task = |story: &Story| {
        story.model.task().map_or_else(String::new, |task| format!("{} {}", task.word, task.share))
    };
    compare(
        &[
            ("open", "page.task.reading 0"),
            ("open half", "page.task.reading 0.5"),
            ("open-project", ""),
            ("open certain", "page.task.planning 0"),
            ("open certain half", "page.task.planning 0.5"),
            ("open certain old-half", "page.task.planning 0"),
            ("open certain half edit", "page.task.planning 0.5"),
            ("open certain half edit plan", "page.task.planning 0"),
            ("open certain plan", "page.task.proving 0"),
            ("open certain plan half", "page.task.proving 0.5"),
            ("open certain plan old-half", "page.task.proving 0"),
            ("open certain plan edit prove plan", "page.task.proving 0"),
            ("open certain plan time", "page.task.proving 0"),
            ("open certain plan prove", "page.task.timing 0"),
            ("open certain plan prove half", "page.task.timing 0.5"),
            ("open certain plan prove time", ""),
            ("open certain cancel", ""),
            ("open certain cancel half", ""),
            ("open warning", ""),
        ],
        task,
    );
}

#[test]
fn underside_is_requested_until_known() {
    let rows = [
        ("", "underside"),
        // a request cancelled with other work is sent again, to a worker that is sent the board first
        ("underside-stopped", "underside"),
        ("underside-stopped underside-gone", "read underside"),
        ("underside-stopped underside-gone underside-gone", ""),
        ("underside-refused", ""),
        ("underside", ""),
    ];
    for (words, out) in rows {
        let mut story = Story::told("open certain plan prove time bottom plan prove time");
        let bounds = Bounds { min: Point::default(), max: Point::new(MM, MM) };
        story.model.play.carved = Some(Arc::new(Stock::new(bounds, MM).unwrap()));
        story.send(FrameEvent::Grid);
        words.split_whitespace().for_each(|word| story.tell(word));
        assert_eq!(story.out(), out, "{words}");
        assert_eq!(story.model.underside.tiles.len(), usize::from(words == "underside"), "{words}");
    }
}
