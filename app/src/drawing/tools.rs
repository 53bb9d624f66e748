//! The tools: how each reacts to the pointer and the cross-hair.
//!
//! ```text
//! select   press a thing, drag it ─ press an empty spot, drag a box
//! track    place ─ place ─ place … End           pad, hole, node   place
//! measure  from ─ to
//! ```

use super::Editor;
use crate::said::{Text, key};
use crate::view::Touch;
use annulus_core::board::drawing::{
    Body, Catch, Id, Layer, Selection, Snap, Thing, TrackEnd, hole, node, pad, removed, track,
};
use annulus_core::geometry::{Bounds, Point};
use annulus_core::units::Length;
use std::collections::BTreeSet;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    #[default]
    Select,
    Track,
    Pad,
    Hole,
    Node,
    Measure,
}

impl Tool {
    pub const ALL: [Self; 6] = [Self::Select, Self::Track, Self::Pad, Self::Hole, Self::Node, Self::Measure];

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

#[derive(Clone, Debug, Default, PartialEq)]
pub enum Doing {
    #[default]
    Nothing,
    Track {
        from: Point,
        /// Segments placed before, latest last.
        before: Vec<TrackPiece>,
    },
    Drag {
        /// The point of the selection that follows the aim.
        anchor: Point,
        press: Point,
        moved: bool,
        /// Selected alone on release if nothing moved.
        alone: Option<Catch>,
        /// The bounding box, if the selection is too large to redraw at each move: only the box follows the
        /// pointer until release.
        boxed: Option<Bounds>,
    },
    Box {
        from: Point,
        to: Point,
        /// Adds to the selection instead of replacing it.
        adding: bool,
    },
    Measure {
        from: Point,
        /// The end; while none, the measurement follows the aim.
        to: Option<Point>,
    },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrackPiece {
    from: Point,
    track: Id,
    /// Depth of the history right after this segment was placed.
    edits: usize,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pointer {
    pub touch: Touch,
    pub at: Point,
    /// A press this close to a thing still hits it.
    pub reach: Length,
    /// Shift: add to the selection, or constrain to multiples of 45°.
    pub shift: bool,
    /// Control: select single things of a group, and don't snap.
    pub ctrl: bool,
}

/// `to`, moved onto the nearest ray from `from` at a multiple of 45°.
fn in_eighths(from: Point, to: Point) -> Point {
    let (x, y) = ((to.x - from.x).nm(), (to.y - from.y).nm());
    let (far, near) = (x.abs().max(y.abs()), x.abs().min(y.abs()));
    // The border between two directions is at 22.5°, whose tangent is 0.4142.
    let (x, y) = if near * 10_000 > far * 4_142 {
        (far * x.signum(), far * y.signum())
    } else if x.abs() > y.abs() {
        (x, 0)
    } else {
        (0, y)
    };
    Point::new(from.x + Length::from_nm(x), from.y + Length::from_nm(y))
}

fn end(at: Point) -> TrackEnd {
    TrackEnd::At(at)
}

/// Larger selections are dragged as a box.
const MOST_LIVE: usize = 300;

impl Editor {
    pub fn take(&mut self, tool: Tool) {
        self.leave();
        self.tool = tool;
    }

    /// Cancels what is being done, and undoes a drag. True if there was anything to cancel.
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

    /// Where the tool aims for a pointer at `at`. Never snaps to anything in `without`.
    fn aimed(&self, at: Point, pointer: &Pointer, without: &BTreeSet<Catch>) -> Snap {
        if pointer.ctrl {
            return Snap::Free(at);
        }
        self.finder.snap(self.drawing(), at, pointer.reach, self.grid_now(false), without)
    }

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

    /// Handles the release: closes a box, or ends a track or measurement that was dragged.
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

    /// Places the tool's thing where the tool aims.
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

    /// The second press of a double click hits what the first has placed: show a message instead of a
    /// duplicate.
    fn say_there(&mut self) {
        self.said = Some(Text::of(key!("page.draw.there")));
    }

    fn place_track(&mut self, at: Point) {
        let Doing::Track { from, mut before } = std::mem::take(&mut self.doing) else {
            self.doing = Doing::Track { from: at, before: Vec::new() };
            return;
        };
        // Placing at the same point again ends the track.
        if from == at {
            return;
        }
        let (edit, _) = track(self.drawing(), (end(from), end(at)), self.pen.width, self.pen.layer);
        // The track is the last change of its edit; its nodes come first.
        let track = edit.changes.last().map(|(id, _)| *id);
        if let (true, Some(track)) = (self.make(&edit), track) {
            before.push(TrackPiece { from, track, edits: self.history.depth().0 });
            self.doing = Doing::Track { from: at, before };
        } else {
            self.doing = Doing::Track { from, before };
        }
    }

    /// Removes the last segment of the track. If there were other edits since, keeps them and deletes only
    /// the segment.
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

    /// Select tool, pointer down: starts a drag on a thing, or a box on an empty spot. A selected thing is
    /// dragged even if another is above it; on release without a move, the upper one is selected.
    fn grab(&mut self, pointer: &Pointer) {
        let Some(hit) = self.hit(pointer.at, pointer.reach, pointer.ctrl) else {
            self.doing = Doing::Box { from: pointer.at, to: pointer.at, adding: pointer.shift };
            return;
        };
        if pointer.shift {
            return self.choose_hit(hit, true, pointer.ctrl);
        }
        // A press on the end of a single selected track means its end, not the track.
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

    /// The box of the selection, if it is too large to redraw at each move.
    fn boxed(&self) -> Option<Bounds> {
        let all: Vec<Catch> = self.selection().leaves().collect();
        let bodies =
            all.iter().filter(|_| all.len() > MOST_LIVE).filter_map(|catch| self.finder.body(*catch));
        let boxes = bodies.map(Body::bounds);
        boxes.reduce(|all, bounds| all.with(bounds.min).with(bounds.max))
    }

    fn put_at_aim(&mut self, anchor: Point) {
        let to = self.aim.at();
        let by = Point::new(to.x - anchor.x, to.y - anchor.y);
        let chosen = self.chosen.clone();
        self.make_instead(|drawing, finder| Selection::new(drawing, finder, &chosen).moved(by));
    }

    /// The point of the selection that snaps to the grid: the nearest node, or the nearest position of an
    /// object of a file.
    fn anchor(&self, at: Point) -> Point {
        let drawn = self.drawing().spots_of(&self.ids()).into_iter();
        let imported = self.chosen.iter().filter_map(|catch| self.place_of(*catch));
        let nearest = drawn.chain(imported).min_by(|a, b| a.distance_mm(at).total_cmp(&b.distance_mm(at)));
        nearest.unwrap_or(at)
    }

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
                    // A box has no nodes to snap, so only the grid counts.
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

    /// Everything that moves with the selection: the drag must not snap to it.
    fn moving(&self) -> BTreeSet<Catch> {
        let (drawing, ids) = (self.drawing(), self.ids());
        let nodes = drawing.nodes_of(&ids);
        let hanging = nodes.iter().flat_map(|node| drawing.hanging(*node));
        let drawn = nodes.iter().copied().chain(hanging).map(Catch::Drawn);
        drawn.chain(self.selection().leaves()).chain(self.chosen.iter().copied()).collect()
    }

    /// A box drawn from left to right selects what is entirely inside, from right to left also what it
    /// touches.
    fn take_box(&mut self, from: Point, to: Point, adding: bool) {
        if !adding {
            self.chosen.clear();
        }
        if from == to {
            return;
        }
        let Some(bounds) = Bounds::around([from, to]) else { return };
        let drawing = self.drawing();
        // A node is selected only through what is attached to it.
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

    /// Moves by steps: the selection if the select tool has one, else the cross-hair.
    pub fn nudge(&mut self, (x, y): (i8, i8), step: Length) {
        let by = Point::new(step * i64::from(x), step * i64::from(y));
        if self.tool == Tool::Select && !self.chosen.is_empty() {
            return self.shift(by);
        }
        let at = self.aim.at();
        let to = Point::new(at.x + by.x, at.y + by.y);
        self.aim_at(to);
    }

    fn shift(&mut self, by: Point) {
        self.make(&self.selection().moved(by));
    }

    /// Handles typed coordinates: the tool places there. The select tool moves the selection instead, if the
    /// coordinates are relative or the cross-hair is on the selection.
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

    /// Moves the cross-hair to `at`, onto a node if there is one.
    pub fn aim_at(&mut self, at: Point) {
        let node = self.finder.snap(self.drawing(), at, Length::ZERO, None, &BTreeSet::new());
        self.aim = if node.at() == at { node } else { Snap::Free(at) };
    }
}

/// True for a drag, false for a press.
fn is_far(from: Point, pointer: &Pointer) -> bool {
    from.distance_mm(pointer.at) > pointer.reach.mm() / 2.0
}
