//! The whole board of a set of files, as a person says that they are to be read.
//!
//! Comes in: files, what was said of them. Goes out: what they say, the board with its copper. Does not know what it is for.

use super::messages::ToRead;
use annulus_core::artwork::Artwork;
use annulus_core::board::{Board, BoardWanted, drawing, from_artwork_telling};
use annulus_core::diagnostic::Diagnostic;

/// What files say. `progress` is told how far it is.
pub(super) fn artwork(wanted: &ToRead, progress: &mut dyn FnMut(u64, u64)) -> Artwork {
    drawing::read_under_telling(&wanted.files, &wanted.said.numbers.overrides(), progress)
}

/// The same without what is of other boards than the one that is meant, its layers as they were said to be.
pub(super) fn as_said(wanted: &ToRead, mut artwork: Artwork) -> Artwork {
    wanted.said.choose_board(&mut artwork);
    wanted.said.say_roles(&mut artwork);
    artwork
}

/// The files that are used of them.
pub(super) fn used(wanted: &ToRead, artwork: &Artwork) -> Vec<usize> {
    wanted.said.used_of(artwork).unwrap_or_else(|| artwork.default_use())
}

/// The files with drawings laid over them, which of them are used, the board, and what was found in making it. `progress` is told
/// how far it is.
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

/// The board alone.
pub(super) fn board_of(wanted: &ToRead) -> Board {
    let untold = &mut |_, _| {};
    let artwork = artwork(wanted, untold);
    board(wanted, as_said(wanted, artwork), untold).2
}
