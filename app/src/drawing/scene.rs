//! The scene of a drawing: layers, holes and marks in their colours.

use super::marks::{DrawnMark, MarkMeaning};
use super::pieces::{HolePiece, SlotPiece, both};
use super::{Chosen, DrawnPieces, Marks};
use crate::view::{
    Colour, Disc, FilledLayer as Area, HoleState, Line, Palette, Plate, Scene, SceneSlot, UNORDERED, Width,
};
use annulus_core::board::drawing::Layer;
use annulus_core::units::Length;

const LEAST_MM: [f32; 2] = [100.0, 80.0];
const WANTED_MM: f32 = 20.0;
const MARGIN_MM: f32 = 5.0;
/// The sheet's edges are at multiples of this, mm.
const ROUND_MM: f32 = 10.0;
/// Share of a thing's colour that the far side keeps.
const FAR_SHARE: f32 = 0.5;
/// Share of a thing's colour that a dimmed layer keeps.
const DIM_SHARE: f32 = 0.15;

/// The scene of a drawing. `under` is the board's edge from the files below it. `front` is the side in front.
/// If `only` is given, everything on other layers is dimmed.
pub fn scene(
    (sheet, under): (&DrawnPieces, &[Vec<[f32; 2]>]),
    chosen: &Chosen,
    (front, only): (Layer, Option<Layer>),
    palette: &Palette,
) -> Scene {
    let colour = |layer: Layer| own(layer, palette);
    let near = |layer: Layer| layer == front;
    let far = |layer: Layer| layer != front && layer != Layer::Edge;
    let seen = |layer: Layer| {
        let full = colour(layer);
        match only {
            Some(only) if !only.meets(layer) => full.mixed(palette.plate, DIM_SHARE),
            None if far(layer) => full.mixed(palette.plate, FAR_SHARE),
            _ => full,
        }
    };
    let order: [&dyn Fn(Layer) -> bool; 3] = [&far, &near, &|layer| layer == Layer::Edge];
    let mut layers: Vec<Area> = Vec::with_capacity(sheet.areas.len() + 1);
    for wanted in order {
        let own = sheet.areas.iter().filter(|(layer, _)| wanted(*layer));
        layers.extend(own.map(|(layer, mesh)| Area {
            mesh: mesh.clone(),
            colour: seen(*layer),
            openings: false,
        }));
    }
    if !chosen.mesh.triangles.is_empty() {
        layers.push(Area { mesh: chosen.mesh.clone(), colour: palette.selected.alpha(110), openings: false });
    }
    let slots = sheet.slots.iter().map(|slot| slot.width);
    let mut sizes: Vec<Length> = sheet.holes.iter().map(|hole| hole.diameter).chain(slots).collect();
    sizes.sort_unstable();
    sizes.dedup();
    let tool = |diameter: Length| palette.tool(sizes.partition_point(|size| *size < diameter));
    let slot = |slot: &SlotPiece| SceneSlot {
        path_mm: slot.path_mm.clone(),
        width_mm: slot.width.mm() as f32,
        colour: tool(slot.width),
    };
    let disc = |hole: &HolePiece| Disc {
        centre_mm: hole.at_mm,
        radius_mm: hole.diameter.mm() as f32 / 2.0,
        colour: tool(hole.diameter),
        state: HoleState::Planned,
        order: UNORDERED,
    };
    let node = |at: &[f32; 2]| line(*at, *at, Width::Px(4.0), palette.silk.alpha(150));
    let nodes = sheet.nodes.iter().map(node);
    let ground = match only {
        Some(only) if only != Layer::Edge => DIM_SHARE,
        _ => FAR_SHARE,
    };
    let ground = palette.outline.mixed(palette.plate, ground);
    let under_edges = under.iter().flat_map(|ring| {
        let on = ring.iter().cycle().skip(1);
        ring.iter().zip(on).map(|(a, b)| line(*a, *b, Width::Px(1.25), ground))
    });
    let edges = sheet.edges.iter().map(|[a, b]| line(*a, *b, Width::Px(1.25), seen(Layer::Edge)));
    let bounds_mm = under.iter().flatten().fold(sheet.bounds_mm, |all, at| both(all, Some([*at; 2])));
    Scene {
        plate: Some(plate(bounds_mm)),
        layers,
        lines: under_edges
            .chain(edges)
            .chain(nodes)
            .chain(chosen.rims.iter().map(|mark| stroke(mark, palette)))
            .collect(),
        slots: sheet.slots.iter().map(slot).collect(),
        discs: sheet.holes.iter().map(disc).collect(),
        wanted_mm: bounds_mm.map(wanted),
        chosen_mm: chosen.mesh.bounds_mm(),
        ..Scene::default()
    }
}

pub fn over(marks: &Marks, palette: &Palette) -> Vec<Line> {
    marks.strokes.iter().map(|mark| stroke(mark, palette)).collect()
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

fn stroke(mark: &DrawnMark, palette: &Palette) -> Line {
    let (px, colour) = match mark.kind {
        MarkMeaning::Chosen => (1.75, palette.selected),
        MarkMeaning::ChosenNode => (13.0, palette.selected),
        MarkMeaning::Coming(layer) => (2.0, own(layer, palette).alpha(150)),
        MarkMeaning::Box => (1.5, palette.current),
        MarkMeaning::Measure => (2.0, palette.head),
        MarkMeaning::Caught => (10.0, palette.current.alpha(200)),
        MarkMeaning::Middle => (7.0, palette.current.alpha(160)),
    };
    line(mark.a_mm, mark.b_mm, mark.width_mm.map_or(Width::Px(px), Width::Mm), colour)
}

/// The bounds with some margin, and at least [`WANTED_MM`] in each direction.
fn wanted([low, high]: [[f32; 2]; 2]) -> [[f32; 2]; 2] {
    let room = |axis: usize| (WANTED_MM - (high[axis] - low[axis])).max(0.0) / 2.0 + 1.0;
    [[low[0] - room(0), low[1] - room(1)], [high[0] + room(0), high[1] + room(1)]]
}

fn plate(bounds_mm: Option<[[f32; 2]; 2]>) -> Plate {
    let [low, high] = bounds_mm.unwrap_or([[0.0; 2], LEAST_MM]);
    let down = |mm: f32| libm::floorf((mm - MARGIN_MM) / ROUND_MM) * ROUND_MM;
    let up = |mm: f32| libm::ceilf((mm + MARGIN_MM) / ROUND_MM) * ROUND_MM;
    let min_mm = [down(low[0].min(MARGIN_MM)), down(low[1].min(MARGIN_MM))];
    let max_mm = [up(high[0]).max(LEAST_MM[0]), up(high[1]).max(LEAST_MM[1])];
    Plate { min_mm, max_mm, corner_mm: 1.0 }
}
