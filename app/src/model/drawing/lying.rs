//! How a drawing relates to the open board: drawn over its files, or the source of it. Saved while another is
//! open.

use super::Draw;
use crate::model::Document;
use annulus_core::board::drawing::{self, Drawing, History, Thing};
use std::collections::BTreeSet;

#[derive(Clone, Copy, Debug)]
pub(super) struct Lying {
    over: bool,
    /// The board was made of this drawing; true if of its latest state.
    used: Option<bool>,
}

pub(super) fn lying(draw: &Draw) -> Lying {
    let with_board = &draw.with_board;
    Lying { over: with_board.over, used: with_board.used.map(|used| used == draw.editor.changes()) }
}

pub(super) fn lie_as_before(draw: &mut Draw, Lying { over, used }: Lying) {
    draw.with_board.over = over;
    let changes = draw.editor.changes();
    draw.with_board.used = used.map(|used| if used { changes } else { changes.wrapping_sub(1) });
}

/// A continuation of the drawing takes over its relation; the board is not made of it yet.
pub(super) fn lie_ahead(draw: &mut Draw, lying: Lying) {
    lie_as_before(draw, Lying { used: lying.used.map(|_| false), ..lying });
}

/// Another drawing opens; the open files are drawn over only if it refers to files.
pub(super) fn lie_by_itself(draw: &mut Draw, next: &History) {
    draw.with_board.over = over_files(next.now());
    if !draw.with_board.over {
        draw.forget_files();
    }
}

/// The files of a document that are not drawings.
pub(super) fn plain(document: &Document) -> impl Iterator<Item = &(String, Vec<u8>)> {
    document.files.iter().filter(|(_, bytes)| !drawing::is_one(bytes))
}

/// True if the drawing refers to files, and all of these are in `document`.
pub(super) fn lies_over(drawing: &Drawing, document: &Document) -> bool {
    let files = drawing.things().filter_map(|(_, entry)| match &entry.thing {
        Thing::Imported { file, .. } => Some(file),
        _ => None,
    });
    let is_open = |file: &String| document.reading.files.iter().any(|row| row.read.name == *file);
    over_files(drawing) && files.collect::<BTreeSet<_>>().into_iter().all(is_open)
}

pub(super) fn over_files(drawing: &Drawing) -> bool {
    drawing.things().any(|(_, entry)| matches!(entry.thing, Thing::Imported { .. }))
}
