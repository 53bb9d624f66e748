//! The board editor as plain data: a drawing with its history, what is chosen in it, the tool in hand.
//!
//! ```text
//! pointer ─┐                       ┌─▶ DrawnPieces    what is drawn, in pieces: an edit makes one of them anew
//! keys   ──┼─▶ Editor ─ Edit ─▶ History ─▶ Marks    what is chosen, aimed at, being drawn
//! fields ──┘        ▲              └─▶ rows of the tree, fields of what is chosen, smallest figures
//!                   └─ Finder: what is there, what is near
//! ```
//!
//! Comes in: places, keys, numbers as people type them. Goes out: the next drawing; plain data to be shown. Lengths are whole
//! nanometres. Does not know the model, the page or files.

mod act;
mod catching;
pub mod fields;
pub mod keys;
pub mod kinds;
mod locked;
pub mod marks;
pub mod pieces;
pub mod scene;
mod tools;
pub mod tree;
pub mod typed;
mod when;

pub use act::Act;
pub use keys::DrawKey;
pub use locked::Locked;
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

/// The grids there are to choose from.
pub const GRIDS: [Length; 6] = [
    Length::from_um(50),
    Length::from_um(100),
    Length::from_um(500),
    Length::from_um(635),
    Length::from_um(1_270),
    Length::from_um(2_540),
];

/// Of so many things under a held pointer the smallest figures are measured with every move, of more when it is let go.
const LIVE: usize = 100;

/// With what the next thing is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pen {
    /// Where tracks lie.
    pub layer: Layer,
    /// Where pads lie: on the copper that was drawn on last, as a pad cannot lie on the edge.
    pub copper: Layer,
    /// Width of tracks.
    pub width: Length,
    /// Form of pads.
    pub shape: PadShape,
    /// Size of pads.
    pub size: Length,
    /// Pads have a hole.
    pub drilled: bool,
    /// Diameter of holes, in pads and alone.
    pub diameter: Length,
    /// Holes alone are plated; those in pads are.
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
    /// Draws on a layer from now on; pads stay on copper.
    pub fn draw_on(&mut self, layer: Layer) {
        self.layer = layer;
        if layer != Layer::Edge {
            self.copper = layer;
        }
    }
}

/// Where the pointer snaps to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// It does.
    pub on: bool,
    /// Distance of its lines.
    pub step: Length,
}

/// A drawing under work.
#[derive(Clone, Debug)]
pub struct Editor {
    history: History,
    finder: Finder,
    figures: DrawingFigures,
    pieces: Pieces,
    tree: Tree,
    /// What has another body since the figures were measured.
    unmeasured: BTreeSet<Catch>,
    /// Counts changes of the drawing.
    changes: u32,
    /// What the edit under a held pointer touched.
    held: BTreeSet<Id>,
    /// The smallest gap, track, ring and hole.
    pub smallest: Smallest,
    /// What is chosen: things, groups, objects of files.
    pub chosen: BTreeSet<Catch>,
    /// The tool in hand.
    pub tool: Tool,
    /// With what is drawn.
    pub pen: Pen,
    /// Where the pointer snaps to.
    pub grid: Grid,
    /// What lies on other layers than the one that is drawn on is faint.
    pub dim: bool,
    /// What is not caught, and not changed.
    pub locked: Locked,
    /// Where the tool aims.
    pub aim: Snap,
    /// What is being done.
    pub doing: Doing,
    /// Where the pointer went down, while it is held.
    pressed: Option<Point>,
    /// What was copied.
    pub clip: Option<Arc<Drawing>>,
    /// Groups whose members the tree shows.
    pub open: BTreeSet<Id>,
    /// Said to the person.
    pub said: Option<Text>,
}

impl Default for Editor {
    fn default() -> Self {
        Self::new(History::default(), Arc::default())
    }
}

impl Editor {
    /// A drawing over what is imported.
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

    /// The same tools for another drawing.
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

    /// The drawing.
    pub fn drawing(&self) -> &Drawing {
        self.history.now()
    }

    /// The drawing with its edits.
    pub fn history(&self) -> &History {
        &self.history
    }

    /// What is imported, and where.
    pub fn finder(&self) -> &Finder {
        &self.finder
    }

    /// Counts changes of the drawing.
    pub fn changes(&self) -> u32 {
        self.changes
    }

    /// Whether there is a step back, and one on.
    pub fn can_undo(&self) -> (bool, bool) {
        let (back, on) = self.history.depth();
        (back > 0, on > 0)
    }

    /// What is drawn, in pieces.
    pub fn sheet(&mut self) -> Arc<DrawnPieces> {
        self.pieces.sheet(self.history.now(), &self.finder)
    }

    /// What is chosen, to do something with it.
    pub fn selection(&self) -> Selection<'_> {
        Selection::new(self.drawing(), &self.finder, &self.chosen)
    }

    /// Things of the drawing that are chosen.
    pub fn ids(&self) -> BTreeSet<Id> {
        let drawn = |catch: &Catch| if let Catch::Drawn(id) = catch { Some(*id) } else { None };
        self.chosen.iter().filter_map(drawn).collect()
    }

    /// Makes an edit; what cannot be is said. Whether it was made.
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

    /// Makes an edit in place of the one that is being made under a held pointer.
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
                // What was made before is taken back all the same.
                self.follow(&held, false);
                self.said = Some(Text::Found(why));
            }
        }
    }

    /// What is being made is made.
    fn rest(&mut self) {
        self.history.rest();
        self.held.clear();
        self.measure();
    }

    /// Back by an edit, or on again.
    pub fn step(&mut self, back: bool) -> bool {
        let Some(touched) = self.history.step(back) else { return false };
        self.held.clear();
        self.follow(&touched, true);
        self.measure();
        true
    }

    /// Everything that follows from the drawing follows what was touched.
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

    /// The smallest figures of the drawing as it is.
    fn measure(&mut self) {
        if self.unmeasured.is_empty() {
            return;
        }
        let moved = std::mem::take(&mut self.unmeasured);
        self.figures.update(self.history.now(), &self.finder, &moved);
        self.smallest = self.figures.smallest();
    }

    /// The thing of the drawing that something is, or that speaks of it.
    pub fn id_of(&self, catch: Catch) -> Option<Id> {
        match catch {
            Catch::Drawn(id) => Some(id),
            Catch::Imported(of) => self.finder.said_of(of),
        }
    }

    /// The group that something is in.
    pub fn group_of(&self, catch: Catch) -> Option<Id> {
        self.drawing().get(self.id_of(catch)?)?.group
    }

    /// The outermost group that a thing is in; itself where it is in none.
    pub fn outermost(&self, mut catch: Catch) -> Catch {
        while let Some(group) = self.group_of(catch) {
            catch = Catch::Drawn(group);
        }
        catch
    }

    /// Chooses a thing by itself, or adds it to what is chosen, or takes it away again.
    pub fn choose(&mut self, catch: Catch, adding: bool) {
        if !adding {
            self.chosen = BTreeSet::from([catch]);
        } else if !self.chosen.remove(&catch) {
            self.chosen.insert(catch);
        }
    }

    /// Everything is chosen: what is in no group, and the groups. Nodes go with what hangs on them.
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
