//! The board editor as plain data: a drawing with its history, the selection and the active tool.
//!
//! ```text
//! pointer ─┐                       ┌─▶ DrawnPieces    triangles in chunks: an edit rebuilds few of them
//! keys   ──┼─▶ Editor ─ Edit ─▶ History ─▶ Marks      selection, aim, what is being drawn
//! fields ──┘        ▲              └─▶ tree rows, fields of the selection, smallest figures
//!                   └─ Finder: what is at or near a position
//! ```
//!
//! Lengths are whole nanometres.

mod act;
mod catching;
pub mod fields;
pub mod keys;
pub mod kinds;
pub mod marks;
pub mod pieces;
pub mod scene;
mod tools;
pub mod tree;
pub mod typed;
mod when;

pub use act::Act;
pub use catching::Locked;
pub use keys::DrawKey;
pub use marks::{Chosen, Marks};
pub use pieces::DrawnPieces;
pub use tools::{Doing, Pointer, Tool};
pub use when::{AtHand, When};

use crate::said::{Text, key};
use annulus_core::board::drawing::{
    Catch, Drawing, DrawingFigures, Edit, Finder, History, Id, Imported, Layer, PadShape, Selection,
    Smallest, Snap, Thing,
};
use annulus_core::geometry::Point;
use annulus_core::units::Length;
use pieces::Pieces;
use std::collections::BTreeSet;
use std::sync::Arc;
use tree::Tree;

pub const GRIDS: [Length; 6] = [
    Length::from_um(50),
    Length::from_um(100),
    Length::from_um(500),
    Length::from_um(635),
    Length::from_um(1_270),
    Length::from_um(2_540),
];

/// Up to this many dragged things, the smallest figures are measured at every move; for more, on release.
const LIVE: usize = 100;

/// Properties of the next thing to be drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pen {
    pub layer: Layer,
    /// Layer of pads: the copper last drawn on, because a pad can't be on the edge layer.
    pub copper: Layer,
    pub width: Length,
    pub shape: PadShape,
    pub size: Length,
    /// True if pads have a hole.
    pub drilled: bool,
    pub diameter: Length,
    /// True if single holes are plated. Holes in pads always are.
    pub plated: bool,
}

impl Default for Pen {
    fn default() -> Self {
        Self {
            layer: Layer::Top,
            copper: Layer::Top,
            width: Length::from_um(600),
            shape: PadShape::Circle,
            size: Length::from_um(2_000),
            drilled: true,
            diameter: Length::from_um(800),
            plated: false,
        }
    }
}

impl Pen {
    /// Sets the active layer; pads stay on copper.
    pub fn draw_on(&mut self, layer: Layer) {
        self.layer = layer;
        if layer != Layer::Edge {
            self.copper = layer;
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    pub on: bool,
    pub step: Length,
}

#[derive(Clone, Debug)]
pub struct Editor {
    history: History,
    finder: Finder,
    figures: DrawingFigures,
    pieces: Pieces,
    tree: Tree,
    /// Things whose shape changed since the figures were measured.
    unmeasured: BTreeSet<Catch>,
    /// Number of changes; wraps.
    changes: u32,
    held: BTreeSet<Id>,
    /// Smallest gap, track, annular ring and hole.
    pub smallest: Smallest,
    /// The selection: things, groups, objects of files.
    pub chosen: BTreeSet<Catch>,
    pub tool: Tool,
    pub pen: Pen,
    pub grid: Grid,
    /// Everything that isn't on the active layer is dimmed.
    pub dim: bool,
    /// Layers that can't be selected or edited.
    pub locked: Locked,
    /// Where the tool aims: the cross-hair.
    pub aim: Snap,
    pub doing: Doing,
    pressed: Option<Point>,
    pub clip: Option<Arc<Drawing>>,
    pub open: BTreeSet<Id>,
    pub said: Option<Text>,
}

impl Default for Editor {
    fn default() -> Self {
        Self::new(History::default(), Arc::default())
    }
}

impl Editor {
    pub fn new(history: History, imported: Arc<Vec<Imported>>) -> Self {
        let finder = Finder::new(history.now(), imported);
        let figures = DrawingFigures::new(history.now(), &finder);
        let smallest = figures.smallest();
        let pieces = Pieces::new(history.now(), &finder);
        let tree = Tree::new(history.now(), &finder);
        Self {
            history,
            finder,
            figures,
            pieces,
            tree,
            smallest,
            unmeasured: BTreeSet::new(),
            changes: 0,
            held: BTreeSet::new(),
            chosen: BTreeSet::new(),
            tool: Tool::default(),
            pen: Pen::default(),
            grid: Grid { on: true, step: Length::from_um(500) },
            dim: false,
            locked: Locked::default(),
            aim: Snap::Free(Point::default()),
            doing: Doing::Nothing,
            pressed: None,
            clip: None,
            open: BTreeSet::new(),
            said: None,
        }
    }

    /// Another drawing with the same tool settings and clipboard.
    #[must_use]
    pub fn with(&self, history: History, imported: Arc<Vec<Imported>>) -> Self {
        Self {
            pen: self.pen,
            grid: self.grid,
            tool: self.tool,
            dim: self.dim,
            locked: self.locked.clone(),
            clip: self.clip.clone(),
            changes: self.changes + 1,
            ..Self::new(history, imported)
        }
    }

    pub fn drawing(&self) -> &Drawing {
        self.history.now()
    }

    pub fn history(&self) -> &History {
        &self.history
    }

    pub fn finder(&self) -> &Finder {
        &self.finder
    }

    /// Number of changes; the screens compare it to know when to refresh.
    pub fn changes(&self) -> u32 {
        self.changes
    }

    pub fn can_undo(&self) -> (bool, bool) {
        let (back, on) = self.history.depth();
        (back > 0, on > 0)
    }

    pub fn sheet(&mut self) -> Arc<DrawnPieces> {
        self.pieces.sheet(self.history.now(), &self.finder)
    }

    pub fn selection(&self) -> Selection<'_> {
        Selection::new(self.drawing(), &self.finder, &self.chosen)
    }

    pub fn ids(&self) -> BTreeSet<Id> {
        let drawn = |catch: &Catch| if let Catch::Drawn(id) = catch { Some(*id) } else { None };
        self.chosen.iter().filter_map(drawn).collect()
    }

    /// Makes an edit. If it fails or touches a locked layer, leaves a message and returns false.
    pub fn make(&mut self, edit: &Edit) -> bool {
        if self.locked.refuses(self.history.now(), &self.finder, edit) {
            self.said = Some(Text::of(key!("page.draw.locked")));
            return false;
        }
        match self.history.make(edit) {
            Ok(touched) => {
                self.follow(&touched, edit.name.is_some());
                self.measure();
                true
            }
            Err(why) => {
                self.said = Some(Text::Found(why));
                false
            }
        }
    }

    /// Replaces the edit of the current drag, so that a whole drag is one undo step.
    fn make_instead(&mut self, edit: impl FnOnce(&Drawing, &Finder) -> Edit) {
        let held = std::mem::take(&mut self.held);
        let (locked, finder, mut refused) = (&self.locked, &self.finder, false);
        let made = self.history.make_instead(|drawing| {
            let edit = edit(drawing, finder);
            refused = locked.refuses(drawing, finder, &edit);
            if refused { Edit::default() } else { edit }
        });
        if refused {
            self.said = Some(Text::of(key!("page.draw.locked")));
        }
        match made {
            Ok(touched) => {
                self.follow(&touched, false);
                self.held = touched;
                if self.unmeasured.len() <= LIVE {
                    self.measure();
                }
            }
            Err(why) => {
                // The previous edit of the drag is undone even so.
                self.follow(&held, false);
                self.said = Some(Text::Found(why));
            }
        }
    }

    fn rest(&mut self) {
        self.history.rest();
        self.held.clear();
        self.measure();
    }

    /// Undo or redo by one edit; false if there is none.
    pub fn step(&mut self, back: bool) -> bool {
        let Some(touched) = self.history.step(back) else { return false };
        self.held.clear();
        self.follow(&touched, true);
        self.measure();
        true
    }

    fn follow(&mut self, touched: &BTreeSet<Id>, renamed: bool) {
        if touched.is_empty() && !renamed {
            return;
        }
        let moved = self.finder.update(self.history.now(), touched);
        self.pieces.touch(&moved);
        self.tree.update(self.history.now(), &self.finder, touched.iter().copied());
        self.unmeasured.extend(moved);
        self.changes = self.changes.wrapping_add(1);
        let (now, finder) = (self.history.now(), &self.finder);
        self.chosen.retain(|catch| match catch {
            Catch::Drawn(id) => now.get(*id).is_some(),
            Catch::Imported(_) => finder.body(*catch).is_some(),
        });
        self.open.retain(|id| now.get(*id).is_some());
    }

    fn measure(&mut self) {
        if self.unmeasured.is_empty() {
            return;
        }
        let moved = std::mem::take(&mut self.unmeasured);
        self.figures.update(self.history.now(), &self.finder, &moved);
        self.smallest = self.figures.smallest();
    }

    /// The drawn thing, or the drawing's entry for an object of a file.
    pub fn id_of(&self, catch: Catch) -> Option<Id> {
        match catch {
            Catch::Drawn(id) => Some(id),
            Catch::Imported(of) => self.finder.said_of(of),
        }
    }

    pub fn group_of(&self, catch: Catch) -> Option<Id> {
        self.drawing().get(self.id_of(catch)?)?.group
    }

    /// The outermost group around it, or the thing itself if it is in none.
    pub fn outermost(&self, mut catch: Catch) -> Catch {
        while let Some(group) = self.group_of(catch) {
            catch = Catch::Drawn(group);
        }
        catch
    }

    /// Selects a thing alone, or toggles it in the selection if `adding`.
    pub fn choose(&mut self, catch: Catch, adding: bool) {
        if !adding {
            self.chosen = BTreeSet::from([catch]);
        } else if !self.chosen.remove(&catch) {
            self.chosen.insert(catch);
        }
    }

    /// Selects everything at the top level. Nodes are selected through what is attached to them.
    fn choose_all(&mut self) {
        let drawing = self.drawing();
        let bare = |id: &Id| drawing.at(*id).is_none() || drawing.hanging(*id).next().is_none();
        let said = |id: &Id| matches!(drawing.thing(*id), Some(Thing::Imported { copy: false, .. }));
        let drawn = drawing.top().filter(|id| bare(id) && !said(id)).map(Catch::Drawn);
        let imported = (0..self.finder.imported().len() as u32).map(Catch::Imported);
        let alone = |catch: &Catch| self.group_of(*catch).is_none();
        let there = imported.filter(|catch| self.finder.body(*catch).is_some() && alone(catch));
        self.chosen = drawn.chain(there).filter(|catch| !self.is_locked(*catch)).collect();
    }
}
