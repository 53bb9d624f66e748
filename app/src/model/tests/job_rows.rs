//! Edits of the job, its problems, and its export.

use super::story::{Story, compare};
use crate::model::export::ExportOutcome;

/// Kinds of the operations, the selected one in brackets, undo and redo steps.
fn job(story: &Story) -> String {
    let job = &story.model.job;
    let words = job.work.iter().flat_map(|work| &work.operations).enumerate().map(|(at, operation)| {
        let word = operation.action.word();
        if at == job.chosen { format!("[{word}]") } else { word.to_owned() }
    });
    let (undo, redo) = job.can_undo();
    let steps = format!("{}{}", if undo { "<" } else { "" }, if redo { ">" } else { "" });
    format!("{} {steps}", words.collect::<Vec<_>>().join(" "))
}

#[test]
fn every_job_edit_can_be_undone() {
    compare(
        &[
            ("open certain", "[drill] isolate cut_out "),
            ("open certain choose-last", "drill isolate [cut_out] "),
            ("open certain choose-last up", "drill [cut_out] isolate <"),
            ("open certain up", "[drill] isolate cut_out "),
            ("open certain choose-last down", "drill isolate [cut_out] "),
            ("open certain down down", "isolate cut_out [drill] <"),
            ("open certain drag", "isolate cut_out [drill] <"),
            ("open certain drag undo", "drill isolate [cut_out] >"),
            ("open certain drag undo redo", "isolate cut_out [drill] <"),
            ("open certain add", "drill [mill_holes] isolate cut_out <"),
            ("open certain add-nothing", "[drill] isolate cut_out "),
            ("open certain remove", "[isolate] cut_out <"),
            ("open certain choose-last remove", "drill [isolate] <"),
            ("open certain remove remove remove", " <"),
            ("open certain remove remove remove remove add", "[mill_holes] <"),
            ("open certain remove undo", "[drill] isolate cut_out >"),
            ("open certain edit edit undo", "[drill] isolate cut_out <>"),
            ("open certain type type undo", "[drill] isolate cut_out >"),
            ("open certain edit undo edit redo", "[drill] isolate cut_out <"),
            ("open certain undo redo", "[drill] isolate cut_out "),
            ("open certain bottom", "[drill] isolate cut_out <"),
            ("open certain bottom add", "drill [mill_holes] isolate cut_out <"),
            ("undo remove add up", " "),
        ],
        job,
    );
}

#[test]
fn new_board_clears_read_marks_and_undo() {
    let mut story = Story::told("open certain plan prove-two time mark see-one edit");
    story.tell("open-other");
    story.tell("certain");
    assert!(story.model.job.read.is_empty() && story.model.job.marked.is_none());
    assert!(!story.model.job.edited());
}

#[test]
fn plan_is_cleared_after_every_problem_is_accepted() {
    let cleared = |story: &Story| {
        format!("{} {}", story.model.cleared(), story.model.board.unread(&story.model.job.read))
    };
    compare(
        &[
            ("open certain", "false 0"),
            ("open certain plan", "false 0"),
            ("open certain plan prove", "false 0"),
            ("open certain plan prove time", "true 0"),
            ("open certain plan prove-two time", "false 2"),
            ("open certain plan prove-two time see-one", "false 1"),
            ("open certain plan prove-two time see-one unsee-one", "false 2"),
            ("open certain plan prove-two time see-all", "true 0"),
            ("open certain plan-error prove time", "false 1"),
            ("open certain plan-error prove time see-all", "false 0"),
            ("open certain plan-error prove time see-all plan-error prove time", "true 0"),
            ("open certain plan prove time edit", "false 0"),
            ("open certain plan prove-refused time", "false 0"),
        ],
        cleared,
    );
}

#[test]
fn new_proof_removes_the_mark() {
    assert_eq!(Story::told("open certain plan prove-two time mark").model.job.marked, Some(1));
    assert_eq!(Story::told("open certain plan prove-two time mark edit plan").model.job.marked, Some(1));
    assert_eq!(Story::told("open certain plan prove-two time mark edit plan prove").model.job.marked, None);
}

/// Outcome of an export, and effects of the last word.
fn written(story: &Story) -> String {
    let export = &story.model.export;
    let outcome = match &export.outcome {
        None => String::new(),
        Some(ExportOutcome::Saved { names }) => format!("saved {}", names.join(" ")),
        Some(ExportOutcome::Unread { sides }) => format!("unread on {}", sides.len()),
        Some(ExportOutcome::Refused { why }) => why.code.clone(),
    };
    let refused = export.refused.first().map(|why| format!("refused {}", why.code)).unwrap_or_default();
    let sheet = if export.run_sheet.is_some() { "sheet" } else { "" };
    format!("{outcome}{refused}{sheet} | {}", story.out())
}

#[test]
fn written_programs_are_reported_until_the_job_changes() {
    compare(
        &[
            ("write", " | "),
            ("save-project", " | "),
            ("open certain plan prove time write", " | export"),
            ("open certain plan prove time write exported", "saved a.nc | save:a.nc"),
            ("open certain plan prove time write exported-two", "saved a.nc b.nc | save:a-grbl.zip"),
            ("open certain plan prove time write export-unread", "unread on 1 | "),
            ("open certain plan prove time write export-refused", "refused post.broken | "),
            ("open certain plan prove time write export-gone", " | read export"),
            ("open certain plan prove time write export-gone certain exported", "saved a.nc | save:a.nc"),
            (
                "open certain plan prove time write export-gone certain export-gone",
                "refused engine.board_gone | ",
            ),
            ("open certain plan prove time write exported edit", " | plan keep-rests"),
            ("open certain plan prove time write exported mark", "saved a.nc | "),
            ("open certain plan prove time write edit exported", "saved a.nc | save:a.nc"),
            ("open certain plan prove time write cancel exported", " | "),
            ("open certain plan prove time write write old-exported", " | "),
            ("open certain plan prove time sheet exported", "sheet | "),
            ("open certain plan prove time sheet exported save-sheet", "sheet | save:run-sheet.html"),
            ("open certain plan prove time sheet exported close-sheet", " | "),
            ("open certain plan prove time save-project", " | save"),
            ("open certain plan prove time save-project saved", " | save:a.annulus"),
            ("open certain plan prove time save-project save-refused", "refused saved.too_large | "),
            // a project is saved by a separate worker: cancelling the board's worker does not affect it
            ("open certain plan prove time save-project cancel saved", " | save:a.annulus"),
        ],
        written,
    );
}

#[test]
fn template_is_checked_after_typing_stops() {
    compare(
        &[
            ("template", "typing-rests"),
            ("template typing-rested", "check"),
            ("template typing-rested checked", ""),
            ("template typing-rested typed", "typing-rests"),
            ("template typed typing-rested", "check"),
            ("typed", ""),
            ("template template-done typed", ""),
            ("open certain plan prove template time", "typing-rests"),
        ],
        Story::out,
    );
    let seen = |words: &str| Story::told(words).model.template.checked.is_some();
    assert!(seen("template typing-rested checked"));
    assert!(!seen("template typing-rested typed checked"), "it is of an older text");
    assert_eq!(Story::told("typed").model.template.own_name().as_deref(), Some("Mine"));
    assert_eq!(Story::told("typed").model.template.target, "own");
}
