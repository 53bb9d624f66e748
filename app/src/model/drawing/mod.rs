//! The board editor: its events, and what is shown of the drawing.
//!
//! ```text
//! pointer, keys, fields ─▶ Editor ─▶ Shown: sheet, marks, tree, fields    unchanged parts keep their handle
//!                            │
//!                            ├─ after a delay ─▶ the browser's store             (kept)
//!                            └─ Use ───────────▶ read like files that were opened (board)
//! ```

mod board;
pub(super) mod kept;
mod keyed;
mod lying;
mod saving;

use annulus_core::error;
pub use board::Using;
pub(super) use board::{answered, follow};
pub use kept::{Earlier, PLACES};
pub use saving::DrawingExport;

use super::{Effect, Model};
use crate::drawing::fields::{self, Field, FieldRow};
use crate::drawing::tree::{self, TreeRow};
use crate::drawing::{Act, Chosen, DrawKey, DrawnPieces, Editor, Marks, Pen, Pointer, Tool, typed};
use crate::format::Unit;
use crate::keys::Tab;
use crate::said::{Text, key};
use crate::view::Touch;
use annulus_core::board::drawing::{Catch, History, Id, NARROWEST, WIDEST};
use annulus_core::geometry::Point;
use annulus_core::locale;
use annulus_core::units::Length;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Distance within which a pointer hits an object, in CSS pixels.
const REACH_PX: f64 = 8.0;

/// Which of the smallest dimensions to show.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Least {
    Gap,
    Track,
    Ring,
    Hole,
}

#[derive(Clone, Debug, Default)]
pub struct Shown {
    pub sheet: Arc<DrawnPieces>,
    /// The outline of the open files that are drawn over, in mm.
    pub under: Arc<Vec<Vec<[f32; 2]>>>,
    pub chosen: Arc<Chosen>,
    /// Marks that follow the pointer.
    pub marks: Arc<Marks>,
    pub tree: Arc<Vec<TreeRow>>,
    pub fields: Arc<Vec<FieldRow>>,
    /// The drawing refers to objects of files.
    pub of_files: bool,
    /// The change, selection and open groups that this was computed for.
    of: (u32, BTreeSet<Catch>, BTreeSet<Id>),
}

#[derive(Clone, Debug, Default)]
pub struct Draw {
    pub editor: Editor,
    pub shown: Shown,
    /// Position to show, `None` to fit everything; the count of requests.
    pub look: (u32, Option<[f64; 2]>),
    with_board: board::WithBoard,
    saving: Option<u32>,
    kept: kept::Kept,
}

#[derive(Clone, Debug, PartialEq)]
pub enum DrawEvent {
    Point {
        touch: Touch,
        at_mm: [f64; 2],
        shift: bool,
        ctrl: bool,
    },
    Key {
        key: DrawKey,
    },
    /// Cancels the current action; else clears the selection; else puts the tool away.
    Escape,
    Take {
        tool: Tool,
    },
    Pen {
        pen: Pen,
    },
    PenSize {
        /// Width of tracks, size of pads or diameter of holes.
        field: Field,
        text: String,
    },
    Grid {
        text: String,
    },
    Save,
    Typed {
        text: String,
    },
    Set {
        field: Field,
        text: String,
    },
    Choose {
        id: Id,
        adding: bool,
    },
    ChooseImported {
        /// Index in the list of imported objects.
        of: u32,
    },
    Open {
        id: Id,
    },
    Find {
        least: Least,
    },
    Act {
        act: Act,
    },
    Group,
    /// Move an object into a group, together with the selection if it is selected.
    Regroup {
        id: Id,
        group: Option<Id>,
    },
    /// Move the selection into the nearest other group of the tree, or out of its own.
    Beside {
        into: bool,
    },
    Back,
    /// Draw over the open files or not.
    Over {
        on: bool,
    },
    /// Start a new drawing; the current one stays in the store.
    New,
    Use {
        tab: Tab,
    },
    Export {
        what: DrawingExport,
    },
    /// Open the manual's example.
    Example,
    Opened {
        place: Option<u32>,
        /// Another tab has the drawing open: this is a copy.
        is_copy: bool,
        /// `None` if it could not be loaded.
        text: Option<String>,
    },
    Found {
        /// This tab's drawing: its slot (`None` if another tab holds it) and its text.
        own: Option<(Option<u32>, String)>,
        earlier: Vec<Earlier>,
    },
    /// The save delay is over.
    Rested,
    Kept {
        of: u32,
        /// The slot; `None` if the write failed.
        place: Option<u32>,
    },
    /// Open a saved drawing.
    Fetch {
        place: u32,
    },
    /// Discard a saved drawing; can be undone for a while.
    Forget {
        place: u32,
    },
    /// The time to undo a discard is over.
    Drop {
        place: u32,
    },
}

impl Draw {
    /// The last attempt to save the drawing failed.
    pub fn unkept(&self) -> bool {
        self.kept.failed
    }

    /// Other saved drawings, the latest first.
    pub fn earlier(&self) -> &Vec<Earlier> {
        &self.kept.earlier
    }

    /// Updates `shown` from the editor; unchanged parts keep their handle.
    fn refresh(&mut self) {
        let (editor, shown) = (&mut self.editor, &mut self.shown);
        shown.sheet = editor.sheet();
        let same = shown.of.0 == editor.changes() && shown.of.1 == editor.chosen && shown.of.2 == editor.open;
        if !same {
            shown.of = (editor.changes(), editor.chosen.clone(), editor.open.clone());
            let chosen = Chosen::new(editor, &shown.sheet);
            if *shown.chosen != chosen {
                shown.chosen = Arc::new(chosen);
            }
            shown.of_files = lying::over_files(editor.drawing());
            shown.tree = Arc::new(tree::rows(editor));
            let fields = fields::rows(editor);
            if *shown.fields != fields {
                shown.fields = Arc::new(fields);
            }
        }
        let marks = Marks::new(editor);
        if *shown.marks != marks {
            shown.marks = Arc::new(marks);
        }
    }

    fn open(&mut self, history: History) {
        let imported = self.editor.finder().imported().clone();
        self.editor = self.editor.with(history, imported);
        self.look_at_all();
    }

    fn look_at_all(&mut self) {
        self.look = (self.look.0.wrapping_add(1), None);
    }

    fn look_at(&mut self, at: Point) {
        self.look = (self.look.0.wrapping_add(1), Some([at.x.mm(), at.y.mm()]));
    }

    fn find(&mut self, least: Least) {
        let smallest = self.editor.smallest;
        let one = |found: Option<(Length, Id)>| found.map(|(_, id)| BTreeSet::from([Catch::Drawn(id)]));
        let found = match least {
            Least::Gap => smallest.gap.map(|(_, a, b)| BTreeSet::from([a, b])),
            Least::Track => one(smallest.track),
            Least::Ring => one(smallest.ring),
            Least::Hole => one(smallest.hole),
        };
        let Some(found) = found else { return };
        self.editor.take(Tool::Select);
        self.editor.chosen = found;
        self.editor.open_to_chosen();
        let middle = self.editor.selection().middle();
        middle.into_iter().for_each(|at| self.look_at(at));
    }
}

fn group_name(model: &Model) -> String {
    let groups = model.draw.editor.drawing().things();
    let count = groups.filter(|(_, entry)| entry.thing.word() == "group").count() + 1;
    locale::text(&model.frame.language, key!("page.draw.group_name"), &[("n".to_owned(), count.to_string())])
}

pub(super) fn update(model: &mut Model, event: DrawEvent) -> Vec<Effect> {
    // A message about a press stays on screen when the pointer is released.
    let hovers = matches!(event, DrawEvent::Point { touch: Touch::Hover | Touch::Move | Touch::Up, .. });
    let of_store = matches!(event, DrawEvent::Rested | DrawEvent::Kept { .. });
    if !hovers && !of_store {
        model.draw.editor.said = None;
    }
    let effects = match event {
        DrawEvent::Point { touch, at_mm: [x, y], shift, ctrl } => {
            let reach = REACH_PX / model.frame.camera.map_or(10.0, |camera| camera.px_per_mm);
            let pointer =
                Pointer { touch, at: Point::from_mm(x, y), reach: Length::from_mm(reach), shift, ctrl };
            model.draw.editor.point(&pointer);
            Vec::new()
        }
        DrawEvent::Over { on } => board::over(model, on),
        DrawEvent::New => kept::make_room(model),
        DrawEvent::Back => kept::back(model),
        DrawEvent::Use { tab } => board::make(model, tab),
        DrawEvent::Export { what } => saving::export(model, what),
        DrawEvent::Example => vec![Effect::DrawExample],
        DrawEvent::Opened { place, is_copy, text } => kept::opened(model, place, is_copy, text),
        DrawEvent::Found { own, earlier } => kept::found(model, own, earlier),
        DrawEvent::Rested => kept::rested(model),
        DrawEvent::Kept { of, place } => kept::written(model, of, place),
        DrawEvent::Fetch { place } => vec![Effect::TakeDrawing { place }],
        DrawEvent::Forget { place } => kept::forgotten(model, place),
        DrawEvent::Drop { place } => kept::dropped(model, place),
        DrawEvent::Save => saving::save(model),
        other => {
            edit(model, other);
            Vec::new()
        }
    };
    model.draw.refresh();
    effects
}

/// Events that change only the editor.
fn edit(model: &mut Model, event: DrawEvent) {
    let (unit, mirrored) = (model.frame.unit, model.frame.flipped);
    let groups = matches!(event, DrawEvent::Group | DrawEvent::Key { key: DrawKey::Group });
    let group = if groups { group_name(model) } else { String::new() };
    let draw = &mut model.draw;
    let editor = &mut draw.editor;
    match event {
        DrawEvent::Key { key } => keyed::by_key(draw, keyed::as_seen(key, mirrored), &group),
        DrawEvent::Escape => escape(editor),
        DrawEvent::Take { tool } => editor.take(tool),
        DrawEvent::Pen { pen } => editor.pen = pen,
        DrawEvent::PenSize { field, text } => pen_size(editor, field, &text, unit),
        DrawEvent::Grid { text } => match typed::length(&text, unit).filter(|step| step.nm() > 0) {
            Some(step) => editor.grid.step = step,
            None => editor.said = Some(no_number(&text)),
        },
        DrawEvent::Typed { text } => match typed::place(&text, last(editor), unit) {
            Some(at) => editor.go(at, text.trim_start().starts_with('@')),
            None => editor.said = Some(Text::of(key!("page.draw.no_place"))),
        },
        DrawEvent::Set { field, text } => match fields::edit(editor, field, &text, unit) {
            Some(edit) => drop(editor.make(&edit)),
            None => editor.said = Some(refused(field, &text, unit)),
        },
        DrawEvent::Choose { id, adding } => {
            let catch = editor.catch_of(id);
            editor.take(Tool::Select);
            editor.choose(catch, adding);
        }
        DrawEvent::ChooseImported { of } => editor.choose_imported(of),
        DrawEvent::Open { id } => turn_group(editor, id),
        DrawEvent::Find { least } => draw.find(least),
        DrawEvent::Act { act } => editor.act(act),
        DrawEvent::Group => editor.group(&group),
        DrawEvent::Regroup { id, group } => editor.regroup(Some(id), group),
        DrawEvent::Beside { into } => match tree::beside(editor, &draw.shown.tree, into) {
            Some(group) => editor.regroup(None, group),
            None => editor.said = Some(Text::of(key!("page.draw.no_place_in_tree"))),
        },
        _ => {}
    }
}

fn escape(editor: &mut Editor) {
    if editor.leave() {
        return;
    }
    if editor.chosen.is_empty() {
        editor.take(Tool::Select);
    }
    editor.chosen.clear();
}

fn turn_group(editor: &mut Editor, id: Id) {
    if !editor.open.remove(&id) {
        editor.open.insert(id);
    }
}

/// Origin of relative coordinates: the end of the open track, else the tool's aim.
fn last(editor: &Editor) -> Point {
    match &editor.doing {
        crate::drawing::Doing::Track { from, .. } => *from,
        _ => editor.aim.at(),
    }
}

fn no_number(text: &str) -> Text {
    Text::of(if locale::has_two_marks(text) {
        key!("page.draw.two_marks")
    } else {
        key!("page.draw.no_number")
    })
}

/// Why the typed text is refused: not a number, or a size out of range.
fn refused(field: Field, text: &str, unit: Unit) -> Text {
    match typed::millimetres(text, unit) {
        Some(mm) if field.is_size() => {
            let why = error!("drawing.size", size = mm, ..);
            Text::Found(why.with("low", NARROWEST.mm()).with("high", WIDEST.mm()))
        }
        _ => no_number(text),
    }
}

fn pen_size(editor: &mut Editor, field: Field, text: &str, unit: Unit) {
    match typed::length(text, unit).filter(|size| fields::may_be(field, *size)) {
        Some(size) => match field {
            Field::Width => editor.pen.width = size,
            Field::Size => editor.pen.size = size,
            _ => editor.pen.diameter = size,
        },
        None => editor.said = Some(refused(field, text, unit)),
    }
}
