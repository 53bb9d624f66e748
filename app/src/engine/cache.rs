//! What the worker keeps between requests, so that a slider does not send the copper back and forth, nor plans again what
//! did not change.
//!
//! Comes in: the board that was read, parts of plans. Goes out: the same, by number or key. Forgets the board and all that
//! was made of it when another one is read.

use super::messages::LayerRow;
use annulus_core::board::Board;
use annulus_core::cam::toolpaths::{Kept, Planned, PlannedOperation};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Bounds;
use annulus_core::proof::Verdict;
use std::collections::VecDeque;
use std::rc::Rc;

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
    /// How its board lies.
    pub(super) laid_key: String,
}

/// How often something was made because it was not known.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Made {
    /// Operations that were planned.
    pub parts: u32,
    /// Islands of copper, each with what it touches, that were grown or gone round.
    pub families: u32,
    /// Programs that were proved.
    pub proofs: u32,
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
    /// What was found in programs that were proved, by all that it depends on. The latest last.
    proofs: VecDeque<(String, Rc<Verdict>)>,
    /// What isolation made before, on this board or one before it.
    kept: Kept,
    made: Made,
}

impl Cache {
    /// Keeps `board`, whose files have `lost`, and no other. What isolation made of the one before may serve it too.
    pub(super) fn keep(&mut self, key: u32, board: Board, lost: Vec<String>) {
        let (kept, made) = (std::mem::take(&mut self.kept), self.made);
        *self = Self { board: Some((key, board)), lost, kept, made, ..Self::default() };
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

    /// How often something was made since there is this cache.
    pub fn made(&self) -> Made {
        Made { families: self.kept.made(), ..self.made }
    }

    /// What isolation made before, to be brought back by [`Cache::keep_kept`].
    pub(super) fn take_kept(&mut self) -> Kept {
        std::mem::take(&mut self.kept)
    }

    /// Keeps what isolation made.
    pub(super) fn keep_kept(&mut self, kept: Kept) {
        self.kept = kept;
    }

    /// What was found under `key`, if that was looked for.
    pub(super) fn verdict(&mut self, key: &str) -> Option<Rc<Verdict>> {
        let known = self.proofs.iter().position(|(kept, _)| kept == key)?;
        let known = self.proofs.remove(known)?;
        self.proofs.push_back(known);
        self.proofs.back().map(|(_, verdict)| Rc::clone(verdict))
    }

    /// Keeps what was found anew.
    pub(super) fn keep_verdict(&mut self, key: String, verdict: Verdict) -> Rc<Verdict> {
        self.made.proofs += 1;
        let verdict = Rc::new(verdict);
        self.proofs.push_back((key, Rc::clone(&verdict)));
        while self.proofs.len() > MOST_PROOFS {
            self.proofs.pop_front();
        }
        verdict
    }

    /// The part that was planned under `key`.
    pub(super) fn part(&self, key: &str) -> Option<PlannedOperation> {
        self.parts.iter().find(|(kept, _)| kept == key).map(|(_, part)| part.clone())
    }

    /// A part is made, since none is known.
    pub(super) fn makes_part(&mut self) {
        self.made.parts += 1;
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
