//! Text that knows of each of its lines which command of the program it is for.
//!
//! Comes in: text, and the command that is being written. Goes out: the text, and a command for each line. Does not know words of
//! controllers.

use crate::job::CommandPlace;

/// Such a text.
#[derive(Clone, Debug, Default)]
pub(super) struct Lined {
    text: String,
    commands: Vec<CommandPlace>,
    /// The last command that is done with what is pushed from here on.
    pub(super) now: CommandPlace,
}

impl Lined {
    /// More text; a line is of the command that is written when it ends.
    pub(super) fn push(&mut self, text: &str) {
        self.text.push_str(text);
        let ends = text.bytes().filter(|byte| *byte == b'\n').count();
        self.commands.extend(std::iter::repeat_n(self.now, ends));
    }

    /// Bytes and lines so far.
    pub(super) fn place(&self) -> (usize, usize) {
        (self.text.len(), self.commands.len())
    }

    /// What there is so far.
    pub(super) fn text(&self) -> &str {
        &self.text
    }

    /// `other` at `place`, where a line begins.
    pub(super) fn insert(&mut self, place: (usize, usize), other: &Self) {
        self.text.insert_str(place.0, &other.text);
        self.commands.splice(place.1..place.1, other.commands.iter().copied());
    }

    /// Text, and a command for each of its lines.
    pub(super) fn finish(self) -> (String, Vec<CommandPlace>) {
        (self.text, self.commands)
    }
}
