//! Builds the board from a set of files and the user's import choices, compares two versions of the files,
//! and exports a drawing over them.

use super::mesh::mesh;
use super::messages::{Compared, CopperMarks, ToCompare, ToRead, ToWriteOver, WrittenOver};
use crate::picture;
use annulus_core::artwork::{Artwork, packed};
use annulus_core::board::changes::changes;
use annulus_core::board::{Board, BoardWanted, drawing, from_artwork_telling};
use annulus_core::cam::carried::carried;
use annulus_core::code;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Region;

pub(super) fn artwork(wanted: &ToRead, progress: &mut dyn FnMut(u64, u64)) -> Artwork {
    drawing::read_under_telling(&wanted.files, &wanted.said.numbers.overrides(), progress)
}

/// Keeps only the selected board's files, and applies the user's roles of layers.
pub(super) fn as_said(wanted: &ToRead, mut artwork: Artwork) -> Artwork {
    wanted.said.choose_board(&mut artwork);
    wanted.said.say_roles(&mut artwork);
    artwork
}

pub(super) fn used(wanted: &ToRead, artwork: &Artwork) -> Vec<usize> {
    wanted.said.used_of(artwork).unwrap_or_else(|| artwork.default_use())
}

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

fn board_of(wanted: &ToRead) -> Board {
    let untold = &mut |_, _| {};
    let artwork = artwork(wanted, untold);
    board(wanted, as_said(wanted, artwork), untold).2
}

/// Compares two versions of a board's files. Uses no cache, because it runs in a separate worker.
pub(super) fn compare(wanted: &ToCompare) -> Compared {
    let (before, now) = (board_of(&wanted.before), board_of(&wanted.now));
    let mut changes = changes(&before, &now);
    let origin = picture::origin(picture::body(&now));
    let mut marks = Vec::new();
    for side in &mut changes.copper {
        // The page needs only the triangles.
        let [added, gone] = [&mut side.added, &mut side.gone].map(|area: &mut Region| {
            let area = std::mem::take(area);
            mesh(&area, origin)
        });
        marks.push(CopperMarks { face: side.face, added, gone });
    }
    let work = carried(&wanted.work, &before, &now, changes.shift);
    let work = (work != wanted.work).then_some(work);
    Compared { changes, marks, work }
}

/// Exports a drawing over files: the changed files and the new ones, or a picture of everything.
pub(super) fn write(wanted: &ToWriteOver) -> Result<WrittenOver, Diagnostic> {
    let read = &wanted.read;
    let under = as_said(read, artwork(read, &mut |_, _| {}));
    let drawn = read.files.iter().find(|(_, bytes)| drawing::is_one(bytes));
    let history = match drawn {
        Some((name, bytes)) => drawing::read(name, &String::from_utf8_lossy(bytes))?,
        None => drawing::History::default(),
    };
    let name = history.now().name();
    let stem = drawing::stem(name);
    if wanted.picture {
        let (.., board, mut lost) = board(read, under, &mut |_, _| {});
        // Other problems of the board do not concern the picture.
        lost.retain(|one| one.code == code!("drawing.file_is_another"));
        let bytes = drawing::board_svg(&board, name).into_bytes();
        return Ok(WrittenOver { name: format!("{stem}.svg"), bytes, is_picture: true, lost });
    }
    let (texts, lost) = drawing::files_over(history.now(), under);
    let files: Vec<_> = texts.into_iter().map(|(name, text)| (name, text.into_bytes())).collect();
    let bytes = packed(&files)?;
    Ok(WrittenOver { name: format!("{stem}.zip"), bytes, is_picture: false, lost })
}
