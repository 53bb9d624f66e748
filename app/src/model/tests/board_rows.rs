//! What a person has to see of a board before it is used.

use super::story::row;
use crate::engine::messages::Reading;
use crate::model::{Document, Unseen};
use annulus_core::project::saved::Said;
use annulus_core::remark::{Remark, Weight};

/// Losses of a file and of the board, what was accepted of them, and what is to be seen first.
#[test]
fn what_has_to_be_seen_is_called_what_it_is() {
    let rows: [(&[&str], &[&str], &[&str], Option<Unseen>); 9] = [
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
        let losses =
            |codes: &[&str]| codes.iter().map(|code| Remark::new(Weight::Loss, code)).collect::<Vec<_>>();
        let mut of_file = losses(of_file);
        of_file.push(Remark::new(Weight::Doubt, "drill.no_end"));
        let reading =
            Reading { files: vec![row(of_file.clone())], remarks: losses(of_board), ..Reading::default() };
        let document = Document::new(Vec::new(), Said::default(), None, reading);
        let accepted = accepted.iter().map(|code| (*code).to_owned()).collect();
        assert_eq!(document.unseen(&accepted), expected, "{of_file:?} {of_board:?} {accepted:?}");
    }
}
