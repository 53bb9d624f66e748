//! New exports of the open board: reading, comparison, and going back.

use super::story::{Story, compare, shifted_work};
use crate::keys::Tab;
use crate::model::{AnewEvent, FilesEvent, FrameEvent, Model};

fn open(model: &Model) -> String {
    let document = model.board.document.as_ref();
    let files = document.map(|document| document.files.clone()).unwrap_or_default();
    files.iter().map(|(name, bytes)| format!("{name}={bytes:?}")).collect::<Vec<_>>().join(" ")
}

#[test]
fn files_with_open_names_replace_them_and_are_compared() {
    compare(
        &[
            ("open certain open-anew", "reading | board stale | call-off read"),
            ("open certain open-anew certain", "planning | board stale | compare plan keep-rests"),
            ("open certain open-anew certain compared", "planning | board stale | "),
            ("open certain open-anew certain compare-refused", "planning | board stale | "),
            // comparison and plan do not wait for each other
            ("open certain open-anew certain plan compared", "proving | board plan stale | "),
            ("open certain open-anew read-refused", "planning | board stale | toast-goes plan"),
            // a job edited meanwhile is compared again
            ("open certain open-anew certain edit compared", "planning-again | board stale | compare"),
            (
                "open certain open-anew certain say-aligned certain",
                "planning | board stale | compare plan keep-rests",
            ),
            ("open certain open-other certain", "planning | board stale | plan keep-rests"),
            ("open-anew certain", "planning | board stale | plan keep-rests"),
            ("open certain choose-anew", "planning | board stale | choose-anew"),
            ("open certain chosen-anew certain", "planning | board stale | compare plan keep-rests"),
            // a review is needed if the new files have problems that the old ones did not have
            ("open certain open-anew warning", "nothing | board review stale | compare keep-rests"),
            ("open warning reviewed open-anew warning", "planning | board stale | compare plan keep-rests"),
            ("open warning reviewed open-anew empty", "nothing | board review stale | compare keep-rests"),
            // or if the old files are under review themselves
            ("open warning open-anew warning", "nothing | board review | compare keep-rests"),
            ("open warning open-anew certain", "planning | board stale | compare plan keep-rests"),
            (
                "open warning open-anew certain as-before",
                "nothing | board review stale | call-off keep-rests",
            ),
            ("open certain open-anew warning back", "planning | board stale | call-off plan keep-rests"),
            ("open certain open-anew warning reviewed back", "planning | board stale | "),
            ("open certain chosen-anew-project", "opening | board stale | call-off open"),
        ],
        Story::stands,
    );
}

#[test]
fn open_files_follow_uploads_and_disk_changes() {
    compare(
        &[
            ("open certain open-anew certain", "a.drl=[3] b.drl=[1]"),
            ("open certain open-anew certain as-before", "a.drl=[1] b.drl=[1]"),
            ("open certain open-anew read-refused", "a.drl=[1] b.drl=[1]"),
            ("open certain open-anew certain another certain", "a.drl=[3]"),
            ("open certain open-anew-whole certain another", "a.drl=[1] b.drl=[1]"),
            ("open certain open-anew-whole certain another certain", "a.drl=[3] b.drl=[3]"),
            ("open certain open-anew warning back", "a.drl=[1] b.drl=[1]"),
            ("open certain chosen-anew certain", "c.drl=[2] d.drl=[2]"),
            ("open certain chosen-anew certain as-before", "a.drl=[1] b.drl=[1]"),
            // a chosen file with a new name: the chosen files are the whole board
            ("open certain chosen-anew-mixed certain", "a.drl=[3] c.drl=[2]"),
            ("open certain chosen-anew-one certain", "a.drl=[3] b.drl=[1]"),
            ("open certain on-disk take-from-disk certain", "a.drl=[1] b.drl=[9]"),
            // a later change on disk keeps an earlier one
            ("open certain on-disk on-disk-a take-from-disk certain", "a.drl=[8] b.drl=[9]"),
            ("open certain on-disk open-anew certain take-from-disk certain", "a.drl=[3] b.drl=[9]"),
            (
                "open certain on-disk open-anew certain as-before take-from-disk certain",
                "a.drl=[1] b.drl=[9]",
            ),
            ("open certain open-anew certain compared seen as-before", "a.drl=[3] b.drl=[1]"),
        ],
        |story| open(&story.model),
    );
}

#[test]
fn changes_are_shown_until_acknowledged() {
    let shown = |story: &Story| match story.model.anew.shown.as_deref() {
        None => "nothing".to_owned(),
        Some(shown) => match &shown.compared {
            Some(compared) => format!("{} changed", compared.changes.holes.len()),
            None if shown.failed => "failed".to_owned(),
            None => format!("looking at {}", shown.replaced.join(" ")),
        },
    };
    compare(
        &[
            ("open certain", "nothing"),
            ("open certain open-anew", "nothing"),
            ("open certain open-anew certain", "looking at a.drl"),
            ("open certain open-anew certain compared", "1 changed"),
            ("open certain open-anew certain compare-refused", "failed"),
            ("open certain open-anew certain compared seen", "nothing"),
            ("open certain open-anew certain seen compared", "nothing"),
            ("open certain open-anew certain compared as-before", "nothing"),
            ("open certain open-anew certain compared open-other certain", "nothing"),
            ("open certain open-anew certain compared discard", "nothing"),
            ("open certain open-anew warning back", "nothing"),
            ("open certain open-anew certain another", "nothing"),
        ],
        shown,
    );
}

#[test]
fn edited_job_survives_a_board_change_and_can_be_undone() {
    let depth = |words: &str| {
        let story = Story::told(words);
        story.model.job.work.as_ref().unwrap().operations[0].depth
    };
    let carried = shifted_work().operations[0].depth;
    let edited = depth("open certain edit");
    assert_ne!(edited, carried);
    assert_eq!(depth("open certain edit open-anew certain"), edited, "what the person changed stays");
    assert_eq!(depth("open certain edit open-anew certain compared-carried"), carried);
    assert_eq!(
        depth("open certain edit open-anew certain compared-carried undo"),
        edited,
        "a step as any other"
    );
    assert_eq!(depth("open certain edit open-anew certain compared-carried as-before"), edited);
    assert_eq!(
        depth("open certain edit open-anew certain seen compared-carried"),
        carried,
        "also once it was seen"
    );
    let later = "open certain open-anew certain compared-carried edit say-aligned certain compared-carried";
    assert_ne!(depth(later), carried, "it goes along with the board once");
    assert_eq!(
        depth("open certain say-board certain flip-use certain edit chosen-anew certain"),
        depth("open certain say-board certain flip-use certain edit"),
        "also where what was said is of files that are gone"
    );
    let story = Story::told("open certain edit open-anew certain edit as-before");
    assert!(story.model.job.edited(), "with its own steps back");
}

#[test]
fn disk_change_is_offered_once_and_read_only_on_request() {
    compare(
        &[
            ("open certain on-disk", "page.anew.on_disk"),
            ("open certain on-disk on-disk", "page.anew.on_disk"),
            ("open certain on-disk-same", ""),
            ("on-disk", ""),
            ("open-other certain on-disk", ""),
            ("open certain on-disk take-from-disk", ""),
            ("open certain on-disk on-disk-same", ""),
            // the offer stays while a change is left
            ("open certain on-disk open-anew certain", "page.anew.on_disk"),
            ("open certain on-disk open-other certain", ""),
            ("open certain on-disk discard", ""),
        ],
        |story| story.toasts().join(" "),
    );
    let story = Story::told("open certain on-disk");
    assert_eq!((story.way(), story.out().as_str()), ("planning", ""), "nothing is read unasked");
}

#[test]
fn changed_files_open_the_board_screen() {
    let mut story = Story::told("open certain");
    story.send(FrameEvent::Show { tab: Tab::Cam });
    ["open-anew", "certain"].into_iter().for_each(|word| story.tell(word));
    assert_eq!(story.model.frame.tab, Tab::Board);
}

#[test]
fn renamed_file_is_replaced_under_its_open_name() {
    let named = |name: &str, byte| (name.to_owned(), vec![byte]);
    let mut story = Story::default();
    story.send(FilesEvent::Chosen { files: vec![named("board/a.drl", 1), named("board/b.drl", 1)] });
    story.tell("certain");
    story.send(AnewEvent::Chosen { files: vec![named("a.drl", 2)] });
    story.tell("certain");
    story.send(AnewEvent::OnDisk { files: vec![named("a.drl", 3)] });
    ["take-from-disk", "certain"].into_iter().for_each(|word| story.tell(word));
    assert_eq!(open(&story.model), "board/a.drl=[3] board/b.drl=[1]");
}

#[test]
fn changed_file_of_a_folder_leaves_the_others_open() {
    let named = |name: &str, byte| (format!("board/{name}"), vec![byte]);
    let mut story = Story::default();
    story.send(FilesEvent::Chosen { files: vec![named("a.drl", 1), named("b.drl", 1)] });
    story.tell("certain");
    story.send(AnewEvent::OnDisk { files: vec![named("a.drl", 2)] });
    ["take-from-disk", "certain"].into_iter().for_each(|word| story.tell(word));
    assert_eq!(open(&story.model), "board/a.drl=[2] board/b.drl=[1]");
}
