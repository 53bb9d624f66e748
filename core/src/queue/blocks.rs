//! Order of rows: repeats, named parts and calls.
//!
//! ```text
//!  0 MOVE_BY 1 0        order  0 1 2 3 2 3 4 5 ▸7 8▸ 6 …
//!  1 REPEAT 2
//!  2   DRILL_DOWN       END of a repeat returns to its first row until the last repetition;
//!  3 END                a SUB is skipped unless it is called
//!  …
//! ```

use super::words::WorkCommand;
use super::{DEEPEST, MOST_STEPS};
use crate::diagnostic::Diagnostic;
use crate::error;

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct QueueRow {
    /// A run to the next breakpoint stops before this row.
    pub breakpoint: bool,
    /// None if the line is empty or only a note.
    pub command: Option<WorkCommand>,
    /// Text after `;`.
    pub note: Option<String>,
}

/// Rows with matching blocks.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Queue {
    pub(super) rows: Vec<QueueRow>,
    pub(super) links: Vec<Link>,
}

/// Target of a row, in addition to the next row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Link {
    /// Only the next row.
    None,
    /// `SUB` or `REPEAT`: its `END`.
    ToEnd(usize),
    /// `END` of a repeat: its `REPEAT`.
    Again(usize),
    /// `END` of a `SUB`: back to the call.
    Back,
    Into(usize),
}

impl Queue {
    pub fn rows(&self) -> &[QueueRow] {
        &self.rows
    }

    /// Block depth of each row, from 0. `REPEAT`, `SUB` and `END` count as outside their own block.
    pub fn depths(&self) -> Vec<usize> {
        let mut depth = 0_usize;
        let of = |row: &QueueRow| {
            depth -= usize::from(row.command == Some(WorkCommand::End)).min(depth);
            let here = depth;
            depth += usize::from(opens(row).is_some());
            here
        };
        self.rows.iter().map(of).collect()
    }
}

fn opens(row: &QueueRow) -> Option<&'static str> {
    match row.command {
        Some(WorkCommand::Repeat { .. }) => Some("REPEAT"),
        Some(WorkCommand::Sub { .. }) => Some("SUB"),
        _ => None,
    }
}

/// Links of all rows, or the first row that doesn't fit and why.
pub(super) fn link(rows: &[QueueRow]) -> Result<Vec<Link>, (usize, Diagnostic)> {
    let mut links = vec![Link::None; rows.len()];
    let mut open: Vec<usize> = Vec::new();
    for (at, row) in rows.iter().enumerate() {
        match &row.command {
            Some(WorkCommand::Sub { name }) => {
                if !open.is_empty() {
                    return Err((at, error!("queue.sub_inside", name = name)));
                }
                if let Some(first) = find_sub(&rows[..at], name) {
                    return Err((at, error!("queue.sub_twice", name = name, line = first + 1)));
                }
                open.push(at);
            }
            Some(WorkCommand::Repeat { .. }) => {
                if open.len() >= DEEPEST {
                    return Err((at, error!("queue.too_deep", most = DEEPEST)));
                }
                open.push(at);
            }
            Some(WorkCommand::End) => {
                let begin = open.pop().ok_or_else(|| (at, error!("queue.end_alone")))?;
                links[begin] = Link::ToEnd(at);
                links[at] = if opens(&rows[begin]) == Some("SUB") { Link::Back } else { Link::Again(begin) };
            }
            Some(WorkCommand::Call { name }) => {
                links[at] = Link::Into(find_sub(rows, name).ok_or_else(|| (at, no_such_sub(rows, name)))?);
            }
            _ => {}
        }
    }
    if let Some(at) = open.pop() {
        return Err((at, error!("queue.unclosed", word = opens(&rows[at]).unwrap_or("REPEAT"))));
    }
    without_recursion(rows, &links)?;
    Ok(links)
}

fn find_sub(rows: &[QueueRow], name: &str) -> Option<usize> {
    rows.iter()
        .position(|row| matches!(&row.command, Some(WorkCommand::Sub { name: found }) if found == name))
}

fn no_such_sub(rows: &[QueueRow], name: &str) -> Diagnostic {
    let names = rows.iter().filter_map(|row| match &row.command {
        Some(WorkCommand::Sub { name }) => Some(name.as_str()),
        _ => None,
    });
    let known: Vec<_> = names.collect();
    let known = if known.is_empty() { "–".to_owned() } else { known.join(", ") };
    error!("queue.no_such_sub", name = name, known = known).with("field", "name")
}

/// Refuses parts that call themselves, directly or indirectly: repeatedly removes parts with no calls to
/// remaining parts.
fn without_recursion(rows: &[QueueRow], links: &[Link]) -> Result<(), (usize, Diagnostic)> {
    let calls_of = |sub: usize| {
        let end = if let Link::ToEnd(end) = links[sub] { end } else { sub };
        (sub..end).filter_map(|at| if let Link::Into(other) = links[at] { Some((at, other)) } else { None })
    };
    let is_sub = |at: &usize| opens(&rows[*at]) == Some("SUB");
    let mut left: Vec<usize> = (0..rows.len()).filter(is_sub).collect();
    loop {
        let before = left.len();
        let still = left.clone();
        left.retain(|sub| calls_of(*sub).any(|(_, other)| still.contains(&other)));
        if left.len() == before {
            break;
        }
    }
    let found = left.iter().flat_map(|sub| calls_of(*sub)).find(|(_, other)| left.contains(other));
    match found {
        None => Ok(()),
        Some((at, _)) => {
            let name =
                if let Some(WorkCommand::Call { name }) = &rows[at].command { name.as_str() } else { "" };
            Err((at, error!("queue.recursion", name = name).with("field", "name")))
        }
    }
}

/// A position in a queue, with its repeats and calls.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct QueueCursor {
    at: usize,
    frames: Vec<Frame>,
    passed: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Frame {
    /// Repetitions left after this one.
    Repeat(u32),
    /// Row of the call.
    Call(usize),
}

impl QueueCursor {
    /// At the first row of `queue` with a command.
    pub fn new(queue: &Queue) -> Self {
        let mut cursor = Self::default();
        cursor.settle(queue);
        cursor
    }

    /// Next row to execute; none at the end.
    pub fn row(&self, queue: &Queue) -> Option<usize> {
        (self.at < queue.rows.len()).then_some(self.at)
    }

    /// Rows executed; a repeated row counts each time.
    pub fn passed(&self) -> u32 {
        self.passed
    }

    /// Advances to the next row. Fails if the limit of executed rows is reached.
    pub fn pass(&mut self, queue: &Queue) -> Result<(), Diagnostic> {
        let Some(row) = queue.rows.get(self.at) else { return Ok(()) };
        if self.passed >= MOST_STEPS {
            return Err(error!("queue.too_many_steps", most = MOST_STEPS));
        }
        self.passed += 1;
        match (queue.links[self.at], &row.command) {
            (Link::Into(sub), _) => {
                self.frames.push(Frame::Call(self.at));
                self.at = sub + 1;
            }
            (Link::ToEnd(_), Some(WorkCommand::Repeat { times })) => {
                self.frames.push(Frame::Repeat(times.saturating_sub(1)));
                self.at += 1;
            }
            (Link::Again(begin), _) => match self.frames.last_mut() {
                Some(Frame::Repeat(left)) if *left > 0 => {
                    *left -= 1;
                    self.at = begin + 1;
                }
                _ => {
                    self.frames.pop();
                    self.at += 1;
                }
            },
            (Link::Back, _) => match self.frames.pop() {
                Some(Frame::Call(from)) => self.at = from + 1,
                _ => self.at += 1,
            },
            _ => self.at += 1,
        }
        self.settle(queue);
        Ok(())
    }

    /// Skips empty rows and uncalled parts.
    fn settle(&mut self, queue: &Queue) {
        while let Some(row) = queue.rows.get(self.at) {
            match (&row.command, queue.links[self.at]) {
                (Some(WorkCommand::Sub { .. }), Link::ToEnd(end)) => self.at = end + 1,
                (None, _) => self.at += 1,
                _ => return,
            }
        }
    }
}
