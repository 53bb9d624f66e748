//! A queue gone through dry, row by row as it will run, through every repeat and call: the first row that may not be is
//! refused before anything moves.
//!
//! Comes in: a queue, a machine, how the drill stands. Goes out: what the queue will do, or the refusal with its row and
//! field. Does not know how anything moves.

use super::blocks::{Queue, QueueCursor};
use super::rules::{Standing, after};
use super::text::refuse;
use super::words::WorkCommand;
use crate::diagnostic::Diagnostic;
use crate::machine::Machine;

/// What a queue that passed will do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CheckedQueue {
    /// Rows done, each as often as it comes.
    pub rows: u32,
    /// Strokes down.
    pub strokes: u32,
    /// Lowest place of X and Y after any row that moves them, machine steps; none when none does.
    pub lowest: Option<[i64; 2]>,
    /// Highest.
    pub highest: Option<[i64; 2]>,
    /// How the drill will stand at the end.
    pub end: Standing,
}

/// Goes through `queue` from its first row. `outputs` are the names that may be switched.
pub fn check(
    queue: &Queue,
    machine: &Machine,
    outputs: &[String],
    standing: &Standing,
) -> Result<CheckedQueue, Diagnostic> {
    let mut cursor = QueueCursor::new(queue);
    let mut done = CheckedQueue { rows: 0, strokes: 0, lowest: None, highest: None, end: standing.clone() };
    if cursor.row(queue).is_none() {
        return Err(refuse("queue.empty"));
    }
    while let Some(row) = cursor.row(queue) {
        let turn = cursor.passed() + 1;
        let placed = |why: Diagnostic| {
            let line = u32::try_from(row + 1).unwrap_or(u32::MAX);
            why.with("row", line).with("turn", turn).at("", line, 1)
        };
        if let Some(command) = &queue.rows()[row].command {
            done.end = after(command, machine, outputs, &done.end).map_err(placed)?;
            match command {
                WorkCommand::MoveBy { .. }
                | WorkCommand::MoveTo { .. }
                | WorkCommand::Home { .. }
                | WorkCommand::Park => {
                    let at = [done.end.position[0], done.end.position[1]];
                    let low = done.lowest.unwrap_or(at);
                    let high = done.highest.unwrap_or(at);
                    done.lowest = Some([low[0].min(at[0]), low[1].min(at[1])]);
                    done.highest = Some([high[0].max(at[0]), high[1].max(at[1])]);
                }
                WorkCommand::DrillDown => done.strokes += 1,
                _ => {}
            }
        }
        cursor.pass(queue).map_err(placed)?;
    }
    done.rows = cursor.passed();
    Ok(done)
}
