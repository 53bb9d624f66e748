//! The tree of a drawing as lines: groups with what is in them to any depth, then tracks, pads, holes, nodes.
//!
//! Comes in: an [`Editor`]. Goes out: [`TreeRow`]s from above to below; what is in a closed group is not among them. Knows no
//! words.

use super::Editor;
use annulus_core::board::drawing::{Catch, Drawing, Id, Thing};
use annulus_core::geometry::Point;

/// A line of the tree.
#[derive(Clone, Debug, PartialEq)]
pub struct TreeRow {
    /// The thing.
    pub id: Id,
    /// As what it is chosen: an object of a file is chosen as such.
    pub catch: Catch,
    /// In how many groups it lies.
    pub depth: usize,
    /// What it is.
    pub thing: Thing,
    /// Where it is; both ends of a track.
    pub at: (Option<Point>, Option<Point>),
    /// Whether the group is open; none where it is no group.
    pub open: Option<bool>,
}

/// Lines of groups within groups deeper than this are not shown.
const DEEPEST: usize = 64;

/// Every line.
pub fn rows(editor: &Editor) -> Vec<TreeRow> {
    let mut rows = Vec::new();
    level(editor, editor.drawing().top(), 0, &mut rows);
    rows
}

/// Groups first, then what is drawn, nodes last.
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

fn level(editor: &Editor, ids: impl Iterator<Item = Id>, depth: usize, rows: &mut Vec<TreeRow>) {
    let drawing = editor.drawing();
    let mut own: Vec<(u8, Id)> = ids.filter_map(|id| Some((rank(drawing.thing(id)?), id))).collect();
    own.sort_unstable();
    for (_, id) in own {
        let Some(thing) = drawing.thing(id) else { continue };
        let is_group = matches!(thing, Thing::Group { .. });
        let open = is_group.then(|| editor.open.contains(&id));
        let (catch, at) = (editor.catch_of(id), places(drawing, thing));
        rows.push(TreeRow { id, catch, depth, thing: thing.clone(), at, open });
        if open == Some(true) && depth < DEEPEST {
            level(editor, members(drawing, id), depth + 1, rows);
        }
    }
}

/// What is in a group.
fn members(drawing: &Drawing, group: Id) -> impl Iterator<Item = Id> + '_ {
    drawing.hanging(group)
}

fn places(drawing: &Drawing, thing: &Thing) -> (Option<Point>, Option<Point>) {
    match thing {
        Thing::Node { at } | Thing::Imported { at, .. } => (Some(*at), None),
        Thing::Track { from, to, .. } => (drawing.at(*from), drawing.at(*to)),
        Thing::Pad { node, .. } | Thing::Hole { node, .. } => (drawing.at(*node), None),
        Thing::Group { .. } => (None, None),
    }
}

impl Editor {
    /// What a line of the tree stands for: an object of a file is chosen as such.
    pub fn catch_of(&self, id: Id) -> Catch {
        match self.drawing().thing(id) {
            Some(Thing::Imported { file, object, .. }) => {
                self.finder().imported_at(file, *object).map_or(Catch::Drawn(id), Catch::Imported)
            }
            _ => Catch::Drawn(id),
        }
    }

    /// The groups above what is chosen are opened, so that the tree shows it.
    pub fn open_to_chosen(&mut self) {
        let mut above = Vec::new();
        for id in self.ids() {
            let mut group = self.drawing().get(id).and_then(|entry| entry.group);
            while let Some(id) = group {
                above.push(id);
                group = self.drawing().get(id).and_then(|entry| entry.group);
            }
        }
        self.open.extend(above);
    }
}
