//! A drawing as a scene: layers, holes, marks, in their colours.
//!
//! Comes in: a [`Sheet`], [`Marks`], a [`Palette`], the layer that is drawn on. Goes out: a [`Scene`] whose zero point is that
//! of the drawing. Does not know who looks.

use super::marks::{Kind, Mark};
use super::{Marks, Sheet};
use crate::view::{Colour, Disc, Layer as Area, Line, Palette, Plate, Scene, State, UNORDERED, Width};
use annulus_core::board::drawing::Layer;
use annulus_core::units::Length;

/// The sheet is at least so large, in mm.
const LEAST_MM: [f32; 2] = [100.0, 80.0];
/// It ends at whole tens of mm, at least so far beside everything.
const MARGIN_MM: f32 = 5.0;
const ROUND_MM: f32 = 10.0;
/// How much of its own colour has what lies on the other side.
const FAR_SHARE: f32 = 0.5;

/// The scene of a drawing; `front` is the side that lies in front.
pub fn scene(sheet: &Sheet, marks: &Marks, front: Layer, palette: &Palette) -> Scene {
    let colour = |layer: Layer| own(layer, palette);
    let near = |layer: Layer| layer == front;
    let far = |layer: Layer| layer != front && layer != Layer::Edge;
    let seen = |layer: Layer| {
        let full = colour(layer);
        if far(layer) { full.mixed(palette.plate, FAR_SHARE) } else { full }
    };
    let order: [&dyn Fn(Layer) -> bool; 3] = [&far, &near, &|layer| layer == Layer::Edge];
    let mut layers: Vec<Area> = Vec::with_capacity(sheet.areas.len() + 1);
    for wanted in order {
        let own = sheet.areas.iter().filter(|(layer, _)| wanted(*layer));
        layers.extend(own.map(|(layer, mesh)| Area { mesh: mesh.clone(), colour: seen(*layer) }));
    }
    if !marks.chosen.triangles.is_empty() {
        layers.push(Area { mesh: marks.chosen.clone(), colour: palette.selected.alpha(110) });
    }
    let mut sizes: Vec<Length> = sheet.holes.iter().map(|hole| hole.diameter).collect();
    sizes.sort_unstable();
    sizes.dedup();
    let disc = |hole: &super::pieces::Drilled| Disc {
        centre_mm: hole.at_mm,
        radius_mm: hole.diameter.mm() as f32 / 2.0,
        colour: palette.tool(sizes.partition_point(|size| *size < hole.diameter)),
        state: State::Planned,
        order: UNORDERED,
    };
    Scene {
        plate: Some(plate(sheet.bounds_mm)),
        layers,
        lines: lines(sheet, marks, palette),
        discs: sheet.holes.iter().map(disc).collect(),
        ..Scene::default()
    }
}

/// What changes with every move of the pointer: nodes and marks.
pub fn lines(sheet: &Sheet, marks: &Marks, palette: &Palette) -> Vec<Line> {
    let node = |at: &[f32; 2]| line(*at, *at, Width::Px(4.0), palette.silk.alpha(150));
    let nodes = sheet.nodes.iter().map(node);
    nodes.chain(marks.strokes.iter().map(|mark| stroke(mark, palette))).collect()
}

fn own(layer: Layer, palette: &Palette) -> Colour {
    match layer {
        Layer::Top | Layer::Both => palette.copper_top,
        Layer::Bottom => palette.copper_bottom,
        Layer::Edge => palette.outline,
    }
}

fn line(a_mm: [f32; 2], b_mm: [f32; 2], width: Width, colour: Colour) -> Line {
    Line { a_mm, b_mm, width, colour, order: UNORDERED }
}

fn stroke(mark: &Mark, palette: &Palette) -> Line {
    let (px, colour) = match mark.kind {
        Kind::Chosen => (1.75, palette.selected),
        Kind::Coming(layer) => (2.0, own(layer, palette).alpha(150)),
        Kind::Box => (1.5, palette.current),
        Kind::Measure => (2.0, palette.head),
        Kind::Caught => (10.0, palette.current.alpha(200)),
        Kind::Middle => (7.0, palette.current.alpha(160)),
    };
    line(mark.a_mm, mark.b_mm, mark.width_mm.map_or(Width::Px(px), Width::Mm), colour)
}

fn plate(bounds_mm: Option<[[f32; 2]; 2]>) -> Plate {
    let [low, high] = bounds_mm.unwrap_or([[0.0; 2], LEAST_MM]);
    let down = |mm: f32| libm::floorf((mm - MARGIN_MM) / ROUND_MM) * ROUND_MM;
    let up = |mm: f32| libm::ceilf((mm + MARGIN_MM) / ROUND_MM) * ROUND_MM;
    let min_mm = [down(low[0].min(MARGIN_MM)), down(low[1].min(MARGIN_MM))];
    let max_mm = [up(high[0]).max(LEAST_MM[0]), up(high[1]).max(LEAST_MM[1])];
    Plate { min_mm, max_mm, corner_mm: 1.0 }
}
