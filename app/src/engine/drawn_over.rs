//! Exports a drawing over files: the changed files and the new ones, or a picture of everything.

use super::board_files;
use super::messages::{ToWriteOver, WrittenOver};
use annulus_core::artwork;
use annulus_core::board::drawing;
use annulus_core::diagnostic::Diagnostic;

pub(super) fn write(wanted: &ToWriteOver) -> Result<WrittenOver, Diagnostic> {
    let read = &wanted.read;
    let under = board_files::as_said(read, board_files::artwork(read, &mut |_, _| {}));
    let drawn = read.files.iter().find(|(_, bytes)| drawing::is_one(bytes));
    let history = match drawn {
        Some((name, bytes)) => drawing::read(name, &String::from_utf8_lossy(bytes))?,
        None => drawing::History::default(),
    };
    let name = history.now().name();
    let stem = drawing::stem(name);
    if wanted.picture {
        let (.., board, mut lost) = board_files::board(read, under, &mut |_, _| {});
        // Other problems of the board do not concern the picture.
        lost.retain(|one| one.code == "drawing.file_is_another");
        let bytes = drawing::board_svg(&board, name).into_bytes();
        return Ok(WrittenOver { name: format!("{stem}.svg"), bytes, is_picture: true, lost });
    }
    let (texts, lost) = drawing::files_over(history.now(), under);
    let files: Vec<_> = texts.into_iter().map(|(name, text)| (name, text.into_bytes())).collect();
    let bytes = artwork::packed(&files)?;
    Ok(WrittenOver { name: format!("{stem}.zip"), bytes, is_picture: false, lost })
}
