//! Finds elements under the pointer, in a box, and near enough to snap to.
//!
//! ```text
//!  drawing + imported ─ update(touched) ─▶ bodies by place ─┬─ at(place)   ─▶ hits, the smallest first
//!                                                           ├─ within(box) ─▶ hits of a box
//!                                                           └─ snap(place) ─▶ node · track middle · grid
//! ```
//!
//! The time of an update depends on the touched elements, not on the drawing.

use super::over::is_called;
use super::places::Places;
use super::{Body, Drawing, Id, Imported, Layer, Thing};
use crate::geometry::{Bounds, Point};
use crate::units::Length;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Catch {
    /// An element of the drawing.
    Drawn(Id),
    /// An object of an imported file: index into the list of imported objects.
    Imported(u32),
}

/// Target of a snap, and its reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Snap {
    /// No target: the pointer's position.
    Free(Point),
    Grid(Point),
    /// A node: the end of a track, the centre of a pad.
    Node(Point, Id),
    Middle(Point, Id),
    /// The centre of an imported pad or hole, or the end of an imported track.
    Imported(Point, u32),
}

impl Snap {
    pub const fn at(self) -> Point {
        match self {
            Self::Free(at)
            | Self::Grid(at)
            | Self::Node(at, _)
            | Self::Middle(at, _)
            | Self::Imported(at, _) => at,
        }
    }
}

/// Rank of a node with tracks only: after holes and pads, before tracks.
const BARE_NODE: u8 = 2;

/// The objects of a file: indices into the list of imported objects.
#[derive(Clone, Debug, Default)]
struct OfFile {
    by_number: BTreeMap<u32, u32>,
    by_place: BTreeMap<Point, u32>,
}

#[derive(Clone, Debug, Default)]
pub struct Finder {
    places: Places<Catch>,
    bodies: BTreeMap<Catch, Body>,
    imported: Arc<Vec<Imported>>,
    files: BTreeMap<String, OfFile>,
    /// The imported object that an element refers to or copies.
    spoken_of: BTreeMap<Id, u32>,
    /// The inverse, without copies.
    spoken_by: BTreeMap<u32, Id>,
}

impl Finder {
    /// Indexes `drawing` and the imported objects.
    pub fn new(drawing: &Drawing, imported: Arc<Vec<Imported>>) -> Self {
        let mut finder = Self { imported, ..Self::default() };
        for (at, one) in (0..).zip(finder.imported.clone().iter()) {
            let file = finder.files.entry(one.file.clone()).or_default();
            file.by_number.insert(one.object, at);
            file.by_place.entry(one.at).or_insert(at);
            finder.set(Catch::Imported(at), Some(one.body.clone()));
        }
        finder.update(drawing, &drawing.things().map(|(id, _)| id).collect());
        finder
    }

    pub fn imported(&self) -> &Arc<Vec<Imported>> {
        &self.imported
    }

    /// Index of the imported object that an element refers to or copies. The board uses the same rule: by
    /// number if that object is at the stated position, else the first object of the file there. `None` if
    /// there is none: the file has changed.
    pub fn imported_of(&self, thing: &Thing) -> Option<u32> {
        let Thing::Imported { file, object, at, .. } = thing else { return None };
        let called = || self.files.iter().find(|(name, _)| is_called(name, file)).map(|(_, own)| own);
        let own = self.files.get(file).or_else(called)?;
        let lies_there = |of: &u32| self.imported.get(*of as usize).is_some_and(|one| one.at == *at);
        own.by_number.get(object).copied().filter(lies_there).or_else(|| own.by_place.get(at).copied())
    }

    /// The element that modifies an imported object; `None` if the object is as in its file.
    pub fn said_of(&self, imported: u32) -> Option<Id> {
        self.spoken_by.get(&imported).copied()
    }

    /// The hit for an element: an imported object for an element that modifies one.
    pub fn catch_of(&self, id: Id, thing: &Thing) -> Catch {
        let of = match thing {
            Thing::Imported { copy: false, .. } => self.imported_of(thing),
            _ => None,
        };
        of.map_or(Catch::Drawn(id), Catch::Imported)
    }

    /// The imported object of a hit, also of a copy.
    pub fn object_of(&self, catch: Catch) -> Option<u32> {
        match catch {
            Catch::Imported(of) => Some(of),
            Catch::Drawn(id) => self.spoken_of.get(&id).copied(),
        }
    }

    /// Current position of an imported object or its copy; `None` if it was removed.
    pub fn place_of(&self, drawing: &Drawing, catch: Catch) -> Option<Point> {
        let said = match catch {
            Catch::Drawn(id) => drawing.thing(id),
            Catch::Imported(of) => self.said_of(of).and_then(|id| drawing.thing(id)),
        };
        match (said, catch) {
            (Some(thing), _) => thing.place(),
            (None, Catch::Imported(of)) => Some(self.imported.get(of as usize)?.at),
            (None, Catch::Drawn(_)) => None,
        }
    }

    /// Current body of a hit; `None` if it was removed.
    pub fn body(&self, catch: Catch) -> Option<&Body> {
        self.bodies.get(&catch)
    }

    /// Updates the touched elements. Returns everything with a changed body.
    pub fn update(&mut self, drawing: &Drawing, touched: &BTreeSet<Id>) -> BTreeSet<Catch> {
        let mut moved = BTreeSet::new();
        for id in touched {
            if let Some(of) = self.spoken_of.remove(id)
                && self.spoken_by.get(&of) == Some(id)
            {
                self.spoken_by.remove(&of);
                let whole = self.imported.get(of as usize).map(|one| one.body.clone());
                self.set(Catch::Imported(of), whole);
                moved.insert(Catch::Imported(of));
            }
            let entry = drawing.get(*id);
            let mut body = entry.and_then(|entry| Body::of(drawing, entry));
            if let Some(thing @ Thing::Imported { copy, .. }) = entry.map(|entry| &entry.thing)
                && let Some(of) = self.imported_of(thing)
                && let Some(one) = self.imported.get(of as usize)
            {
                let placed = thing.placement().map(|placement| one.body.clone().placed(placement, one.at));
                self.spoken_of.insert(*id, of);
                if *copy {
                    body = placed;
                } else {
                    self.set(Catch::Imported(of), placed);
                    self.spoken_by.insert(of, *id);
                    moved.insert(Catch::Imported(of));
                }
            }
            self.set(Catch::Drawn(*id), body);
            moved.insert(Catch::Drawn(*id));
        }
        moved
    }

    fn set(&mut self, catch: Catch, body: Option<Body>) {
        self.places.set(catch, body.as_ref().map(Body::bounds));
        match body {
            Some(body) => drop(self.bodies.insert(catch, body)),
            None => drop(self.bodies.remove(&catch)),
        }
    }

    /// The layer of its copper; `None` for holes and nodes.
    pub fn layer(&self, drawing: &Drawing, catch: Catch) -> Option<Layer> {
        let own = if let Catch::Drawn(id) = catch { drawing.thing(id)?.layer() } else { None };
        own.or_else(|| self.imported.get(self.object_of(catch)? as usize)?.layer)
    }

    /// Candidates whose bounds meet `bounds`.
    pub(super) fn meeting(&self, bounds: Bounds) -> BTreeSet<Catch> {
        self.places.meeting(bounds)
    }

    /// Hits within `reach` of a position. Direct hits first: holes, pads, tracks; among equals the latest.
    /// Nodes with tracks only come before tracks anywhere within reach, the nearest first.
    pub fn at(&self, drawing: &Drawing, at: Point, reach: Length) -> Vec<Catch> {
        let near = self.meeting(Bounds::of(at).grown(reach)).into_iter();
        let mut hit: Vec<((bool, u8, Length), Catch)> = near
            .filter_map(|catch| {
                let distance = self.bodies.get(&catch)?.distance_mm(at);
                if distance > reach.mm() {
                    return None;
                }
                let rank = self.rank(drawing, catch);
                // A bare node has no area, so its distance counts instead of a direct hit.
                let order = if rank == BARE_NODE {
                    (false, rank, Length::from_mm(distance))
                } else {
                    (distance > 0.0, rank, Length::ZERO)
                };
                Some((order, catch))
            })
            .collect();
        hit.sort_by_key(|(order, catch)| (*order, std::cmp::Reverse(*catch)));
        hit.into_iter().map(|(_, catch)| catch).collect()
    }

    fn rank(&self, drawing: &Drawing, catch: Catch) -> u8 {
        if let Some(of) = self.object_of(catch) {
            return match self.imported.get(of as usize) {
                Some(one) if one.layer.is_none() => 5,
                Some(one) if !one.is_area => 6,
                _ => 7,
            };
        }
        let Catch::Drawn(id) = catch else { return 7 };
        match drawing.thing(id) {
            Some(Thing::Node { .. }) => {
                let bare = |id: Id| matches!(drawing.thing(id), Some(Thing::Track { .. }));
                if drawing.hanging(id).all(bare) { BARE_NODE } else { 4 }
            }
            Some(Thing::Hole { .. }) => 0,
            Some(Thing::Pad { .. }) => 1,
            _ => 3,
        }
    }

    /// Hits of a box: elements entirely inside, or with `crossing` also those that it meets.
    pub fn within(&self, bounds: Bounds, crossing: bool) -> Vec<Catch> {
        let inside = |catch: &Catch| {
            let Some(body) = self.bodies.get(catch) else { return false };
            let own = body.bounds();
            let whole = bounds.contains(own.min) && bounds.contains(own.max);
            whole || crossing && body.gap_mm(&of_box(bounds)) <= 0.0
        };
        self.meeting(bounds).into_iter().filter(inside).collect()
    }

    /// Snaps a pointer at `at`: to the nearest node or end within `reach`, else to the middle of a track,
    /// else to the grid. Ignores `without`.
    pub fn snap(
        &self,
        drawing: &Drawing,
        at: Point,
        reach: Length,
        grid: Option<Length>,
        without: &BTreeSet<Catch>,
    ) -> Snap {
        let (mut ends, mut middles) = (Vec::new(), Vec::new());
        for catch in self.meeting(Bounds::of(at).grown(reach)) {
            let Some(body) = self.bodies.get(&catch).filter(|_| !without.contains(&catch)) else { continue };
            if let Some(of) = self.object_of(catch) {
                let place = self.place_of(drawing, catch);
                let spots = self.imported.get(of as usize).zip(place).map(|(one, at)| one.spots(at, body));
                ends.extend(spots.into_iter().flatten().map(|spot| Snap::Imported(spot, of)));
                continue;
            }
            let Catch::Drawn(id) = catch else { continue };
            match (drawing.thing(id), body.points.as_slice()) {
                (Some(Thing::Node { at }), _) => ends.push(Snap::Node(*at, id)),
                (Some(Thing::Track { .. }), [a, b]) => middles.push(Snap::Middle(halfway(*a, *b), id)),
                _ => {}
            }
        }
        let nearest = |snaps: Vec<Snap>| {
            let near = snaps.into_iter().map(|snap| (snap.at().distance_mm(at), snap));
            let near = near.filter(|(distance, _)| *distance <= reach.mm());
            near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, snap)| snap)
        };
        let gridded = || match grid.filter(|grid| grid.nm() > 0) {
            Some(grid) => Snap::Grid(Point::new(whole(at.x, grid), whole(at.y, grid))),
            None => Snap::Free(at),
        };
        nearest(ends).or_else(|| nearest(middles)).unwrap_or_else(gridded)
    }
}

pub fn whole(length: Length, grid: Length) -> Length {
    let (length, grid) = (length.nm(), grid.nm().max(1));
    Length::from_nm((length + grid / 2).div_euclid(grid) * grid)
}

fn halfway(a: Point, b: Point) -> Point {
    let half = |a: Length, b: Length| Length::from_nm((a.nm() + b.nm()).div_euclid(2));
    Point::new(half(a.x, b.x), half(a.y, b.y))
}

fn of_box(bounds: Bounds) -> Body {
    let (low, high) = (bounds.min, bounds.max);
    let points = vec![low, Point::new(high.x, low.y), high, Point::new(low.x, high.y)];
    Body { points, closed: true, radius: Length::ZERO }
}
