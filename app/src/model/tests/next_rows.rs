//! The line at the foot of the page: proof, number of problems, next step; files that are being read.

use super::story::{Story, compare};
use crate::keys::Tab;
use crate::model::{FilesEvent, FrameEvent, JobEvent, ProofState};
use crate::said::Text;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::proof::{ProofResult, Proven, Verdict};
use annulus_core::units::Length;
use std::sync::Arc;

/// State and key of the sentence.
fn sentence(story: &Story) -> String {
    story.model.proof_sentence().map_or_else(String::new, |sentence| {
        let key = match &sentence.text {
            Text::Key { key, .. } => (*key).to_owned(),
            Text::Found(why) => why.code.clone(),
        };
        format!("{:?} {key}", sentence.state)
    })
}

#[test]
fn proof_sentence_matches_the_plan() {
    compare(
        &[
            ("", ""),
            ("open", ""),
            ("open warning", "Waits page.next.in_review"),
            ("open warning reviewed", "Waits page.cam.not_proved"),
            ("open error reviewed", "Open page.next.in_files"),
            ("open error reviewed accept", "Waits page.cam.not_proved"),
            ("open certain", "Waits page.cam.not_proved"),
            ("open certain plan prove", "Waits page.cam.not_proved"),
            ("open certain plan prove time", "Nothing proof.outcome.no_copper"),
            ("open certain plan-refused", "Refused plan.nothing"),
            ("open certain plan prove time edit", "Waits page.cam.not_proved"),
            ("open certain plan prove time discard", ""),
        ],
        sentence,
    );
}

#[test]
fn proved_sentence_is_that_of_the_command_line() {
    let mut story = Story::told("open certain plan prove-two time");
    let outcome = ProofResult {
        proven: Proven::Copper,
        isolates: true,
        nets: 8,
        isolated: 8,
        smallest_gap: Some(Length::from_um(310)),
    };
    let board = &mut story.model.board;
    let proved = board.proved.as_deref().cloned().unwrap_or_default();
    board.proved = Some(Arc::new(Verdict { outcome, ..proved }));
    assert_eq!(sentence(&story), "Open proof.outcome.unread");
    story.tell("see-all");
    let found = story.model.proof_sentence().unwrap();
    assert_eq!(found.state, ProofState::Proved);
    let (key, args) = outcome.sentence(0);
    assert_eq!(found.text, Text::Key { key, args });
    assert_eq!(key, "proof.outcome.proved");
}

#[test]
fn next_step_follows_problems_and_visited_screens() {
    let step = |story: &Story| {
        let screen = story.model.problems_tab().word();
        story.model.next_step().map_or_else(String::new, |step| format!("{step:?}, problems on {screen}"))
    };
    compare(
        &[
            ("", ""),
            ("open warning", "Files, problems on board"),
            ("open error reviewed", "Files, problems on board"),
            ("open certain", "Toolpaths, problems on board"),
            ("open certain plan-refused", "Problems, problems on board"),
            ("open certain plan prove time", "Toolpaths, problems on board"),
            ("open certain plan prove-two time", "Problems, problems on cam"),
            ("open certain plan prove-two time see-all", "Toolpaths, problems on cam"),
        ],
        step,
    );
    let mut story = Story::told("open certain plan prove time");
    let visited: Vec<_> = [Tab::Board, Tab::Machine, Tab::Cam, Tab::Board, Tab::Simulate, Tab::Board]
        .into_iter()
        .map(|tab| {
            story.send(FrameEvent::Show { tab });
            step(&story)
        })
        .collect();
    let steps = ["Toolpaths", "Toolpaths", "Simulate", "Simulate", "Run", "Run"];
    assert_eq!(visited, steps.map(|step| format!("{step}, problems on board")));
    story.tell("open-other");
    story.tell("certain");
    assert_eq!(step(&story), "Toolpaths, problems on board", "another board");
}

#[test]
fn problems_have_one_number() {
    let counts = |story: &Story| {
        let board = &story.model.board;
        format!("{} = {} of files, {} found", board.problem_count(), board.of_files_count(), board.found())
    };
    compare(
        &[
            ("", "0 = 0 of files, 0 found"),
            ("open warning", "1 = 1 of files, 0 found"),
            ("open warning reviewed plan prove-two time", "3 = 1 of files, 2 found"),
            ("open warning reviewed plan prove-two time see-all", "3 = 1 of files, 2 found"),
            ("open certain plan-error prove time", "1 = 0 of files, 0 found"),
            ("open certain plan-refused", "1 = 1 of files, 0 found"),
        ],
        counts,
    );
    let mut story = Story::told("open certain plan prove time");
    let notes = vec![Diagnostic::note("plan.loaded_not_used")];
    let plan = story.model.board.plan.as_deref().cloned().unwrap_or_default();
    story.model.board.plan =
        Some(Arc::new(crate::engine::messages::PlanReady { diagnostics: notes, ..plan }));
    assert_eq!(story.model.board.problem_count(), 0, "a note is no problem");
}

#[test]
fn files_are_shown_from_the_drop_until_they_are_read() {
    let loading = |story: &Story| story.model.loading().map(|loading| (loading.files, loading.share));
    let mut story = Story::default();
    assert_eq!(loading(&story), None);
    story.send(FilesEvent::Coming { files: 12 });
    assert_eq!(loading(&story), Some((12, 0.0)));
    story.tell("open");
    assert_eq!(loading(&story), Some((2, 0.0)), "as many as arrived");
    story.tell("half");
    story.send(FilesEvent::Coming { files: 0 });
    assert_eq!(loading(&story), Some((2, 0.5)));
    story.tell("certain");
    assert_eq!(loading(&story), None);
    story.tell("open-project");
    assert_eq!(loading(&story), Some((1, 0.0)));
    story.send(FilesEvent::Coming { files: 3 });
    story.tell("cancel");
    story.send(FilesEvent::Coming { files: 0 });
    assert_eq!(loading(&story), None, "unreadable files");
}

#[test]
fn chosen_operation_is_lit_until_it_is_chosen_again() {
    let mut story = Story::told("open certain");
    assert!(!story.model.job.lit);
    let lit: Vec<bool> = [0, 1, 1, 1, 2]
        .into_iter()
        .map(|at| {
            story.send(JobEvent::Choose { at });
            story.model.job.lit
        })
        .collect();
    assert_eq!(lit, [true, true, false, true, true]);
    story.tell("bottom");
    assert!(!story.model.job.lit, "the other side has other operations");
}

#[test]
fn export_panel_shows_every_answer_but_the_run_sheet() {
    let open = |story: &Story| story.model.export.open.to_string();
    compare(
        &[
            ("open certain plan prove time", "false"),
            ("open certain plan prove time panel", "true"),
            ("open certain plan prove time panel write exported", "true"),
            ("open certain plan prove time panel panel-closed", "false"),
            ("open certain plan prove time write export-refused", "true"),
            ("open certain plan prove time write export-unread", "true"),
            ("open certain plan prove time save-project save-refused", "true"),
            ("open certain plan prove time save-project saved", "false"),
            ("open certain plan prove time panel sheet exported", "false"),
        ],
        open,
    );
    let closed = Story::told("open certain plan prove time panel write exported panel-closed");
    assert_eq!(closed.model.export.outcome, None, "an old answer is not shown again");
}
