//! How a drawing lies to the open board, while another one takes its place and when it comes back.
//!
//! Comes in: the drawing under work, the one that comes. Goes out: whether it lies over the open files. Does not know who changes
//! drawings.

use super::Draw;
use crate::model::Document;
use annulus_core::board::drawing::{self, Drawing, History, Thing};
use std::collections::BTreeSet;

/// How a drawing lies to the open board.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lying {
    /// Over its files.
    over: bool,
    /// It was made of the drawing, and of its last state.
    used: Option<bool>,
}

/// How the drawing under work lies to the open board.
pub(super) fn lying(draw: &Draw) -> Lying {
    let with_board = &draw.with_board;
    Lying { over: with_board.over, used: with_board.used.map(|used| used == draw.editor.changes()) }
}

/// The drawing lies as it did before another one came in its place.
pub(super) fn lie_as_before(draw: &mut Draw, Lying { over, used }: Lying) {
    draw.with_board.over = over;
    let changes = draw.editor.changes();
    draw.with_board.used = used.map(|used| if used { changes } else { changes.wrapping_sub(1) });
}

/// What goes on from the drawing lies as that did; the board is not made of it yet.
pub(super) fn lie_ahead(draw: &mut Draw, lying: Lying) {
    lie_as_before(draw, Lying { used: lying.used.map(|_| false), ..lying });
}

/// Another drawing comes, which lies over the open files only where it speaks of files.
pub(super) fn lie_by_itself(draw: &mut Draw, next: &History) {
    draw.with_board.over = over_files(next.now());
    if !draw.with_board.over {
        draw.forget_files();
    }
}

/// The files of a document that are no drawings.
pub(super) fn plain(document: &Document) -> impl Iterator<Item = &(String, Vec<u8>)> {
    document.files.iter().filter(|(_, bytes)| !drawing::is_one(bytes))
}

/// Whether it speaks of files, and all of these are among those of a document.
pub(super) fn lies_over(drawing: &Drawing, document: &Document) -> bool {
    let files = drawing.things().filter_map(|(_, entry)| match &entry.thing {
        Thing::Imported { file, .. } => Some(file),
        _ => None,
    });
    let is_open = |file: &String| document.reading.files.iter().any(|row| row.name == *file);
    over_files(drawing) && files.collect::<BTreeSet<_>>().into_iter().all(is_open)
}

/// Whether it speaks of things that open files draw.
pub(super) fn over_files(drawing: &Drawing) -> bool {
    drawing.things().any(|(_, entry)| matches!(entry.thing, Thing::Imported { .. }))
}
