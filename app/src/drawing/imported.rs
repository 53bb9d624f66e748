//! What a drawing says of what its files draw: that it lies elsewhere, or is taken out.
//!
//! Comes in: a drawing, objects of files. Goes out: edits. The files themselves stay as they are. Does not know what is chosen.

use annulus_core::board::drawing::{self, Drawing, Edit, Entry, Id, Imported, Thing, put};
use annulus_core::geometry::Point;
use std::collections::{BTreeMap, BTreeSet};

/// What a drawing says of objects of files: the thing that says it, and by how much they are moved.
type Said<'a> = BTreeMap<(&'a str, u32), (Id, Option<Point>)>;

fn said(drawing: &Drawing) -> Said<'_> {
    let said = drawing.things().filter_map(|(id, entry)| match &entry.thing {
        Thing::Imported { file, object, by, .. } => Some(((file.as_str(), *object), (id, *by))),
        _ => None,
    });
    said.collect()
}

/// Everything of `ids` and of what is imported moved.
pub(super) fn moved(drawing: &Drawing, ids: &BTreeSet<Id>, imported: &[Imported], by: Point) -> Edit {
    let edit = drawing::moved(drawing, ids, by);
    edit.then(said_anew(drawing, imported, |before| {
        let before = before.unwrap_or_default();
        Some(Point::new(before.x + by.x, before.y + by.y))
    }))
}

/// What is imported is moved by so much in all, or taken out, as `becomes` makes of what it was.
pub(super) fn said_anew(
    drawing: &Drawing,
    imported: &[Imported],
    becomes: impl Fn(Option<Point>) -> Option<Point>,
) -> Edit {
    if imported.is_empty() {
        return Edit::default();
    }
    let (said, mut next, mut edit) = (said(drawing), drawing.next_id(), Edit::default());
    for one in imported {
        let known = said.get(&(one.file.as_str(), one.object));
        let by = becomes(known.and_then(|(_, by)| *by));
        let thing = Thing::Imported { file: one.file.clone(), object: one.object, at: one.at, by };
        match known {
            Some((id, _)) => edit.changes.extend(put(drawing, *id, thing).changes),
            None => {
                edit.changes.push((next, Some(Entry { thing, group: None })));
                next = Id(next.0.saturating_add(1));
            }
        }
    }
    edit
}
