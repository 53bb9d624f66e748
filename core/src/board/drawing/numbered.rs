//! Which number each object of a file has, so that a drawing can speak of it.
//!
//! ```text
//!  layer       0 1 2 ⠿ 4 5 │ 6 7 8 9        objects in their order; behind them, copy by copy, what the repeats among them draw
//!  drill file  hits │ slots │ routes        each in their order
//! ```
//!
//! Comes in: objects of a layer as read. Goes out: the same with repeats taken apart, each in the place where it is drawn. Repeats
//! that draw more than can be caught stay whole. Does not know what is done with them.

use super::body::shifted;
use super::imported::MOST_IMPORTED;
use crate::artwork::{Form, Gerber, Object, ObjectShape};
use crate::geometry::{Path, Placement, Point};

/// The objects of a layer with their numbers, in the order in which they are drawn.
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

/// Whether everything in a layer adds to what lies below it, in its block apertures too.
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

/// How many objects a repeat draws.
fn count(object: &Object) -> u64 {
    match &object.shape {
        ObjectShape::Repeat { objects, columns, rows, .. } => {
            (objects.len() as u64).saturating_mul(u64::from(*columns)).saturating_mul(u64::from(*rows))
        }
        _ => 1,
    }
}

/// By how much each copy lies beside the first, in the order in which they are drawn.
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
