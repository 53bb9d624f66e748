//! The drawing and the open board: files that are drawn over, and the board made from a drawing.
//!
//! ```text
//! open files ─ worker ─▶ their objects ─▶ selectable in the editor
//! drawing ─ added to the files ─▶ read like opened files ─▶ CAM, proof, simulation
//! ```

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

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Using {
    changes: u32,
    tab: Tab,
}

#[derive(Clone, Debug, Default)]
pub(super) struct WithBoard {
    /// The open files are drawn over.
    pub over: bool,
    seen: Option<Arc<Document>>,
    tracing: Option<u32>,
    /// The editor has the objects of the document's files.
    traced: bool,
    using: Option<Using>,
    /// Change of the drawing that the open board was made from.
    pub(super) used: Option<u32>,
    /// The board that was replaced by one made from a drawing.
    replaced: Weak<Document>,
    tab: Tab,
}

fn drawn(document: &Document) -> Option<(&str, &str)> {
    let found = document.files.iter().find(|(_, bytes)| drawing::is_one(bytes))?;
    Some((found.0.as_str(), std::str::from_utf8(&found.1).ok()?))
}

impl Draw {
    pub fn waits_for(&self, number: u32) -> bool {
        [self.with_board.tracing, self.saving].contains(&Some(number))
    }

    pub(super) fn document(&self) -> Option<Arc<Document>> {
        self.with_board.seen.clone()
    }

    pub fn over(&self) -> (bool, bool) {
        let files = self.with_board.seen.as_ref().is_some_and(|seen| plain(seen).next().is_some());
        (self.with_board.over && files, files)
    }

    /// True if the drawing refers to files and none are open.
    pub fn is_of_files_elsewhere(&self) -> bool {
        self.shown.of_files && !self.over().1
    }

    pub(in crate::model) fn is_making(&self) -> bool {
        self.with_board.using.is_some()
    }

    /// True if the open board was not made from the drawing's latest state.
    pub fn is_ahead(&self) -> bool {
        let drawn = !self.editor.drawing().is_empty() || self.with_board.used.is_some();
        drawn && self.with_board.used != Some(self.editor.changes())
    }

    /// True if the open board was made from the drawing, or its files are drawn over.
    pub(super) fn is_of_board(&self) -> bool {
        self.with_board.used.is_some() || self.over().0
    }

    pub(super) fn file(&self) -> (String, Vec<u8>) {
        let name = format!("{}.drawing.json", drawing::stem(self.editor.drawing().name()));
        (name, drawing::write(self.editor.history()).into_bytes())
    }

    /// The files of the open board, with the drawing's latest state if it belongs to that board.
    pub(in crate::model) fn files_of(&self, document: &Document) -> Vec<(String, Vec<u8>)> {
        if !self.is_of_board() || !self.is_ahead() {
            return document.files.clone();
        }
        plain(document).cloned().chain([self.file()]).collect()
    }

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
        // The editor counts this as a change, but the drawing itself is unchanged.
        if self.with_board.used == Some(changes) {
            self.with_board.used = Some(self.editor.changes());
        }
    }
}

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
        // Reading failed or was cancelled.
        model.draw.with_board.using = None;
    }
    let (before, tab) = (std::mem::replace(&mut model.draw.with_board.tab, model.frame.tab), model.frame.tab);
    if before == Tab::Draw && tab.shows_board() {
        effects.extend(left(model, tab));
    }
    if tab == Tab::Draw {
        effects.extend(kept::look(model));
        effects.extend(trace(model));
    }
    effects.extend(kept::follow(model));
    effects
}

/// The layers that are locked in the layers panel, as the editor's layers.
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
        // The user went back from the board made from this drawing; the drawing stays open.
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
        // After a reload, the files that the drawing refers to are open again.
        draw.with_board.over = true;
        return Vec::new();
    }
    if same { Vec::new() } else { other_files(model, &now, found, is_own) }
}

/// Other files are open: opens the drawing among them, or starts one over them. The drawing before stays in
/// the store. `is_own`: the open drawing continues the one that was `found`.
fn other_files(model: &mut Model, now: &Document, found: Option<History>, is_own: bool) -> Vec<Effect> {
    let draw = &mut model.draw;
    let empty = draw.editor.drawing().is_empty();
    let has_files = plain(now).next().is_some();
    match found {
        // After a reload this tab's drawing may be ahead of the one saved with the project.
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

/// The user leaves the editor for a board screen: makes the board from the drawing. Not if the open board
/// isn't made from it, or if it refers to files that are not open, because then it is incomplete.
fn left(model: &mut Model, tab: Tab) -> Vec<Effect> {
    let draw = &model.draw;
    let own = draw.is_of_board() || model.board.document.is_none();
    if draw.is_of_files_elsewhere() || !own || !draw.is_ahead() || draw.with_board.using.is_some() {
        return Vec::new();
    }
    make(model, tab)
}

/// Requests the objects of the open files, once.
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

/// The objects of the files are known, or an export is written.
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

pub(super) fn over(model: &mut Model, on: bool) -> Vec<Effect> {
    model.draw.with_board.over = on;
    if !on {
        model.draw.forget_files();
    }
    Vec::new()
}

/// Makes the board from the drawing and from the files under it.
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
