//! Projects saved in the browser: saving, offers, restoring, discarding.

use super::story::{Story, compare, offer};
use crate::model::{Effect, KeepEvent, Offer, OnTheWay};

#[test]
fn open_project_is_saved_half_a_second_after_a_change() {
    compare(
        &[
            ("begin", "look"),
            ("begin found-none", ""),
            ("begin found-none rested", ""),
            ("begin found-none open certain rested", "save"),
            ("begin found-none open certain rested saved", "write:new+files"),
            ("begin found-none open certain rested saved written", ""),
            // the files are saved already: only the job is written
            ("begin found-none open certain rested saved written edit rested", "write:4"),
            ("begin found-none open certain rested saved written edit rested written undo rested", "write:4"),
            ("begin found-none open certain rested saved written open-other certain rested", "save"),
            ("begin found-none open certain rested saved written say-aligned certain rested", "save"),
            // a series of changes is saved half a second after the first one
            ("begin found-none open certain rested saved written edit edit edit rested-before", "write:4"),
            ("begin found-none open certain rested saved written edit edit rested-before rested", ""),
            // the store's contents are not known yet: the store selects a slot
            ("begin open certain rested saved", "write:new+files"),
            // another project gets another slot, and the latest changes of the one before are saved
            ("begin open certain rested saved written open-other certain rested saved", "write:new+files"),
            ("begin open certain rested saved written edit open-other", "call-off read"),
            ("begin open certain rested saved written edit open-other certain", "write:4 plan keep-rests"),
            ("begin open certain rested saved written edit open-other certain written", "let-go:4"),
            ("begin open certain rested saved written open-other certain", "plan let-go:4 keep-rests"),
            ("begin open certain rested saved written open-other", "call-off read"),
            // the page closes: unsaved changes are left where writing takes no time
            ("begin open certain rested saved written edit leaving", "leave:4 write:4"),
            ("begin open certain rested saved written edit rested leaving", "leave:4"),
            ("begin open certain rested saved written leaving", ""),
            ("begin open certain leaving", "save"),
            ("begin found-none open certain plan", "toast-goes prove time"),
            ("begin found-none open certain discard", "look keep-rests"),
            ("begin found-none open certain discard rested", ""),
            ("begin found-none looked", "look"),
            ("begin found-none open certain looked", ""),
        ],
        Story::out,
    );
}

#[test]
fn changes_during_a_save_are_saved_afterwards() {
    compare(
        &[
            ("begin found-none open certain rested edit rested", ""),
            ("begin found-none open certain rested edit rested saved", "write:new+files"),
            ("begin found-none open certain rested edit rested saved written", "write:4"),
            ("begin found-none open certain rested saved edit rested written", "write:4"),
            ("begin found-none open certain rested saved edit rested written written", ""),
            (
                "begin found-none open certain rested saved edit rested not-written",
                "toast-goes save Guard { on: true }",
            ),
            // a project that was being saved when another one opened gets a slot of its own, which is
            // released afterwards
            ("begin found-none open certain rested open-other certain saved", "write:new+files"),
            ("begin found-none open certain rested open-other certain saved written", "let-go:4"),
            // the same for its last changes
            ("begin found-none open certain rested edit open-other certain", "plan keep-rests"),
            ("begin found-none open certain rested edit open-other certain saved written", "write:4"),
            (
                "begin found-none open certain rested edit open-other certain saved written written",
                "let-go:4",
            ),
            ("begin found-none open certain rested edit rested discard saved written", "write:4"),
            // a board that was closed before it had a slot is offered once it has one
            (
                "begin found-none open certain rested edit rested discard saved written written",
                "look let-go:4",
            ),
            ("begin found-none open certain edit open-other certain", "save plan keep-rests"),
            // a project that is still being written is restored only afterwards
            ("begin open certain rested saved written edit discard found-fourth restore", ""),
            ("begin open certain rested saved written edit discard found-fourth restore written", "take:4"),
            ("begin found-one open certain rested saved discard restore", "take:0"),
            ("begin found-one open certain rested saved discard restore written", "look let-go:4"),
            ("begin found-one open certain rested saved discard restore taken written", "look let-go:4"),
        ],
        Story::out,
    );
}

#[test]
fn failed_save_is_reported_once_and_retried() {
    let told = |story: &Story| {
        let failed = story.model.keeping.failed.unwrap_or("-");
        format!("{} | {failed}", story.toasts().join(" "))
    };
    compare(
        &[
            ("begin found-none open certain rested save-refused", "page.kept.failed | page.kept.failed"),
            ("begin found-none open certain rested saved not-written", "page.kept.failed | page.kept.failed"),
            (
                "begin found-none open certain rested saved not-written edit rested saved not-written",
                "page.kept.failed | page.kept.failed",
            ),
            ("begin found-none open certain rested saved full", "page.kept.full | page.kept.full"),
            (
                "begin found-none open certain rested saved full edit rested saved written",
                "page.kept.full | -",
            ),
            ("begin found-none open certain rested saved full open-other certain", "page.kept.full | -"),
            ("begin found-none open certain rested saved written", " | -"),
        ],
        told,
    );
    // While the project is not saved, the browser asks before the page is left.
    compare(
        &[
            ("begin open certain rested saved full", "toast-goes Guard { on: true }"),
            ("begin open certain rested saved full edit rested saved written", "Guard { on: false }"),
            // saving is tried again when the page is visible again, when it closes, and when another board
            // opens
            ("begin open certain rested saved full looked", "save"),
            ("begin open certain rested saved full leaving", "save"),
            (
                "begin open certain edit rested saved full open-other certain",
                "save plan keep-rests Guard { on: false }",
            ),
            ("begin open certain rested saved written looked", ""),
        ],
        Story::out,
    );
}

#[test]
fn saved_projects_are_offered_restored_and_forgotten() {
    let offered = |story: &Story| {
        let offers: Vec<_> = story.model.keeping.offers.iter().map(|offer| offer.name.clone()).collect();
        format!("{} | {}", offers.join(", "), story.stands())
    };
    compare(
        &[
            ("begin found-none", " | nothing |  | "),
            ("begin found-one", "kept 0 | nothing |  | "),
            ("begin found-two", "kept 1, kept 0 | nothing |  | "),
            ("begin found-one restore", "kept 0 | nothing |  | take:0"),
            ("begin found-one restore taken", "kept 0 | opening |  | call-off open"),
            ("begin found-one restore taken opened", "kept 0 | reading |  | call-off read"),
            (
                "begin found-two restore taken opened certain",
                "kept 0 | planning | board stale | plan keep-rests",
            ),
            ("begin found-one restore taken opened warning", " | nothing | board review | keep-rests"),
            // a project that could not be opened is still offered
            ("begin found-one restore taken open-refused", "kept 0 | nothing |  | toast-goes let-go:0"),
            (
                "begin found-one restore taken opened read-refused",
                "kept 0 | nothing |  | toast-goes let-go:0",
            ),
            ("begin found-one restore taken-nothing", "kept 0 | nothing |  | toast-goes let-go:0"),
            ("begin found-one restore open taken", "kept 0 | opening |  | call-off open"),
            ("begin found-one restore taken open opened", "kept 0 | reading |  | "),
            ("begin found-one restore taken open", "kept 0 | reading |  | call-off read let-go:0"),
            ("begin found-one taken", "kept 0 | nothing |  | let-go:0"),
            ("begin found-one restore restore", "kept 0 | nothing |  | "),
            ("begin found-one restore taken-nothing restore", "kept 0 | nothing |  | take:0"),
            ("begin found-one restore forget", "kept 0 | nothing |  | "),
            // a discard can be undone while its toast is shown
            ("begin found-one forget", " | nothing |  | toast-goes drops-soon:0"),
            ("begin found-one forget found-one", " | nothing |  | "),
            ("begin found-one forget drop", " | nothing |  | drop:0"),
            ("begin found-one forget take-back", " | nothing |  | look"),
            ("begin found-one forget take-back found-one", "kept 0 | nothing |  | "),
            ("begin found-one forget take-back drop", " | nothing |  | "),
            ("begin found-two forget forgotten", "kept 0 | nothing |  | look"),
            ("begin found-two forget forgotten found-one", "kept 0 | nothing |  | "),
        ],
        offered,
    );
}

#[test]
fn restored_project_uses_its_slot_unless_open_elsewhere() {
    compare(
        &[
            ("begin found-one restore taken opened certain rested saved", "write:0+files"),
            ("begin found-two restore taken opened certain rested saved", "write:1+files"),
            (
                "begin found-one restore taken opened read-refused open certain rested saved",
                "write:new+files",
            ),
            ("begin found-one restore taken-elsewhere opened certain", "plan keep-rests"),
            ("begin found-one restore taken-elsewhere opened certain rested saved", "write:new+files"),
        ],
        Story::out,
    );
    let story = Story::told("begin found-one restore taken-elsewhere opened certain");
    assert_eq!(story.toasts(), ["page.kept.copy"], "and the person is told");
}

#[test]
fn last_of_two_restore_requests_wins() {
    let mut story = Story::told("begin found-two");
    let taken = |place| KeepEvent::Taken { place, files: Some(vec![1]), job: None, own: true };
    story.send(KeepEvent::Restore { offer: offer(1, 2.0) });
    story.send(KeepEvent::Restore { offer: offer(0, 1.0) });
    story.send(taken(1));
    assert_eq!((story.way(), story.out().as_str()), ("nothing", "let-go:1"));
    story.send(taken(0));
    assert!(matches!(story.model.on_the_way, OnTheWay::Opening { place: Some(0), .. }));
}

#[test]
fn cancelled_review_returns_to_the_previous_slot() {
    compare(
        &[
            // the slot stays held while the user can go back
            ("begin open certain rested saved written open-other warning", "keep-rests"),
            ("begin open certain rested saved written open-other warning reviewed", "plan let-go:4"),
            (
                "begin open certain rested saved written open-other warning discard",
                "look let-go:4 keep-rests",
            ),
            (
                "begin open certain rested saved written open-other warning rested saved written-fifth back",
                "call-off plan let-go:5 keep-rests",
            ),
            ("begin open certain rested saved written open-other warning back rested", "write:4"),
            (
                "begin open certain rested saved written edit open-other warning written back rested",
                "write:4",
            ),
            // a slot assigned while another board opened is known after going back
            ("begin open certain rested saved open-other warning written back rested", "write:4"),
            ("begin open certain rested saved open-other warning back written", ""),
            // a review of the board itself changes nothing
            ("begin open certain rested saved written review back", "call-off plan"),
            ("begin open certain rested saved written review say-aligned certain back rested", "write:4"),
            ("begin open certain rested saved written edit open-anew warning back rested", "write:4"),
        ],
        Story::out,
    );
}

#[test]
fn board_with_equal_file_names_preserves_the_saved_one() {
    let board = "begin open certain rested saved written edit open-anew certain rested saved written";
    let rows = [
        ("another", "call-off call-off read keep-rests"),
        ("another certain", "save plan keep-rests"),
        ("another certain saved", "write:4+files"),
        ("another certain saved written", "let-go:4"),
        ("another certain saved written rested saved", "write:new+files"),
    ];
    for (words, out) in rows {
        assert_eq!(Story::told(&format!("{board} {words}")).out(), out, "{words}");
    }
}

#[test]
fn all_closed_saved_projects_are_deleted_at_once() {
    let mut story = Story::told("begin");
    let elsewhere = Offer { elsewhere: true, ..offer(2, 3.0) };
    story.send(KeepEvent::Found { offers: vec![offer(0, 1.0), offer(1, 2.0), elsewhere.clone()] });
    story.send(KeepEvent::Restore { offer: offer(1, 2.0) });
    story.send(KeepEvent::DropAll);
    let dropped: Vec<u32> = story
        .out
        .iter()
        .filter_map(|effect| if let Effect::DropFromStore { place } = effect { Some(*place) } else { None })
        .collect();
    assert_eq!(dropped, [0], "what is open elsewhere stays, and what is just being restored");
    assert_eq!(story.model.keeping.offers, [elsewhere, offer(1, 2.0)]);
    // The saved projects are listed even if a board is open.
    let mut story = Story::told("begin found-none open certain");
    story.send(KeepEvent::Listed);
    assert!(story.out.contains(&Effect::LookInStore), "{:?}", story.out);
}
