//! An edit is a value: elements and their new states. Applying it returns the inverse edit.
//!
//! ```text
//!  drawing ─ apply(edit) ─▶ drawing', inverse        drawing' ─ apply(inverse) ─▶ drawing, edit again
//! ```
//!
//! Time depends on the elements that the edit names and those attached to them, not on the drawing. Copy and
//! paste make drawings and edits of parts.

use super::body::shifted;
use super::{
    Drawing, Entry, FURTHEST, Id, LONGEST_NAME, Layer, MOST_THINGS, NARROWEST, PadShape, Thing,
    WHOLE_TURN_MDEG, WIDEST,
};
use crate::diagnostic::Diagnostic;
use crate::geometry::{Placement, Point};
use crate::units::Length;
use crate::{code, error};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// New states of elements, applied in order.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Edit {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// New state of each element; `None` removes it.
    pub changes: Vec<(Id, Option<Entry>)>,
}

impl Edit {
    pub fn one(id: Id, becomes: Option<Entry>) -> Self {
        Self { name: None, changes: vec![(id, becomes)] }
    }

    pub fn is_empty(&self) -> bool {
        self.name.is_none() && self.changes.is_empty()
    }

    #[must_use]
    pub fn then(mut self, other: Self) -> Self {
        self.name = other.name.or(self.name);
        self.changes.extend(other.changes);
        self
    }
}

impl Drawing {
    /// Applies the edit and returns its inverse. An invalid edit is refused and changes nothing.
    pub fn apply(&mut self, edit: &Edit) -> Result<Edit, Diagnostic> {
        if edit.name.as_ref().is_some_and(|name| name.chars().count() > LONGEST_NAME) {
            return Err(refuse(code!("drawing.long_name"), LONGEST_NAME));
        }
        let mut inverse = Edit { name: None, changes: Vec::with_capacity(edit.changes.len()) };
        if let Some(name) = &edit.name {
            inverse.name = Some(std::mem::replace(&mut self.name, name.clone()));
        }
        for (id, becomes) in &edit.changes {
            inverse.changes.push((*id, self.set(*id, becomes.clone())));
        }
        inverse.changes.reverse();
        if let Err(why) = self.check(edit.changes.iter().map(|(id, _)| *id)) {
            for (id, was) in inverse.changes {
                self.set(id, was);
            }
            if let Some(name) = inverse.name {
                self.name = name;
            }
            return Err(why);
        }
        Ok(inverse)
    }

    /// The elements that an edit affects: those it names, and those attached to named nodes.
    pub fn touched(&self, edit: &Edit) -> BTreeSet<Id> {
        let named = edit.changes.iter().map(|(id, _)| *id);
        let is_node = |id: &Id| !matches!(self.thing(*id), Some(Thing::Group { .. }));
        named.clone().filter(is_node).flat_map(|id| self.hanging(id)).chain(named).collect()
    }

    /// Sets one element without checks and returns its old state.
    fn set(&mut self, id: Id, becomes: Option<Entry>) -> Option<Entry> {
        let place = |entry: Option<&Entry>| match entry?.thing {
            Thing::Node { at } => Some((at, id)),
            _ => None,
        };
        if let Some(was) = place(self.things.get(&id)) {
            self.places.remove(&was);
        }
        self.places.extend(place(becomes.as_ref()));
        let ties = |entry: &Entry| entry.thing.nodes().chain(entry.group).collect::<Vec<Id>>();
        let was = match becomes {
            Some(entry) => {
                let on = ties(&entry);
                let was = self.things.insert(id, entry);
                was.iter().flat_map(ties).for_each(|from| self.untie(from, id));
                on.into_iter().for_each(|on| self.hanging.entry(on).or_default().extend([id]));
                return was;
            }
            None => self.things.remove(&id),
        };
        was.iter().flat_map(ties).for_each(|from| self.untie(from, id));
        was
    }

    fn untie(&mut self, from: Id, id: Id) {
        if let Some(ids) = self.hanging.get_mut(&from) {
            ids.remove(&id);
            if ids.is_empty() {
                self.hanging.remove(&from);
            }
        }
    }

    /// Checks the changed elements and those attached to them.
    fn check(&self, changed: impl Iterator<Item = Id>) -> Result<(), Diagnostic> {
        if self.things.len() > MOST_THINGS {
            return Err(refuse(code!("drawing.too_many"), MOST_THINGS));
        }
        for id in changed {
            match self.things.get(&id) {
                Some(entry) => self.fits(id, entry)?,
                None if self.hanging.contains_key(&id) => {
                    return Err(refuse(code!("drawing.still_needed"), id.0));
                }
                None => {}
            }
            for hanging in self.hanging(id) {
                if let Some(entry) = self.things.get(&hanging) {
                    self.ties_hold(hanging, entry)?;
                }
            }
        }
        Ok(())
    }

    fn fits(&self, id: Id, entry: &Entry) -> Result<(), Diagnostic> {
        match &entry.thing {
            Thing::Node { at } => in_reach(*at)?,
            Thing::Track { from, to, width, .. } => {
                if from == to {
                    return Err(refuse(code!("drawing.no_length"), id.0));
                }
                sized(*width)?;
            }
            Thing::Pad { shape, size, turn_mdeg, layer, .. } => {
                sized(*size)?;
                if *layer == Layer::Edge {
                    return Err(refuse(code!("drawing.pad_on_edge"), id.0));
                }
                if *turn_mdeg != whole_turn(*shape, *turn_mdeg) {
                    return Err(refuse(code!("drawing.turn"), turn_mdeg));
                }
            }
            Thing::Hole { diameter, .. } => sized(*diameter)?,
            Thing::Group { name } => {
                if name.chars().count() > LONGEST_NAME {
                    return Err(refuse(code!("drawing.long_name"), LONGEST_NAME));
                }
            }
            Thing::Imported { file, at, by, turn_mdeg, .. } => {
                if !(0..WHOLE_TURN_MDEG).contains(turn_mdeg) {
                    return Err(refuse(code!("drawing.turn"), turn_mdeg));
                }
                if file.len() > 4 * LONGEST_NAME {
                    return Err(refuse(code!("drawing.long_name"), LONGEST_NAME));
                }
                in_reach(*at)?;
                in_reach(by.unwrap_or_default())?;
            }
        }
        self.ties_hold(id, entry)
    }

    /// Checks that its nodes exist, and that its chain of groups ends at the top level.
    fn ties_hold(&self, id: Id, entry: &Entry) -> Result<(), Diagnostic> {
        for node in entry.thing.nodes() {
            if !matches!(self.thing(node), Some(Thing::Node { .. })) {
                return Err(refuse(code!("drawing.no_node"), node.0));
            }
        }
        let mut above = entry.group;
        for _ in 0..=self.things.len() {
            let Some(group) = above else { return Ok(()) };
            match self.things.get(&group) {
                Some(Entry { thing: Thing::Group { .. }, group }) => above = *group,
                _ => return Err(refuse(code!("drawing.no_group"), group.0)),
            }
        }
        Err(refuse(code!("drawing.group_in_itself"), id.0))
    }
}

/// Equivalent rotation of a pad within its symmetry angle.
pub fn whole_turn(shape: PadShape, turn_mdeg: i32) -> i32 {
    turn_mdeg.rem_euclid(shape.symmetry_mdeg())
}

fn in_reach(at: Point) -> Result<(), Diagnostic> {
    let far = at.x.nm().unsigned_abs().max(at.y.nm().unsigned_abs()) > FURTHEST.nm().unsigned_abs();
    if far { Err(refuse(code!("drawing.too_far"), FURTHEST.mm())) } else { Ok(()) }
}

fn sized(size: Length) -> Result<(), Diagnostic> {
    if (NARROWEST..=WIDEST).contains(&size) {
        return Ok(());
    }
    let wrong = error!("drawing.size", size = size.mm(), ..);
    Err(wrong.with("low", NARROWEST.mm()).with("high", WIDEST.mm()))
}

fn refuse(code: &str, what: impl ToString) -> Diagnostic {
    Diagnostic::error(code).with("what", what.to_string())
}

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
