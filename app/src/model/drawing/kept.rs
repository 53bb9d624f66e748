//! The drawing kept in this browser with all its edits, so that a reload loses nothing (S2).
//!
//! ```text
//! an edit ─ rests half a second ─▶ the store, at the place of this tab ─ reload ─▶ opened by itself
//!                                  places of other tabs and of earlier drawings ──▶ on offer
//! ```
//!
//! Comes in: the drawing, as it changes; what the store says. Goes out: what to write and to take. Does not know the store.

use super::lying;
use crate::model::{DrawEvent, Effect, Event, Model, ToastAct, frame};
use crate::said::{Text, key};
use annulus_core::board::drawing::{self, History};

/// Edits rest so long before they are kept, in ms.
const REST_MS: u32 = 500;
/// How many drawings are kept at most; a further one takes the place of the one that was touched longest ago.
pub const PLACES: u32 = 8;

/// A drawing that is kept.
#[derive(Clone, Debug, PartialEq)]
pub struct Earlier {
    /// Where.
    pub place: u32,
    /// Its name.
    pub name: String,
    /// When it was kept last, in ms since 1970.
    pub at_ms: f64,
    /// Another tab has it.
    pub elsewhere: bool,
}

/// How the drawing goes with the store.
#[derive(Clone, Debug, Default)]
pub(super) struct Kept {
    /// What was looked for.
    looked: bool,
    /// Counts the drawings that were under work.
    drawing: u32,
    /// Where this one is kept.
    place: Option<u32>,
    /// The change of it that is in the store, or on its way there.
    change: u32,
    /// The change that was seen last.
    seen: u32,
    /// The store writes it.
    writing: bool,
    /// That nothing can be kept was said.
    told: bool,
    /// Other drawings, the latest first.
    pub earlier: Vec<Earlier>,
    /// The one that was under work before.
    before: Option<Before>,
}

/// A drawing that was put aside, and how it was under work.
#[derive(Clone, Debug)]
struct Before {
    /// Which, by the count of drawings.
    of: u32,
    history: History,
    place: Option<u32>,
    with_board: lying::Lying,
}

/// Looks once for what was kept.
pub(super) fn look(model: &mut Model) -> Vec<Effect> {
    if std::mem::replace(&mut model.draw.kept.looked, true) {
        return Vec::new();
    }
    vec![Effect::LookForDrawings { own: true }]
}

/// Waits for a rest where the drawing is another one.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    let change = model.draw.editor.changes();
    if std::mem::replace(&mut model.draw.kept.seen, change) == change {
        return Vec::new();
    }
    let event = Event::Draw(DrawEvent::Rested { change });
    vec![Effect::Wake { after_ms: REST_MS, event: Box::new(event) }]
}

/// The drawing did not change for a while.
pub(super) fn rested(model: &mut Model, change: u32) -> Vec<Effect> {
    if change != model.draw.editor.changes() || model.draw.kept.writing { Vec::new() } else { keep(model) }
}

/// Whether nothing was ever drawn in it.
fn untouched(model: &Model) -> bool {
    let history = model.draw.editor.history();
    history.now().is_empty() && history.depth() == (0, 0) && model.draw.kept.place.is_none()
}

/// Keeps the drawing as it is, where it is not kept so.
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

/// The store has written a drawing, or could not.
pub(super) fn written(model: &mut Model, of: u32, place: Option<u32>) -> Vec<Effect> {
    let kept = &mut model.draw.kept;
    if of != kept.drawing {
        if let Some(before) = kept.before.as_mut().filter(|before| before.of == of) {
            before.place = place;
        }
        return vec![Effect::LookForDrawings { own: false }];
    }
    kept.writing = false;
    if place.is_none() {
        let told = std::mem::replace(&mut kept.told, true);
        let failed = || Text::of(key!("page.kept.failed"));
        return if told { Vec::new() } else { vec![frame::toast(model, failed(), None)] };
    }
    let is_new = std::mem::replace(&mut kept.place, place) != place;
    let mut effects = if is_new { vec![Effect::OwnDrawing { place }] } else { Vec::new() };
    effects.extend(keep(model));
    effects
}

/// What was in the store: the drawing of this tab is opened, unless one is under work already.
pub(super) fn found(
    model: &mut Model,
    own: Option<(Option<u32>, String)>,
    earlier: Vec<Earlier>,
) -> Vec<Effect> {
    let place = model.draw.kept.place;
    let kept = &mut model.draw.kept;
    kept.earlier = earlier.into_iter().filter(|one| Some(one.place) != place).collect();
    kept.earlier.sort_by(|a, b| b.at_ms.total_cmp(&a.at_ms));
    match own {
        Some((place, text)) if untouched(model) => opened(model, place, place.is_none(), Some(text)),
        _ => Vec::new(),
    }
}

/// The text of a drawing is there: it is under work now, and the one before is put aside.
pub(super) fn opened(
    model: &mut Model,
    place: Option<u32>,
    is_copy: bool,
    text: Option<String>,
) -> Vec<Effect> {
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

/// A new drawing is begun.
pub(super) fn begun_anew(model: &mut Model) -> Vec<Effect> {
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

/// Back to the drawing that was under work before this one.
pub(super) fn back(model: &mut Model) -> Vec<Effect> {
    let Some(Before { history, place, with_board, .. }) = model.draw.kept.before.take() else {
        return Vec::new();
    };
    let mut effects = put_aside(model);
    effects.extend(put_on(model, history, place));
    lying::lie_as_before(&mut model.draw, with_board);
    effects
}

/// A drawing is under work, from its place in the store where it has one.
fn put_on(model: &mut Model, history: History, place: Option<u32>) -> Option<Effect> {
    let draw = &mut model.draw;
    draw.open(history);
    place?;
    draw.kept.place = place;
    draw.kept.earlier.retain(|one| Some(one.place) != place);
    (draw.kept.change, draw.kept.seen) = (draw.editor.changes(), draw.editor.changes());
    Some(Effect::OwnDrawing { place })
}

/// The drawing is kept as it is; what comes in its place is empty and gets a place of its own.
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
    if effects.len() == 1 {
        effects.push(Effect::LookForDrawings { own: false });
    }
    let draw = &mut model.draw;
    draw.kept.drawing += 1;
    (draw.kept.place, draw.kept.writing) = (None, false);
    draw.open(History::default());
    effects
}
