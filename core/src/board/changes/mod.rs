//! Differences between two exports of one board.
//!
//! ```text
//!   before ─┐    ┌─ shift         the whole board moved: reported once, then ignored
//!           ├──▶ ├─ holes, slots  added · removed · moved · resized · plating changed
//!   now ────┘    ├─ copper        added and removed areas
//!                ├─ outline       bounds before and now
//!                └─ nets          added · removed · renamed
//! ```
//!
//! Rounding in files is no change: positions and sizes within 5 µm, copper thinner than 10 µm.

mod pairs;
#[cfg(test)]
mod tests;

use super::{Board, Copper, Face, Hole, Slot};
use crate::geometry::{
    Bounds, CombineRule, Index, Island, Placement, Point, Region, area_mm2, combine, island_area_mm2,
};
use pairs::{SAME, Thing, found, near, pairs};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

const THIN_MM: f64 = 0.01;
const MOST_NAMES: usize = 6;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fate {
    Added,
    Gone,
    Moved,
    Resized,
    Replated,
}

/// A changed hole or slot. Positions are those of the new files.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Changed<T> {
    pub fate: Fate,
    /// State before, shifted with the whole board.
    pub before: Option<T>,
    pub now: Option<T>,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChangedCopper {
    pub face: Face,
    pub added: Region,
    pub gone: Region,
    pub added_mm2: f64,
    pub gone_mm2: f64,
    /// Number of islands before and now.
    pub islands: [u32; 2],
}

/// Named nets, if the files have names.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ChangedNets {
    pub added: Vec<String>,
    pub gone: Vec<String>,
    /// Before and now: the same copper under another name.
    pub renamed: Vec<(String, String)>,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BoardChanges {
    /// Shift of the whole board.
    pub shift: Point,
    pub same: u32,
    pub holes: Vec<Changed<Hole>>,
    pub slots: Vec<Changed<Slot>>,
    pub copper: Vec<ChangedCopper>,
    /// Bounds of a changed outline, before (shifted) and now.
    pub outline: Option<[Option<Bounds>; 2]>,
    pub nets: ChangedNets,
}

pub fn changes(before: &Board, now: &Board) -> BoardChanges {
    let shift = shift(before, now);
    let moved_along;
    let before = if shift == Point::default() {
        before
    } else {
        moved_along = before.placed(&Placement::shifted(shift));
        &moved_along
    };
    let (holes, same_holes) = features(&before.holes, &now.holes);
    let (slots, same_slots) = features(&before.slots, &now.slots);
    let faces = [Face::Top, Face::Bottom];
    BoardChanges {
        shift,
        same: same_holes + same_slots,
        holes,
        slots,
        copper: faces.into_iter().filter_map(|face| copper(before, now, face)).collect(),
        outline: outline(before, now),
        nets: nets(before, now),
    }
}

impl BoardChanges {
    pub fn is_none(&self) -> bool {
        *self == Self { same: self.same, ..Self::default() }
    }

    /// True if the files may be of another board: fewer than half of the holes and slots are still there.
    pub fn may_be_another(&self) -> bool {
        let stayed = |fate: Fate| matches!(fate, Fate::Moved | Fate::Resized | Fate::Replated);
        let fates = || self.holes.iter().map(|hole| hole.fate).chain(self.slots.iter().map(|slot| slot.fate));
        let of_before = self.same as usize + fates().filter(|fate| *fate != Fate::Added).count();
        let kept = self.same as usize + fates().filter(|fate| stayed(*fate)).count();
        2 * kept < of_before
    }

    /// The changes as lines: keys of the locale tables with their arguments.
    pub fn lines(&self) -> Vec<ChangeLine> {
        let mut lines = Vec::new();
        if self.shift != Point::default() {
            lines.push(line("changes.shift", &[("x", mm(self.shift.x.mm())), ("y", mm(self.shift.y.mm()))]));
        }
        let of = |fate: Fate| {
            let holes = self.holes.iter().filter(|hole| hole.fate == fate).count();
            (holes, self.slots.iter().filter(|slot| slot.fate == fate).count())
        };
        for (fate, holes_key, slots_key) in FATES {
            let (holes, slots) = of(fate);
            for (count, key) in [(holes, holes_key), (slots, slots_key)] {
                if count > 0 {
                    lines.push(line(key, &[("count", count.to_string())]));
                }
            }
        }
        for side in &self.copper {
            let key = match side.face {
                Face::Top => "changes.copper_top",
                Face::Bottom => "changes.copper_bottom",
            };
            let [before, now] = side.islands.map(|count| count.to_string());
            let areas = [("added", mm(side.added_mm2)), ("gone", mm(side.gone_mm2))];
            lines.push(line(key, &[areas.as_slice(), &[("before", before), ("now", now)]].concat()));
        }
        if let Some([before, now]) = &self.outline {
            lines.push(line("changes.outline", &[("before", size(*before)), ("now", size(*now))]));
        }
        let renamed: Vec<String> =
            self.nets.renamed.iter().map(|(before, now)| format!("{before} → {now}")).collect();
        let nets = [
            ("changes.nets_added", &self.nets.added),
            ("changes.nets_gone", &self.nets.gone),
            ("changes.nets_renamed", &renamed),
        ];
        for (key, names) in nets.into_iter().filter(|(_, names)| !names.is_empty()) {
            let more = if names.len() > MOST_NAMES { ", …" } else { "" };
            let said = names.iter().take(MOST_NAMES).map(String::as_str).collect::<Vec<_>>().join(", ");
            lines.push(line(key, &[("count", names.len().to_string()), ("names", said + more)]));
        }
        lines
    }
}

/// A line for people: a key of the locale tables, and the arguments of its message by name.
pub type ChangeLine = (&'static str, Vec<(&'static str, String)>);

/// Message keys of holes and slots for each kind of change.
const FATES: [(Fate, &str, &str); 5] = [
    (Fate::Added, "changes.holes_added", "changes.slots_added"),
    (Fate::Gone, "changes.holes_gone", "changes.slots_gone"),
    (Fate::Moved, "changes.holes_moved", "changes.slots_moved"),
    (Fate::Resized, "changes.holes_resized", "changes.slots_resized"),
    (Fate::Replated, "changes.holes_replated", "changes.slots_replated"),
];

fn line(key: &'static str, args: &[(&'static str, String)]) -> ChangeLine {
    (key, args.to_vec())
}

fn mm(value: f64) -> String {
    format!("{value:.3}")
}

fn size(bounds: Option<Bounds>) -> String {
    let size = bounds.map(|bounds| (bounds.max.x - bounds.min.x, bounds.max.y - bounds.min.y));
    size.map_or_else(|| "–".to_owned(), |(width, height)| format!("{} × {}", mm(width.mm()), mm(height.mm())))
}

/// Common view of holes and slots.
trait Feature: Clone {
    fn thing(&self) -> Thing;
    fn plated(&self) -> Option<bool>;
}

impl Feature for Hole {
    fn thing(&self) -> Thing {
        Thing { at: self.at, shape: Vec::new(), size: self.diameter }
    }
    fn plated(&self) -> Option<bool> {
        self.plated
    }
}

impl Feature for Slot {
    /// A slot may start at either end.
    fn thing(&self) -> Thing {
        let mut path = self.path.clone();
        if path.last() < path.first() {
            path.reverse();
        }
        let at = path.first().copied().unwrap_or_default();
        let shape = path.iter().skip(1).map(|to| Point::new(to.x - at.x, to.y - at.y)).collect();
        Thing { at, shape, size: self.width }
    }
    fn plated(&self) -> Option<bool> {
        self.plated
    }
}

fn things<T: Feature>(features: &[T]) -> Vec<Thing> {
    features.iter().map(Feature::thing).collect()
}

/// Changed features, and the number of unchanged ones.
fn features<T: Feature>(before: &[T], now: &[T]) -> (Vec<Changed<T>>, u32) {
    let (old, new) = (things(before), things(now));
    let pairs = pairs(&old, &new);
    let (mut changed, mut same) = (Vec::new(), 0);
    for &(from, to) in &pairs {
        let otherwise = matches!((before[from].plated(), now[to].plated()), (Some(a), Some(b)) if a != b);
        let fate = if !near(old[from].at, new[to].at) {
            Fate::Moved
        } else if !old[from].same_size(&new[to]) {
            Fate::Resized
        } else if otherwise {
            Fate::Replated
        } else {
            same += 1;
            continue;
        };
        changed.push(Changed { fate, before: Some(before[from].clone()), now: Some(now[to].clone()) });
    }
    let stayed: BTreeSet<usize> = pairs.iter().map(|(from, _)| *from).collect();
    let known: BTreeSet<usize> = pairs.iter().map(|(_, to)| *to).collect();
    let gone = before.iter().enumerate().filter(|(number, _)| !stayed.contains(number));
    changed.extend(gone.map(|(_, one)| Changed { fate: Fate::Gone, before: Some(one.clone()), now: None }));
    let added = now.iter().enumerate().filter(|(number, _)| !known.contains(number));
    changed.extend(added.map(|(_, one)| Changed { fate: Fate::Added, before: None, now: Some(one.clone()) }));
    changed.sort_by_key(|one| one.fate);
    (changed, same)
}

/// Shift of the whole board: a shift between corresponding corners that matches most features, at least half
/// of them, and more than no shift.
fn shift(before: &Board, now: &Board) -> Point {
    let corners = |board: &Board| -> Vec<Option<Bounds>> {
        let copper = board.copper.iter().filter_map(|copper| copper.region.bounds());
        let copper = copper.reduce(|all, next| all.with(next.min).with(next.max));
        vec![board.outline.bounds(), board.bounds(), copper]
    };
    let (from, to) = (corners(before), corners(now));
    let all = |board: &Board, corners: &[Option<Bounds>]| {
        let corner = |at: Point| Thing { at, shape: Vec::new(), size: None };
        let corners = corners.iter().flatten().flat_map(|bounds| [corner(bounds.min), corner(bounds.max)]);
        [things(&board.holes), things(&board.slots), corners.collect()].concat()
    };
    let (old, new) = (all(before, &from), all(now, &to));
    let offsets = from.iter().zip(&to).filter_map(|(from, to)| from.zip(*to)).flat_map(|(from, to)| {
        [(from.min, to.min), (from.max, to.max)].map(|(a, b)| Point::new(b.x - a.x, b.y - a.y))
    });
    let stays = found(&old, &new, Point::default());
    let offsets: BTreeSet<Point> = offsets.filter(|way| !near(*way, Point::default())).collect();
    let best = offsets.into_iter().map(|way| (found(&old, &new, way), way)).max_by_key(|(count, _)| *count);
    match best {
        Some((count, way)) if count > stays && 2 * count >= old.len() => way,
        _ => Point::default(),
    }
}

/// The parts of `first` that are not in `second`, without slivers from rounding.
fn less(first: &Region, second: &Region) -> Region {
    let mut rest = combine(first, second, CombineRule::Difference);
    let thin = |island: &Island| {
        let around: f64 = island.paths().map(|path| path.length_mm()).sum();
        2.0 * island_area_mm2(island) < THIN_MM * around
    };
    rest.islands.retain(|island| !thin(island));
    rest
}

fn of_face(board: &Board, face: Face) -> Option<&Copper> {
    board.copper.iter().find(|copper| copper.face == face)
}

fn copper(before: &Board, now: &Board, face: Face) -> Option<ChangedCopper> {
    let none = Region::default();
    let (old, new) = (of_face(before, face), of_face(now, face));
    let (old, new) = (old.map_or(&none, |copper| &copper.region), new.map_or(&none, |copper| &copper.region));
    let islands = [old.islands.len() as u32, new.islands.len() as u32];
    if old == new {
        return None;
    }
    let (added, gone) = (less(new, old), less(old, new));
    let (added_mm2, gone_mm2) = (area_mm2(&added), area_mm2(&gone));
    let changed = !added.is_empty() || !gone.is_empty() || islands[0] != islands[1];
    changed.then_some(ChangedCopper { face, added, gone, added_mm2, gone_mm2, islands })
}

fn outline(before: &Board, now: &Board) -> Option<[Option<Bounds>; 2]> {
    let (old, new) = (&before.outline, &now.outline);
    let changed = old != new && !(less(old, new).is_empty() && less(new, old).is_empty());
    changed.then(|| [old.bounds(), new.bounds()])
}

/// Names of nets, each with a position on its copper.
fn named(board: &Board) -> BTreeMap<&str, (Face, Point)> {
    let mut named = BTreeMap::new();
    for copper in &board.copper {
        for (island, net) in copper.region.islands.iter().zip(&copper.nets) {
            if let Some(net) = net {
                named.entry(net.as_str()).or_insert((copper.face, island.outer.start));
            }
        }
    }
    named
}

fn nets(before: &Board, now: &Board) -> ChangedNets {
    let (old, new) = (named(before), named(now));
    let mut nets = ChangedNets::default();
    let mut added: BTreeSet<&str> = new.keys().filter(|name| !old.contains_key(*name)).copied().collect();
    let mut indices: BTreeMap<Face, Index> = BTreeMap::new();
    for (name, (face, at)) in old.iter().filter(|(name, _)| !new.contains_key(*name)) {
        let there = of_face(now, *face).filter(|_| !added.is_empty()).and_then(|copper| {
            let index = indices.entry(*face).or_insert_with(|| Index::of(&copper.region));
            let island = index.nearest(*at, SAME)?.edge.island;
            copper.nets.get(island as usize)?.as_deref()
        });
        match there.filter(|other| added.remove(other)) {
            Some(other) => nets.renamed.push(((*name).to_owned(), other.to_owned())),
            None => nets.gone.push((*name).to_owned()),
        }
    }
    nets.added = added.into_iter().map(str::to_owned).collect();
    nets
}
