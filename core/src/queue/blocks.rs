//! How rows follow each other: repeats, named parts and calls.
//!
//! ```text
//!  0 MOVE_BY 1 0        flow  0 1 2 3 2 3 4 5 ▸7 8▸ 6 …
//!  1 REPEAT 2
//!  2   DRILL_DOWN       a repeat's END goes back to its first row until it was done often enough;
//!  3 END                a SUB is stepped over unless it is called
//!  …
//! ```
//!
//! Comes in: rows. Goes out: a [`Queue`] whose blocks are closed and whose calls never come back to themselves, and a
//! [`QueueCursor`] that walks it. Does not know what the rows mean.

use super::text::{QueueRow, refuse};
use super::words::WorkCommand;
use super::{DEEPEST, MOST_STEPS};
use crate::diagnostic::Diagnostic;

/// Rows whose blocks fit together.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Queue {
    pub(super) rows: Vec<QueueRow>,
    pub(super) links: Vec<Link>,
}

/// Where a row leads besides to the next one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Link {
    /// Nowhere.
    None,
    /// `SUB` or `REPEAT`: its `END`.
    ToEnd(usize),
    /// `END` of a repeat: its `REPEAT`.
    Again(usize),
    /// `END` of a `SUB`: back to the call.
    Back,
    /// `CALL`: the `SUB`.
    Into(usize),
}

impl Queue {
    /// All rows, one a line of the text.
    pub fn rows(&self) -> &[QueueRow] {
        &self.rows
    }

    /// How deep row after row stands inside blocks, from 0; a block's own rows `REPEAT`, `SUB` and `END` stand outside it.
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

/// Where every row leads, or the first row that does not fit and why.
pub(super) fn link(rows: &[QueueRow]) -> Result<Vec<Link>, (usize, Diagnostic)> {
    let mut links = vec![Link::None; rows.len()];
    let mut open: Vec<usize> = Vec::new();
    for (at, row) in rows.iter().enumerate() {
        match &row.command {
            Some(WorkCommand::Sub { name }) => {
                if !open.is_empty() {
                    return Err((at, refuse("queue.sub_inside").with("name", name)));
                }
                if let Some(first) = find_sub(&rows[..at], name) {
                    return Err((at, refuse("queue.sub_twice").with("name", name).with("line", first + 1)));
                }
                open.push(at);
            }
            Some(WorkCommand::Repeat { .. }) => {
                if open.len() >= DEEPEST {
                    return Err((at, refuse("queue.too_deep").with("most", DEEPEST)));
                }
                open.push(at);
            }
            Some(WorkCommand::End) => {
                let begin = open.pop().ok_or_else(|| (at, refuse("queue.end_alone")))?;
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
        return Err((at, refuse("queue.unclosed").with("word", opens(&rows[at]).unwrap_or("REPEAT"))));
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
    refuse("queue.no_such_sub").with("field", "name").with("name", name).with("known", known)
}

/// No part may come back to itself through calls: each is taken away once all parts it calls are gone.
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
            Err((at, refuse("queue.recursion").with("field", "name").with("name", name)))
        }
    }
}

/// A place in a queue, and how it came there.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct QueueCursor {
    at: usize,
    frames: Vec<Frame>,
    passed: u32,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Frame {
    /// Times still to come after this one.
    Repeat(u32),
    /// Where the call stands.
    Call(usize),
}

impl QueueCursor {
    /// Before the first row of `queue` that does anything.
    pub fn new(queue: &Queue) -> Self {
        let mut cursor = Self::default();
        cursor.settle(queue);
        cursor
    }

    /// The row to be done next; none at the end.
    pub fn row(&self, queue: &Queue) -> Option<usize> {
        (self.at < queue.rows.len()).then_some(self.at)
    }

    /// Rows passed so far, each as often as it was done.
    pub fn passed(&self) -> u32 {
        self.passed
    }

    /// The row is done: to the next one. Refused when that were one too many.
    pub fn pass(&mut self, queue: &Queue) -> Result<(), Diagnostic> {
        let Some(row) = queue.rows.get(self.at) else { return Ok(()) };
        if self.passed >= MOST_STEPS {
            return Err(refuse("queue.too_many_steps").with("most", MOST_STEPS));
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

    /// Over empty rows and over parts that nobody called.
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
