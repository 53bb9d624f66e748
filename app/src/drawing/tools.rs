//! The tools in hand: what a pointer and the cross-hair do with each.
//!
//! ```text
//! select   press a thing, drag it ─ press beside all, drag a box
//! track    place ─ place ─ place … End           pad, hole, node   place
//! measure  from ─ to
//! ```
//!
//! Comes in: places in whole nanometres, what is held down. Goes out: edits, what is chosen, what is being done. Does not know
//! pixels: how far the pointer reaches is told.

use super::Editor;
use crate::said::{Text, key};
use crate::view::Touch;
use annulus_core::board::drawing::{
    Body, Catch, Id, Layer, Selection, Snap, Thing, TrackEnd, hole, node, pad, removed, track,
};
use annulus_core::geometry::{Bounds, Point};
use annulus_core::units::Length;
use std::collections::BTreeSet;

/// A tool.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    /// Chooses and moves.
    #[default]
    Select,
    /// Draws tracks from place to place.
    Track,
    /// Places pads.
    Pad,
    /// Places holes.
    Hole,
    /// Places nodes.
    Node,
    /// Measures from place to place.
    Measure,
}

impl Tool {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Select, Self::Track, Self::Pad, Self::Hole, Self::Node, Self::Measure];

    /// Its word in the address of a sentence.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Select => "select",
            Self::Track => "track",
            Self::Pad => "pad",
            Self::Hole => "hole",
            Self::Node => "node",
            Self::Measure => "measure",
        }
    }
}

/// What is being done.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Doing {
    /// Nothing.
    #[default]
    Nothing,
    /// A track goes on from here.
    Track {
        /// Where its next piece begins.
        from: Point,
        /// The pieces before, the latest last.
        before: Vec<TrackPiece>,
    },
    /// What is chosen is dragged.
    Drag {
        /// The place of it that is put where the pointer aims.
        anchor: Point,
        /// Where the pointer went down.
        press: Point,
        /// It was moved.
        moved: bool,
        /// To be chosen alone where nothing was moved.
        alone: Option<Catch>,
        /// So much is chosen that only its box follows the pointer until it is let go: the box.
        boxed: Option<Bounds>,
    },
    /// A box is drawn.
    Box {
        /// From this corner.
        from: Point,
        /// To that one.
        to: Point,
        /// What is in it is added to what is chosen.
        adding: bool,
    },
    /// Something is measured.
    Measure {
        /// From here.
        from: Point,
        /// To there; where the tool aims while it is open.
        to: Option<Point>,
    },
}

/// A piece of the track that is being drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackPiece {
    /// Where it began.
    from: Point,
    /// The track that it is.
    track: Id,
    /// How many edits there were with it.
    edits: usize,
}

/// A pointer over the drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pointer {
    /// What it does.
    pub touch: Touch,
    /// Where.
    pub at: Point,
    /// How far beside a thing it still means it.
    pub reach: Length,
    /// Shift is held: add, or keep to eighths of a turn.
    pub shift: bool,
    /// Control is held: take one thing out of a group; snap to nothing.
    pub ctrl: bool,
}

/// `to` on the nearest line from `from` that goes along an axis or midway between two.
fn in_eighths(from: Point, to: Point) -> Point {
    let (x, y) = ((to.x - from.x).nm(), (to.y - from.y).nm());
    let (far, near) = (x.abs().max(y.abs()), x.abs().min(y.abs()));
    // tan 22.5° is 0.4142.
    let (x, y) = if near * 10_000 > far * 4_142 {
        (far * x.signum(), far * y.signum())
    } else if x.abs() > y.abs() {
        (x, 0)
    } else {
        (0, y)
    };
    Point::new(from.x + Length::from_nm(x), from.y + Length::from_nm(y))
}

/// The node that the drawing would use at a place, or a new one.
fn end(at: Point) -> TrackEnd {
    TrackEnd::At(at)
}

/// More things than these are dragged as a box.
const MOST_LIVE: usize = 300;

impl Editor {
    /// Another tool; what was being done is left.
    pub fn take(&mut self, tool: Tool) {
        self.leave();
        self.tool = tool;
    }

    /// What is being done is broken off: a drag is taken back. Whether anything was.
    pub fn leave(&mut self) -> bool {
        self.pressed = None;
        match std::mem::take(&mut self.doing) {
            Doing::Nothing => false,
            Doing::Drag { moved, boxed, .. } => {
                if moved && boxed.is_none() {
                    self.make_instead(|_, _| super::Edit::default());
                    self.rest();
                }
                moved
            }
            _ => true,
        }
    }

    fn grid_now(&self, free: bool) -> Option<Length> {
        (self.grid.on && !free).then_some(self.grid.step)
    }

    /// Where the tool aims when the pointer is at `at`.
    fn aimed(&self, at: Point, pointer: &Pointer, without: &BTreeSet<Catch>) -> Snap {
        if pointer.ctrl {
            return Snap::Free(at);
        }
        self.finder.snap(self.drawing(), at, pointer.reach, self.grid_now(false), without)
    }

    /// Takes a pointer in.
    pub fn point(&mut self, pointer: &Pointer) {
        if let Doing::Drag { .. } = self.doing {
            return self.drag(pointer);
        }
        self.aim = self.aimed(pointer.at, pointer, &BTreeSet::new());
        if let (Doing::Track { from, .. }, true) = (&self.doing, pointer.shift) {
            self.aim = Snap::Free(in_eighths(*from, self.aim.at()));
        }
        match pointer.touch {
            Touch::Hover => {}
            Touch::Down => {
                self.pressed = Some(pointer.at);
                if self.tool == Tool::Select { self.grab(pointer) } else { self.place() }
            }
            Touch::Move => {
                if let Doing::Box { to, .. } = &mut self.doing {
                    *to = pointer.at;
                }
            }
            Touch::Up => self.let_go(pointer),
            Touch::Cancel => {
                self.leave();
            }
        }
    }

    /// The pointer goes up: a box is closed; a track or a measure that was dragged ends here.
    fn let_go(&mut self, pointer: &Pointer) {
        let dragged = self.pressed.take().is_some_and(|from| is_far(from, pointer));
        match self.doing {
            Doing::Box { from, to, adding } => {
                self.doing = Doing::Nothing;
                self.take_box(from, to, adding);
            }
            Doing::Track { from, .. } if dragged && from != self.aim.at() => self.place(),
            Doing::Measure { to: None, .. } if dragged => self.place(),
            _ => {}
        }
    }

    /// Places what the tool makes where it aims.
    pub fn place(&mut self) {
        let (at, pen) = (self.aim.at(), self.pen);
        match self.tool {
            Tool::Select => {}
            Tool::Track => self.place_track(at),
            Tool::Pad if self.has_pad(at, pen.copper) => self.say_there(),
            Tool::Pad => {
                let drill = (pen.drilled && !self.has_hole(at)).then_some(pen.diameter);
                let edit = pad(self.drawing(), end(at), (pen.shape, pen.size), drill, pen.copper);
                self.make(&edit);
            }
            Tool::Hole if self.has_hole(at) => self.say_there(),
            Tool::Hole => {
                let edit = hole(self.drawing(), end(at), pen.diameter, pen.plated);
                self.make(&edit);
            }
            Tool::Node => {
                let edit = node(self.drawing(), at);
                self.make(&edit);
            }
            Tool::Measure => {
                self.doing = match self.doing {
                    Doing::Measure { from, to: None } => Doing::Measure { from, to: Some(at) },
                    _ => Doing::Measure { from: at, to: None },
                };
            }
        }
    }

    /// What hangs on the node at a place.
    fn hanging_at(&self, at: Point) -> impl Iterator<Item = &Thing> {
        let drawing = self.drawing();
        let hanging = drawing.node_at(at).into_iter().flat_map(|node| drawing.hanging(node));
        hanging.filter_map(|id| drawing.thing(id))
    }

    fn has_pad(&self, at: Point, on: Layer) -> bool {
        self.hanging_at(at).any(|thing| matches!(thing, Thing::Pad { layer, .. } if layer.meets(on)))
    }

    fn has_hole(&self, at: Point) -> bool {
        self.hanging_at(at).any(|thing| matches!(thing, Thing::Hole { .. }))
    }

    /// At the second press of a double click the first has placed already.
    fn say_there(&mut self) {
        self.said = Some(Text::of(key!("page.draw.there")));
    }

    fn place_track(&mut self, at: Point) {
        let Doing::Track { from, mut before } = std::mem::take(&mut self.doing) else {
            self.doing = Doing::Track { from: at, before: Vec::new() };
            return;
        };
        // The same place once more ends the track.
        if from == at {
            return;
        }
        let (edit, _) = track(self.drawing(), (end(from), end(at)), self.pen.width, self.pen.layer);
        // The nodes of a track come first in its edit.
        let track = edit.changes.last().map(|(id, _)| *id);
        if let (true, Some(track)) = (self.make(&edit), track) {
            before.push(TrackPiece { from, track, edits: self.history.depth().0 });
            self.doing = Doing::Track { from: at, before };
        } else {
            self.doing = Doing::Track { from, before };
        }
    }

    /// The last piece of the track is taken back. Where something else was edited meanwhile that stays, and the piece is taken out.
    pub fn back_by_a_piece(&mut self) {
        let Doing::Track { before, .. } = &mut self.doing else { return };
        let (last, before) = (before.pop(), std::mem::take(before));
        let Some(last) = last else {
            self.doing = Doing::Nothing;
            return;
        };
        if self.history.depth().0 == last.edits {
            self.step(true);
        } else {
            let edit = removed(self.drawing(), &BTreeSet::from([last.track]));
            self.make(&edit);
        }
        self.doing = Doing::Track { from: last.from, before };
    }

    /// Select goes down: on something, which can be dragged then, or beside all of it. What is chosen is dragged though something
    /// else lies above it; that is chosen where nothing was dragged.
    fn grab(&mut self, pointer: &Pointer) {
        let Some(hit) = self.hit(pointer.at, pointer.reach, pointer.ctrl) else {
            self.doing = Doing::Box { from: pointer.at, to: pointer.at, adding: pointer.shift };
            return;
        };
        if pointer.shift {
            return self.choose_hit(hit, true, pointer.ctrl);
        }
        // Who presses the end of one track that is chosen means the end.
        let is_node = matches!(hit, Catch::Drawn(id) if self.drawing().at(id).is_some());
        let chosen = self.chosen.contains(&hit)
            || (!is_node || self.chosen.len() > 1)
                && self.is_chosen_at(pointer.at, pointer.reach, pointer.ctrl);
        if !chosen {
            self.choose_hit(hit, false, pointer.ctrl);
        }
        self.doing = Doing::Drag {
            anchor: self.anchor(pointer.at),
            press: pointer.at,
            moved: false,
            alone: chosen.then_some(hit),
            boxed: None,
        };
    }

    /// The box of what is chosen, where that is more than can be drawn anew with every move.
    fn boxed(&self) -> Option<Bounds> {
        let all: Vec<Catch> = self.selection().leaves().collect();
        let bodies =
            all.iter().filter(|_| all.len() > MOST_LIVE).filter_map(|catch| self.finder.body(*catch));
        let boxes = bodies.map(Body::bounds);
        boxes.reduce(|all, bounds| all.with(bounds.min).with(bounds.max))
    }

    /// What is chosen is put so that its `anchor` lies where the tool aims.
    fn put_at_aim(&mut self, anchor: Point) {
        let to = self.aim.at();
        let by = Point::new(to.x - anchor.x, to.y - anchor.y);
        let chosen = self.chosen.clone();
        self.make_instead(|drawing, finder| Selection::new(drawing, finder, &chosen).moved(by));
    }

    /// The place of what is chosen that is put onto the grid: its nearest node, or place of an object of a file.
    fn anchor(&self, at: Point) -> Point {
        let drawn = self.drawing().spots_of(&self.ids()).into_iter();
        let imported = self.chosen.iter().filter_map(|catch| self.place_of(*catch));
        let nearest = drawn.chain(imported).min_by(|a, b| a.distance_mm(at).total_cmp(&b.distance_mm(at)));
        nearest.unwrap_or(at)
    }

    /// Where something of a file is now.
    pub fn place_of(&self, catch: Catch) -> Option<Point> {
        self.finder.place_of(self.drawing(), catch)
    }

    fn drag(&mut self, pointer: &Pointer) {
        let Doing::Drag { anchor, press, moved, alone, boxed } = self.doing else { return };
        match pointer.touch {
            Touch::Move if moved || is_far(press, pointer) => {
                let by = Point::new(pointer.at.x - press.x, pointer.at.y - press.y);
                let wanted = Point::new(anchor.x + by.x, anchor.y + by.y);
                let boxed = boxed.or_else(|| if moved { None } else { self.boxed() });
                if boxed.is_some() {
                    // A box has nothing that could be caught: the grid alone counts.
                    let far = Pointer { reach: Length::ZERO, ..*pointer };
                    self.aim = self.aimed(wanted, &far, &BTreeSet::new());
                } else {
                    self.aim = self.aimed(wanted, pointer, &self.moving());
                    self.put_at_aim(anchor);
                }
                self.doing = Doing::Drag { anchor, press, moved: true, alone, boxed };
            }
            Touch::Up => {
                self.doing = Doing::Nothing;
                if boxed.is_some() {
                    self.put_at_aim(anchor);
                }
                self.pressed = None;
                self.rest();
                if let (false, Some(alone)) = (moved, alone) {
                    self.choose_hit(alone, false, pointer.ctrl);
                }
            }
            Touch::Cancel => {
                self.leave();
            }
            _ => {}
        }
    }

    /// What moves with what is chosen: nothing snaps to that.
    fn moving(&self) -> BTreeSet<Catch> {
        let (drawing, ids) = (self.drawing(), self.ids());
        let nodes = drawing.nodes_of(&ids);
        let hanging = nodes.iter().flat_map(|node| drawing.hanging(*node));
        let drawn = nodes.iter().copied().chain(hanging).map(Catch::Drawn);
        drawn.chain(self.selection().leaves()).chain(self.chosen.iter().copied()).collect()
    }

    /// A box from left to right takes what lies in it whole, from right to left what it meets.
    fn take_box(&mut self, from: Point, to: Point, adding: bool) {
        if !adding {
            self.chosen.clear();
        }
        if from == to {
            return;
        }
        let Some(bounds) = Bounds::around([from, to]) else { return };
        let drawing = self.drawing();
        // A node goes with what hangs on it.
        let wanted = |catch: &Catch| match catch {
            Catch::Drawn(id) => drawing.at(*id).is_none() || drawing.hanging(*id).next().is_none(),
            Catch::Imported(_) => true,
        };
        let found: Vec<Catch> =
            self.finder.within(bounds, to.x < from.x).into_iter().filter(wanted).collect();
        let found: Vec<Catch> = found.into_iter().filter(|catch| !self.is_locked(*catch)).collect();
        let found: Vec<Catch> = found.into_iter().map(|catch| self.outermost(catch)).collect();
        self.chosen.extend(found);
    }

    /// The cross-hair goes by so many steps; what is chosen goes in its place where the tool selects.
    pub fn nudge(&mut self, (x, y): (i8, i8), step: Length) {
        let by = Point::new(step * i64::from(x), step * i64::from(y));
        if self.tool == Tool::Select && !self.chosen.is_empty() {
            return self.shift(by);
        }
        let at = self.aim.at();
        let to = Point::new(at.x + by.x, at.y + by.y);
        self.aim_at(to);
    }

    /// What is chosen goes by so much.
    fn shift(&mut self, by: Point) {
        self.make(&self.selection().moved(by));
    }

    /// A typed place: the tool places there. Where it selects, what is chosen goes by as much as the cross-hair does, if it was
    /// said by how much, or if the cross-hair stands on it.
    pub fn go(&mut self, to: Point, by: bool) {
        let from = self.aim.at();
        let (ids, drawing) = (self.ids(), self.drawing());
        let on = |at: Option<Point>| at == Some(from);
        let stands = drawing.spots_of(&ids).into_iter().any(|spot| spot == from)
            || self.chosen.iter().any(|catch| on(self.place_of(*catch)));
        if self.tool == Tool::Select && (by || stands) && !self.chosen.is_empty() {
            self.shift(Point::new(to.x - from.x, to.y - from.y));
        }
        self.aim_at(to);
        if self.tool != Tool::Select {
            self.place();
        }
    }

    /// The cross-hair stands at `at`.
    pub fn aim_at(&mut self, at: Point) {
        let node = self.finder.snap(self.drawing(), at, Length::ZERO, None, &BTreeSet::new());
        self.aim = if node.at() == at { node } else { Snap::Free(at) };
    }
}

/// Whether the pointer was dragged, and not only pressed.
fn is_far(from: Point, pointer: &Pointer) -> bool {
    from.distance_mm(pointer.at) > pointer.reach.mm() / 2.0
}
