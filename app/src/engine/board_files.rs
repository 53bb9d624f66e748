//! Builds the board from a set of files and the user's import choices.

use super::messages::ToRead;
use annulus_core::artwork::Artwork;
use annulus_core::board::{Board, BoardWanted, drawing, from_artwork_telling};
use annulus_core::diagnostic::Diagnostic;

/// Reads the files.
pub(super) fn artwork(wanted: &ToRead, progress: &mut dyn FnMut(u64, u64)) -> Artwork {
    drawing::read_under_telling(&wanted.files, &wanted.said.numbers.overrides(), progress)
}

/// Keeps only the selected board's files, and applies the user's roles of layers.
pub(super) fn as_said(wanted: &ToRead, mut artwork: Artwork) -> Artwork {
    wanted.said.choose_board(&mut artwork);
    wanted.said.say_roles(&mut artwork);
    artwork
}

/// Indices of the files that are used.
pub(super) fn used(wanted: &ToRead, artwork: &Artwork) -> Vec<usize> {
    wanted.said.used_of(artwork).unwrap_or_else(|| artwork.default_use())
}

/// The files with drawings applied, the indices of those used, the board, and its problems.
pub(super) fn board(
    wanted: &ToRead,
    mut artwork: Artwork,
    progress: &mut dyn FnMut(u64, u64),
) -> (Artwork, Vec<usize>, Board, Vec<Diagnostic>) {
    let mut used = used(wanted, &artwork);
    let mut diagnostics = drawing::lay_over_all(&wanted.files, &mut artwork, &mut used);
    let asked = BoardWanted { copper: true, aligned: wanted.said.aligned };
    let (board, more) = from_artwork_telling(&artwork, &used, asked, progress);
    diagnostics.extend(more);
    (artwork, used, board, diagnostics)
}

pub(super) fn board_of(wanted: &ToRead) -> Board {
    let untold = &mut |_, _| {};
    let artwork = artwork(wanted, untold);
    board(wanted, as_said(wanted, artwork), untold).2
}
