//! What the worker keeps between requests, so that a slider does not send the copper back and forth.
//!
//! Comes in: the board that was read. Goes out: the same, by its number. Forgets it when another one is read.

use annulus_core::board::Board;
use annulus_core::remark::{Remark, Weight};

/// The worker's memory. A new worker has none.
#[derive(Debug, Default)]
pub struct Shelf {
    board: Option<(u32, Board)>,
}

impl Shelf {
    /// Keeps `board`, and no other.
    pub(super) fn keep(&mut self, key: u32, board: Board) {
        self.board = Some((key, board));
    }

    /// The board with number `key`, or that it is not here.
    pub(super) fn board(&self, key: u32) -> Result<&Board, Vec<Remark>> {
        let here = self.board.as_ref().filter(|(kept, _)| *kept == key);
        here.map(|(_, board)| board).ok_or_else(|| vec![Remark::new(Weight::Loss, "engine.board_gone")])
    }
}
