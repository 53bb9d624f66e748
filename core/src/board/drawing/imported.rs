//! Objects of imported files, reduced to what the editor needs to select, move, rotate and copy them.
//!
//! Repeats are expanded. A flash of a block aperture is one object, as large as its bounds.

use super::body::shifted;
use super::numbered::{MOST_IMPORTED, is_dark, numbered};
use super::{Body, Layer};
use crate::artwork::{
    Aperture, Artwork, DrillFile, Form, Gerber, Object, ObjectShape, Role, Side, Transform,
};
use crate::board::copper;
use crate::geometry::{Bounds, Path, PathSegment, Placement, Point};
use crate::units::Length;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

const CHORD_ERROR_MM: f64 = 0.02;

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Imported {
    /// Name of the file, as read.
    pub file: String,
    /// Object number, as [`Thing::Imported`](super::Thing::Imported) counts it.
    pub object: u32,
    pub at: Point,
    #[serde(with = "shape")]
    pub body: Body,
    /// The layer of its copper; `None` for holes.
    pub layer: Option<Layer>,
    /// A filled area, not a pad or track.
    pub is_area: bool,
    /// A pad or a hole: has a centre.
    pub is_pad: bool,
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
    /// True if rotation changes it: everything but round shapes.
    pub fn has_angle(&self) -> bool {
        self.body.points.len() > 1
    }

    /// Snap positions of the object at `at` with that body: the centre of a pad or hole, the ends of a track.
    pub(super) fn spots(&self, at: Point, body: &Body) -> Vec<Point> {
        match body.points.as_slice() {
            _ if self.is_area => Vec::new(),
            [first, .., last] if !self.is_pad => vec![*first, *last],
            _ => vec![at],
        }
    }
}

/// Objects of the copper layers and of the drill files among `used`.
pub fn imported(artwork: &Artwork, used: &[usize]) -> Vec<Imported> {
    let mut found = Vec::new();
    for (layer, row) in copper_rows(artwork, used) {
        let Some(file) = artwork.files.get(row) else { continue };
        let Some(gerber) = &file.gerber else { continue };
        // If the layer also erases copper, an object's shape is not the copper's shape.
        let dark = !gerber.negative_image && is_dark(gerber);
        let blocks = blocks(gerber);
        for (object, drawn) in numbered(&gerber.objects) {
            if let Some((at, body)) = place_of(&drawn.shape).zip(body(gerber, &blocks, &drawn))
                && found.len() < MOST_IMPORTED
            {
                let is_block = blocks.contains_key(&drawn.aperture);
                let is_flash = matches!(drawn.shape, ObjectShape::Flash { .. });
                let is_area = matches!(drawn.shape, ObjectShape::Contour(_)) || is_flash && is_block || !dark;
                let is_pad = is_flash && !is_block;
                let (file, layer) = (file.name.clone(), Some(layer));
                found.push(Imported { file, object, at, body, layer, is_area, is_pad });
            }
        }
    }
    for file in used.iter().filter_map(|row| artwork.files.get(*row)) {
        let Some(drill) = file.drill.as_ref().filter(|_| file.role == Role::Drill) else { continue };
        let left = MOST_IMPORTED.saturating_sub(found.len());
        found.extend((0..).zip(drilled(drill)).take(left).map(|(object, (at, body))| {
            let (file, is_pad) = (file.name.clone(), body.points.len() == 1);
            Imported { file, object, at, body, layer: None, is_area: false, is_pad }
        }));
    }
    found
}

/// Drilled features in the order of their numbers: hits, slots, routes; each with its position.
fn drilled(drill: &DrillFile) -> impl Iterator<Item = (Point, Body)> {
    let size = |tool: u16| drill.tools.get(usize::from(tool)).and_then(|tool| tool.diameter);
    let body = move |points: Vec<Point>, tool: u16| {
        let radius = Length::from_nm(size(tool).unwrap_or_default().nm() / 2);
        Body { points, closed: false, radius }
    };
    let hits = drill.hits.iter().map(move |hit| (hit.at, body(vec![hit.at], hit.tool)));
    let slots = drill.slots.iter().map(move |slot| (slot.from, body(vec![slot.from, slot.to], slot.tool)));
    let routes = drill.routes.iter().map(move |route| {
        let path = Path { start: route.from, segments: route.segments.clone() };
        (route.from, body(path.flattened(CHORD_ERROR_MM), route.tool))
    });
    hits.chain(slots).chain(routes)
}

fn copper_rows(artwork: &Artwork, used: &[usize]) -> Vec<(Layer, usize)> {
    let side = |(layer, side)| Some((layer, taken(artwork, used, Role::Copper, Some(side))?));
    [(Layer::Top, Side::Top), (Layer::Bottom, Side::Bottom)].into_iter().filter_map(side).collect()
}

pub(super) fn taken(artwork: &Artwork, used: &[usize], role: Role, side: Option<Side>) -> Option<usize> {
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

pub(super) fn place_of(shape: &ObjectShape) -> Option<Point> {
    match shape {
        ObjectShape::Flash { at } => Some(*at),
        ObjectShape::Stroke { from, .. } => Some(*from),
        ObjectShape::Contour(path) => Some(path.start),
        ObjectShape::Repeat { .. } => None,
    }
}

type Blocks = BTreeMap<u32, Bounds>;

/// Those of a layer. Blocks are defined before the blocks that use them.
fn blocks(gerber: &Gerber) -> Blocks {
    let mut blocks = Blocks::new();
    for (number, aperture) in (0..).zip(&gerber.apertures) {
        if let Form::Block { objects } = &aperture.form
            && let Some(bounds) = bounds(gerber, &blocks, objects)
        {
            blocks.insert(number, bounds);
        }
    }
    blocks
}

/// Bounds of the dark objects.
fn bounds(gerber: &Gerber, blocks: &Blocks, objects: &[Object]) -> Option<Bounds> {
    let one = |object: &Object| match &object.shape {
        ObjectShape::Repeat { objects, columns, rows, step } => {
            let first = bounds(gerber, blocks, objects)?;
            let last = |step: Length, count: u32| step * i64::from(count.saturating_sub(1));
            let by = Point::new(last(step.x, *columns), last(step.y, *rows));
            Some(first.with(shifted(first.min, by)).with(shifted(first.max, by)))
        }
        _ if object.clear => None,
        _ => {
            let body = body(gerber, blocks, object)?;
            Some(Bounds::around(body.points.iter().copied())?.grown(body.radius))
        }
    };
    objects.iter().filter_map(one).reduce(|a, b| a.with(b.min).with(b.max))
}

/// The shape of an object; `None` for repeats and for objects that draw nothing.
fn body(gerber: &Gerber, blocks: &Blocks, object: &Object) -> Option<Body> {
    let form = gerber.aperture(object).map(|aperture: &Aperture| &aperture.form);
    let held = gerber.transforms.get(object.transform as usize).copied().unwrap_or(Transform::PLAIN);
    match &object.shape {
        ObjectShape::Flash { at } => {
            let block = blocks.get(&object.aperture).map(|bounds| boxed(*bounds));
            Some(as_held(block.or_else(|| flash(form?))?, held).moved(*at))
        }
        ObjectShape::Stroke { from, segment } => {
            let radius = match form? {
                Form::Circle { diameter } => Length::from_nm(diameter.nm() / 2),
                Form::Rectangle { width, height } => Length::from_nm((*width).min(*height).nm() / 2),
                _ => return None,
            };
            let path = Path { start: *from, segments: vec![*segment] };
            let points = match segment {
                PathSegment::Line { to } => vec![*from, *to],
                PathSegment::Arc { .. } => path.flattened(CHORD_ERROR_MM),
            };
            Some(Body { points, closed: false, radius: Length::from_mm(radius.mm() * held.scale) })
        }
        ObjectShape::Contour(path) => ring_of(path),
        ObjectShape::Repeat { .. } => None,
    }
}

fn ring_of(path: &Path) -> Option<Body> {
    let mut points = path.flattened(CHORD_ERROR_MM);
    points.pop();
    (points.len() > 2).then_some(Body { points, closed: true, radius: Length::ZERO })
}

/// An aperture about its origin, with mirror, rotation and scale applied.
fn as_held(body: Body, held: Transform) -> Body {
    let rotation_mdeg = libm::round(held.turn_deg * 1_000.0) as i32;
    let placement = Placement { mirror: held.mirrored, rotation_mdeg, shift: Point::default() };
    let mut body = body.placed(placement, Point::default());
    if held.scale != Transform::PLAIN.scale {
        let scaled = |length: Length| Length::from_mm(length.mm() * held.scale);
        body.points.iter_mut().for_each(|at| *at = Point::new(scaled(at.x), scaled(at.y)));
        body.radius = scaled(body.radius);
    }
    body
}

fn boxed(Bounds { min, max }: Bounds) -> Body {
    let points = vec![min, Point::new(max.x, min.y), max, Point::new(min.x, max.y)];
    Body { points, closed: true, radius: Length::ZERO }
}

/// The shape of an aperture about its origin, without transform.
fn flash(form: &Form) -> Option<Body> {
    let ring = |points: Vec<Point>| Body { points, closed: true, radius: Length::ZERO };
    match form {
        Form::Circle { diameter } => Some(Body::disc(Point::default(), *diameter)),
        Form::Rectangle { width, height } => {
            let corner = Point::new(Length::from_nm(width.nm() / 2), Length::from_nm(height.nm() / 2));
            Some(boxed(Bounds { min: Point::new(-corner.x, -corner.y), max: corner }))
        }
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
            // A macro with one outline has that shape; several outlines are replaced by their bounds.
            if let [(true, paths)] = primitives.as_slice()
                && let [path] = paths.as_slice()
            {
                return ring_of(path);
            }
            let paths = primitives.iter().filter(|(dark, _)| *dark).flat_map(|(_, paths)| paths);
            let boxes: Vec<_> = paths.map(crate::geometry::path_bounds).collect();
            boxes.into_iter().reduce(|a, b| a.with(b.min).with(b.max)).map(boxed)
        }
        Form::Block { .. } => None,
    }
}
