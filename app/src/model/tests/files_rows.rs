//! Opening, review, and reading files again.

use super::story::{Story, compare};
use crate::keys::Tab;
use crate::model::{Effect, Event, FilesEvent, FrameEvent, LinkEvent};
use annulus_core::control::State;
use annulus_core::wire::Tell;

#[test]
fn certain_files_are_planned_at_once() {
    compare(
        &[
            ("choose", "nothing |  | choose"),
            ("sample", "nothing |  | sample"),
            ("open", "reading |  | call-off read"),
            ("open certain", "planning | board stale | plan keep-rests"),
            ("open warning", "nothing | board review | keep-rests"),
            ("open error", "nothing | board review | keep-rests"),
            ("open empty", "nothing | board review | keep-rests"),
            ("open read-refused", "nothing |  | toast-goes"),
            ("open read-stopped", "nothing |  | "),
            ("open warning reviewed", "planning | board stale | plan"),
            ("open certain plan prove time", "nothing | board plan proof job | "),
            ("open certain plan", "proving | board plan stale | toast-goes prove time"),
            ("open warning reviewed plan", "proving | board plan stale | prove time"),
            ("open certain plan-error", "proving | board plan stale | prove time"),
            // a linked file does not replace an open board
            ("fetched", "reading |  | call-off read"),
            ("open certain plan prove time fetched", "nothing | board plan proof job | toast-goes"),
            // no task is shown while a project is unpacked
            ("open-project", "opening |  | call-off open"),
            ("open-project opened", "reading |  | call-off read"),
            ("open-project opened certain", "planning | board stale | plan keep-rests"),
            ("open-project open-refused", "nothing |  | toast-goes"),
        ],
        Story::stands,
    );
}

#[test]
fn visible_notification_is_not_repeated() {
    compare(
        &[
            ("open certain plan", "page.open.certain"),
            ("open certain plan open certain plan", "page.open.certain"),
        ],
        |story| story.toasts().join(" "),
    );
}

#[test]
fn failed_reading_leaves_the_open_board() {
    compare(
        &[
            ("open certain plan prove time open-other", "reading | board plan proof job | call-off read"),
            (
                "open certain plan prove time open-other read-refused",
                "nothing | board plan proof job | toast-goes",
            ),
            ("open certain plan prove time open-other certain", "planning | board stale | plan keep-rests"),
            // a plan that was interrupted is made later
            ("open certain open-other read-refused", "planning | board stale | toast-goes plan"),
            ("open certain open-other old-certain", "reading | board stale | "),
            ("open certain open-other old-certain certain", "planning | board stale | plan keep-rests"),
            ("open open-other old-certain", "reading |  | "),
            ("open open-other old-certain old-warning certain", "planning | board stale | plan keep-rests"),
            ("open open-project", "opening |  | call-off open"),
            ("open open-project certain", "opening |  | "),
            ("open-project open opened", "reading |  | "),
            // a new machine description does not cancel the reading
            ("open machine", "reading |  | "),
            ("open machine certain", "planning | board stale | plan keep-rests"),
        ],
        Story::stands,
    );
}

#[test]
fn open_review_blocks_planning() {
    compare(
        &[
            ("open warning edit", "nothing | board review | keep-rests"),
            ("open warning machine", "nothing | board review | "),
            ("open warning say-aligned", "reading | board review | call-off read"),
            ("open warning say-aligned certain", "nothing | board review | keep-rests"),
            ("open warning say-aligned certain reviewed", "planning | board stale | plan"),
            ("open warning flip-use certain reviewed", "planning | board stale | plan"),
            ("open warning say-board warning", "nothing | board review | keep-rests"),
            ("open warning discard", "nothing |  | look keep-rests"),
            ("open certain plan prove time review", "nothing | board review plan proof job | "),
            ("open certain plan prove time review reviewed", "planning | board plan proof job stale | plan"),
            ("open error accept", "nothing | board review | "),
            ("open error accept reviewed", "planning | board stale | plan"),
            ("open certain plan prove time open-other warning", "nothing | board review | keep-rests"),
            (
                "open certain plan prove time open-other warning back",
                "planning | board stale | call-off plan keep-rests",
            ),
            (
                "open certain plan prove time review say-aligned certain back",
                "planning | board stale | call-off plan keep-rests",
            ),
            ("open warning back", "nothing | board review | "),
            ("review", "nothing |  | "),
            ("open certain plan prove time review reviewed back", "planning | board plan proof job stale | "),
            ("say-aligned", "nothing |  | "),
            ("flip-use", "nothing |  | "),
        ],
        Story::stands,
    );
}

#[test]
fn cancelled_review_restores_the_previous_board_and_job() {
    let story = Story::told("open certain plan prove time edit");
    let (files, work) = (story.model.board.document.clone().unwrap(), story.model.job.work.clone());
    let mut story = story;
    for word in ["open-other", "warning", "say-aligned", "warning", "back"] {
        story.tell(word);
    }
    assert_eq!(story.model.board.document.as_ref().map(|open| open.files.clone()), Some(files.files.clone()));
    assert_eq!(story.model.job.work, work);
    assert!(story.model.job.can_undo().0);
    assert!(story.model.before.is_none());
    let story = Story::told("open error accept reviewed open-other warning back");
    assert!(story.model.board.accepted.contains("board.something"), "what was seen of it stays seen");
}

#[test]
fn certain_reading_is_reported_only_after_planning() {
    compare(
        &[
            ("open certain", ""),
            ("open certain plan", "page.open.certain"),
            ("open certain plan prove time edit plan", "page.open.certain"),
            ("open certain plan-error", ""),
            ("open certain plan-refused edit plan", ""),
            ("open warning reviewed plan", ""),
            ("open certain plan prove time open certain plan", "page.open.certain"),
            ("open read-refused", "engine.fell_over"),
            ("open-project open-refused", "saved.broken"),
        ],
        |story| story.toasts().join(" "),
    );
}

#[test]
fn reopened_files_preserve_screen_and_job() {
    let screen = |words: &str| {
        let mut story = Story::told("open certain");
        story.send(FrameEvent::Show { tab: Tab::Cam });
        words.split_whitespace().for_each(|word| story.tell(word));
        story
    };
    assert_eq!(screen("open certain").model.frame.tab, Tab::Cam);
    assert_eq!(screen("open-other certain").model.frame.tab, Tab::Board);
    let rows = [
        ("edit open certain", true),
        ("edit say-aligned certain", true),
        ("edit open-other certain", false),
        ("edit say-board certain", false),
    ];
    for (words, kept) in rows {
        assert_eq!(screen(words).model.job.edited(), kept, "{words}");
    }
}

#[test]
fn notification_action_works_once() {
    let mut story = Story::told("open certain plan");
    let number = story.model.frame.toasts[0].number;
    story.send(FrameEvent::Taken { number });
    assert!(story.model.board.reviewing && story.toasts().is_empty());
    assert!(story.model.before.is_some(), "with a way back, as from any review");
    story.send(FilesEvent::Reviewed);
    story.send(FrameEvent::Taken { number });
    assert!(!story.model.board.reviewing, "it is gone");
    let mut story = Story::told("open certain plan");
    story.send(Event::Frame(FrameEvent::Said { number }));
    assert!(story.toasts().is_empty() && !story.model.board.reviewing);
}

#[test]
fn reading_notification_is_shown_only_on_the_board_screen() {
    let mut story = Story::told("open certain plan");
    assert_eq!(story.toasts(), ["page.open.certain"]);
    story.send(FrameEvent::Show { tab: Tab::Cam });
    assert_eq!(story.toasts(), Vec::<String>::new(), "it lies over nothing of another screen");
    story.send(FrameEvent::Show { tab: Tab::Board });
    assert_eq!(story.toasts(), Vec::<String>::new(), "and is said once");
    let mut story = Story::told("open certain");
    story.send(FrameEvent::Show { tab: Tab::Machine });
    story.tell("plan");
    assert_eq!(story.toasts(), Vec::<String>::new(), "who left the board before does not hear it");
    let mut story = Story::told("begin found-none");
    let tell = Tell::Status(Box::new(super::line::status(State::Running, None)));
    story.send(LinkEvent::Heard { tell: Some(Box::new(tell)) });
    ["open", "certain", "plan"].into_iter().for_each(|word| story.tell(word));
    assert_eq!(story.toasts(), Vec::<String>::new(), "nor who has a job running");
}

#[test]
fn update_is_offered_at_rest_and_installed_on_request() {
    let mut story = Story::told("begin found-none");
    let moves = |story: &mut Story, state| {
        let tell = Tell::Status(Box::new(super::line::status(state, None)));
        story.send(LinkEvent::Heard { tell: Some(Box::new(tell)) });
    };
    moves(&mut story, State::Running);
    story.send(FrameEvent::UpdateReady);
    assert_eq!(story.toasts(), Vec::<String>::new(), "never while something moves");
    moves(&mut story, State::Ready);
    assert_eq!(story.toasts(), ["page.update.ready"]);
    moves(&mut story, State::Jogging);
    assert_eq!(story.toasts(), Vec::<String>::new(), "it moves again");
    moves(&mut story, State::Ready);
    let number = story.model.frame.toasts[0].number;
    story.send(FrameEvent::Taken { number });
    assert_eq!((story.out.as_slice(), story.toasts().len()), ([Effect::TakeUpdate].as_slice(), 0));
    story.send(FrameEvent::UpdateReady);
    let number = story.model.frame.toasts[0].number;
    story.send(FrameEvent::Said { number });
    moves(&mut story, State::Ready);
    assert_eq!((story.out.len(), story.toasts().len()), (0, 0), "waved away, it comes with the next visit");
}

#[test]
fn layers_follow_the_board_and_preserve_their_look() {
    let mut story = Story::told("open certain");
    assert_eq!(story.model.frame.layers.len(), 1, "holes");
    story.send(FrameEvent::LayerEye { index: 0 });
    story.send(FrameEvent::LayerOpacity { index: 0, percent: 40 });
    story.send(FrameEvent::LayerEye { index: 9 });
    ["say-aligned", "certain"].into_iter().for_each(|word| story.tell(word));
    let look = &story.model.frame.layers[0];
    assert_eq!((look.eye, look.opacity), (false, 40));
    story.tell("discard");
    assert!(story.model.frame.layers.is_empty());
}
