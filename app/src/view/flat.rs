//! The renderer without a GPU: draws the scene on a 2D canvas. Slower, and without shading.

use super::gpu::Look;
use super::marks::Emphasis;
use super::palette::Colour;
use super::scene::{Disc, FilledLayer, HoleState, Line, Mesh, UNORDERED, Width};
use std::cell::OnceCell;
use std::f64::consts::TAU;
use wasm_bindgen::JsCast;
use web_sys::{CanvasRenderingContext2d, HtmlCanvasElement};

pub(super) struct Flat {
    canvas: HtmlCanvasElement,
    context: CanvasRenderingContext2d,
    /// A second canvas to cut the openings into a film; created at first use.
    sheet: OnceCell<Option<(HtmlCanvasElement, CanvasRenderingContext2d)>>,
}

impl Flat {
    /// Fails with the reason if there is no 2D context.
    pub(super) fn new(canvas: &HtmlCanvasElement) -> Result<Self, String> {
        let context = context_of(canvas).ok_or("this browser has no 2D canvas")?;
        Ok(Self { canvas: canvas.clone(), context, sheet: OnceCell::new() })
    }

    pub(super) fn paint(&self, look: &Look<'_>, emphasis: &Emphasis) {
        let density = look.density;
        let _ = self.context.set_transform(density, 0.0, 0.0, density, 0.0, 0.0);
        let (width, height) = (f64::from(self.canvas.width()), f64::from(self.canvas.height()));
        self.context.set_fill_style_str(&look.palette.background.css());
        self.context.fill_rect(0.0, 0.0, width, height);
        self.context.set_line_cap("round");
        self.plate(look);
        self.body(look);
        self.layers(look);
        for ring in &look.scene.outline {
            let closed: Vec<_> = ring.iter().chain(ring.first()).copied().collect();
            self.path(look, &closed, 1.5, look.palette.outline);
        }
        for slot in &look.scene.slots {
            let width = f64::from(slot.width_mm) * look.camera.px_per_mm;
            self.path(look, &slot.path_mm, width, slot.colour);
            self.path(look, &slot.path_mm, (width - 3.5).max(0.0), look.palette.bore);
        }
        for line in &look.scene.lines {
            self.line(look, line);
        }
        for (index, disc) in look.scene.discs.iter().enumerate() {
            self.disc(look, disc, emphasis.selected(index), emphasis.hovered(index));
        }
        for line in look.over {
            self.line(look, line);
        }
        if let Some(at) = look.head_mm {
            self.head(look, at);
        }
    }

    fn plate(&self, look: &Look<'_>) {
        let Some(plate) = look.scene.plate else { return };
        let low = look.camera.to_px(plate.min_mm.map(f64::from));
        let high = look.camera.to_px(plate.max_mm.map(f64::from));
        let corner = f64::from(plate.corner_mm) * look.camera.px_per_mm;
        let left = low[0].min(high[0]);
        let width = (high[0] - low[0]).abs();
        self.context.begin_path();
        let _ = self.context.round_rect_with_f64(left, high[1], width, low[1] - high[1], corner);
        self.context.set_fill_style_str(&look.palette.plate.css());
        self.context.fill();
        self.stroke(1.5, look.palette.edge);
    }

    fn body(&self, look: &Look<'_>) {
        fill(&self.context, look, look.scene.body.iter().copied(), look.palette.plate);
        // Closes the hairlines between neighbouring triangles.
        self.stroke(0.75, look.palette.plate);
        for ring in &look.scene.outline {
            let closed: Vec<_> = ring.iter().chain(ring.first()).copied().collect();
            self.path(look, &closed, 4.0, look.palette.edge);
        }
    }

    /// Each layer is one path, because separate translucent triangles would show their seams.
    fn layers(&self, look: &Look<'_>) {
        for layer in &look.scene.layers {
            if layer.openings {
                self.film(look, layer);
                continue;
            }
            fill(&self.context, look, mesh_corners(&layer.mesh), layer.colour);
        }
    }

    /// Draws the body without the layer's openings, composed on the second canvas.
    fn film(&self, look: &Look<'_>, layer: &FilledLayer) {
        let made = || {
            let sheet = self.canvas.owner_document()?.create_element("canvas").ok()?;
            let sheet: HtmlCanvasElement = sheet.dyn_into().ok()?;
            let context = context_of(&sheet)?;
            Some((sheet, context))
        };
        let Some((sheet, on_sheet)) = self.sheet.get_or_init(made) else { return };
        // Setting the size clears a canvas.
        sheet.set_width(self.canvas.width());
        sheet.set_height(self.canvas.height());
        let _ = on_sheet.set_transform(look.density, 0.0, 0.0, look.density, 0.0, 0.0);
        let solid = layer.colour.alpha(255);
        fill(on_sheet, look, look.scene.cover().iter().copied(), solid);
        let _ = on_sheet.set_global_composite_operation("destination-out");
        fill(on_sheet, look, mesh_corners(&layer.mesh), solid);
        self.context.save();
        let _ = self.context.set_transform(1.0, 0.0, 0.0, 1.0, 0.0, 0.0);
        self.context.set_global_alpha(f64::from(layer.colour.0[3]) / 255.0);
        let _ = self.context.draw_image_with_html_canvas_element(sheet, 0.0, 0.0);
        self.context.restore();
    }

    fn path(&self, look: &Look<'_>, points: &[[f32; 2]], width_px: f64, colour: Colour) {
        self.context.begin_path();
        for (index, point) in points.iter().enumerate() {
            let [x, y] = look.camera.to_px(point.map(f64::from));
            if index == 0 { self.context.move_to(x, y) } else { self.context.line_to(x, y) }
        }
        self.stroke(width_px, colour);
    }

    fn stroke(&self, width_px: f64, colour: Colour) {
        if width_px > 0.0 {
            self.context.set_line_width(width_px);
            self.context.set_stroke_style_str(&colour.css());
            self.context.stroke();
        }
    }

    fn line(&self, look: &Look<'_>, line: &Line) {
        let width = match line.width {
            Width::Px(px) => f64::from(px),
            Width::Mm(mm) => f64::from(mm) * look.camera.px_per_mm,
        };
        let passed = line.order != UNORDERED && line.order < look.progress.lines;
        let colour = if passed { look.palette.travelled } else { line.colour };
        self.path(look, &[line.a_mm, line.b_mm], width, colour);
    }

    fn disc(&self, look: &Look<'_>, disc: &Disc, selected: bool, hovered: bool) {
        let palette = look.palette;
        let at = look.camera.to_px(disc.centre_mm.map(f64::from));
        let radius = (f64::from(disc.radius_mm) * look.camera.px_per_mm).max(1.4);
        let rim = (0.3 * radius).clamp(1.25, 4.5);
        let state = look.progress.state(disc.order, disc.state);
        let (fill, ring, ring_width) = match state {
            HoleState::Done => (palette.done, palette.bore.alpha(110), 0.45 * rim),
            HoleState::Current => (palette.bore, palette.current, rim),
            HoleState::Failed => (palette.bore, palette.failed, rim),
            HoleState::Planned | HoleState::Skipped | HoleState::Dimmed => (palette.bore, disc.colour, rim),
        };
        self.context.set_global_alpha(if state == HoleState::Dimmed { 0.35 } else { 1.0 });
        self.circle(at, radius);
        self.context.set_fill_style_str(&fill.css());
        self.context.fill();
        self.circle(at, radius - ring_width / 2.0);
        self.stroke(ring_width, ring);
        let arm = radius * 0.7;
        if matches!(state, HoleState::Skipped | HoleState::Failed) {
            self.segment([at[0] - arm, at[1] - arm], [at[0] + arm, at[1] + arm], rim, ring);
        }
        if state == HoleState::Failed {
            self.segment([at[0] - arm, at[1] + arm], [at[0] + arm, at[1] - arm], rim, ring);
        }
        self.context.set_global_alpha(1.0);
        let halos = [
            (state == HoleState::Current, 4.0, palette.current),
            (state == HoleState::Failed, 2.0, palette.bore),
            (state == HoleState::Failed, 4.0, palette.failed),
            (selected || hovered, 3.0, palette.selected),
        ];
        for (_, away, colour) in halos.into_iter().filter(|halo| halo.0) {
            self.circle(at, radius + away);
            self.stroke(2.0, colour);
        }
    }

    fn head(&self, look: &Look<'_>, at_mm: [f32; 2]) {
        let at = look.camera.to_px(at_mm.map(f64::from));
        let colour = look.palette.head;
        self.circle(at, 9.0);
        self.stroke(1.5, colour);
        for [x, y] in [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]] {
            let from = [at[0] + 4.0 * x, at[1] + 4.0 * y];
            self.segment(from, [at[0] + 16.0 * x, at[1] + 16.0 * y], 1.5, colour);
        }
    }

    fn circle(&self, at: [f64; 2], radius: f64) {
        self.context.begin_path();
        let _ = self.context.arc(at[0], at[1], radius.max(0.0), 0.0, TAU);
    }

    fn segment(&self, a: [f64; 2], b: [f64; 2], width: f64, colour: Colour) {
        self.context.begin_path();
        self.context.move_to(a[0], a[1]);
        self.context.line_to(b[0], b[1]);
        self.stroke(width, colour);
    }
}

fn context_of(canvas: &HtmlCanvasElement) -> Option<CanvasRenderingContext2d> {
    canvas.get_context("2d").ok().flatten().and_then(|context| context.dyn_into().ok())
}

/// Three corners per triangle.
fn mesh_corners(mesh: &Mesh) -> impl Iterator<Item = [f32; 2]> + '_ {
    let corner = |index: &u32| mesh.corners_mm.get(*index as usize).copied().unwrap_or_default();
    mesh.triangles.iter().flatten().map(corner)
}

fn fill(
    context: &CanvasRenderingContext2d,
    look: &Look<'_>,
    corners: impl Iterator<Item = [f32; 2]>,
    colour: Colour,
) {
    context.begin_path();
    for (index, corner) in corners.enumerate() {
        let [x, y] = look.camera.to_px(corner.map(f64::from));
        if index % 3 == 0 {
            context.move_to(x, y);
        } else {
            context.line_to(x, y);
        }
        if index % 3 == 2 {
            context.close_path();
        }
    }
    context.set_fill_style_str(&colour.css());
    context.fill();
}
