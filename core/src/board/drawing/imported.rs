//! Drawn over files: what they draw can be caught, moved and taken out, and what is drawn is added. The files are never changed:
//! what was read of them is, before the board is made.
//!
//! ```text
//!  files ─ read ─▶ Artwork ─┬─ imported ─▶ what can be caught
//!                           └─ lay_over(drawing) ─▶ Artwork ─▶ Board ─▶ plan, proof, simulation, like any other
//! ```
//!
//! Comes in: an [`Artwork`] and a [`Drawing`]. Goes out: the same artwork, changed; [`Imported`]s; diagnostics where a file is
//! not as it was. Takes whole objects of a layer; what lies in blocks and repeats stays as it is.

use super::body::shifted;
use super::text::{is_one, read};
use super::{Body, Drawing, Layer, Thing, files};
use crate::artwork::{
    self, Aperture, Artwork, DrillFile, FileRead, Form, Gerber, Object, ObjectShape, Overrides, Role, Side,
};
use crate::board::copper;
use crate::diagnostic::Diagnostic;
use crate::geometry::{PathSegment, Placement, Point};
use crate::units::Length;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// The most objects of files that can be caught.
const MOST_IMPORTED: usize = 50_000;
/// How far a chord may be from its arc, in mm.
const CHORD_ERROR_MM: f64 = 0.02;

/// Something that a file draws, as far as one needs it to be caught.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Imported {
    /// The file, by its name as read.
    pub file: String,
    /// Which of its objects or hits.
    pub object: u32,
    /// Where it is.
    pub at: Point,
    /// Its shape.
    #[serde(with = "shape")]
    pub body: Body,
    /// Where its copper is; none for holes.
    pub layer: Option<Layer>,
    /// A filled area, and no pad or track.
    pub is_area: bool,
}

/// A [`Body`] as plain data.
mod shape {
    use super::{Body, Length, Point};
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub(super) fn serialize<S: Serializer>(body: &Body, to: S) -> Result<S::Ok, S::Error> {
        (&body.points, body.closed, body.radius).serialize(to)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<Body, D::Error> {
        let (points, closed, radius) = <(Vec<Point>, bool, Length)>::deserialize(from)?;
        Ok(Body { points, closed, radius })
    }
}

impl Imported {
    /// The places of it that a pointer may snap to: the middle of a pad or hole, the ends of a track.
    pub(super) fn spots(&self) -> Vec<Point> {
        match (self.body.closed, self.body.points.as_slice()) {
            _ if self.is_area => Vec::new(),
            (false, [first, .., last]) => vec![*first, *last],
            _ => vec![self.at],
        }
    }
}

/// What the copper layers and the drill files among `used` draw.
pub fn imported(artwork: &Artwork, used: &[usize]) -> Vec<Imported> {
    let mut found = Vec::new();
    for (layer, row) in copper_rows(artwork, used) {
        let Some(file) = artwork.files.get(row) else { continue };
        let Some(gerber) = &file.gerber else { continue };
        // Where copper is taken away again, the shape of an object is not that of the copper.
        let dark = !gerber.negative_image && gerber.objects.iter().all(|object| !object.clear);
        for (object, drawn) in (0..).zip(&gerber.objects) {
            if let Some((at, body)) = place_of(&drawn.shape).zip(body(gerber, drawn))
                && found.len() < MOST_IMPORTED
            {
                let is_area = matches!(drawn.shape, ObjectShape::Contour(_)) || !dark;
                let layer = Some(layer);
                found.push(Imported { file: file.name.clone(), object, at, body, layer, is_area });
            }
        }
    }
    for file in used.iter().filter_map(|row| artwork.files.get(*row)) {
        let Some(drill) = file.drill.as_ref().filter(|_| file.role == Role::Drill) else { continue };
        for (object, hit) in (0..).zip(&drill.hits).take(MOST_IMPORTED.saturating_sub(found.len())) {
            let size = drill.tools.get(usize::from(hit.tool)).and_then(|tool| tool.diameter);
            let body = Body::disc(hit.at, size.unwrap_or_default());
            let (file, at) = (file.name.clone(), hit.at);
            found.push(Imported { file, object, at, body, layer: None, is_area: false });
        }
    }
    found
}

/// The layers that the copper of each side is made of, as the board takes them.
fn copper_rows(artwork: &Artwork, used: &[usize]) -> Vec<(Layer, usize)> {
    let side = |(layer, side)| Some((layer, taken(artwork, used, Role::Copper, Some(side))?));
    [(Layer::Top, Side::Top), (Layer::Bottom, Side::Bottom)].into_iter().filter_map(side).collect()
}

/// The row of the layer that the board takes for a role and a side.
fn taken(artwork: &Artwork, used: &[usize], role: Role, side: Option<Side>) -> Option<usize> {
    let Some(side) = side else {
        return artwork.files.iter().position(|file| file.role == role && file.gerber.is_some());
    };
    let drills = |row: &&usize| {
        artwork.files.get(**row).is_some_and(|file| file.role == Role::Drill && file.drill.is_some())
    };
    let drill = used.iter().find(drills).and_then(|row| artwork.files.get(*row)).map(|file| &file.name);
    let layers = copper::layers(artwork, used, (role, side), drill);
    let first = layers.first()?.0;
    artwork.files.iter().position(|file| std::ptr::eq(file, first))
}

fn place_of(shape: &ObjectShape) -> Option<Point> {
    match shape {
        ObjectShape::Flash { at } => Some(*at),
        ObjectShape::Stroke { from, .. } => Some(*from),
        ObjectShape::Contour(path) => Some(path.start),
        ObjectShape::Repeat { .. } => None,
    }
}

/// The shape of an object; none for blocks and repeats, and for what draws nothing.
fn body(gerber: &Gerber, object: &Object) -> Option<Body> {
    let form = gerber.aperture(object).map(|aperture: &Aperture| &aperture.form);
    match &object.shape {
        ObjectShape::Flash { at } => Some(flash(form?)?.moved(*at)),
        ObjectShape::Stroke { from, segment } => {
            let radius = match form? {
                Form::Circle { diameter } => Length::from_nm(diameter.nm() / 2),
                Form::Rectangle { width, height } => Length::from_nm((*width).min(*height).nm() / 2),
                _ => return None,
            };
            let path = crate::geometry::Path { start: *from, segments: vec![*segment] };
            let points = match segment {
                PathSegment::Line { to } => vec![*from, *to],
                PathSegment::Arc { .. } => path.flattened(CHORD_ERROR_MM),
            };
            Some(Body { points, closed: false, radius })
        }
        ObjectShape::Contour(path) => {
            let mut points = path.flattened(CHORD_ERROR_MM);
            points.pop();
            (points.len() > 2).then_some(Body { points, closed: true, radius: Length::ZERO })
        }
        ObjectShape::Repeat { .. } => None,
    }
}

/// The shape of an aperture about its origin, as it is held by itself.
fn flash(form: &Form) -> Option<Body> {
    let ring = |points: Vec<Point>| Body { points, closed: true, radius: Length::ZERO };
    let boxed = |width: Length, height: Length| {
        let (x, y) = (width.nm() / 2, height.nm() / 2);
        let point = |(x, y): (i64, i64)| Point::new(Length::from_nm(x), Length::from_nm(y));
        [(-x, -y), (x, -y), (x, y), (-x, y)].map(point).to_vec()
    };
    match form {
        Form::Circle { diameter } => Some(Body::disc(Point::default(), *diameter)),
        Form::Rectangle { width, height } => Some(ring(boxed(*width, *height))),
        Form::Obround { width, height } => {
            let (short, long) = ((*width).min(*height), (*width).max(*height));
            let reach = Length::from_nm((long.nm() - short.nm()) / 2);
            let end = if width < height {
                Point::new(Length::ZERO, reach)
            } else {
                Point::new(reach, Length::ZERO)
            };
            let points = vec![Point::new(-end.x, -end.y), end];
            Some(Body { points, closed: false, radius: Length::from_nm(short.nm() / 2) })
        }
        Form::Polygon { diameter, corners, turn_deg } => {
            let corner = |at: u32| {
                let angle = (turn_deg + 360.0 * f64::from(at) / f64::from(*corners)).to_radians();
                let radius = diameter.mm() / 2.0;
                Point::from_mm(radius * libm::cos(angle), radius * libm::sin(angle))
            };
            Some(ring((0..*corners).map(corner).collect()))
        }
        Form::Macro { primitives, .. } => {
            let paths = primitives.iter().filter(|(dark, _)| *dark).flat_map(|(_, paths)| paths);
            let boxes: Vec<_> = paths.map(crate::geometry::path_bounds).collect();
            let all = boxes.into_iter().reduce(|a, b| a.with(b.min).with(b.max))?;
            let (low, high) = (all.min, all.max);
            Some(ring(vec![low, Point::new(high.x, low.y), high, Point::new(low.x, high.y)]))
        }
        Form::Block { .. } => None,
    }
}

/// Lays the drawings among `files`, which are no artwork, over the artwork of the others.
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

/// The artwork of what is no drawing among `files`.
pub fn read_under(files: &[(String, Vec<u8>)], overrides: &Overrides) -> Artwork {
    let under: Vec<_> = files.iter().filter(|(_, bytes)| !is_one(bytes)).cloned().collect();
    artwork::read_set(&under, overrides)
}

/// Makes the artwork what the drawing says it is: takes out, moves, adds. `used` follows.
pub fn lay_over(drawing: &Drawing, artwork: &mut Artwork, used: &mut Vec<usize>) -> Vec<Diagnostic> {
    let mut diagnostics = changed(drawing, artwork);
    let texts = files(drawing);
    if texts.is_empty() {
        return diagnostics;
    }
    let board = used.iter().filter_map(|row| artwork.files.get(*row)).map(|file| file.board.clone()).next();
    let texts: Vec<(String, Vec<u8>)> =
        texts.into_iter().map(|(name, text)| (name, text.into_bytes())).collect();
    for mut file in artwork::read_set(&texts, &Overrides::default()).files {
        // Its numbers are as they are written, wherever its holes lie.
        file.evidence = None;
        file.board = board.clone().unwrap_or_default();
        diagnostics.append(&mut file.diagnostics);
        add(artwork, used, file);
    }
    diagnostics
}

/// What is drawn goes into the layer that the board takes; where there is none, it is that layer.
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
        // What is drawn on a negative layer is no copper; what is taken away from it is.
        clear: object.clear != negative,
        ..object
    }));
}

/// What becomes of the objects of one file: each is moved by so much, or taken out.
type Changes<'a> = BTreeMap<&'a str, Shifts>;

/// Takes out and moves what the drawing says.
fn changed(drawing: &Drawing, artwork: &mut Artwork) -> Vec<Diagnostic> {
    let mut wanted: Changes<'_> = BTreeMap::new();
    for (_, entry) in drawing.things() {
        if let Thing::Imported { file, object, at, by } = &entry.thing {
            wanted.entry(file).or_default().insert(*object, (*at, *by));
        }
    }
    let mut lost = Vec::new();
    for (name, changes) in wanted {
        let file = artwork.files.iter_mut().find(|file| is_called(&file.name, name));
        let missed = match file.map(|file| (&mut file.gerber, &mut file.drill)) {
            Some((Some(gerber), None)) => of_layer(gerber, &changes),
            Some((_, Some(drill))) => of_drill(drill, &changes),
            _ => changes.values().map(|(at, _)| *at).collect(),
        };
        if let Some(first) = missed.first() {
            let warning = Diagnostic::warning("drawing.file_is_another").at(name, 0, 0);
            let warning = warning.with("count", missed.len());
            lost.push(warning.with("x", first.x.mm()).with("y", first.y.mm()));
        }
    }
    lost
}

/// Whether a file that was read is the one that a drawing names: by the whole of its name, or by its end, as a file has
/// another folder before its name where another reads it.
fn is_called(name: &str, wanted: &str) -> bool {
    let ends = |long: &str, short: &str| {
        long.strip_suffix(short).is_some_and(|rest| rest.is_empty() || rest.ends_with('/'))
    };
    ends(name, wanted) || ends(wanted, name)
}

/// What becomes of objects of a file by their numbers: where each lay, and by how much it moves; none where it goes.
type Shifts = BTreeMap<u32, (Point, Option<Point>)>;

/// The place of the object that is meant: by its number where it lies there, else the first that does.
fn meant(places: &[Option<Point>], object: u32, at: Point) -> Option<usize> {
    let by_number = Some(object as usize).filter(|index| places.get(*index) == Some(&Some(at)));
    by_number.or_else(|| places.iter().position(|place| *place == Some(at)))
}

fn of_layer(gerber: &mut Gerber, changes: &Shifts) -> Vec<Point> {
    made(
        &mut gerber.objects,
        changes,
        |object| place_of(&object.shape),
        |object, by| move_shape(&mut object.shape, by),
    )
}

fn of_drill(drill: &mut DrillFile, changes: &Shifts) -> Vec<Point> {
    made(&mut drill.hits, changes, |hit| Some(hit.at), |hit, by| hit.at = shifted(hit.at, by))
}

/// Makes `changes` of `objects`; the places at which none lies.
fn made<T>(
    objects: &mut Vec<T>,
    changes: &Shifts,
    place: impl Fn(&T) -> Option<Point>,
    shift: impl Fn(&mut T, Point),
) -> Vec<Point> {
    let places: Vec<_> = objects.iter().map(place).collect();
    let (mut gone, mut missed) = (BTreeSet::new(), Vec::new());
    for (object, (at, by)) in changes {
        match (meant(&places, *object, *at), by) {
            (None, _) => missed.push(*at),
            (Some(index), None) => gone.extend([index]),
            (Some(index), Some(by)) => {
                if let Some(object) = objects.get_mut(index) {
                    shift(object, *by);
                }
            }
        }
    }
    let mut index = 0;
    objects.retain(|_| {
        index += 1;
        !gone.contains(&(index - 1))
    });
    missed
}

fn move_shape(shape: &mut ObjectShape, by: Point) {
    match shape {
        ObjectShape::Flash { at } => *at = shifted(*at, by),
        ObjectShape::Stroke { from, segment } => {
            let path = crate::geometry::Path { start: *from, segments: vec![*segment] };
            let moved = Placement::shifted(by).path(&path);
            *from = moved.start;
            moved.segments.into_iter().for_each(|now| *segment = now);
        }
        ObjectShape::Contour(path) => *path = Placement::shifted(by).path(path),
        ObjectShape::Repeat { .. } => {}
    }
}
