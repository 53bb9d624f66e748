//! Copy and paste of parts of a drawing.

use super::body::shifted;
use super::{Drawing, Edit, Entry, Id, Thing};
use crate::geometry::{Placement, Point};
use std::collections::{BTreeMap, BTreeSet};

/// Copies `ids` with their nodes and the groups among them. File objects become copies.
pub(super) fn copied(drawing: &Drawing, ids: &BTreeSet<Id>) -> Drawing {
    let mut wanted: BTreeSet<Id> = drawing.leaves(ids);
    wanted.extend(drawing.nodes_of(ids));
    let mut open: Vec<Id> = ids.iter().copied().collect();
    while let Some(id) = open.pop() {
        if matches!(drawing.thing(id), Some(Thing::Group { .. })) && wanted.insert(id) {
            open.extend(drawing.hanging(id));
        }
    }
    let entries = wanted.iter().filter_map(|id| Some((*id, drawing.get(*id)?.clone())));
    let own = entries.filter_map(|(id, entry)| Some((id, Entry { thing: copy_of(entry.thing)?, ..entry })));
    let inside = |entry: Entry| Entry { group: entry.group.filter(|group| wanted.contains(group)), ..entry };
    let changes = own.map(|(id, entry)| (id, Some(inside(entry)))).collect();
    let mut copy = Drawing::default();
    // Can't fail: every reference of a copied element was copied as well.
    let _ = copy.apply(&Edit { name: None, changes });
    copy
}

/// A copy of an element; `None` for a removed file object.
pub(super) fn copy_of(thing: Thing) -> Option<Thing> {
    match thing {
        Thing::Imported { by: None, .. } => None,
        Thing::Imported { file, object, at, by, turn_mdeg, mirror, .. } => {
            Some(Thing::Imported { file, object, at, by, turn_mdeg, mirror, copy: true })
        }
        other => Some(other),
    }
}

/// The edit that adds `copy` to `drawing`, shifted, and the ids at its top level.
pub fn pasted(drawing: &Drawing, copy: &Drawing, by: Point) -> (Edit, BTreeSet<Id>) {
    pasted_from(drawing.next_id(), copy, by)
}

/// As [`pasted`], with ids from `next` on.
pub(super) fn pasted_from(next: Id, copy: &Drawing, by: Point) -> (Edit, BTreeSet<Id>) {
    let fresh: BTreeMap<Id, Id> =
        copy.things().zip(next.0..).map(|((id, _), fresh)| (id, Id(fresh))).collect();
    let new = |id: Id| fresh.get(&id).copied().unwrap_or(id);
    let mut top = BTreeSet::new();
    let changes = copy.things().map(|(id, entry)| {
        let thing = match entry.thing.clone() {
            Thing::Node { at } => Thing::Node { at: shifted(at, by) },
            Thing::Track { from, to, width, layer } => {
                Thing::Track { from: new(from), to: new(to), width, layer }
            }
            Thing::Pad { node, shape, size, turn_mdeg, layer } => {
                Thing::Pad { node: new(node), shape, size, turn_mdeg, layer }
            }
            Thing::Hole { node, diameter, plated } => Thing::Hole { node: new(node), diameter, plated },
            thing @ Thing::Imported { .. } => thing.placed(Placement::shifted(by), |at| shifted(at, by)),
            group @ Thing::Group { .. } => group,
        };
        if entry.group.is_none() && (copy.at(id).is_none() || copy.hanging(id).next().is_none()) {
            top.insert(new(id));
        }
        (new(id), Some(Entry { thing, group: entry.group.map(new) }))
    });
    (Edit { name: None, changes: changes.collect() }, top)
}
