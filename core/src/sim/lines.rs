//! Lines of a written program and the seconds at which they are done, both ways.
//!
//! ```text
//! commands   0    1    2    3    4    5    6
//! lines      ├─── 12 ──┤ 13 ├──── 14, 15 ──┤        a line is done with the commands after the line before, up to its own
//! ```
//!
//! Comes in: for each line the last command that is done with it, a [`Playback`]. Goes out: lines for commands, seconds for lines.
//! Does not know what lines say.

use super::playback::Playback;
use crate::job::CommandPlace;

/// The lines of a program in the order of its commands.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ProgramLines {
    commands: Vec<CommandPlace>,
    /// Lines in the order of their commands: a controller may want places at the end of the file that are gone to before.
    order: Vec<u32>,
}

impl ProgramLines {
    /// Of lines that are done with these commands.
    pub fn new(commands: Vec<CommandPlace>) -> Self {
        let mut order: Vec<u32> = (0..).zip(&commands).map(|(line, _)| line).collect();
        order.sort_by_key(|line| commands.get(*line as usize).copied());
        Self { commands, order }
    }

    /// How many lines there are.
    pub fn len(&self) -> usize {
        self.commands.len()
    }

    /// There are none.
    pub fn is_empty(&self) -> bool {
        self.commands.is_empty()
    }

    /// The line with which a command is done: of several the first; the last one after all of them.
    pub fn line_of(&self, place: CommandPlace) -> Option<usize> {
        let found = self.order.partition_point(|line| self.command(*line as usize) < Some(place));
        self.order.get(found).or(self.order.last()).map(|line| *line as usize)
    }

    /// Whether two lines are done together.
    pub fn are_together(&self, line: usize, other: usize) -> bool {
        self.command(line) == self.command(other)
    }

    /// The second at which a line begins to be done.
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
