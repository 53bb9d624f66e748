//! The tree of a drawing as rows: groups with their members to any depth, then tracks, pads, holes, nodes.
//!
//! ```text
//!  changed ─▶ Tree: things by (group, rank, id) ─▶ rows: the top level, and members of open groups
//! ```
//!
//! Unchanged rows keep their `Arc`.

use super::Editor;
use annulus_core::board::drawing::{Catch, Drawing, Finder, Id, Thing};
use annulus_core::geometry::Point;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Item {
    pub id: Id,
    /// Selected by a press on the row: for an object of a file, the object itself.
    pub catch: Catch,
    /// None at the top level.
    pub group: Option<Id>,
    pub thing: Thing,
    /// The position; both ends of a track.
    pub at: (Option<Point>, Option<Point>),
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TreeRow {
    pub item: Arc<Item>,
    pub depth: usize,
    /// True if the group is open; none if the row isn't a group.
    pub open: Option<bool>,
}

/// Deeper rows are not shown.
const DEEPEST: usize = 64;

/// Sort key: the group, the rank in it, the thing.
type Place = (Option<Id>, u8, Id);

#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    items: BTreeMap<Place, Arc<Item>>,
    places: BTreeMap<Id, Place>,
}

impl Tree {
    pub(super) fn new(drawing: &Drawing, finder: &Finder) -> Self {
        let mut tree = Self::default();
        tree.update(drawing, finder, drawing.things().map(|(id, _)| id));
        tree
    }

    pub(super) fn update(
        &mut self,
        drawing: &Drawing,
        finder: &Finder,
        touched: impl IntoIterator<Item = Id>,
    ) {
        for id in touched {
            if let Some(place) = self.places.remove(&id) {
                self.items.remove(&place);
            }
            let Some(entry) = drawing.get(id) else { continue };
            let place = (entry.group, rank(&entry.thing), id);
            let (catch, thing) = (finder.catch_of(id, &entry.thing), entry.thing.clone());
            let at = places(drawing, &thing);
            self.items.insert(place, Arc::new(Item { id, catch, group: entry.group, thing, at }));
            self.places.insert(id, place);
        }
    }

    fn level(&self, group: Option<Id>, depth: usize, open: &BTreeSet<Id>, rows: &mut Vec<TreeRow>) {
        let level = (group, u8::MIN, Id(u32::MIN))..=(group, u8::MAX, Id(u32::MAX));
        for item in self.items.range(level).map(|(_, item)| item) {
            let is_group = matches!(item.thing, Thing::Group { .. });
            let is_open = is_group.then(|| open.contains(&item.id));
            rows.push(TreeRow { item: item.clone(), depth, open: is_open });
            if is_open == Some(true) && depth < DEEPEST {
                self.level(Some(item.id), depth + 1, open, rows);
            }
        }
    }
}

pub fn rows(editor: &Editor) -> Vec<TreeRow> {
    let mut rows = Vec::new();
    editor.tree.level(None, 0, &editor.open, &mut rows);
    rows
}

/// The target of a move by key: the nearest other group (those above first) if `into`, else the parent of the
/// selection's group. None if there is no such target.
pub fn beside(editor: &Editor, rows: &[TreeRow], into: bool) -> Option<Option<Id>> {
    let chosen = |row: &TreeRow| editor.chosen.contains(&row.item.catch);
    // Objects of files that the drawing doesn't mention have no row: start at the first group.
    let unspoken = || editor.chosen.iter().any(|catch| editor.id_of(*catch).is_none()).then_some(0);
    let own_line = rows.iter().position(chosen);
    let own = own_line.and_then(|at| rows.get(at)?.item.group);
    if !into {
        return own.map(|own| editor.drawing().get(own).and_then(|entry| entry.group));
    }
    let at = own_line.or_else(unspoken)?;
    let (above, below) = rows.split_at(at);
    let fits = |row: &&TreeRow| row.open.is_some() && !chosen(row) && Some(row.item.id) != own;
    above.iter().rev().chain(below).find(fits).map(|row| Some(row.item.id))
}

/// Groups first, then drawn things, nodes last.
fn rank(thing: &Thing) -> u8 {
    match thing {
        Thing::Group { .. } => 0,
        Thing::Track { .. } => 1,
        Thing::Pad { .. } => 2,
        Thing::Hole { .. } => 3,
        Thing::Imported { .. } => 4,
        Thing::Node { .. } => 5,
    }
}

fn places(drawing: &Drawing, thing: &Thing) -> (Option<Point>, Option<Point>) {
    match thing {
        Thing::Imported { at, .. } => (Some(thing.place().unwrap_or(*at)), None),
        Thing::Node { at } => (Some(*at), None),
        Thing::Track { from, to, .. } => (drawing.at(*from), drawing.at(*to)),
        Thing::Pad { node, .. } | Thing::Hole { node, .. } => (drawing.at(*node), None),
        Thing::Group { .. } => (None, None),
    }
}

impl Editor {
    /// Selected by the row of `id`: for an object of a file, the object itself.
    pub fn catch_of(&self, id: Id) -> Catch {
        self.drawing().thing(id).map_or(Catch::Drawn(id), |thing| self.finder().catch_of(id, thing))
    }

    pub fn open_to_chosen(&mut self) {
        let mut above = Vec::new();
        for catch in &self.chosen {
            let mut group = self.group_of(*catch);
            while let Some(id) = group {
                above.push(id);
                group = self.drawing().get(id).and_then(|entry| entry.group);
            }
        }
        self.open.extend(above);
    }
}
