//! Silkscreen of a board's sides as centre lines, for engraving.
//!
//! ```text
//!  stroke ══  ─▶ its centre line; a stroke that starts at the end of the previous one continues its line
//!  contour ▰  ─▶ its edge
//!  flash ●    ─▶ no line: counted
//! ```
//!
//! Strokes that erase are ignored.

use super::copper::layers;
use super::{Board, Face, Legend};
use crate::artwork::{Artwork, Form, Gerber, Object, ObjectShape, Role, Side};
use crate::geometry::{Path, PathSegment, Point};

/// Takes the silkscreen of each side: the layer among `used`, else the first next to the board's drill file,
/// else the first.
pub(super) fn add(board: &mut Board, artwork: &Artwork, used: &[usize]) {
    let drill = board.sources.first().cloned();
    for (face, side) in [(Face::Top, Side::Top), (Face::Bottom, Side::Bottom)] {
        let found = layers(artwork, used, (Role::Silk, side), drill.as_ref()).into_iter().next();
        let Some((file, gerber)) = found else { continue };
        let drawn = dark(gerber);
        let mut strokes = chained(drawn.strokes());
        strokes.extend(drawn.contours());
        let flashes = drawn.pads().len() as u32;
        if strokes.is_empty() && flashes == 0 {
            continue;
        }
        let source = board.sources.len() as u32;
        board.sources.push(file.name.clone());
        board.legend.push(Legend { face, strokes, flashes, source });
    }
}

/// The layer without erasing objects.
fn dark(layer: &Gerber) -> Gerber {
    let mut layer = Gerber { objects: adding(&layer.objects), ..layer.clone() };
    for aperture in &mut layer.apertures {
        if let Form::Block { objects } = &mut aperture.form {
            *objects = adding(objects);
        }
    }
    layer
}

fn adding(objects: &[Object]) -> Vec<Object> {
    let dark = objects.iter().filter(|object| !object.clear).cloned();
    dark.map(|object| match object.shape {
        ObjectShape::Repeat { objects, columns, rows, step } => {
            let objects = adding(&objects);
            Object { shape: ObjectShape::Repeat { objects, columns, rows, step }, ..object }
        }
        _ => object,
    })
    .collect()
}

/// Strokes in file order, joined to lines; dots of zero length are dropped.
fn chained(strokes: Vec<(Point, PathSegment)>) -> Vec<Path> {
    let mut lines: Vec<Path> = Vec::new();
    for (from, segment) in strokes {
        if segment == (PathSegment::Line { to: from }) {
            continue;
        }
        match lines.last_mut() {
            Some(last) if last.end() == from => last.segments.push(segment),
            _ => lines.push(Path { start: from, segments: vec![segment] }),
        }
    }
    lines
}
