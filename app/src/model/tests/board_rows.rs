//! Errors that need a review before a board is used, and the report of what was drilled.

use super::line::status;
use super::story::row;
use crate::engine::messages::Reading;
use crate::model::link::drilled;
use crate::model::{Document, Unseen};
use crate::said::Text;
use annulus_core::control::State;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::project::saved::SaidOfFiles;
use annulus_core::wire::DrilledReport;

/// Errors of a file and of the board, accepted codes, and the expected reason for a review.
#[test]
fn review_reason_matches_the_unaccepted_problem() {
    type Row = (&'static [&'static str], &'static [&'static str], &'static [&'static str], Option<Unseen>);
    let rows: [Row; 9] = [
        (&[], &[], &[], None),
        (&["drill.no_tool"], &[], &[], Some(Unseen::Unread)),
        (&["drill.no_tool"], &[], &["drill.no_tool"], None),
        (&["refused.eia_tape"], &["board.two_coppers"], &[], Some(Unseen::Unread)),
        (&["refused.eia_tape"], &["board.two_coppers"], &["refused.eia_tape"], Some(Unseen::Board)),
        (&["board.two_coppers"], &[], &[], Some(Unseen::Board)),
        (&[], &["board.several"], &[], Some(Unseen::Several)),
        (&["drill.no_tool"], &["board.several"], &[], Some(Unseen::Several)),
        (&["drill.no_tool"], &["board.several"], &["board.several"], Some(Unseen::Unread)),
    ];
    for (of_file, of_board, accepted, expected) in rows {
        let errors = |codes: &[&str]| codes.iter().map(|code| Diagnostic::error(code)).collect::<Vec<_>>();
        let mut of_file = errors(of_file);
        of_file.push(Diagnostic::warning("drill.no_end"));
        let reading = Reading {
            files: vec![row(of_file.clone())],
            diagnostics: errors(of_board),
            ..Reading::default()
        };
        let document = Document::new(Vec::new(), SaidOfFiles::default(), None, reading);
        let accepted = accepted.iter().map(|code| (*code).to_owned()).collect();
        assert_eq!(document.unseen(&accepted), expected, "{of_file:?} {of_board:?} {accepted:?}");
    }
}

/// The virtual drill's record and the expected messages.
#[test]
fn job_end_lists_missing_shifted_and_repeated_holes() {
    let none = DrilledReport::default();
    let rows = [
        (None, vec![], ""),
        (Some(none), vec![], ""),
        (Some(none), vec![7], "run.drilled_twice 7"),
        (
            Some(DrilledReport { missing: 3, broken: 1, ..none }),
            vec![],
            "page.ended.missing 3, page.ended.broken 1",
        ),
        (Some(DrilledReport { missing: 3, ..none }), vec![4], "page.ended.missing 3, run.drilled_twice 4"),
        (
            Some(DrilledReport { shifted: 2, doubled: 1, slipped_steps: 40, ..none }),
            vec![],
            "page.ended.shifted 2, page.ended.doubled 1, page.ended.slipped 40",
        ),
    ];
    for (drilled, drilled_twice, expected) in rows {
        let status = annulus_core::wire::Status { drilled, drilled_twice, ..status(State::Ready, None) };
        let word = |text: &Text| match text {
            Text::Key { key, args } => format!("{key} {}", args[0].1),
            Text::Found(diagnostic) => format!("{} {}", diagnostic.code, diagnostic.args[0].1),
        };
        let said: Vec<_> = drilled::lines(&status).iter().map(word).collect();
        assert_eq!(said.join(", "), expected);
    }
}
