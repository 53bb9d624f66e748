//! What is under the pointer, in a box, and near enough to snap to.
//!
//! ```text
//!  drawing + imported ─ update(touched) ─▶ bodies by place ─┬─ at(place)  ─▶ what is hit, the smallest first
//!                                                           ├─ within(box) ─▶ what a box takes
//!                                                           └─ snap(place) ─▶ node · middle of a track · grid
//! ```
//!
//! Comes in: a [`Drawing`], what an edit touched, what is imported. Goes out: ids and places. Follows an edit by what it
//! touched, whatever the size of the drawing. Does not know pixels.

use super::over::is_called;
use super::places::Places;
use super::{Body, Drawing, Id, Imported, Layer, Thing};
use crate::geometry::{Bounds, Point};
use crate::units::Length;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Something that can be caught.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Catch {
    /// A thing of the drawing.
    Drawn(Id),
    /// Something of an imported file, by its place in the list of those.
    Imported(u32),
}

/// A place to go to, and why.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Snap {
    /// Where the pointer is.
    Free(Point),
    /// On the grid.
    Grid(Point),
    /// At a node: the end of a track, the middle of a pad.
    Node(Point, Id),
    /// At the middle of a track.
    Middle(Point, Id),
    /// At the middle of an imported pad or hole, or the end of an imported track.
    Imported(Point, u32),
}

impl Snap {
    /// The place.
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

/// The rank of a node by which nothing but tracks holds: behind holes and pads, before tracks.
const BARE_NODE: u8 = 2;

/// The objects of a file, by their places in the list of what is imported.
#[derive(Clone, Debug, Default)]
struct OfFile {
    by_number: BTreeMap<u32, u32>,
    /// The first that lies at a place.
    by_place: BTreeMap<Point, u32>,
}

/// Where everything is.
#[derive(Clone, Debug, Default)]
pub struct Finder {
    places: Places<Catch>,
    bodies: BTreeMap<Catch, Body>,
    imported: Arc<Vec<Imported>>,
    /// What is imported, by its file.
    files: BTreeMap<String, OfFile>,
    /// Which imported thing a thing of the drawing speaks of, or is a copy of.
    spoken_of: BTreeMap<Id, u32>,
    /// And the other way round, without copies.
    spoken_by: BTreeMap<u32, Id>,
}

impl Finder {
    /// Everything of `drawing` and of what is imported.
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

    /// What is imported, in order.
    pub fn imported(&self) -> &Arc<Vec<Imported>> {
        &self.imported
    }

    /// The place in that list of the object of a file that a thing speaks of, or is a copy of: found as the board finds it, by its
    /// number where it lies where the thing says, else the first of its file that does. None where none does, as the file is
    /// another one by now.
    pub fn imported_of(&self, thing: &Thing) -> Option<u32> {
        let Thing::Imported { file, object, at, .. } = thing else { return None };
        let called = || self.files.iter().find(|(name, _)| is_called(name, file)).map(|(_, own)| own);
        let own = self.files.get(file).or_else(called)?;
        let lies_there = |of: &u32| self.imported.get(*of as usize).is_some_and(|one| one.at == *at);
        own.by_number.get(object).copied().filter(lies_there).or_else(|| own.by_place.get(at).copied())
    }

    /// The thing of the drawing that says where an imported one is now; none where it is as its file says.
    pub fn said_of(&self, imported: u32) -> Option<Id> {
        self.spoken_by.get(&imported).copied()
    }

    /// As what a thing of the drawing is caught: as an object of a file where it says where that is.
    pub fn catch_of(&self, id: Id, thing: &Thing) -> Catch {
        let of = match thing {
            Thing::Imported { copy: false, .. } => self.imported_of(thing),
            _ => None,
        };
        of.map_or(Catch::Drawn(id), Catch::Imported)
    }

    /// The object of a file that was caught, or of which that is a copy.
    pub fn object_of(&self, catch: Catch) -> Option<u32> {
        match catch {
            Catch::Imported(of) => Some(of),
            Catch::Drawn(id) => self.spoken_of.get(&id).copied(),
        }
    }

    /// Where an object of a file is now, or its copy; none where it was taken out.
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

    /// The body of what was caught, where it is now; none where it was taken out.
    pub fn body(&self, catch: Catch) -> Option<&Body> {
        self.bodies.get(&catch)
    }

    /// Follows the drawing: only these were touched. Gives all that has another body now.
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

    /// Where its copper is; none for holes and nodes.
    pub fn layer(&self, drawing: &Drawing, catch: Catch) -> Option<Layer> {
        let own = if let Catch::Drawn(id) = catch { drawing.thing(id)?.layer() } else { None };
        own.or_else(|| self.imported.get(self.object_of(catch)? as usize)?.layer)
    }

    /// What has a point in common with `bounds`, by their boxes.
    pub(super) fn meeting(&self, bounds: Bounds) -> BTreeSet<Catch> {
        self.places.meeting(bounds)
    }

    /// What lies within `reach` of a place: what is right there first, holes before pads before tracks, of equal ones the
    /// latest. A node by which nothing but tracks holds comes before these wherever it is within reach, the nearest first.
    pub fn at(&self, drawing: &Drawing, at: Point, reach: Length) -> Vec<Catch> {
        let near = self.meeting(Bounds::of(at).grown(reach)).into_iter();
        let mut hit: Vec<((bool, u8, Length), Catch)> = near
            .filter_map(|catch| {
                let distance = self.bodies.get(&catch)?.distance_mm(at);
                if distance > reach.mm() {
                    return None;
                }
                let rank = self.rank(drawing, catch);
                // It has no area: nobody presses right there.
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

    /// What a box takes: what lies in it whole, or what it meets where `crossing`.
    pub fn within(&self, bounds: Bounds, crossing: bool) -> Vec<Catch> {
        let inside = |catch: &Catch| {
            let Some(body) = self.bodies.get(catch) else { return false };
            let own = body.bounds();
            let whole = bounds.contains(own.min) && bounds.contains(own.max);
            whole || crossing && body.gap_mm(&of_box(bounds)) <= 0.0
        };
        self.meeting(bounds).into_iter().filter(inside).collect()
    }

    /// Where a pointer at `at` goes: to the nearest node or end within `reach`, else to the middle of a track, else onto the
    /// grid. What is in `without` does not draw it.
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

/// The multiple of `grid` that is nearest.
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
