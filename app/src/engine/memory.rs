//! Limit on the memory of a worker.

use annulus_core::board::Board;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::Program;
use annulus_core::proof;

/// Refuses a board whose proof needs more memory than a worker may have, because the worker would crash.
pub(super) fn refuse_too_large(board: &Board, programs: &[Program]) -> Result<(), Vec<Diagnostic>> {
    proof::too_large(board, programs).map_or(Ok(()), |why| Err(vec![why]))
}
