//! A selection of drawn elements and file objects, and its operations, each as one [`Edit`].
//!
//! ```text
//!  elements, groups ─┐
//!                    ├─▶ moved · rotated · mirrored · aligned · array · copied · removed
//!  file objects ─────┘   the first edit of a file object adds an element that refers to it
//! ```

use super::body::shifted;
use super::change::{self, emptied, entries_of, into_a_group, into_the_group, taken_out};
use super::{Body, Catch, Drawing, Edit, Entry, Finder, Id, Imported, Thing, edit};
use crate::geometry::{Bounds, Placement, Point};
use crate::units::Length;
use std::collections::{BTreeMap, BTreeSet};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sides {
    /// Left or bottom.
    Low,
    Middle,
    /// Right or top.
    High,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Align {
    /// In X, else in Y.
    pub x: bool,
    pub sides: Sides,
}

#[derive(Clone, Debug)]
pub struct Selection<'a> {
    drawing: &'a Drawing,
    finder: &'a Finder,
    ids: BTreeSet<Id>,
    /// File objects by index, without those in groups of `ids`.
    objects: Vec<u32>,
}

impl<'a> Selection<'a> {
    /// Drops removed file objects.
    pub fn new(drawing: &'a Drawing, finder: &'a Finder, chosen: &BTreeSet<Catch>) -> Self {
        let id = |catch: &Catch| if let Catch::Drawn(id) = catch { Some(*id) } else { None };
        let of = |catch: &Catch| if let Catch::Imported(of) = catch { Some(*of) } else { None };
        let ids: BTreeSet<Id> = chosen.iter().filter_map(id).collect();
        let leaves = drawing.leaves(&ids);
        let inside = |of: u32| finder.said_of(of).is_some_and(|id| leaves.contains(&id));
        let there = |of: &u32| finder.body(Catch::Imported(*of)).is_some() && !inside(*of);
        let objects = chosen.iter().filter_map(of).filter(there).collect();
        Self { drawing, finder, ids, objects }
    }

    fn part(&self, ids: BTreeSet<Id>, objects: Vec<u32>) -> Self {
        Self { drawing: self.drawing, finder: self.finder, ids, objects }
    }

    /// Its elements and objects one by one; a group counts as one.
    fn parts(&self) -> impl Iterator<Item = Self> + '_ {
        let drawn = self.ids.iter().map(|id| self.part(BTreeSet::from([*id]), Vec::new()));
        drawn.chain(self.objects.iter().map(|of| self.part(BTreeSet::new(), vec![*of])))
    }

    /// Elements for its file objects: existing ones, or new ones with fresh ids.
    fn entries(&self) -> Vec<(Id, Entry)> {
        let mut next = self.drawing.next_id();
        let entry = |of: &u32| {
            let one = self.finder.imported().get(*of as usize)?;
            // During a drag the finder may be ahead of the drawing.
            let said = self.finder.said_of(*of).and_then(|id| Some((id, self.drawing.get(id)?.clone())));
            let said = said.filter(|(_, entry)| self.finder.imported_of(&entry.thing) == Some(*of));
            Some(said.unwrap_or_else(|| {
                let id = next;
                next = Id(next.0.saturating_add(1));
                (id, Entry { thing: one.thing(), group: None })
            }))
        };
        self.objects.iter().filter_map(entry).collect()
    }

    /// Replaces each of its file objects by the result of `becomes`.
    fn objects_anew(&self, becomes: impl Fn(Thing) -> Option<Thing>) -> Edit {
        let anew = |(id, entry): (Id, Entry)| {
            let thing = becomes(entry.thing.clone())?;
            (thing != entry.thing).then_some((id, Some(Entry { thing, group: entry.group })))
        };
        Edit { name: None, changes: self.entries().into_iter().filter_map(anew).collect() }
    }

    /// The hit for an element; for a file object, the object.
    fn catch_of(&self, id: Id) -> Catch {
        self.drawing.thing(id).map_or(Catch::Drawn(id), |thing| self.finder.catch_of(id, thing))
    }

    /// All hits in it, with groups expanded.
    pub fn leaves(&self) -> impl Iterator<Item = Catch> + '_ {
        let drawn = self.drawing.leaves(&self.ids).into_iter().map(|id| self.catch_of(id));
        drawn.chain(self.objects.iter().copied().map(Catch::Imported))
    }

    pub fn bounds(&self) -> Option<Bounds> {
        let boxes = self.leaves().filter_map(|catch| self.finder.body(catch)).map(Body::bounds);
        boxes.reduce(|all, bounds| all.with(bounds.min).with(bounds.max))
    }

    /// The position of its only node, pad or hole. `None` if there are several, and for tracks and areas.
    fn single_place(&self) -> Option<Point> {
        let mut places: BTreeSet<Point> =
            self.drawing.nodes_of(&self.ids).into_iter().filter_map(|node| self.drawing.at(node)).collect();
        for catch in self.leaves() {
            if let Some(of) = self.finder.object_of(catch) {
                let one = self.finder.imported().get(of as usize)?;
                places.insert(self.finder.place_of(self.drawing, catch).filter(|_| one.is_pad)?);
            }
        }
        places.first().copied().filter(|_| places.len() == 1)
    }

    /// Centre of rotation: its only node, pad or hole, else the centre of its bounds.
    pub fn middle(&self) -> Option<Point> {
        self.single_place().or_else(|| {
            let all = self.bounds()?;
            Some(Point::new(middle(all.min.x, all.max.x), middle(all.min.y, all.max.y)))
        })
    }

    /// Mirrors, rotates and shifts about a point, in this order.
    pub fn placed(&self, placement: Placement, about: Point) -> Edit {
        let back = Point::new(-about.x, -about.y);
        let place = |at: Point| shifted(placement.point(shifted(at, back)), about);
        let edit = change::placed(self.drawing, &self.ids, placement, about);
        edit.then(self.objects_anew(|thing| Some(thing.placed(placement, place))))
    }

    pub fn moved(&self, by: Point) -> Edit {
        self.placed(Placement::shifted(by), Point::default())
    }

    /// Mirrors (left to right) if wanted, then rotates about its centre, in thousandths of a degree.
    pub fn turned(&self, rotation_mdeg: i32, mirror: bool) -> Edit {
        let placement = Placement { mirror, rotation_mdeg, shift: Point::default() };
        self.middle().map(|middle| self.placed(placement, middle)).unwrap_or_default()
    }

    /// Rotates each file object about its own centre to this angle relative to its original.
    pub fn turned_to(&self, turn_mdeg: i32) -> Edit {
        let mut edit = Edit::default();
        let drawn = self.drawing.leaves(&self.ids).into_iter();
        let drawn = drawn.filter(|id| self.finder.object_of(self.catch_of(*id)).is_some());
        let drawn = drawn.map(|id| self.part(BTreeSet::from([id]), Vec::new()));
        let objects = self.objects.iter().zip(self.entries());
        for part in drawn {
            let now = part.ids.first().and_then(|id| self.drawing.thing(*id)?.placement());
            edit = edit.then(part.turned(turn_mdeg - now.unwrap_or_default().rotation_mdeg, false));
        }
        for (of, (id, entry)) in objects {
            let part = self.part(BTreeSet::new(), vec![*of]);
            let Some(now) = entry.thing.placement() else { continue };
            let turned = part.turned(turn_mdeg - now.rotation_mdeg, false);
            // Each part numbers new elements from the same id: use the id assigned here.
            edit.changes.extend(turned.changes.into_iter().map(|(_, becomes)| (id, becomes)));
        }
        edit
    }

    /// Removes it, with unused nodes and empty groups.
    pub fn removed(&self) -> Edit {
        change::removed(self.drawing, &self.ids).then(self.objects_anew(|thing| taken_out(&thing)))
    }

    fn members(&self) -> Vec<(Id, Entry)> {
        let mut members = entries_of(self.drawing, &self.ids);
        members.extend(self.entries());
        members
    }

    /// Moves it into a new group, inside its common group if there is one. Also returns the id of the group.
    /// A file object gets an element that leaves it unchanged.
    pub fn grouped(&self, name: &str) -> (Edit, Option<Id>) {
        into_a_group(self.drawing, self.members(), name)
    }

    pub fn regrouped(&self, group: Option<Id>) -> Edit {
        into_the_group(self.members(), group)
    }

    /// Aligns its parts; each group counts as one. An empty edit for a single part.
    pub fn aligned(&self, align: Align) -> Edit {
        let several = self.ids.len() + self.objects.len() > 1;
        let Some(all) = self.bounds().filter(|_| several) else { return Edit::default() };
        let wanted = align.line(all);
        let mut changes: BTreeMap<Id, Entry> = BTreeMap::new();
        let mut objects = self.entries().into_iter();
        for part in self.parts() {
            let Some(bounds) = part.bounds() else { continue };
            let by = wanted - align.line(bounds);
            let by = if align.x { Point::new(by, Length::ZERO) } else { Point::new(Length::ZERO, by) };
            let mut own: Vec<(Id, Entry)> = Vec::new();
            for id in part.drawing.nodes_of(&part.ids).into_iter().chain(part.drawing.leaves(&part.ids)) {
                own.extend(part.drawing.get(id).map(|entry| (id, entry.clone())));
            }
            own.extend(part.objects.iter().filter_map(|_| objects.next()));
            for (id, Entry { thing, group }) in own {
                let thing = match thing {
                    Thing::Node { at } => Thing::Node { at: shifted(at, by) },
                    object => object.placed(Placement::shifted(by), |at| shifted(at, by)),
                };
                // A node shared by two parts moves with the first.
                changes.entry(id).or_insert(Entry { thing, group });
            }
        }
        let was: BTreeMap<Id, Entry> = self.entries().into_iter().collect();
        let anew = |id: &Id, entry: &Entry| was.get(id).or(self.drawing.get(*id)) != Some(entry);
        let changes = changes.into_iter().filter(|(id, entry)| anew(id, entry));
        Edit { name: None, changes: changes.map(|(id, entry)| (id, Some(entry))).collect() }
    }

    /// Copies in columns and rows; the original is the first.
    pub fn array(&self, columns: u32, rows: u32, step: Point) -> Edit {
        let copied = self.copied();
        let mut edit = Edit::default();
        let mut next = self.drawing.next_id();
        for column in 0..columns {
            for row in (0..rows).filter(|row| column + row > 0) {
                if edit.changes.len() > super::MOST_THINGS {
                    return edit;
                }
                let by = Point::new(step.x * i64::from(column), step.y * i64::from(row));
                let (pasted, _) = edit::pasted_from(next, &copied, by);
                next = Id(next.0.saturating_add(pasted.changes.len() as u32));
                edit = edit.then(pasted);
            }
        }
        edit
    }

    /// The selection as a drawing, with its nodes and groups. File objects become copies.
    pub fn copied(&self) -> Drawing {
        let mut copy = edit::copied(self.drawing, &self.ids);
        let objects = self.entries().into_iter().filter_map(|(_, entry)| edit::copy_of(entry.thing));
        let fresh = (copy.next_id().0..).map(Id);
        let changes = fresh.zip(objects).map(|(id, thing)| (id, Some(Entry { thing, group: None })));
        let edit = Edit { name: None, changes: changes.collect() };
        // Can't fail: all references are inside.
        let _ = copy.apply(&edit);
        copy
    }
}

/// Restores file objects to their originals: the selected ones, or all if nothing is selected. Their elements
/// are deleted, except members of groups. Copies stay.
pub fn put_back(drawing: &Drawing, finder: &Finder, chosen: &BTreeSet<Catch>) -> Edit {
    let drawn = chosen.iter().filter_map(|catch| if let Catch::Drawn(id) = catch { Some(*id) } else { None });
    let leaves = drawing.leaves(&drawn.collect());
    let wanted = |id: Id, thing: &Thing| leaves.contains(&id) || chosen.contains(&finder.catch_of(id, thing));
    let own = drawing.things().filter(|(id, entry)| {
        let own = matches!(entry.thing, Thing::Imported { copy: false, .. });
        own && (chosen.is_empty() || wanted(*id, &entry.thing))
    });
    let (members, alone): (Vec<_>, Vec<_>) = own.partition(|(_, entry)| entry.group.is_some());
    let mut edit = emptied(drawing, alone.into_iter().map(|(id, _)| id).collect());
    for (id, Entry { thing, .. }) in members {
        edit = edit.then(change::put(drawing, id, as_in_its_file(thing)));
    }
    edit
}

fn as_in_its_file(thing: &Thing) -> Thing {
    match thing {
        Thing::Imported { file, object, at, copy, .. } => Thing::Imported {
            file: file.clone(),
            object: *object,
            at: *at,
            by: Some(Point::default()),
            turn_mdeg: 0,
            mirror: false,
            copy: *copy,
        },
        other => other.clone(),
    }
}

impl Align {
    fn line(self, bounds: Bounds) -> Length {
        let (low, high) = if self.x { (bounds.min.x, bounds.max.x) } else { (bounds.min.y, bounds.max.y) };
        match self.sides {
            Sides::Low => low,
            Sides::Middle => middle(low, high),
            Sides::High => high,
        }
    }
}

impl Imported {
    fn thing(&self) -> Thing {
        Thing::Imported {
            file: self.file.clone(),
            object: self.object,
            at: self.at,
            by: Some(Point::default()),
            turn_mdeg: 0,
            mirror: false,
            copy: false,
        }
    }
}

fn middle(low: Length, high: Length) -> Length {
    Length::from_nm((low.nm() + high.nm()).div_euclid(2))
}
