//! Lines of programs as in their files, for check mode.

use super::gcode_words::Words;

#[derive(Clone, Debug, PartialEq)]
pub struct WrittenLine {
    /// First section of its program.
    pub section: usize,
    /// Line number in the file, from 1.
    pub line: u32,
    /// Without spaces and comments.
    pub text: String,
    /// Annulus writes the line differently when it runs the job: a tool change, or a full circle without X
    /// and Y.
    pub is_changed: bool,
}

/// The line with Annulus' changes: `M0` for a tool change, and the end of a full circle, `end_mm` in the
/// program's unit.
pub(super) fn written(bare: &str, words: &Words, end_mm: Option<[f64; 2]>) -> (String, bool) {
    let mut text = String::new();
    for (letter, number) in &words.all {
        match (letter, *number) {
            ('M', 6.0) => text += "M0",
            _ => text += &format!("{letter}{number}"),
        }
    }
    let changes = words.m.contains(&6) || end_mm.is_some();
    if let Some([x, y]) = end_mm {
        text += &format!("X{}Y{}", super::lines::number(x), super::lines::number(y));
    }
    if changes { (text, true) } else { (bare.to_owned(), false) }
}
