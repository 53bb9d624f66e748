//! The board editor as signals.
//!
//! Goes out: signals to be read. Does not know how they are shown.

use super::signals as all;
use super::slots::Slots;
use crate::drawing::fields::FieldRow;
use crate::drawing::tree::TreeRow;
use crate::drawing::{Chosen, Doing, DrawnPieces, Grid, Marks, Pen, Tool};
use crate::model::drawing::Earlier;
use crate::said::Text;
use annulus_core::board::drawing::{Catch, Imported, Smallest};
use annulus_core::geometry::Point;
use leptos::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;

/// The board editor.
#[derive(Clone, Copy)]
pub struct Drawing {
    /// What is drawn.
    pub sheet: ReadSignal<Arc<DrawnPieces>>,
    /// The closed lines of the edge of the open files under it, in mm.
    pub under: ReadSignal<Arc<Vec<Vec<[f32; 2]>>>>,
    /// What is chosen, as it lies over that.
    pub lit: ReadSignal<Arc<Chosen>>,
    /// What follows the pointer.
    pub marks: ReadSignal<Arc<Marks>>,
    /// The tree.
    pub tree: ReadSignal<Arc<Vec<TreeRow>>>,
    /// The fields of what is chosen.
    pub fields: ReadSignal<Arc<Vec<FieldRow>>>,
    /// What is chosen.
    pub chosen: ReadSignal<BTreeSet<Catch>>,
    /// What the open files draw.
    pub imported: ReadSignal<Arc<Vec<Imported>>>,
    /// The first of what is chosen: the tree shows its line.
    pub shown: ReadSignal<Option<Catch>>,
    /// The tool in hand.
    pub tool: ReadSignal<Tool>,
    /// With what is drawn.
    pub pen: ReadSignal<Pen>,
    /// Where the pointer snaps to.
    pub grid: ReadSignal<Grid>,
    /// What lies on other layers than the one that is drawn on is faint.
    pub dim: ReadSignal<bool>,
    /// Where the tool aims.
    pub aim: ReadSignal<Point>,
    /// What is being done.
    pub doing: ReadSignal<Doing>,
    /// The smallest gap, track, ring and hole.
    pub smallest: ReadSignal<Smallest>,
    /// Whether there is a step back, and one on.
    pub can_undo: ReadSignal<(bool, bool)>,
    /// Something was copied.
    pub copied: ReadSignal<bool>,
    /// Name of the drawing, and how many things are in it.
    pub title: ReadSignal<(String, usize)>,
    /// The open files are drawn over, and whether there are any.
    pub over: ReadSignal<(bool, bool)>,
    /// It speaks of what files draw, and none are open.
    pub elsewhere: ReadSignal<bool>,
    /// The open board is not made of the drawing as it is.
    pub ahead: ReadSignal<bool>,
    /// Drawings that are kept.
    pub earlier: ReadSignal<Vec<Earlier>>,
    /// This one could not be.
    pub unkept: ReadSignal<bool>,
    /// The place to be looked at, none for all of it; and how often one was.
    pub look: ReadSignal<(u32, Option<[f64; 2]>)>,
    /// Said to the person.
    pub said: ReadSignal<Option<Text>>,
}

/// The board editor.
pub fn open_drawing() -> Drawing {
    all().drawing
}

pub(super) fn signals(slots: &mut Slots) -> Drawing {
    Drawing {
        sheet: slots.kept(|model| &model.draw.shown.sheet),
        under: slots.kept(|model| &model.draw.shown.under),
        lit: slots.kept(|model| &model.draw.shown.chosen),
        marks: slots.kept(|model| &model.draw.shown.marks),
        tree: slots.kept(|model| &model.draw.shown.tree),
        fields: slots.kept(|model| &model.draw.shown.fields),
        chosen: slots.part(|model| &model.draw.editor.chosen),
        imported: slots.kept(|model| model.draw.editor.finder().imported()),
        shown: slots.made(|model| model.draw.editor.chosen.first().copied()),
        tool: slots.part(|model| &model.draw.editor.tool),
        pen: slots.part(|model| &model.draw.editor.pen),
        grid: slots.part(|model| &model.draw.editor.grid),
        dim: slots.part(|model| &model.draw.editor.dim),
        aim: slots.made(|model| model.draw.editor.aim.at()),
        doing: slots.part(|model| &model.draw.editor.doing),
        smallest: slots.part(|model| &model.draw.editor.smallest),
        can_undo: slots.made(|model| model.draw.editor.can_undo()),
        copied: slots.made(|model| model.draw.editor.clip.is_some()),
        title: slots.made(|model| {
            let drawing = model.draw.editor.drawing();
            (drawing.name().to_owned(), drawing.len())
        }),
        over: slots.made(|model| model.draw.over()),
        elsewhere: slots.made(|model| model.draw.is_of_files_elsewhere()),
        ahead: slots.made(|model| model.draw.is_ahead()),
        earlier: slots.made(|model| model.draw.earlier().to_vec()),
        unkept: slots.made(|model| model.draw.unkept()),
        look: slots.part(|model| &model.draw.look),
        said: slots.part(|model| &model.draw.editor.said),
    }
}
