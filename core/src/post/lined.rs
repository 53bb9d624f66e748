//! Text that records for each line which command of the program it belongs to.

use crate::job::CommandPlace;

#[derive(Clone, Debug, Default)]
pub(super) struct Lined {
    text: String,
    commands: Vec<CommandPlace>,
    /// The last completed command for text pushed from now on.
    pub(super) now: CommandPlace,
}

impl Lined {
    /// Appends text; a line belongs to the command at its end.
    pub(super) fn push(&mut self, text: &str) {
        self.text.push_str(text);
        let ends = text.bytes().filter(|byte| *byte == b'\n').count();
        self.commands.extend(std::iter::repeat_n(self.now, ends));
    }

    pub(super) fn place(&self) -> (usize, usize) {
        (self.text.len(), self.commands.len())
    }

    pub(super) fn text(&self) -> &str {
        &self.text
    }

    pub(super) fn insert(&mut self, place: (usize, usize), other: &Self) {
        self.text.insert_str(place.0, &other.text);
        self.commands.splice(place.1..place.1, other.commands.iter().copied());
    }

    pub(super) fn finish(mut self) -> (String, Vec<CommandPlace>) {
        self.text.shrink_to_fit();
        self.commands.shrink_to_fit();
        (self.text, self.commands)
    }
}
