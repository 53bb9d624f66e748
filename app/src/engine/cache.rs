//! What the worker keeps between requests, so that a slider does not send the copper back and forth, nor plans again what
//! did not change.
//!
//! Comes in: the board that was read, parts of plans. Goes out: the same, by number or key. Forgets the board and all that
//! was made of it when another one is read.

use super::messages::LayerRow;
use annulus_core::board::Board;
use annulus_core::cam::toolpaths::{Planned, PlannedOperation};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Bounds;
use std::collections::VecDeque;

/// Parts kept beyond those of the job as it is: what one comes back to with an undo or a slider.
const MORE_PARTS: usize = 16;

/// Proofs whose outcome is kept.
const MOST_PROOFS: usize = 8;

/// The last plan, and what became of it.
#[derive(Debug)]
pub(super) struct Last {
    /// The plan.
    pub(super) planned: Planned,
    /// What its operations are called.
    pub(super) titles: Vec<String>,
    /// The key of its program.
    pub(super) program: String,
}

/// The worker's memory. A new worker has none.
#[derive(Debug, Default)]
pub struct Cache {
    board: Option<(u32, Board)>,
    /// The copper of the board as it is shown in this box.
    copper: Option<(Option<Bounds>, Vec<LayerRow>)>,
    /// Codes of the errors that its files have.
    lost: Vec<String>,
    /// The last plan, with the board as it lies for it.
    last: Option<Last>,
    /// The latest last.
    parts: VecDeque<(String, PlannedOperation)>,
    /// What must be read of programs that were proved, by the key of the program. The latest last.
    proofs: VecDeque<(String, Vec<String>)>,
}

impl Cache {
    /// Keeps `board`, whose files have `lost`, and no other.
    pub(super) fn keep(&mut self, key: u32, board: Board, lost: Vec<String>) {
        *self = Self { board: Some((key, board)), lost, ..Self::default() };
    }

    /// Keeps how the copper of the board is shown in the box `body`.
    pub(super) fn keep_copper(&mut self, body: Option<Bounds>, layers: Vec<LayerRow>) {
        self.copper = Some((body, layers));
    }

    /// How the copper of `board` is shown in the box `body`, where it is that of the board that was read.
    pub(super) fn copper(&self, board: &Board, body: Option<Bounds>) -> Option<Vec<LayerRow>> {
        let (_, read) = self.board.as_ref()?;
        let (known, layers) = self.copper.as_ref()?;
        (*known == body && read.copper == board.copper).then(|| layers.clone())
    }

    /// Codes of the errors that the files of the board have.
    pub(super) fn lost(&self) -> Vec<String> {
        self.lost.clone()
    }

    /// The board with number `key`, or that it is not here.
    pub(super) fn board(&self, key: u32) -> Result<&Board, Vec<Diagnostic>> {
        let here = self.board.as_ref().filter(|(kept, _)| *kept == key);
        here.map(|(_, board)| board).ok_or_else(gone)
    }

    /// Keeps the last plan.
    pub(super) fn keep_last(&mut self, last: Last) {
        self.last = Some(last);
    }

    /// The last plan of the board with number `key`.
    pub(super) fn last(&self, key: u32) -> Result<&Last, Vec<Diagnostic>> {
        self.board(key)?;
        self.last.as_ref().ok_or_else(gone)
    }

    /// What must be read of the program with this key, if it was proved.
    pub(super) fn proof(&self, key: &str) -> Option<Vec<String>> {
        self.proofs.iter().find(|(kept, _)| kept == key).map(|(_, names)| names.clone())
    }

    /// Keeps what must be read of a program.
    pub(super) fn keep_proof(&mut self, key: String, names: Vec<String>) {
        self.proofs.retain(|(kept, _)| *kept != key);
        self.proofs.push_back((key, names));
        while self.proofs.len() > MOST_PROOFS {
            self.proofs.pop_front();
        }
    }

    /// The part that was planned under `key`.
    pub(super) fn part(&self, key: &str) -> Option<PlannedOperation> {
        self.parts.iter().find(|(kept, _)| kept == key).map(|(_, part)| part.clone())
    }

    /// Keeps a part; of those kept before, only the latest stay when there are more than a job of `operations` needs.
    pub(super) fn keep_part(&mut self, key: String, part: PlannedOperation, operations: usize) {
        self.parts.retain(|(kept, _)| *kept != key);
        self.parts.push_back((key, part));
        while self.parts.len() > operations + MORE_PARTS {
            self.parts.pop_front();
        }
    }
}

fn gone() -> Vec<Diagnostic> {
    vec![Diagnostic::error("engine.board_gone")]
}
