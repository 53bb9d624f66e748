//! Numbers the objects of a file, so that a drawing can refer to them.
//!
//! ```text
//!  layer       0 1 2 ⠿ 4 5 │ 6 7 8 9        objects in order; then, copy by copy, the expanded repeats
//!  drill file  hits │ slots │ routes        each in order
//! ```
//!
//! Repeats with too many objects to select are not expanded.

use super::body::shifted;
use crate::artwork::{Form, Gerber, Object, ObjectShape};
use crate::geometry::{Path, Placement, Point};

pub(super) const MOST_IMPORTED: usize = 50_000;

/// The objects of a layer with their numbers, in drawing order.
pub(super) fn numbered(objects: &[Object]) -> Vec<(u32, Object)> {
    let mut made = Vec::with_capacity(objects.len());
    let (mut next, mut left) = (objects.len() as u32, MOST_IMPORTED as u64);
    for (number, object) in (0..).zip(objects) {
        match &object.shape {
            ObjectShape::Repeat { objects, columns, rows, step } if count(object) <= left => {
                left -= count(object);
                for by in copies(*columns, *rows, *step) {
                    for one in objects {
                        made.push((next, moved(one, by)));
                        next = next.saturating_add(1);
                    }
                }
            }
            _ => made.push((number, object.clone())),
        }
    }
    made
}

/// True if nothing in a layer erases, block apertures included.
pub(super) fn is_dark(layer: &Gerber) -> bool {
    let blocks = layer.apertures.iter().filter_map(|aperture| match &aperture.form {
        Form::Block { objects } => Some(objects),
        _ => None,
    });
    blocks.chain([&layer.objects]).all(|objects| add(objects))
}

fn add(objects: &[Object]) -> bool {
    objects.iter().all(|object| match &object.shape {
        ObjectShape::Repeat { objects, .. } => add(objects),
        _ => !object.clear,
    })
}

/// Number of objects that a repeat draws.
fn count(object: &Object) -> u64 {
    match &object.shape {
        ObjectShape::Repeat { objects, columns, rows, .. } => {
            (objects.len() as u64).saturating_mul(u64::from(*columns)).saturating_mul(u64::from(*rows))
        }
        _ => 1,
    }
}

/// Offset of each copy from the first, in drawing order.
fn copies(columns: u32, rows: u32, step: Point) -> impl Iterator<Item = Point> {
    let all = (0..columns).flat_map(move |column| (0..rows).map(move |row| (column, row)));
    all.map(move |(column, row)| Point::new(step.x * i64::from(column), step.y * i64::from(row)))
}

fn moved(object: &Object, by: Point) -> Object {
    let mut object = object.clone();
    match &mut object.shape {
        ObjectShape::Flash { at } => *at = shifted(*at, by),
        ObjectShape::Stroke { from, segment } => {
            let path = Placement::shifted(by).path(&Path { start: *from, segments: vec![*segment] });
            *from = path.start;
            path.segments.into_iter().for_each(|now| *segment = now);
        }
        ObjectShape::Contour(path) => *path = Placement::shifted(by).path(path),
        ObjectShape::Repeat { objects, .. } => {
            objects.iter_mut().for_each(|object| *object = moved(object, by));
        }
    }
    object
}
