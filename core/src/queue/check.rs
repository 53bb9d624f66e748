//! Dry run of a queue, through every repeat and call. The first forbidden row is refused before anything
//! moves.

use super::blocks::{Queue, QueueCursor};
use super::rules::{Standing, after};
use super::words::WorkCommand;
use crate::diagnostic::Diagnostic;
use crate::machine::Machine;

/// Summary of a queue that passed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CheckedQueue {
    /// Rows executed; a repeated row counts each time.
    pub rows: u32,
    pub strokes: u32,
    /// Lowest position of X and Y after any row that moves them, machine steps; none if no row does.
    pub lowest: Option<[i64; 2]>,
    pub highest: Option<[i64; 2]>,
    /// Final state of the drill.
    pub end: Standing,
}

/// Checks `queue` from its first row. `outputs` are the names that may be switched.
pub fn check(
    queue: &Queue,
    machine: &Machine,
    outputs: &[String],
    standing: &Standing,
) -> Result<CheckedQueue, Diagnostic> {
    let mut cursor = QueueCursor::new(queue);
    let mut done = CheckedQueue { rows: 0, strokes: 0, lowest: None, highest: None, end: standing.clone() };
    if cursor.row(queue).is_none() {
        return Err(Diagnostic::error("queue.empty"));
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
