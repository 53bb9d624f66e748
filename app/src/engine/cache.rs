//! The worker's memory between requests, so that moving a slider neither transfers the copper again nor
//! plans unchanged operations again.
//!
//! Reading another board clears it, except for the results of isolation.

use super::messages::LayerRow;
use annulus_core::board::Board;
use annulus_core::cam::toolpaths::{Kept, Planned, PlannedOperation};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::geometry::Bounds;
use annulus_core::proof::Verdict;
use std::collections::VecDeque;
use std::rc::Rc;

/// Planned operations remembered beyond those of the current job, for undo and sliders.
const MORE_PARTS: usize = 16;

const MOST_PROOFS: usize = 8;

#[derive(Debug)]
pub(super) struct Last {
    pub(super) planned: Planned,
    pub(super) titles: Vec<String>,
    pub(super) program: String,
    pub(super) laid_key: String,
}

/// Counts of work that was not in the cache.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Made {
    pub parts: u32,
    /// Groups of neighbouring copper islands that were offset or followed by toolpaths.
    pub families: u32,
    pub proofs: u32,
}

/// A worker's memory; empty in a new worker.
#[derive(Debug, Default)]
pub struct Cache {
    board: Option<(u32, Board)>,
    copper: Option<(Option<Bounds>, Vec<LayerRow>)>,
    /// Codes of the errors of the board's files.
    lost: Vec<String>,
    last: Option<Last>,
    parts: VecDeque<(String, PlannedOperation)>,
    /// Proofs by a digest of their inputs, the latest last.
    proofs: VecDeque<(String, Rc<Verdict>)>,
    kept: Kept,
    made: Made,
}

impl Cache {
    /// Replaces the board. Results of isolation stay, because the new board may share copper with the old
    /// one.
    pub(super) fn keep(&mut self, key: u32, board: Board, lost: Vec<String>) {
        let (kept, made) = (std::mem::take(&mut self.kept), self.made);
        *self = Self { board: Some((key, board)), lost, kept, made, ..Self::default() };
    }

    pub(super) fn keep_copper(&mut self, body: Option<Bounds>, layers: Vec<LayerRow>) {
        self.copper = Some((body, layers));
    }

    pub(super) fn copper(&self, board: &Board, body: Option<Bounds>) -> Option<Vec<LayerRow>> {
        let (_, read) = self.board.as_ref()?;
        let (known, layers) = self.copper.as_ref()?;
        (*known == body && read.copper == board.copper).then(|| layers.clone())
    }

    /// Codes of the errors of the board's files.
    pub(super) fn lost(&self) -> Vec<String> {
        self.lost.clone()
    }

    /// The board `key`; an error if this worker does not have it.
    pub(super) fn board(&self, key: u32) -> Result<&Board, Vec<Diagnostic>> {
        let here = self.board.as_ref().filter(|(kept, _)| *kept == key);
        here.map(|(_, board)| board).ok_or_else(gone)
    }

    pub(super) fn keep_last(&mut self, last: Last) {
        self.last = Some(last);
    }

    pub(super) fn last(&self, key: u32) -> Result<&Last, Vec<Diagnostic>> {
        self.board(key)?;
        self.last.as_ref().ok_or_else(gone)
    }

    pub fn made(&self) -> Made {
        Made { families: self.kept.made(), ..self.made }
    }

    /// Takes the results of isolation; return them with [`Cache::keep_kept`].
    pub(super) fn take_kept(&mut self) -> Kept {
        std::mem::take(&mut self.kept)
    }

    pub(super) fn keep_kept(&mut self, kept: Kept) {
        self.kept = kept;
    }

    /// The proof under `key`, which becomes the latest.
    pub(super) fn verdict(&mut self, key: &str) -> Option<Rc<Verdict>> {
        let known = self.proofs.iter().position(|(kept, _)| kept == key)?;
        let known = self.proofs.remove(known)?;
        self.proofs.push_back(known);
        self.proofs.back().map(|(_, verdict)| Rc::clone(verdict))
    }

    /// Stores a new proof and drops the oldest.
    pub(super) fn keep_verdict(&mut self, key: String, verdict: Verdict) -> Rc<Verdict> {
        self.made.proofs += 1;
        let verdict = Rc::new(verdict);
        self.proofs.push_back((key, Rc::clone(&verdict)));
        while self.proofs.len() > MOST_PROOFS {
            self.proofs.pop_front();
        }
        verdict
    }

    pub(super) fn part(&self, key: &str) -> Option<PlannedOperation> {
        self.parts.iter().find(|(kept, _)| kept == key).map(|(_, part)| part.clone())
    }

    /// Counts an operation that must be planned.
    pub(super) fn makes_part(&mut self) {
        self.made.parts += 1;
    }

    /// Stores a planned operation and drops the oldest beyond those of a job with `operations`.
    pub(super) fn keep_part(&mut self, key: String, part: PlannedOperation, operations: usize) {
        self.parts.retain(|(kept, _)| *kept != key);
        self.parts.push_back((key, part));
        while self.parts.len() > operations + MORE_PARTS {
            self.parts.pop_front();
        }
    }
}

fn gone() -> Vec<Diagnostic> {
    vec![error!("engine.board_gone")]
}
