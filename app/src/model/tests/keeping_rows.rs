//! What is kept in the browser, offered, restored and forgotten.

use super::story::{Story, compare};

#[test]
fn what_is_open_is_kept_once_it_rests() {
    compare(
        &[
            ("begin", "look"),
            ("begin found-none", "keep-rests"),
            ("begin found-none rested", ""),
            ("begin found-none open certain rested", "save"),
            ("begin found-none open certain rested-before", ""),
            ("begin found-none open certain rested saved", "write:0+files"),
            ("begin found-none open certain rested saved written", ""),
            // the files are there: the job alone
            ("begin found-none open certain rested saved written edit rested", "write:0"),
            ("begin found-none open certain rested saved written edit rested written undo rested", "write:0"),
            ("begin found-none open certain rested saved written open-other certain rested", "save"),
            ("begin found-none open certain rested saved written say-aligned certain rested", "save"),
            // it is not known yet what is there
            ("begin open certain rested", ""),
            ("begin open certain found-none rested", "save"),
            // what is on offer is not written over
            ("begin found-one open certain rested saved", "write:1+files"),
            ("begin found-second open certain rested saved", "write:0+files"),
            ("begin found-two open certain rested saved", "write:0+files"),
            ("begin found-none open certain plan", "toast-goes prove"),
            ("begin found-none open certain discard", "keep-rests"),
            ("begin found-none open certain discard rested", ""),
        ],
        Story::out,
    );
}

#[test]
fn what_changes_while_the_store_is_busy_is_kept_after() {
    compare(
        &[
            ("begin found-none open certain rested edit rested", ""),
            ("begin found-none open certain rested edit rested saved", "write:0+files"),
            ("begin found-none open certain rested edit rested saved written", "write:0"),
            ("begin found-none open certain rested saved edit rested written", "write:0"),
            ("begin found-none open certain rested saved edit rested written written", ""),
            ("begin found-none open certain rested saved edit rested not-written", "toast-goes save"),
            ("begin found-none open certain rested open-other certain saved", "write:0+files"),
            ("begin found-none open certain rested saved saved", ""),
            ("written", ""),
        ],
        Story::out,
    );
}

#[test]
fn that_nothing_can_be_kept_is_said_once() {
    compare(
        &[
            ("begin found-none open certain rested save-refused", "page.kept.failed"),
            ("begin found-none open certain rested saved not-written", "page.kept.failed"),
            (
                "begin found-none open certain rested saved not-written edit rested saved not-written",
                "page.kept.failed",
            ),
            ("begin found-none open certain rested saved written", ""),
        ],
        |story| story.toasts().join(" "),
    );
}

#[test]
fn the_last_project_is_offered_restored_and_forgotten() {
    let offered = |story: &Story| {
        let offer = story.model.keeping.offer.as_ref().map(|offer| offer.name.clone()).unwrap_or_default();
        format!("{offer} | {}", story.stands())
    };
    compare(
        &[
            ("begin found-none", " | nothing |  | keep-rests"),
            ("begin found-one", "kept 0 | nothing |  | keep-rests"),
            ("begin found-two", "kept 1 | nothing |  | keep-rests"),
            ("begin found-one restore", "kept 0 | nothing |  | take:0"),
            ("begin found-one restore taken", "kept 0 | opening |  | call-off open"),
            ("begin found-one restore taken opened", "kept 0 | reading |  | call-off read"),
            ("begin found-one restore taken opened certain", " | planning | board stale | plan keep-rests"),
            ("begin found-one restore taken opened warning", " | nothing | board review | keep-rests"),
            // what could not be opened is still there
            ("begin found-one restore taken open-refused", "kept 0 | nothing |  | toast-goes"),
            ("begin found-one restore taken opened read-refused", "kept 0 | nothing |  | toast-goes"),
            ("begin found-one restore taken-nothing", "kept 0 | nothing |  | toast-goes"),
            ("begin found-one restore open taken", "kept 0 | opening |  | call-off open"),
            ("begin found-one restore taken open opened", "kept 0 | reading |  | "),
            ("begin found-one taken", "kept 0 | nothing |  | "),
            ("begin found-one forget", "kept 0 | nothing |  | drop:0"),
            ("begin found-two forget forgotten", " | nothing |  | look"),
            ("begin found-two forget forgotten found-one", "kept 0 | nothing |  | keep-rests"),
            ("begin found-one forget forgotten found-none", " | nothing |  | keep-rests"),
        ],
        offered,
    );
}

#[test]
fn a_restored_project_is_kept_where_it_was() {
    compare(
        &[
            ("begin found-one restore taken opened certain rested saved", "write:0+files"),
            ("begin found-two restore taken opened certain rested saved", "write:1+files"),
            ("begin found-one restore taken opened read-refused open certain rested saved", "write:1+files"),
        ],
        Story::out,
    );
}
