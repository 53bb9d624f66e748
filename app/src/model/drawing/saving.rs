//! Exports the drawing: as a drawing, as manufacturing files or as a picture.
//!
//! ```text
//! drawing alone ─────────────────────────────▶ files, picture
//! over files ─ worker: files read, changed ─▶ new and changed files; a picture of everything
//! ```

use super::lying::{over_files, plain};
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Request, ToRead, ToWriteOver, WrittenOver};
use crate::model::{Effect, Lane, Model, export, frame};
use crate::said::{Text, key};
use annulus_core::artwork;
use annulus_core::board::drawing;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DrawingExport {
    /// Gerber and Excellon, in one zip.
    Board,
    Svg,
    /// The drawing with its whole history.
    Drawing,
}

/// Saves the open project with the drawing as it is now, or the drawing alone if it belongs to no open board.
pub(super) fn save(model: &mut Model) -> Vec<Effect> {
    if model.board.document.is_some() && model.draw.is_of_board() {
        return export::save_project(model);
    }
    self::export(model, DrawingExport::Drawing)
}

pub(super) fn export(model: &mut Model, what: DrawingExport) -> Vec<Effect> {
    let drawing = model.draw.editor.drawing();
    let stem = drawing::stem(drawing.name());
    let saved = |name: String, kind: &'static str, bytes: Vec<u8>| vec![Effect::Save { name, kind, bytes }];
    let over = model.draw.over().0;
    match what {
        DrawingExport::Drawing => {
            let (name, bytes) = model.draw.file();
            saved(name, "application/json", bytes)
        }
        DrawingExport::Svg if over => ask(model, true),
        DrawingExport::Svg => {
            saved(format!("{stem}.svg"), "image/svg+xml", drawing::svg(drawing).into_bytes())
        }
        DrawingExport::Board if over && over_files(drawing) => ask(model, false),
        DrawingExport::Board => {
            let files = drawing::files(drawing).into_iter();
            let files: Vec<(String, Vec<u8>)> = files.map(|(name, text)| (name, text.into_bytes())).collect();
            if files.is_empty() {
                model.draw.editor.said = Some(Text::of(key!("page.draw.nothing")));
                return Vec::new();
            }
            match artwork::packed(&files) {
                Ok(bytes) => saved(format!("{stem}.zip"), "application/zip", bytes),
                Err(why) => vec![frame::toast(model, Text::Found(why), None)],
            }
        }
    }
}

/// Asks the worker to export a drawing made over the open files.
fn ask(model: &mut Model, picture: bool) -> Vec<Effect> {
    let Some(document) = model.draw.document() else { return Vec::new() };
    let number = model.next_request();
    model.draw.saving = Some(number);
    let files = plain(&document).cloned().chain([model.draw.file()]).collect();
    let said = document.said.clone();
    let read = ToRead { board_key: number, files, said, job: None, machine: None };
    let request = Request::WriteOver(ToWriteOver { read, picture });
    vec![Effect::Ask { lane: Lane::Beside, number, request: Box::new(request) }]
}

pub(super) fn answered(model: &mut Model, answer: Result<Answer, Stopped>) -> Vec<Effect> {
    model.draw.saving = None;
    match answer {
        Ok(Answer::WrittenOver(written)) => {
            let WrittenOver { name, bytes, is_picture, lost } = *written;
            let kind = if is_picture { "image/svg+xml" } else { "application/zip" };
            let told = lost.into_iter().next().map(|why| frame::toast(model, Text::Found(why), None));
            told.into_iter().chain([Effect::Save { name, kind, bytes }]).collect()
        }
        Err(Stopped::Refused(why)) => {
            let first = why.into_iter().next();
            first.map(|why| frame::toast(model, Text::Found(why), None)).into_iter().collect()
        }
        _ => Vec::new(),
    }
}
