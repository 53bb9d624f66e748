//! The board editor: what happens to it, and what is shown of it.
//!
//! ```text
//! pointer, keys, fields ─▶ Editor ─▶ Shown: sheet, marks, tree, fields      each the same handle while it is the same
//!                            │
//!                            ├─ rests ─▶ the store of the browser          (kept)
//!                            └─ Use ───▶ read like files that were dropped (board)
//! ```
//!
//! Comes in: events. Goes out: the next drawing, effects. Does not know screens.

mod board;
pub(super) mod kept;
mod keyed;
mod lying;
mod saving;

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
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Point;
use annulus_core::locale;
use annulus_core::units::Length;
use std::collections::BTreeSet;
use std::sync::Arc;

/// How far beside a thing a pointer still means it, in CSS pixels.
const REACH_PX: f64 = 8.0;

/// Which of the smallest figures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Least {
    /// The smallest gap.
    Gap,
    /// The narrowest track.
    Track,
    /// The narrowest ring.
    Ring,
    /// The smallest hole.
    Hole,
}

/// What is shown of the drawing.
#[derive(Clone, Debug, Default)]
pub struct Shown {
    /// What is drawn.
    pub sheet: Arc<DrawnPieces>,
    /// The closed lines of the edge of the open files, which are drawn over, in mm.
    pub under: Arc<Vec<Vec<[f32; 2]>>>,
    /// What is chosen, as it lies over that.
    pub chosen: Arc<Chosen>,
    /// What follows the pointer.
    pub marks: Arc<Marks>,
    /// The tree.
    pub tree: Arc<Vec<TreeRow>>,
    /// The fields of what is chosen.
    pub fields: Arc<Vec<FieldRow>>,
    /// It speaks of what files draw.
    pub of_files: bool,
    /// Of which drawing, which choice and which open groups that is.
    of: (u32, BTreeSet<Catch>, BTreeSet<Id>),
}

/// The board editor.
#[derive(Clone, Debug, Default)]
pub struct Draw {
    /// The drawing under work.
    pub editor: Editor,
    /// What is shown of it.
    pub shown: Shown,
    /// The place to be looked at, none for all of it; and how often one was.
    pub look: (u32, Option<[f64; 2]>),
    /// How it goes with files and boards.
    with_board: board::WithBoard,
    /// What lies over files is being written to be saved, by this request.
    saving: Option<u32>,
    /// How it goes with the store.
    kept: kept::Kept,
}

/// What happens to it.
#[derive(Clone, Debug, PartialEq)]
pub enum DrawEvent {
    /// A pointer over the picture.
    Point {
        /// What it does.
        touch: Touch,
        /// Where, in mm.
        at_mm: [f64; 2],
        /// Shift is held.
        shift: bool,
        /// Control is held.
        ctrl: bool,
    },
    /// A key.
    Key {
        /// What it asks for.
        key: DrawKey,
    },
    /// What is being done is left; else nothing is chosen any more; else the tool is put down.
    Escape,
    /// Another tool.
    Take {
        /// Which.
        tool: Tool,
    },
    /// The next thing is drawn otherwise.
    Pen {
        /// So.
        pen: Pen,
    },
    /// One size of the pen was typed.
    PenSize {
        /// Of tracks, pads or holes.
        field: Field,
        /// As typed.
        text: String,
    },
    /// Another grid.
    Grid {
        /// Distance of its lines, as typed.
        text: String,
    },
    /// What is under work is to be saved as a file.
    Save,
    /// A place was typed.
    Typed {
        /// As typed.
        text: String,
    },
    /// A property of what is chosen was typed.
    Set {
        /// Which.
        field: Field,
        /// As typed.
        text: String,
    },
    /// A line of the tree is chosen.
    Choose {
        /// The thing.
        id: Id,
        /// Beside what is chosen.
        adding: bool,
    },
    /// An object of a file is chosen.
    ChooseImported {
        /// Its place in the list of those.
        of: u32,
    },
    /// A group of the tree is opened or closed.
    Open {
        /// Which.
        id: Id,
    },
    /// The smallest of something is shown.
    Find {
        /// Of what.
        least: Least,
    },
    /// Something is done with what is chosen.
    Act {
        /// What.
        act: Act,
    },
    /// What is chosen becomes a group.
    Group,
    /// A thing, with all that is chosen where it is among that, goes into a group.
    Regroup {
        /// The thing.
        id: Id,
        /// The group; none for the top.
        group: Option<Id>,
    },
    /// What is chosen goes into the nearest other group of the tree, or out of its own.
    Beside {
        /// Into one.
        into: bool,
    },
    /// Back to the drawing that was under work before this one.
    Back,
    /// The open files are drawn over, or are not.
    Over {
        /// They are.
        on: bool,
    },
    /// A new drawing is begun; the one before stays in the store.
    New,
    /// The board is made of the drawing, and shown on this screen.
    Use {
        /// Which.
        tab: Tab,
    },
    /// The drawing is saved as files.
    Export {
        /// Which.
        what: DrawingExport,
    },
    /// The example of the manual is wanted.
    Example,
    /// The text of a drawing is there.
    Opened {
        /// Where it is kept, where that is so.
        place: Option<u32>,
        /// Another tab has the drawing: this is a copy.
        is_copy: bool,
        /// Its text; none where it could not be had.
        text: Option<String>,
    },
    /// This was in the store.
    Found {
        /// The drawing of this tab: its place, none where another tab has it, and its text.
        own: Option<(Option<u32>, String)>,
        /// The others.
        earlier: Vec<Earlier>,
    },
    /// An edit is half a second old.
    Rested,
    /// The store has written a drawing.
    Kept {
        /// Which, by the count of drawings.
        of: u32,
        /// Where; none where it could not.
        place: Option<u32>,
    },
    /// An earlier drawing is wanted.
    Fetch {
        /// Where it is kept.
        place: u32,
    },
    /// An earlier drawing is to be forgotten.
    Forget {
        /// Where it is kept.
        place: u32,
    },
    /// It is forgotten, unless that was taken back.
    Drop {
        /// Where it is kept.
        place: u32,
    },
}

impl Draw {
    /// That the store could not keep it.
    pub fn unkept(&self) -> bool {
        self.kept.failed
    }

    /// Other drawings that are kept, the latest first.
    pub fn earlier(&self) -> &[Earlier] {
        &self.kept.earlier
    }

    /// What is shown follows the editor.
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

    /// Another drawing is under work.
    fn open(&mut self, history: History) {
        let imported = self.editor.finder().imported().clone();
        self.editor = self.editor.with(history, imported);
        self.look_at_all();
    }

    /// Everything is looked at.
    fn look_at_all(&mut self) {
        self.look = (self.look.0.wrapping_add(1), None);
    }

    /// Where one looks.
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

/// A name for a group: how many there are, and one more.
fn group_name(model: &Model) -> String {
    let groups = model.draw.editor.drawing().things();
    let count = groups.filter(|(_, entry)| entry.thing.word() == "group").count() + 1;
    locale::text(&model.frame.language, key!("page.draw.group_name"), &[("n".to_owned(), count.to_string())])
}

/// Takes one event in.
pub(super) fn update(model: &mut Model, event: DrawEvent) -> Vec<Effect> {
    // What was said of a press stays when it is let go.
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

/// What changes nothing but the editor.
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

/// What is being done is left; else nothing is chosen any more; else the tool is put down.
fn escape(editor: &mut Editor) {
    if editor.leave() {
        return;
    }
    if editor.chosen.is_empty() {
        editor.take(Tool::Select);
    }
    editor.chosen.clear();
}

/// A group of the tree is opened or closed: the other of the two.
fn turn_group(editor: &mut Editor, id: Id) {
    if !editor.open.remove(&id) {
        editor.open.insert(id);
    }
}

/// What a typed place counts from: where the track goes on, else where the tool aims.
fn last(editor: &Editor) -> Point {
    match &editor.doing {
        crate::drawing::Doing::Track { from, .. } => *from,
        _ => editor.aim.at(),
    }
}

/// Why what was typed is no number for a field.
fn no_number(text: &str) -> Text {
    Text::of(if locale::has_two_marks(text) {
        key!("page.draw.two_marks")
    } else {
        key!("page.draw.no_number")
    })
}

/// Why what was typed cannot be that property: it is no number, or none of the sizes that there are.
fn refused(field: Field, text: &str, unit: Unit) -> Text {
    match typed::millimetres(text, unit) {
        Some(mm) if field.is_size() => {
            let why = Diagnostic::error("drawing.size").with("size", mm);
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
