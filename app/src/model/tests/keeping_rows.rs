//! What is kept in the browser, offered, restored and forgotten.

use super::story::{Story, compare, offer};
use crate::model::{Effect, KeepEvent, Offer, OnTheWay};

#[test]
fn what_is_open_is_kept_half_a_second_after_it_changed() {
    compare(
        &[
            ("begin", "look"),
            ("begin found-none", ""),
            ("begin found-none rested", ""),
            ("begin found-none open certain rested", "save"),
            ("begin found-none open certain rested saved", "write:new+files"),
            ("begin found-none open certain rested saved written", ""),
            // the files are there: the job alone
            ("begin found-none open certain rested saved written edit rested", "write:4"),
            ("begin found-none open certain rested saved written edit rested written undo rested", "write:4"),
            ("begin found-none open certain rested saved written open-other certain rested", "save"),
            ("begin found-none open certain rested saved written say-aligned certain rested", "save"),
            // changes that follow each other without a rest are kept all the same: the first of them is half a second old
            ("begin found-none open certain rested saved written edit edit edit rested-before", "write:4"),
            ("begin found-none open certain rested saved written edit edit rested-before rested", ""),
            // it is not known yet what is there: the store finds a place by itself
            ("begin open certain rested saved", "write:new+files"),
            // another project has a place of its own, and what was not kept yet of the one before is
            ("begin open certain rested saved written open-other certain rested saved", "write:new+files"),
            ("begin open certain rested saved written edit open-other", "call-off read"),
            ("begin open certain rested saved written edit open-other certain", "write:4 plan keep-rests"),
            ("begin open certain rested saved written edit open-other certain written", "let-go:4"),
            ("begin open certain rested saved written open-other certain", "plan let-go:4 keep-rests"),
            ("begin open certain rested saved written open-other", "call-off read"),
            // the page is left: what is not in the store yet is put where it takes no time
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
fn what_changes_while_the_store_is_busy_is_kept_after() {
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
            // what was on its way when another one was opened is kept at a place of its own, which is not held then
            ("begin found-none open certain rested open-other certain saved", "write:new+files"),
            ("begin found-none open certain rested open-other certain saved written", "let-go:4"),
            // and so is what changed of it before it was left
            ("begin found-none open certain rested edit open-other certain", "plan keep-rests"),
            ("begin found-none open certain rested edit open-other certain saved written", "write:4"),
            (
                "begin found-none open certain rested edit open-other certain saved written written",
                "let-go:4",
            ),
            ("begin found-none open certain rested edit rested discard saved written", "write:4"),
            // a board that was closed before it had a place is on offer once it has one
            (
                "begin found-none open certain rested edit rested discard saved written written",
                "look let-go:4",
            ),
            ("begin found-none open certain edit open-other certain", "save plan keep-rests"),
            // what is still being written is restored only when it is written
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
fn that_nothing_can_be_kept_is_said_once_and_stays_told() {
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
    // As long as it is not kept the browser asks before the page is left.
    compare(
        &[
            ("begin open certain rested saved full", "toast-goes Guard { on: true }"),
            ("begin open certain rested saved full edit rested saved written", "Guard { on: false }"),
            // it is tried again when the page is looked at, when it is left, and when another board comes
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
fn projects_are_offered_restored_and_forgotten() {
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
            // what could not be opened is still there
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
            // what is to be forgotten can be taken back as long as its word stays
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
fn a_restored_project_is_kept_where_it_was_and_that_of_another_tab_is_not() {
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
fn of_two_that_are_wanted_the_last_is_restored_and_the_other_is_let_go_of() {
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
fn the_way_back_leads_to_the_place_of_the_board_before() {
    compare(
        &[
            // it is this tab's as long as there is a way back
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
            // what was on its way when the other one came is known when it is there
            ("begin open certain rested saved open-other warning written back rested", "write:4"),
            ("begin open certain rested saved open-other warning back written", ""),
            // a review of its own changes nothing
            ("begin open certain rested saved written review back", "call-off plan"),
            ("begin open certain rested saved written review say-aligned certain back rested", "write:4"),
            ("begin open certain rested saved written edit open-anew warning back rested", "write:4"),
        ],
        Story::out,
    );
}

#[test]
fn what_only_had_the_names_of_the_board_does_not_push_it_out() {
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
fn all_that_is_kept_and_not_open_is_forgotten_at_once() {
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
    // What is kept is listed while a board is open too.
    let mut story = Story::told("begin found-none open certain");
    story.send(KeepEvent::Listed);
    assert!(story.out.contains(&Effect::LookInStore), "{:?}", story.out);
}
