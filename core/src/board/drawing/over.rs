//! Applies a drawing to imported files: moves, rotates, copies and removes their objects and adds drawn
//! elements. The files never change: the changes apply to the data read from them, before the board is made.
//!
//! ```text
//!  files ─ read ─▶ Artwork ─ lay_over(drawing) ─▶ Artwork ─▶ Board ─▶ plan, proof, simulation
//!  object 7 ─┬─ as the drawing states, at its own place in the file    apertures are mirrored and rotated,
//!            └─ its copies, directly after it                          paths get new points
//! ```
//!
//! A repeat with a changed object is expanded; a flash of a block aperture is one object.

use super::body::{path_about, placed_about, shifted};
use super::holes_written::excellon_text;
use super::imported::{place_of, taken};
use super::numbered::numbered;
use super::text::{is_one, read};
use super::written::gerber_text;
use super::{Drawing, Thing, files};
use crate::artwork::{
    self, Artwork, DrillFile, FileRead, Gerber, Hit, Object, ObjectShape, Overrides, Route, SlotEntry,
    Transform,
};
use crate::diagnostic::Diagnostic;
use crate::geometry::{Path, Placement, Point};
use crate::warning;
use std::collections::{BTreeMap, BTreeSet};

pub fn lay_over_all(
    files: &[(String, Vec<u8>)],
    artwork: &mut Artwork,
    used: &mut Vec<usize>,
) -> Vec<Diagnostic> {
    let drawings = files.iter().filter(|(_, bytes)| is_one(bytes));
    let each = |(name, bytes): &(String, Vec<u8>)| match read(name, &String::from_utf8_lossy(bytes)) {
        Ok(history) => lay_over(history.now(), artwork, used),
        Err(why) => vec![why],
    };
    drawings.flat_map(each).collect()
}

/// The artwork of those `files` that are no drawings.
pub fn read_under(files: &[(String, Vec<u8>)], overrides: &Overrides) -> Artwork {
    read_under_telling(files, overrides, &mut |_, _| {})
}

/// As [`read_under`]; calls `progress` with the bytes read and the total.
pub fn read_under_telling(
    files: &[(String, Vec<u8>)],
    overrides: &Overrides,
    progress: &mut dyn FnMut(u64, u64),
) -> Artwork {
    let under: Vec<_> = files.iter().filter(|(_, bytes)| !is_one(bytes)).cloned().collect();
    artwork::read_set_telling(&under, overrides, progress)
}

pub fn lay_over(drawing: &Drawing, artwork: &mut Artwork, used: &mut Vec<usize>) -> Vec<Diagnostic> {
    let (_, mut diagnostics) = changed(drawing, artwork);
    let texts = files(drawing);
    if texts.is_empty() {
        return diagnostics;
    }
    let board = used.iter().filter_map(|row| artwork.files.get(*row)).map(|file| file.board.clone()).next();
    let texts: Vec<(String, Vec<u8>)> =
        texts.into_iter().map(|(name, text)| (name, text.into_bytes())).collect();
    for mut file in artwork::read_set(&texts, &Overrides::default()).files {
        // Coordinates are exact as written, so no format evidence is needed.
        file.evidence = None;
        file.board = board.clone().unwrap_or_default();
        diagnostics.append(&mut file.diagnostics);
        add(artwork, used, file);
    }
    diagnostics
}

/// Exported files of a drawing over files: each changed file as a whole, under its name; and [`files()`] of
/// the drawn elements. Unchanged files are not included.
pub fn files_over(drawing: &Drawing, mut artwork: Artwork) -> (Vec<(String, String)>, Vec<Diagnostic>) {
    let (rows, lost) = changed(drawing, &mut artwork);
    let mut texts = files(drawing);
    rows.into_iter().filter_map(|row| artwork.files.get(row)).for_each(|file| add_text(file, &mut texts));
    (texts, lost)
}

/// Exported files of the files in `rows`, as they were read: layers as Gerber X2, holes as Excellon, each
/// under its name without its folder. Other files are left out.
pub fn files_of(artwork: &Artwork, rows: &[usize]) -> Vec<(String, String)> {
    let mut texts = Vec::new();
    rows.iter().filter_map(|row| artwork.files.get(*row)).for_each(|file| add_text(file, &mut texts));
    texts
}

/// Adds the text of a layer or drill file, under a name that is still free.
fn add_text(file: &FileRead, texts: &mut Vec<(String, String)>) {
    let text = match (&file.drill, &file.gerber) {
        (Some(drill), _) => excellon_text(drill, file.plated),
        (None, Some(gerber)) => gerber_text(gerber),
        (None, None) => return,
    };
    let own = file.name.rsplit(['/', '\\']).next().unwrap_or_default();
    let taken = |name: &str| texts.iter().any(|(other, _)| other == name);
    let again = (2..).map(|count| format!("{count}-{own}"));
    let name = std::iter::once(own.to_owned()).chain(again).find(|name| !taken(name));
    texts.extend(name.map(|name| (name, text)));
}

/// Adds a drawn file to the layer that the board uses for its role, or as a new layer.
fn add(artwork: &mut Artwork, used: &mut Vec<usize>, file: FileRead) {
    let row = file.gerber.as_ref().and_then(|_| taken(artwork, used, file.role, file.side));
    let into = row.and_then(|row| artwork.files.get_mut(row)?.gerber.as_mut());
    match (into, file.gerber) {
        (Some(into), Some(drawn)) => graft(into, drawn),
        (_, gerber) => {
            if file.drill.is_some() {
                used.push(artwork.files.len());
            }
            artwork.files.push(FileRead { gerber, ..file });
        }
    }
}

fn graft(into: &mut Gerber, drawn: Gerber) {
    let (apertures, transforms) = (into.apertures.len() as u32, into.transforms.len() as u32);
    let (tags, negative) = (into.tags.len() as u32, into.negative_image);
    into.apertures.extend(drawn.apertures);
    into.transforms.extend(drawn.transforms);
    into.tags.extend(drawn.tags);
    into.objects.extend(drawn.objects.into_iter().map(|object| Object {
        aperture: object.aperture + apertures,
        transform: object.transform + transforms,
        tag: object.tag + tags,
        // A negative layer inverts: drawn copper must clear there.
        clear: object.clear != negative,
        ..object
    }));
}

/// A change of a file object.
struct Change {
    object: u32,
    at: Point,
    /// New placement about that position; `None` if removed.
    becomes: Option<Placement>,
    /// The change makes a copy; the original stays.
    copy: bool,
}

/// Applies the drawing's changes. Returns the changed rows of the files, and diagnostics.
fn changed(drawing: &Drawing, artwork: &mut Artwork) -> (BTreeSet<usize>, Vec<Diagnostic>) {
    let mut wanted: BTreeMap<&str, Vec<Change>> = BTreeMap::new();
    for (_, entry) in drawing.things() {
        if let Thing::Imported { file, object, at, copy, .. } = &entry.thing
            && !entry.thing.is_as_in_its_file()
        {
            let becomes = entry.thing.placement();
            let change = Change { object: *object, at: *at, becomes, copy: *copy };
            wanted.entry(file).or_default().push(change);
        }
    }
    let (mut rows, mut lost) = (BTreeSet::new(), Vec::new());
    for (name, changes) in wanted {
        let row = artwork.files.iter().position(|file| is_called(&file.name, name));
        rows.extend(row);
        let file = row.and_then(|row| artwork.files.get_mut(row));
        let missed = match file.map(|file| (&mut file.gerber, &mut file.drill)) {
            Some((Some(gerber), None)) => of_layer(gerber, &changes),
            Some((_, Some(drill))) => of_drill(drill, &changes),
            _ => changes.iter().map(|change| change.at).collect(),
        };
        if let Some(first) = missed.first() {
            let warning = warning!("drawing.file_is_another", ..).at(name, 0, 0);
            let warning = warning.with("count", missed.len());
            lost.push(warning.with("x", first.x.mm()).with("y", first.y.mm()));
        }
    }
    (rows, lost)
}

/// True if a file is the one that a drawing names. One name may be the end of the other, because folders
/// differ between readers.
pub(super) fn is_called(name: &str, wanted: &str) -> bool {
    let ends = |long: &str, short: &str| {
        long.strip_suffix(short).is_some_and(|rest| rest.is_empty() || rest.ends_with('/'))
    };
    ends(name, wanted) || ends(wanted, name)
}

#[derive(Default)]
struct Meant<'a> {
    changes: Vec<(usize, &'a Change)>,
    /// Positions without an object.
    missed: Vec<Point>,
}

/// Resolves changes: by number if that object is at the position, else the first object there.
fn meant<'a>(changes: &'a [Change], places: &[(u32, Option<Point>)]) -> Meant<'a> {
    let by_number: BTreeMap<u32, usize> =
        (0..).zip(places).map(|(index, (number, _))| (*number, index)).collect();
    let mut meant = Meant::default();
    for change in changes {
        let lies_there = |index: &usize| places.get(*index).is_some_and(|(_, at)| *at == Some(change.at));
        let own = by_number.get(&change.object).copied().filter(lies_there);
        match own.or_else(|| places.iter().position(|(_, at)| *at == Some(change.at))) {
            Some(index) => meant.changes.push((index, change)),
            None => meant.missed.push(change.at),
        }
    }
    meant
}

fn of_layer(gerber: &mut Gerber, changes: &[Change]) -> Vec<Point> {
    let mut objects: Vec<(u32, Object)> = (0..).zip(std::mem::take(&mut gerber.objects)).collect();
    let places = |objects: &[(u32, Object)]| -> Vec<_> {
        objects.iter().map(|(number, object)| (*number, place_of(&object.shape))).collect()
    };
    let mut all = meant(changes, &places(&objects));
    let behind = changes.iter().any(|change| change.object as usize >= objects.len());
    if behind || !all.missed.is_empty() {
        let plain: Vec<Object> = objects.into_iter().map(|(_, object)| object).collect();
        objects = numbered(&plain);
        all = meant(changes, &places(&objects));
    }
    let mut held = Held { transforms: &mut gerber.transforms, known: BTreeMap::new() };
    let objects = objects.into_iter().map(|(_, object)| object);
    let made = made(objects, 0, &all.changes, |object, placement| held.placed(object, placement));
    gerber.objects = made.objects;
    all.missed
}

fn of_drill(drill: &mut DrillFile, changes: &[Change]) -> Vec<Point> {
    let (hits, slots) = (drill.hits.len(), drill.slots.len());
    let own = drill.hits.iter().map(|hit| hit.at);
    let own = own.chain(drill.slots.iter().map(|slot| slot.from));
    let own = own.chain(drill.routes.iter().map(|route| route.from));
    let places: Vec<(u32, Option<Point>)> = (0..).zip(own.map(Some)).collect();
    let all = meant(changes, &places);
    let made_hits = made(std::mem::take(&mut drill.hits), 0, &all.changes, |hit, placement| Hit {
        at: shifted(hit.at, placement.shift),
        ..*hit
    });
    for slot in &mut drill.slots {
        let begins = made_hits.begins.get(slot.after_hits as usize).copied();
        slot.after_hits = begins.unwrap_or(made_hits.objects.len()) as u32;
    }
    drill.hits = made_hits.objects;
    drill.slots = made(std::mem::take(&mut drill.slots), hits, &all.changes, slot_placed).objects;
    drill.routes = made(std::mem::take(&mut drill.routes), hits + slots, &all.changes, route_placed).objects;
    all.missed
}

fn slot_placed(slot: &SlotEntry, placement: Placement) -> SlotEntry {
    let from = shifted(slot.from, placement.shift);
    SlotEntry { from, to: placed_about(slot.to, placement, slot.from), ..*slot }
}

fn route_placed(route: &Route, placement: Placement) -> Route {
    let path = Path { start: route.from, segments: route.segments.clone() };
    let Path { start, segments } = path_about(&path, placement, route.from);
    Route { from: start, segments, ..*route }
}

struct Made<T> {
    objects: Vec<T>,
    /// New index of each original object, or of what follows it.
    begins: Vec<usize>,
}

/// Applies `changes` to `objects`; `first` is the index of the first of them in the whole list. Copies
/// directly follow their originals.
fn made<T: Clone>(
    objects: impl IntoIterator<Item = T>,
    first: usize,
    changes: &[(usize, &Change)],
    mut placed: impl FnMut(&T, Placement) -> T,
) -> Made<T> {
    let mut becomes: BTreeMap<usize, Option<Placement>> = BTreeMap::new();
    let mut copies: BTreeMap<usize, Vec<Placement>> = BTreeMap::new();
    let mut made = Made { objects: Vec::new(), begins: Vec::new() };
    for (index, change) in changes {
        if change.copy {
            copies.entry(*index).or_default().extend(change.becomes);
        } else {
            becomes.insert(*index, change.becomes);
        }
    }
    for (index, object) in (first..).zip(objects) {
        made.begins.push(made.objects.len());
        let beside: Vec<T> =
            copies.get(&index).into_iter().flatten().map(|copy| placed(&object, *copy)).collect();
        match becomes.get(&index) {
            None => made.objects.push(object),
            Some(None) => {}
            Some(Some(placement)) => made.objects.push(placed(&object, *placement)),
        }
        made.objects.extend(beside);
    }
    made
}

/// Transforms of a layer, extended for rotated apertures.
struct Held<'a> {
    transforms: &'a mut Vec<Transform>,
    /// New transform by old transform, mirror and rotation.
    known: BTreeMap<(u32, bool, i32), u32>,
}

impl Held<'_> {
    fn placed(&mut self, object: &Object, placement: Placement) -> Object {
        let mut object = object.clone();
        match &mut object.shape {
            ObjectShape::Flash { at } => *at = shifted(*at, placement.shift),
            ObjectShape::Stroke { from, segment } => {
                let path = Path { start: *from, segments: vec![*segment] };
                let placed = path_about(&path, placement, *from);
                *from = placed.start;
                placed.segments.into_iter().for_each(|now| *segment = now);
            }
            ObjectShape::Contour(path) => *path = path_about(path, placement, path.start),
            ObjectShape::Repeat { .. } => {}
        }
        if placement.mirror || placement.rotation_mdeg != 0 {
            object.transform = self.turned(object.transform, placement);
        }
        object
    }

    fn turned(&mut self, transform: u32, Placement { mirror, rotation_mdeg, .. }: Placement) -> u32 {
        let transforms = &mut *self.transforms;
        *self.known.entry((transform, mirror, rotation_mdeg)).or_insert_with(|| {
            let turn_deg = f64::from(rotation_mdeg) / 1_000.0;
            let inner = transforms.get(transform as usize).copied().unwrap_or(Transform::PLAIN);
            let next = transforms.len() as u32;
            transforms.push(Transform { mirrored: mirror, turn_deg, scale: 1.0 }.over(inner));
            next
        })
    }
}
