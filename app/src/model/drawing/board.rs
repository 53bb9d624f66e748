//! The drawing and the open board: files that are drawn over, the board that is made of a drawing, files made of it.
//!
//! ```text
//! open files ─ worker ─▶ what they draw ─▶ can be caught in the editor
//! drawing ─ as a file beside them ─▶ read like files that were dropped ─▶ CAM, proof, simulation
//! ```
//!
//! Comes in: the open document, as it changes; wishes. Goes out: requests, files to save. Does not know how a drawing is read:
//! the worker writes it as Gerber and Excellon and reads these.

use super::lying::{lies_over, over_files, plain};
use super::{Draw, Editor, kept, saving};
use crate::drawing::Locked;
use crate::engine::Stopped;
use crate::engine::messages::{Answer, Request, ToRead, Traced};
use crate::keys::Tab;
use crate::layers::{LayerKind, LayerLook};
use crate::model::planning::{OnTheWay, Wanted};
use crate::model::{Document, Effect, Lane, Model, files};
use crate::said::{Text, key};
use annulus_core::board::drawing::{self, History, Layer};
use annulus_core::project::saved::SaidOfFiles;
use std::sync::{Arc, Weak};

/// A board that is being made of the drawing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Using {
    /// Of this state of it.
    changes: u32,
    /// Shown on this screen.
    tab: Tab,
}

/// How the drawing goes with files and boards.
#[derive(Clone, Debug, Default)]
pub(super) struct WithBoard {
    /// The open files are drawn over.
    pub over: bool,
    /// The document seen last.
    seen: Option<Arc<Document>>,
    /// What its files draw is asked for, by this request.
    tracing: Option<u32>,
    /// What the files of the document draw is in the editor.
    traced: bool,
    /// A board is being made.
    using: Option<Using>,
    /// The state of the drawing that the open board was made of.
    pub(super) used: Option<u32>,
    /// The board that one made of a drawing took the place of last.
    replaced: Weak<Document>,
    /// The screen seen last.
    tab: Tab,
}

/// The drawing among the files of a document.
fn drawn(document: &Document) -> Option<(&str, &str)> {
    let found = document.files.iter().find(|(_, bytes)| drawing::is_one(bytes))?;
    Some((found.0.as_str(), std::str::from_utf8(&found.1).ok()?))
}

impl Draw {
    /// Whether this request is waited for.
    pub fn waits_for(&self, number: u32) -> bool {
        [self.with_board.tracing, self.saving].contains(&Some(number))
    }

    /// The open document as it was seen last.
    pub(super) fn document(&self) -> Option<Arc<Document>> {
        self.with_board.seen.clone()
    }

    /// Whether the open files are drawn over, and whether there are any.
    pub fn over(&self) -> (bool, bool) {
        let files = self.with_board.seen.as_ref().is_some_and(|seen| plain(seen).next().is_some());
        (self.with_board.over && files, files)
    }

    /// Whether it speaks of what files draw, and none are open.
    pub fn is_of_files_elsewhere(&self) -> bool {
        self.shown.of_files && !self.over().1
    }

    /// Whether a board is being made of it.
    pub(in crate::model) fn is_making(&self) -> bool {
        self.with_board.using.is_some()
    }

    /// Whether the open board is not made of the drawing as it is.
    pub fn is_ahead(&self) -> bool {
        let drawn = !self.editor.drawing().is_empty() || self.with_board.used.is_some();
        drawn && self.with_board.used != Some(self.editor.changes())
    }

    /// Whether the open board was made of it, or it lies over its files.
    pub(super) fn is_of_board(&self) -> bool {
        self.with_board.used.is_some() || self.over().0
    }

    /// It as a file.
    pub(super) fn file(&self) -> (String, Vec<u8>) {
        let name = format!("{}.drawing.json", drawing::stem(self.editor.drawing().name()));
        (name, drawing::write(self.editor.history()).into_bytes())
    }

    /// The files of the open board `document`, with the drawing as it is now where it is that of the board.
    pub(in crate::model) fn files_of(&self, document: &Document) -> Vec<(String, Vec<u8>)> {
        if !self.is_of_board() || !self.is_ahead() {
            return document.files.clone();
        }
        plain(document).cloned().chain([self.file()]).collect()
    }

    /// Nothing of files is in the editor.
    pub(super) fn forget_files(&mut self) {
        self.with_board.traced = false;
        self.with_board.tracing = None;
        self.set_imported(Arc::default());
        self.shown.under = Arc::default();
    }

    fn set_imported(&mut self, imported: Arc<Vec<drawing::Imported>>) {
        if self.editor.finder().imported().is_empty() && imported.is_empty() {
            return;
        }
        let changes = self.editor.changes();
        self.editor = self.editor.with(self.editor.history().clone(), imported);
        // The drawing is the same one.
        if self.with_board.used == Some(changes) {
            self.with_board.used = Some(self.editor.changes());
        }
    }
}

/// Follows the open document and the screen.
pub(in crate::model) fn follow(model: &mut Model) -> Vec<Effect> {
    let mut effects = Vec::new();
    let now = model.board.document.clone();
    if now.as_ref().map(Arc::as_ptr) != model.draw.with_board.seen.as_ref().map(Arc::as_ptr) {
        effects.extend(other_document(model, now));
        model.draw.refresh();
    }
    let locked = locked(&model.frame.layers);
    if model.draw.editor.locked != locked {
        model.draw.editor.locked = locked;
    }
    if !matches!(model.on_the_way, OnTheWay::Reading { .. }) {
        // It could not be read, or was called off.
        model.draw.with_board.using = None;
    }
    let (before, tab) = (std::mem::replace(&mut model.draw.with_board.tab, model.frame.tab), model.frame.tab);
    if before == Tab::Draw && matches!(tab, Tab::Board | Tab::Cam | Tab::Simulate) {
        effects.extend(left(model, tab));
    }
    if tab == Tab::Draw {
        effects.extend(kept::look(model));
        effects.extend(trace(model));
    }
    effects.extend(kept::follow(model));
    effects
}

/// What is locked in the layers panel, as the editor knows it.
fn locked(looks: &[LayerLook]) -> Locked {
    let mut locked = Locked::default();
    for look in looks.iter().filter(|look| look.locked) {
        match look.kind {
            LayerKind::CopperTop => locked.layers.push(Layer::Top),
            LayerKind::CopperBottom => locked.layers.push(Layer::Bottom),
            LayerKind::Outline => locked.layers.push(Layer::Edge),
            LayerKind::Holes => locked.holes = true,
            _ => {}
        }
    }
    locked
}

/// Another document is open, or none.
fn other_document(model: &mut Model, now: Option<Arc<Document>>) -> Vec<Effect> {
    let draw = &mut model.draw;
    let before = std::mem::replace(&mut draw.with_board.seen, now.clone());
    let using = draw.with_board.using.take();
    let Some(now) = now else {
        draw.with_board.used = None;
        draw.forget_files();
        return Vec::new();
    };
    if let Some(Using { changes, tab }) = using {
        draw.with_board.used = Some(changes);
        model.frame.tab = tab;
        return Vec::new();
    }
    if Weak::as_ptr(&draw.with_board.replaced) == Arc::as_ptr(&now) {
        // Back from the board that was made of the drawing, which stays under work.
        draw.forget_files();
        draw.with_board.used = None;
        return Vec::new();
    }
    let found = drawn(&now).and_then(|(name, text)| drawing::read(name, text).ok());
    let is_own = found.as_ref().is_none_or(|found| draw.editor.history().goes_on_from(found));
    let is_first = before.is_none();
    let same = is_own && before.as_ref().is_some_and(|before| plain(before).eq(plain(&now)));
    if same && before.is_some_and(|before| before.said == now.said) {
        return Vec::new();
    }
    draw.forget_files();
    if found.is_none() && is_first && lies_over(draw.editor.drawing(), &now) {
        // Its files are back, after a reload.
        draw.with_board.over = true;
        return Vec::new();
    }
    if same { Vec::new() } else { other_files(model, &now, found, is_own) }
}

/// Other files are open: the drawing among them is under work now, or they are drawn over from the start. What was drawn
/// before stays in the store. The drawing under work `is_own` where it goes on from the one that was `found`.
fn other_files(model: &mut Model, now: &Document, found: Option<History>, is_own: bool) -> Vec<Effect> {
    let draw = &mut model.draw;
    let empty = draw.editor.drawing().is_empty();
    let has_files = plain(now).next().is_some();
    match found {
        // After a reload the drawing of this tab may be ahead of the one that the project was kept with.
        Some(history) if !empty && is_own => {
            draw.with_board.over = has_files;
            let (now, changes) = (draw.editor.drawing(), draw.editor.changes());
            draw.with_board.used = Some(if history.now() == now { changes } else { changes.wrapping_sub(1) });
            Vec::new()
        }
        Some(history) => {
            let effects = kept::make_room(model);
            let draw = &mut model.draw;
            draw.open(history);
            draw.with_board.over = has_files;
            draw.with_board.used = Some(draw.editor.changes());
            draw.kept.came = true;
            effects
        }
        None if empty => {
            draw.with_board.over = true;
            draw.with_board.used = None;
            Vec::new()
        }
        None => {
            let of_before = draw.with_board.used.is_some() || over_files(draw.editor.drawing());
            draw.with_board.over = of_before;
            if of_before { kept::put_aside(model) } else { Vec::new() }
        }
    }
}

/// The person leaves the editor for the board: it is made of the drawing, unless it is another one's, or the drawing speaks of files
/// that are not open: it is no board by itself.
fn left(model: &mut Model, tab: Tab) -> Vec<Effect> {
    let draw = &model.draw;
    let own = draw.is_of_board() || model.board.document.is_none();
    if draw.is_of_files_elsewhere() || !own || !draw.is_ahead() || draw.with_board.using.is_some() {
        return Vec::new();
    }
    make(model, tab)
}

/// What the open files draw is asked for, once it is wanted.
fn trace(model: &mut Model) -> Vec<Effect> {
    let draw = &model.draw;
    let Some(document) = draw.with_board.seen.clone().filter(|_| draw.over().0) else { return Vec::new() };
    if draw.with_board.traced || draw.with_board.tracing.is_some() {
        return Vec::new();
    }
    let number = model.next_request();
    model.draw.with_board.tracing = Some(number);
    let request = Request::Trace(ToRead {
        board_key: number,
        files: plain(&document).cloned().collect(),
        said: document.said.clone(),
        job: None,
        machine: None,
    });
    vec![Effect::Ask { lane: Lane::Beside, number, request: Box::new(request) }]
}

/// What the files draw is known, or what was to be saved is written.
pub(in crate::model) fn answered(
    model: &mut Model,
    number: u32,
    answer: Result<Answer, Stopped>,
) -> Vec<Effect> {
    if model.draw.saving == Some(number) {
        return saving::answered(model, answer);
    }
    let draw = &mut model.draw;
    draw.with_board.tracing = None;
    draw.with_board.traced = true;
    if let Ok(Answer::Traced(Traced { imported, outline_mm })) = answer {
        draw.set_imported(Arc::new(imported));
        draw.shown.under = Arc::new(outline_mm);
        draw.look_at_all();
    }
    draw.refresh();
    Vec::new()
}

/// The open files are drawn over, or are not.
pub(super) fn over(model: &mut Model, on: bool) -> Vec<Effect> {
    model.draw.with_board.over = on;
    if !on {
        model.draw.forget_files();
    }
    Vec::new()
}

/// The board is made of the drawing, and of the files under it.
pub(super) fn make(model: &mut Model, tab: Tab) -> Vec<Effect> {
    let draw = &mut model.draw;
    let editor: &Editor = &draw.editor;
    if editor.drawing().is_empty() && !draw.with_board.over {
        draw.editor.said = Some(Text::of(key!("page.draw.nothing")));
        return Vec::new();
    }
    let file = draw.file();
    draw.with_board.using = Some(Using { changes: editor.changes(), tab });
    let under = draw.with_board.seen.clone().filter(|_| draw.over().0);
    let again = under.is_some() || draw.with_board.used.is_some();
    if !again {
        draw.with_board.replaced = draw.with_board.seen.as_ref().map(Arc::downgrade).unwrap_or_default();
    }
    let mut files: Vec<(String, Vec<u8>)> = under.iter().flat_map(|under| plain(under)).cloned().collect();
    files.push(file);
    let open = draw.with_board.seen.clone().filter(|_| again);
    let (said, job) =
        open.map_or_else(|| (SaidOfFiles::default(), None), |open| (open.said.clone(), open.job.clone()));
    files::read(model, Wanted { files, said, job, again, place: None, anew: None })
}
