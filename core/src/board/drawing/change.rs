//! The user's edits of a drawing, each as one [`Edit`].
//!
//! ```text
//!  moved · rotated · mirrored (a placement about a point) · removed · grouped · one element replaced
//! ```

use super::body::shifted;
use super::edit::whole_turn;
use super::{Drawing, Edit, Entry, Id, Layer, PadShape, Thing};
use crate::geometry::{Placement, Point};
use crate::units::Length;
use std::collections::BTreeSet;

/// The end of a track, or the centre of a pad.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TrackEnd {
    Node(Id),
    /// A position: an existing node exactly there, else a new one.
    At(Point),
}

/// An edit under construction, with the ids that it assigns.
struct Draft<'a> {
    drawing: &'a Drawing,
    next: Id,
    edit: Edit,
}

impl<'a> Draft<'a> {
    fn new(drawing: &'a Drawing) -> Self {
        Self { drawing, next: drawing.next_id(), edit: Edit::default() }
    }

    fn add(&mut self, thing: Thing, group: Option<Id>) -> Id {
        let id = self.next;
        self.next = Id(id.0.saturating_add(1));
        self.edit.changes.push((id, Some(Entry { thing, group })));
        id
    }

    fn end(&mut self, end: TrackEnd) -> Id {
        match end {
            TrackEnd::Node(id) => id,
            TrackEnd::At(at) => {
                self.drawing.node_at(at).unwrap_or_else(|| self.add(Thing::Node { at }, None))
            }
        }
    }
}

/// A single node; an empty edit if one exists there.
pub fn node(drawing: &Drawing, at: Point) -> Edit {
    let mut draft = Draft::new(drawing);
    draft.end(TrackEnd::At(at));
    draft.edit
}

/// A track, and the id of the node at its end.
pub fn track(drawing: &Drawing, ends: (TrackEnd, TrackEnd), width: Length, layer: Layer) -> (Edit, Id) {
    let mut draft = Draft::new(drawing);
    let (from, to) = (draft.end(ends.0), draft.end(ends.1));
    draft.add(Thing::Track { from, to, width, layer }, None);
    (draft.edit, to)
}

pub fn pad(
    drawing: &Drawing,
    at: TrackEnd,
    (shape, size): (PadShape, Length),
    drill: Option<Length>,
    layer: Layer,
) -> Edit {
    let mut draft = Draft::new(drawing);
    let node = draft.end(at);
    draft.add(Thing::Pad { node, shape, size, turn_mdeg: 0, layer }, None);
    if let Some(diameter) = drill {
        draft.add(Thing::Hole { node, diameter, plated: true }, None);
    }
    draft.edit
}

pub fn hole(drawing: &Drawing, at: TrackEnd, diameter: Length, plated: bool) -> Edit {
    let mut draft = Draft::new(drawing);
    let node = draft.end(at);
    draft.add(Thing::Hole { node, diameter, plated }, None);
    draft.edit
}

/// Replaces an element in its group.
pub fn put(drawing: &Drawing, id: Id, thing: Thing) -> Edit {
    match drawing.get(id) {
        Some(entry) if entry.thing != thing => Edit::one(id, Some(Entry { thing, group: entry.group })),
        _ => Edit::default(),
    }
}

pub fn renamed(drawing: &Drawing, group: Option<Id>, name: &str) -> Edit {
    let name = name.to_owned();
    match group {
        Some(group) => put(drawing, group, Thing::Group { name }),
        None if drawing.name() == name => Edit::default(),
        None => Edit { name: Some(name), changes: Vec::new() },
    }
}

/// Mirrors, rotates and shifts `ids` about a point, in this order. Other elements on their nodes move with
/// them.
pub fn placed(drawing: &Drawing, ids: &BTreeSet<Id>, placement: Placement, about: Point) -> Edit {
    let back = Point::new(-about.x, -about.y);
    let place = |at: Point| shifted(placement.point(shifted(at, back)), about);
    let mut edit = Edit::default();
    for id in drawing.nodes_of(ids) {
        let (Some(entry), Some(at)) = (drawing.get(id), drawing.at(id)) else { continue };
        let (thing, group) = (Thing::Node { at: place(at) }, entry.group);
        if thing != entry.thing {
            edit.changes.push((id, Some(Entry { thing, group })));
        }
    }
    for id in drawing.leaves(ids) {
        let Some(entry) = drawing.get(id) else { continue };
        let thing = match entry.thing.clone() {
            Thing::Pad { node, shape, size, turn_mdeg, layer } => {
                let turn = if placement.mirror { -turn_mdeg } else { turn_mdeg };
                let turn_mdeg = whole_turn(shape, turn.saturating_add(placement.rotation_mdeg));
                Thing::Pad { node, shape, size, turn_mdeg, layer }
            }
            thing @ Thing::Imported { .. } => thing.placed(placement, place),
            other => other,
        };
        if thing != entry.thing {
            edit.changes.push((id, Some(Entry { thing, group: entry.group })));
        }
    }
    edit
}

pub fn moved(drawing: &Drawing, ids: &BTreeSet<Id>, by: Point) -> Edit {
    placed(drawing, ids, Placement::shifted(by), Point::default())
}

/// Removes `ids`, then unused nodes and empty groups. File objects are taken out of the board; their copies
/// are deleted.
pub fn removed(drawing: &Drawing, ids: &BTreeSet<Id>) -> Edit {
    let mut gone = drawing.leaves(ids);
    // Elements on a removed node are removed too.
    let nodes: Vec<Id> = gone.iter().copied().filter(|id| drawing.at(*id).is_some()).collect();
    gone.extend(nodes.into_iter().flat_map(|node| drawing.hanging(node)));
    let nodes: BTreeSet<Id> =
        gone.iter().filter_map(|id| drawing.thing(*id)).flat_map(Thing::nodes).collect();
    let bare = |node: &Id| drawing.hanging(*node).all(|id| gone.contains(&id));
    let bare: Vec<Id> = nodes.into_iter().filter(bare).collect();
    gone.extend(bare);
    groups_below(drawing, ids, &mut gone);
    let mut edit = emptied(drawing, gone);
    for (id, becomes) in &mut edit.changes {
        *becomes = drawing.thing(*id).and_then(taken_out).map(|thing| Entry { thing, group: None });
    }
    edit
}

/// A file object after removal; `None` for a copy and for drawn elements.
pub(super) fn taken_out(thing: &Thing) -> Option<Thing> {
    match thing {
        Thing::Imported { file, object, at, copy: false, .. } => Some(Thing::Imported {
            file: file.clone(),
            object: *object,
            at: *at,
            by: None,
            turn_mdeg: 0,
            mirror: false,
            copy: false,
        }),
        _ => None,
    }
}

/// Extends `gone` by the groups that become empty, inner groups first.
pub(super) fn emptied(drawing: &Drawing, mut gone: BTreeSet<Id>) -> Edit {
    let mut above: Vec<Id> = gone.iter().filter_map(|id| drawing.get(*id)?.group).collect();
    while let Some(group) = above.pop() {
        if drawing.hanging(group).all(|id| gone.contains(&id)) && gone.insert(group) {
            above.extend(drawing.get(group).and_then(|entry| entry.group));
        }
    }
    Edit { name: None, changes: gone.into_iter().map(|id| (id, None)).collect() }
}

/// Nested groups that are removed as a whole.
fn groups_below(drawing: &Drawing, ids: &BTreeSet<Id>, gone: &mut BTreeSet<Id>) {
    let mut open: Vec<Id> = ids.iter().copied().collect();
    while let Some(id) = open.pop() {
        if matches!(drawing.thing(id), Some(Thing::Group { .. })) {
            gone.insert(id);
            open.extend(drawing.hanging(id));
        }
    }
}

/// Moves `ids` into a new group, inside their common group if they have one. Also returns the id of the new
/// group.
pub fn grouped(drawing: &Drawing, ids: &BTreeSet<Id>, name: &str) -> (Edit, Option<Id>) {
    into_a_group(drawing, entries_of(drawing, ids), name)
}

/// The elements with their entries, including those that the edit adds.
pub(super) fn entries_of(drawing: &Drawing, ids: &BTreeSet<Id>) -> Vec<(Id, Entry)> {
    ids.iter().filter_map(|id| Some((*id, drawing.get(*id)?.clone()))).collect()
}

/// Moves `entries` into a new group; see [`grouped`].
pub(super) fn into_a_group(drawing: &Drawing, entries: Vec<(Id, Entry)>, name: &str) -> (Edit, Option<Id>) {
    let Some((_, first)) = entries.first() else { return (Edit::default(), None) };
    let above = first
        .group
        .filter(|group| entries.iter().all(|(id, entry)| entry.group == Some(*group) && id != group));
    let mut draft = Draft::new(drawing);
    let last = entries.iter().map(|(id, _)| id.0.saturating_add(1)).max().unwrap_or_default();
    draft.next = draft.next.max(Id(last));
    let group = draft.add(Thing::Group { name: name.to_owned() }, above);
    let into = entries.into_iter().map(|(id, entry)| (id, Some(Entry { group: Some(group), ..entry })));
    draft.edit.changes.extend(into);
    (draft.edit, Some(group))
}

/// Dissolves the groups among `ids`; their members keep their positions.
pub fn ungrouped(drawing: &Drawing, ids: &BTreeSet<Id>) -> Edit {
    let mut edit = Edit::default();
    for id in ids {
        let Some(Entry { thing: Thing::Group { .. }, group }) = drawing.get(*id) else { continue };
        // If the outer group is dissolved too, members move further up.
        let mut above = *group;
        while let Some(outer) = above.filter(|outer| ids.contains(outer)) {
            above = drawing.get(outer).and_then(|entry| entry.group);
        }
        let members = drawing.hanging(*id).filter(|member| !is_group_of(drawing, *member, ids));
        let members = members.filter_map(|member| Some((member, drawing.get(member)?)));
        edit.changes
            .extend(members.map(|(member, entry)| (member, Some(Entry { group: above, ..entry.clone() }))));
    }
    let groups = ids.iter().filter(|id| matches!(drawing.thing(**id), Some(Thing::Group { .. })));
    edit.changes.extend(groups.map(|id| (*id, None)));
    edit
}

fn is_group_of(drawing: &Drawing, id: Id, ids: &BTreeSet<Id>) -> bool {
    ids.contains(&id) && matches!(drawing.thing(id), Some(Thing::Group { .. }))
}

pub fn regrouped(drawing: &Drawing, ids: &BTreeSet<Id>, group: Option<Id>) -> Edit {
    into_the_group(entries_of(drawing, ids), group)
}

pub(super) fn into_the_group(entries: Vec<(Id, Entry)>, group: Option<Id>) -> Edit {
    let moved = entries.into_iter().filter(|(id, entry)| entry.group != group && Some(*id) != group);
    let changes = moved.map(|(id, entry)| (id, Some(Entry { group, ..entry }))).collect();
    Edit { name: None, changes }
}
