//! Maps lines of a written program to the seconds of their execution, and back.
//!
//! ```text
//! commands   0    1    2    3    4    5    6
//! lines      ├─── 12 ──┤ 13 ├──── 14, 15 ──┤        a line ends with its own command
//! ```

use super::playback::Playback;
use crate::job::CommandPlace;

/// The lines of a program in the order of its commands.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ProgramLines {
    commands: Vec<CommandPlace>,
    /// Lines in the order of their commands. Some controllers list positions at the end of the file.
    order: Vec<u32>,
}

impl ProgramLines {
    /// `commands` holds the last command of each line.
    pub fn new(commands: Vec<CommandPlace>) -> Self {
        let mut order: Vec<u32> = (0..).zip(&commands).map(|(line, _)| line).collect();
        order.sort_by_key(|line| commands.get(*line as usize).copied());
        Self { commands, order }
    }

    pub fn len(&self) -> usize {
        self.commands.len()
    }

    pub fn is_empty(&self) -> bool {
        self.commands.is_empty()
    }

    /// The line that executes a command: the first of several; the last line for later commands.
    pub fn line_of(&self, place: CommandPlace) -> Option<usize> {
        let found = self.order.partition_point(|line| self.command(*line as usize) < Some(place));
        self.order.get(found).or(self.order.last()).map(|line| *line as usize)
    }

    /// True if two lines belong to one command.
    pub fn are_together(&self, line: usize, other: usize) -> bool {
        self.command(line) == self.command(other)
    }

    /// Start time of a line, in seconds.
    pub fn start_s(&self, line: usize, playback: &Playback) -> f64 {
        let own = self.command(line);
        let before = self.order.partition_point(|line| self.command(*line as usize) < own).checked_sub(1);
        let before = before.and_then(|before| self.command(*self.order.get(before)? as usize));
        before.map_or(0.0, |CommandPlace { leg, command }| {
            playback.time_of_command(CommandPlace { leg, command: command.saturating_add(1) })
        })
    }

    fn command(&self, line: usize) -> Option<CommandPlace> {
        self.commands.get(line).copied()
    }
}
