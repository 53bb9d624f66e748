//! Saves the drawing in this browser with its whole history, so that a reload loses nothing.
//!
//! ```text
//! an edit ─ half a second later ─▶ store, in this tab's slot ─ reload ─▶ reopened
//!         ─ the page closes ─────▶ synchronous storage
//!                                  slots of other tabs and of earlier drawings ──▶ offered
//! ```

use super::lying;
use crate::model::{DrawEvent, Effect, Event, Model, ToastAct, frame};
use crate::said::{Text, key};
use annulus_core::board::drawing::{self, History};
use std::collections::BTreeSet;

/// Delay from an edit to saving it, in ms; later edits are saved with it.
const REST_MS: u32 = 500;
/// How many drawings are saved at most. One more replaces the one used longest ago.
pub const PLACES: u32 = 8;

#[derive(Clone, Debug, PartialEq)]
pub struct Earlier {
    pub place: u32,
    pub name: String,
    /// When it was saved last, ms since 1970.
    pub at_ms: f64,
    pub elsewhere: bool,
}

/// The drawing's state in the store.
#[derive(Clone, Debug, Default)]
pub(super) struct Kept {
    looked: bool,
    /// Counts the drawings of this visit.
    drawing: u32,
    place: Option<u32>,
    /// The latest change that is saved or being saved.
    change: u32,
    /// The latest change that [`follow`] has seen.
    seen: u32,
    waiting: bool,
    writing: bool,
    pub failed: bool,
    /// Slots that the user discarded and can still undo.
    leaving: BTreeSet<u32>,
    /// Other saved drawings, the latest first.
    pub earlier: Vec<Earlier>,
    /// The drawing came with the open project.
    pub came: bool,
    /// Slot being read because its drawing may continue this one.
    asked: Option<u32>,
    before: Option<Before>,
}

/// A drawing that was closed, and its state then.
#[derive(Clone, Debug)]
struct Before {
    of: u32,
    history: History,
    place: Option<u32>,
    with_board: lying::Lying,
}

pub(super) fn look(model: &mut Model) -> Vec<Effect> {
    if std::mem::replace(&mut model.draw.kept.looked, true) {
        return Vec::new();
    }
    vec![Effect::LookForDrawings { own: true }]
}

pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    let change = model.draw.editor.changes();
    let kept = &mut model.draw.kept;
    let is_new = std::mem::replace(&mut kept.seen, change) != change;
    if !is_new || std::mem::replace(&mut kept.waiting, true) {
        return Vec::new();
    }
    let event = Event::Draw(DrawEvent::Rested);
    vec![Effect::Wake { after_ms: REST_MS, event: Box::new(event) }]
}

/// The save delay is over.
pub(super) fn rested(model: &mut Model) -> Vec<Effect> {
    model.draw.kept.waiting = false;
    keep_soon(model)
}

/// The page is visible again. A failed save is tried again: the user may have freed storage.
pub(in crate::model) fn looked(model: &mut Model) -> Vec<Effect> {
    if model.draw.kept.failed { keep_soon(model) } else { Vec::new() }
}

/// The page is closing or hidden: leaves an unsaved drawing where writing takes no time.
pub(in crate::model) fn left(model: &mut Model) -> Vec<Effect> {
    let (draw, at_ms) = (&model.draw, model.clock.wall_ms);
    let is_unwritten = draw.kept.writing || draw.kept.change != draw.editor.changes();
    let place = draw.kept.place.filter(|_| is_unwritten);
    let text = || drawing::write(draw.editor.history());
    let left = place.map(|place| Effect::LeaveDrawing { place, text: text(), at_ms });
    let mut effects: Vec<Effect> = left.into_iter().collect();
    effects.extend(keep_soon(model));
    effects
}

/// Saves the drawing, after the write that is running.
fn keep_soon(model: &mut Model) -> Vec<Effect> {
    if model.draw.kept.writing { Vec::new() } else { keep(model) }
}

/// True if the drawing is empty, has no history and is not saved.
fn untouched(model: &Model) -> bool {
    let history = model.draw.editor.history();
    history.now().is_empty() && history.depth() == (0, 0) && model.draw.kept.place.is_none()
}

/// Saves the drawing if it changed since the last save.
fn keep(model: &mut Model) -> Vec<Effect> {
    let change = model.draw.editor.changes();
    if model.draw.kept.change == change || untouched(model) {
        return Vec::new();
    }
    let (kept, at_ms) = (&mut model.draw.kept, model.clock.wall_ms);
    (kept.change, kept.writing) = (change, true);
    let history = model.draw.editor.history();
    let (name, text) = (history.now().name().to_owned(), drawing::write(history));
    let (of, place) = (model.draw.kept.drawing, model.draw.kept.place);
    vec![Effect::KeepDrawing { of, place, name, text, at_ms }]
}

/// The store saved a drawing, or failed.
pub(super) fn written(model: &mut Model, of: u32, place: Option<u32>) -> Vec<Effect> {
    let kept = &mut model.draw.kept;
    if of != kept.drawing {
        if let Some(before) = kept.before.as_mut().filter(|before| before.of == of) {
            before.place = place;
        }
        return vec![Effect::LookForDrawings { own: false }];
    }
    kept.writing = false;
    let was_told = std::mem::replace(&mut kept.failed, place.is_none());
    if place.is_none() {
        kept.change = 0;
        let failed = || Text::of(key!("page.draw.not_kept_is"));
        return if was_told { Vec::new() } else { vec![frame::toast(model, failed(), None)] };
    }
    let is_new = std::mem::replace(&mut kept.place, place) != place;
    let mut effects = if is_new { vec![Effect::OwnDrawing { place }] } else { Vec::new() };
    effects.extend(keep(model));
    effects
}

/// The store's contents: opens this tab's drawing, unless another one is open already.
pub(super) fn found(
    model: &mut Model,
    own: Option<(Option<u32>, String)>,
    earlier: Vec<Earlier>,
) -> Vec<Effect> {
    let kept = &mut model.draw.kept;
    let is_offered = |one: &Earlier| Some(one.place) != kept.place && !kept.leaving.contains(&one.place);
    kept.earlier = earlier.into_iter().filter(is_offered).collect();
    kept.earlier.sort_by(|a, b| b.at_ms.total_cmp(&a.at_ms));
    match own {
        Some((place, text)) if untouched(model) => opened(model, place, place.is_none(), Some(text)),
        None => ask_for_later(model),
        _ => Vec::new(),
    }
}

/// The open project's drawing is unchanged. If the page was lost before the project was saved again, the
/// latest saved drawing of that name may continue it: read that one.
fn ask_for_later(model: &mut Model) -> Vec<Effect> {
    let draw = &mut model.draw;
    if !std::mem::take(&mut draw.kept.came) || draw.with_board.used != Some(draw.editor.changes()) {
        return Vec::new();
    }
    let name = draw.editor.drawing().name();
    let later = draw.kept.earlier.iter().find(|one| !one.elsewhere && one.name == name);
    draw.kept.asked = later.map(|one| one.place);
    draw.kept.asked.map(|place| Effect::TakeDrawing { place }).into_iter().collect()
}

/// Opens a saved drawing if its history continues that of the open one.
fn later(model: &mut Model, place: Option<u32>, text: Option<String>) -> Vec<Effect> {
    let Some(Ok(history)) = text.map(|text| drawing::read("drawing.json", &text)) else { return Vec::new() };
    let now = model.draw.editor.history();
    if history.now() == now.now() || !history.goes_on_from(now) {
        return Vec::new();
    }
    let over = lying::lying(&model.draw);
    let mut effects: Vec<Effect> = put_on(model, history, place).into_iter().collect();
    lying::lie_ahead(&mut model.draw, over);
    effects.push(frame::toast(model, Text::of(key!("page.draw.went_on")), None));
    effects
}

/// A drawing was read: opens it and puts the current one aside.
pub(super) fn opened(
    model: &mut Model,
    place: Option<u32>,
    is_copy: bool,
    text: Option<String>,
) -> Vec<Effect> {
    if model.draw.kept.asked.take_if(|asked| is_copy || Some(*asked) == place).is_some() {
        let is_free = !is_copy && !model.draw.is_ahead();
        return if is_free { later(model, place, text) } else { Vec::new() };
    }
    let history = match text.map(|text| drawing::read("drawing.json", &text)) {
        Some(Ok(history)) => history,
        Some(Err(why)) => return vec![frame::toast(model, Text::Found(why), None)],
        None => return vec![frame::toast(model, Text::of(key!("page.draw.gone")), None)],
    };
    let offered = !untouched(model);
    let mut effects = put_aside(model);
    lying::lie_by_itself(&mut model.draw, &history);
    effects.extend(put_on(model, history, place));
    if offered {
        effects.push(offer_back(model));
    }
    if is_copy {
        effects.push(frame::toast(model, Text::of(key!("page.draw.copy")), None));
    }
    effects
}

/// Discards a saved drawing; it is deleted only when the time to undo is over.
pub(super) fn forgotten(model: &mut Model, place: u32) -> Vec<Effect> {
    let kept = &mut model.draw.kept;
    kept.earlier.retain(|one| one.place != place);
    kept.leaving.insert(place);
    let event = Box::new(Event::Draw(DrawEvent::Drop { place }));
    let text = Text::of(key!("page.draw.forgotten"));
    let said = frame::toast(model, text, Some(ToastAct::TakeBackDrawing { place }));
    vec![said, Effect::Wake { after_ms: frame::TOAST_MS, event }]
}

/// The time to undo is over: deletes the drawing unless it was undone or reopened.
pub(super) fn dropped(model: &mut Model, place: u32) -> Vec<Effect> {
    let is_meant = model.draw.kept.leaving.remove(&place) && model.draw.kept.place != Some(place);
    if is_meant { vec![Effect::DropDrawing { place }] } else { Vec::new() }
}

/// Deletes all drawings that no tab has open, without undo.
pub(in crate::model) fn drop_all(model: &mut Model) -> Vec<Effect> {
    let kept = &mut model.draw.kept;
    let (stay, go): (Vec<Earlier>, Vec<Earlier>) =
        std::mem::take(&mut kept.earlier).into_iter().partition(|one| one.elsewhere);
    kept.earlier = stay;
    go.into_iter().map(|one| Effect::DropDrawing { place: one.place }).collect()
}

pub(in crate::model) fn listed(model: &mut Model) -> Vec<Effect> {
    if model.draw.kept.looked { vec![Effect::LookForDrawings { own: false }] } else { look(model) }
}

pub(in crate::model) fn taken_back(model: &mut Model, place: u32) -> Vec<Effect> {
    model.draw.kept.leaving.remove(&place);
    vec![Effect::LookForDrawings { own: false }]
}

/// Puts the drawing aside for another one, and offers to go back if it has content.
pub(super) fn make_room(model: &mut Model) -> Vec<Effect> {
    let offered = !untouched(model);
    let mut effects = put_aside(model);
    if offered {
        effects.push(offer_back(model));
    }
    effects
}

fn offer_back(model: &mut Model) -> Effect {
    frame::toast(model, Text::of(key!("page.draw.put_aside")), Some(ToastAct::DrawnBefore))
}

pub(super) fn back(model: &mut Model) -> Vec<Effect> {
    let Some(Before { history, place, with_board, .. }) = model.draw.kept.before.take() else {
        return Vec::new();
    };
    let mut effects = put_aside(model);
    effects.extend(put_on(model, history, place));
    lying::lie_as_before(&mut model.draw, with_board);
    effects
}

fn put_on(model: &mut Model, history: History, place: Option<u32>) -> Option<Effect> {
    let draw = &mut model.draw;
    draw.open(history);
    place?;
    draw.kept.place = place;
    draw.kept.earlier.retain(|one| Some(one.place) != place);
    (draw.kept.change, draw.kept.seen) = (draw.editor.changes(), draw.editor.changes());
    Some(Effect::OwnDrawing { place })
}

/// Saves the drawing and opens an empty one, which gets its own slot.
pub(super) fn put_aside(model: &mut Model) -> Vec<Effect> {
    let with_board = lying::lying(&model.draw);
    model.draw.with_board.used = None;
    if untouched(model) {
        model.draw.kept.before = None;
        return Vec::new();
    }
    let (of, place) = (model.draw.kept.drawing, model.draw.kept.place);
    let history = model.draw.editor.history().clone();
    model.draw.kept.before = Some(Before { of, history, place, with_board });
    let mut effects = keep(model);
    effects.push(Effect::OwnDrawing { place: None });
    // Nothing had to be written, so no write will update the list of saved drawings.
    if effects.len() == 1 {
        effects.push(Effect::LookForDrawings { own: false });
    }
    let draw = &mut model.draw;
    draw.kept.drawing += 1;
    (draw.kept.place, draw.kept.writing) = (None, false);
    draw.open(History::default());
    effects
}
