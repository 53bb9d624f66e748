//! Work commands as typed: lines that can still be wrong, edited by row or as text. The core checks them.
//!
//! ```text
//! * MOVE_TO 10 20 ; note     ◀▶  breakpoint, word, arguments, note
//!     DRILL_DOWN                 lines inside REPEAT or SUB are indented by one level
//! ```

use serde::{Deserialize, Serialize};

/// Further lines are dropped; the core rejects longer queues.
pub const MOST_LINES: usize = 2_000;

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct QueueLine {
    /// A run stops before this line.
    pub breakpoint: bool,
    /// The command's name.
    pub word: String,
    pub arguments: String,
    /// The text after `;`.
    pub note: String,
}

#[derive(Clone, Debug, PartialEq)]
pub enum QueueEdit {
    /// Inserts an empty line after this one.
    Insert {
        at: usize,
    },
    Double {
        at: usize,
    },
    Delete {
        at: usize,
    },
    Move {
        at: usize,
        down: bool,
    },
    Break {
        at: usize,
    },
    Word {
        at: usize,
        word: String,
        arguments: String,
    },
    Arguments {
        at: usize,
        text: String,
    },
    Note {
        at: usize,
        text: String,
    },
    Text(String),
}

/// `lines` after `edit`, and the line to select. An edit of a missing line has no effect.
pub fn edited(lines: &[QueueLine], edit: &QueueEdit) -> (Vec<QueueLine>, usize) {
    let mut next = lines.to_vec();
    let at = match edit {
        QueueEdit::Insert { at } => {
            let place = (at + 1).min(next.len());
            next.insert(place, QueueLine::default());
            place
        }
        QueueEdit::Double { at } => {
            if let Some(line) = lines.get(*at) {
                next.insert(at + 1, line.clone());
            }
            at + 1
        }
        QueueEdit::Delete { at } => {
            if *at < next.len() {
                next.remove(*at);
            }
            *at
        }
        QueueEdit::Move { at, down } => {
            let to = at.saturating_add_signed(if *down { 1 } else { -1 });
            if *at < next.len() && to < next.len() {
                next.swap(*at, to);
                to
            } else {
                *at
            }
        }
        QueueEdit::Break { at } => changed(&mut next, *at, |line| line.breakpoint = !line.breakpoint),
        QueueEdit::Word { at, word, arguments } => changed(&mut next, *at, |line| {
            line.word.clone_from(word);
            line.arguments.clone_from(arguments);
        }),
        QueueEdit::Arguments { at, text } => changed(&mut next, *at, |line| line.arguments = one_line(text)),
        QueueEdit::Note { at, text } => changed(&mut next, *at, |line| line.note = one_line(text)),
        QueueEdit::Text(text) => {
            next = of_text(text);
            0
        }
    };
    next.truncate(MOST_LINES);
    let last = next.len().saturating_sub(1);
    (next, at.min(last))
}

fn changed(lines: &mut [QueueLine], at: usize, change: impl FnOnce(&mut QueueLine)) -> usize {
    if let Some(line) = lines.get_mut(at) {
        change(line);
    }
    at
}

fn one_line(text: &str) -> String {
    text.replace(['\n', '\r'], " ")
}

pub fn of_text(text: &str) -> Vec<QueueLine> {
    text.lines().take(MOST_LINES).map(of_line).collect()
}

fn of_line(text: &str) -> QueueLine {
    let (code, note) = text.split_once(';').unwrap_or((text, ""));
    let code = code.trim();
    let (breakpoint, code) = code.strip_prefix('*').map_or((false, code), |rest| (true, rest.trim()));
    let (word, arguments) = code.split_once(char::is_whitespace).unwrap_or((code, ""));
    QueueLine {
        breakpoint,
        word: word.to_owned(),
        arguments: arguments.trim().to_owned(),
        note: note.trim().to_owned(),
    }
}

/// The lines as text; line `n` of the text is line `n` here.
pub fn to_text(lines: &[QueueLine]) -> String {
    let mut out = String::new();
    for (line, level) in lines.iter().zip(levels(lines)) {
        let mut text = if line.breakpoint { "* ".to_owned() } else { "  ".to_owned() };
        text.push_str(&"  ".repeat(level - 1));
        for part in [&line.word, &line.arguments].into_iter().filter(|part| !part.is_empty()) {
            text.push_str(part);
            text.push(' ');
        }
        if !line.note.is_empty() {
            text.push_str(if line.word.is_empty() { "; " } else { " ; " });
            text.push_str(&line.note);
        }
        out.push_str(text.trim_end());
        out.push('\n');
    }
    out
}

/// Indentation level of each line, from 1: one more inside `REPEAT` and `SUB`, up to `END`.
pub fn levels(lines: &[QueueLine]) -> Vec<usize> {
    let mut level = 1;
    let each = lines.iter().map(|line| {
        let is = |word: &str| line.word.eq_ignore_ascii_case(word);
        if is("END") {
            level = usize::max(level - 1, 1);
        }
        let here = level;
        if is("REPEAT") || is("SUB") {
            level = usize::min(level + 1, 12);
        }
        here
    });
    each.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "* MOVE_TO 10 20  ; first\nREPEAT 3\n  DRILL_DOWN\n  DRILL_UP\nEND\n\n; only a note\n";

    #[test]
    fn queue_text_and_lines_convert_both_ways() {
        let lines = of_text(TEXT);
        assert_eq!(lines.len(), 7);
        assert!(lines[0].breakpoint);
        assert_eq!((lines[0].word.as_str(), lines[0].arguments.as_str()), ("MOVE_TO", "10 20"));
        assert_eq!((lines[6].word.as_str(), lines[6].note.as_str()), ("", "only a note"));
        assert_eq!(of_text(&to_text(&lines)), lines);
        assert_eq!(levels(&lines), [1, 1, 2, 2, 1, 1, 1]);
        assert_eq!(to_text(&lines).lines().count(), lines.len());
    }

    #[test]
    fn queue_edits_change_lines_and_cursor() {
        let words =
            |lines: &[QueueLine]| lines.iter().map(|line| line.word.clone()).collect::<Vec<_>>().join(" ");
        let rows: [(QueueEdit, &str, usize); 10] = [
            (QueueEdit::Insert { at: 0 }, "A  B C", 1),
            (QueueEdit::Insert { at: 9 }, "A B C ", 3),
            (QueueEdit::Double { at: 1 }, "A B B C", 2),
            (QueueEdit::Delete { at: 2 }, "A B", 1),
            (QueueEdit::Delete { at: 7 }, "A B C", 2),
            (QueueEdit::Move { at: 0, down: true }, "B A C", 1),
            (QueueEdit::Move { at: 0, down: false }, "A B C", 0),
            (QueueEdit::Move { at: 2, down: true }, "A B C", 2),
            (QueueEdit::Word { at: 1, word: "X".into(), arguments: String::new() }, "A X C", 1),
            (QueueEdit::Text("Q 1\nR".into()), "Q R", 0),
        ];
        let lines = of_text("A\nB\nC");
        for (edit, expected, at) in rows {
            let (next, now_at) = edited(&lines, &edit);
            assert_eq!((words(&next).as_str(), now_at), (expected, at), "{edit:?}");
        }
        let (next, _) = edited(&lines, &QueueEdit::Arguments { at: 1, text: "3\n4".into() });
        assert_eq!(next[1].arguments, "3 4");
        let (next, _) = edited(&lines, &QueueEdit::Break { at: 2 });
        assert!(next[2].breakpoint && edited(&next, &QueueEdit::Break { at: 2 }).0 == lines);
        assert_eq!(edited(&[], &QueueEdit::Insert { at: 0 }).0.len(), 1);
        assert_eq!(edited(&[], &QueueEdit::Delete { at: 0 }), (Vec::new(), 0));
    }

    #[test]
    fn unmatched_ends_do_not_lower_the_level() {
        assert_eq!(levels(&of_text("END\nEND\nREPEAT 2\nEND\nEND")), [1, 1, 1, 1, 1]);
        assert!(of_text(&"A\n".repeat(9_999)).len() <= MOST_LINES);
    }
}
