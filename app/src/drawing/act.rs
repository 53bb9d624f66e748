//! Commands on the selection: rotate, mirror, align, repeat, group, copy, delete.
//!
//! Objects from files take the same commands as drawn things. "Put back" restores them as their file draws
//! them.

use super::{Editor, GRIDS};
use crate::said::{Text, key};
use annulus_core::board::drawing::{
    Align, Catch, Drawing, Edit, Id, Layer, Thing, pasted, put, put_back, regrouped, removed, ungrouped,
};
use annulus_core::geometry::Point;
use annulus_core::units::Length;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Offset of a duplicate from its original.
const BESIDE: Point = Point::new(Length::from_um(2_540), Length::from_um(-2_540));

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Act {
    Turn {
        /// Thousandths of a degree, counter-clockwise.
        mdeg: i32,
    },
    /// Swaps left and right (`x`), else top and bottom.
    Mirror {
        x: bool,
    },
    Align(Align),
    Array {
        columns: u32,
        rows: u32,
        step: Point,
    },
    Ungroup,
    Copy,
    Cut,
    Paste,
    Duplicate,
    Delete,
    All,
    Layer(Layer),
    /// Restores objects of files as their file draws them.
    PutBack,
    Snap,
    NextGrid,
    /// Toggles dimming of everything that is not on the active layer.
    Dim,
    Undo {
        /// Undo, else redo.
        back: bool,
    },
}

/// The kind of a thing and its positions, sorted.
type Marked = (&'static str, Vec<Point>);

/// None for nodes and groups.
fn marked(drawing: &Drawing, thing: &Thing) -> Option<Marked> {
    let mut spots: Vec<Point> =
        thing.nodes().filter_map(|node| drawing.at(node)).chain(thing.place()).collect();
    spots.sort_unstable();
    (!spots.is_empty()).then(|| (thing.word(), spots))
}

impl Editor {
    pub fn act(&mut self, act: Act) {
        let ids = self.ids();
        match act {
            Act::Turn { mdeg } => {
                self.make(&self.selection().turned(mdeg, false));
            }
            // Mirroring in Y is mirroring in X followed by half a turn.
            Act::Mirror { x } => {
                self.make(&self.selection().turned(if x { 0 } else { 180_000 }, true));
            }
            Act::Align(align) => {
                self.make(&self.selection().aligned(align));
            }
            Act::Array { columns, rows, step } => {
                self.make(&self.selection().array(columns, rows, step));
            }
            Act::Ungroup => self.ungroup(&ids),
            Act::Copy => self.copy(),
            Act::Cut => {
                self.copy();
                self.make(&self.selection().removed());
            }
            Act::Paste => self.paste(),
            Act::Duplicate => {
                let copy = self.selection().copied();
                self.put_copy(&copy, BESIDE);
            }
            Act::Delete => {
                self.make(&self.selection().removed());
            }
            Act::All => {
                self.take(super::Tool::Select);
                self.choose_all();
            }
            Act::Layer(layer) => self.put_on_layer(&ids, layer),
            Act::PutBack => self.put_back(),
            Act::Snap => self.grid.on = !self.grid.on,
            Act::NextGrid => {
                let next = GRIDS.into_iter().find(|grid| *grid > self.grid.step).unwrap_or(GRIDS[0]);
                self.grid = super::Grid { on: true, step: next };
            }
            Act::Dim => self.dim = !self.dim,
            Act::Undo { back } => {
                self.leave();
                self.step(back);
            }
        }
    }

    /// Restores the selected objects of files; without a selection restores all and shows a message about it.
    fn put_back(&mut self) {
        let all = self.chosen.is_empty();
        let edit = put_back(self.drawing(), self.finder(), &self.chosen);
        if !edit.is_empty() && self.make(&edit) && all {
            self.said = Some(Text::of(key!("page.draw.all_put_back")));
        }
    }

    pub fn group(&mut self, name: &str) {
        if let (edit, Some(group)) = self.selection().grouped(name)
            && self.make(&edit)
        {
            self.chosen = BTreeSet::from([Catch::Drawn(group)]);
        }
    }

    /// Moves the selection into `group`, or to the top level. Moves only `id` if `id` isn't selected.
    pub fn regroup(&mut self, id: Option<Id>, group: Option<Id>) {
        let alone = id.filter(|id| !self.chosen.contains(&self.catch_of(*id)));
        let edit = match alone {
            Some(id) => regrouped(self.drawing(), &BTreeSet::from([id]), group),
            None => self.selection().regrouped(group),
        };
        if !edit.is_empty() && self.make(&edit) {
            self.open.extend(group);
        }
    }

    fn ungroup(&mut self, ids: &BTreeSet<Id>) {
        let drawing = self.drawing();
        let is_group = |id: &&Id| matches!(drawing.thing(**id), Some(Thing::Group { .. }));
        let members = ids.iter().filter(is_group).flat_map(|id| drawing.hanging(*id));
        let members: BTreeSet<Catch> = members.map(|id| self.catch_of(id)).collect();
        let edit = ungrouped(drawing, ids);
        if !edit.is_empty() && self.make(&edit) {
            self.chosen.extend(members);
            let drawing = self.history.now();
            self.chosen.retain(|catch| !matches!(catch, Catch::Drawn(id) if drawing.get(*id).is_none()));
        }
    }

    fn copy(&mut self) {
        let copy = self.selection().copied();
        if !copy.is_empty() {
            self.clip = Some(Arc::new(copy));
        }
    }

    /// Pastes the clipboard so that its lowest, leftmost point is where the tool aims.
    fn paste(&mut self) {
        let Some(clip) = self.clip.clone() else { return };
        let clip = self.without_strangers(&clip);
        let places = clip.spots_of(&clip.top().collect());
        let Some(corner) = places.into_iter().min_by_key(|at| (at.x + at.y, at.x)) else { return };
        let to = self.aim.at();
        let by = Point::new(to.x - corner.x, to.y - corner.y);
        let mut by = if by == Point::default() { BESIDE } else { by };
        while self.lies_there(&clip, by) {
            by = Point::new(by.x + BESIDE.x, by.y + BESIDE.y);
        }
        self.put_copy(&clip, by);
    }

    /// True if the drawing already has identical things at the target: the pasted ones would be invisible.
    fn lies_there(&self, clip: &Drawing, by: Point) -> bool {
        let there: BTreeSet<Marked> =
            self.drawing().things().filter_map(|(_, entry)| marked(self.drawing(), &entry.thing)).collect();
        let moved = |at: Point| Point::new(at.x + by.x, at.y + by.y);
        let coming = clip.things().filter_map(|(_, entry)| marked(clip, &entry.thing));
        let mut coming =
            coming.map(|(word, spots)| (word, spots.into_iter().map(moved).collect())).peekable();
        coming.peek().is_some() && coming.all(|one: Marked| there.contains(&one))
    }

    /// The copy without objects of files that aren't drawn over here; shows a message if it drops any.
    fn without_strangers(&mut self, clip: &Drawing) -> Drawing {
        let is_strange = |thing: &Thing| {
            matches!(thing, Thing::Imported { .. }) && self.finder.imported_of(thing).is_none()
        };
        let strange = clip.things().filter(|(_, entry)| is_strange(&entry.thing)).map(|(id, _)| id).collect();
        let (edit, mut own) = (removed(clip, &strange), clip.clone());
        if !edit.is_empty() {
            self.said = Some(Text::of(key!("page.draw.not_here")));
            // Removal fails only for things with dependents, and nothing depends on these.
            let _ = own.apply(&edit);
        }
        own
    }

    fn put_copy(&mut self, copy: &Drawing, by: Point) {
        let (edit, top) = pasted(self.drawing(), copy, by);
        if !top.is_empty() && self.make(&edit) {
            self.take(super::Tool::Select);
            self.chosen = top.into_iter().map(Catch::Drawn).collect();
        }
    }

    fn put_on_layer(&mut self, ids: &BTreeSet<Id>, to: Layer) {
        let drawing = self.drawing();
        let mut edit = Edit::default();
        for id in drawing.leaves(ids) {
            let mut thing = drawing.thing(id).cloned();
            if let Some(Thing::Track { layer, .. } | Thing::Pad { layer, .. }) = &mut thing {
                *layer = to;
            }
            edit = edit.then(thing.map(|thing| put(drawing, id, thing)).unwrap_or_default());
        }
        self.make(&edit);
    }
}
