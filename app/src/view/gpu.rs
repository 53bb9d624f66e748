//! The GPU renderer on the page's side: encodes scenes as bytes for a [`Device`].
//!
//! ```text
//! Scene ─ marks, meshes, numbers ─▶ bytes ─▶ Device    a separate WebAssembly file: wgpu, shaders
//! ```

use super::camera::Camera;
#[cfg(test)]
use super::device::Device;
use super::marks::{self, Afar, Emphasis, Mark};
use super::numbers::{FlatNumbers, Painted, SpaceNumbers};
use super::orbit::Orbit;
use super::palette::Palette;
use super::relief::{Cutting, PATCH, Patch, ReliefField};
#[cfg(not(test))]
use super::remote::Device;
use super::scene::{FilledLayer, Line, Mesh, OrderProgress, Scene};
use std::ops::Range;
use std::sync::Arc;
use web_sys::HtmlCanvasElement;

/// From this zoom on, layers have edges; `edge_corner` in the shader fades them in.
const EDGED_FROM_PX_PER_MM: f64 = 8.0;
/// A coarse frame has one pixel per this many window pixels in each direction.
const COARSE_PX: u32 = 3;
/// A tile without cuts.
const UNCUT: &[u16] = &[0; PATCH * PATCH];

pub(super) struct Look<'a> {
    pub(super) camera: &'a Camera,
    pub(super) density: f64,
    pub(super) scene: &'a Scene,
    pub(super) over: &'a [Line],
    pub(super) palette: &'a Palette,
    pub(super) grid: bool,
    pub(super) progress: OrderProgress,
    pub(super) head_mm: Option<[f32; 2]>,
    /// The 3D view, drawn instead of everything else.
    pub(super) solid: Option<(&'a ReliefField, &'a Orbit, Option<Cutting>)>,
    /// Full resolution, however long it takes.
    pub(super) sharp: bool,
}

pub(super) struct Gpu {
    device: Device,
    size_px: [u32; 2],
    most_px: u32,
    /// A graphics card, not a software renderer.
    hardware: bool,
    count: u32,
    first_disc: usize,
    afar: Afar,
    meshes: Vec<(Arc<Mesh>, u32)>,
}

impl Gpu {
    /// Opens a device on `canvas`. `kind` is `webgpu`, `webgl2` or `best`; fails with the reason. `when_lost`
    /// is called when the device is lost.
    pub(super) async fn new(canvas: &HtmlCanvasElement, kind: &str, when_lost: fn()) -> Result<Self, String> {
        let device = Device::open(canvas, kind, when_lost).await?;
        Ok(Self {
            size_px: [canvas.width(), canvas.height()].map(|px| px.max(1)),
            most_px: device.most_px(),
            hardware: device.hardware(),
            device,
            count: 0,
            first_disc: 0,
            afar: Afar::default(),
            meshes: Vec::new(),
        })
    }

    /// Replaces the board of the 3D view. False if it is too large for the device.
    pub(super) fn set_field(&mut self, field: Option<&ReliefField>) -> bool {
        let [width, height] =
            field.map_or([0; 2], |field| field.relief.tiles().map(|tiles| (tiles * PATCH) as u32));
        let fits = width > 0 && height > 0 && width.max(height) <= self.most_px;
        let Some(field) = field.filter(|_| fits) else {
            self.device.set_depths(0, 0, false);
            return field.is_none();
        };
        self.device.set_depths(width, height, !field.under().is_empty());
        field.cut().for_each(|patch| self.patch(&patch));
        field.under().iter().for_each(|patch| self.write(patch, true));
        true
    }

    pub(super) fn patch(&self, patch: &Patch) {
        self.write(patch, false);
    }

    fn write(&self, patch: &Patch, below: bool) {
        let depths = patch.depths_um.as_deref().unwrap_or(UNCUT);
        let [x, y] = patch.first.map(|cell| cell as u32);
        if depths.len() == UNCUT.len() {
            self.device.write_depths(below, x, y, depths);
        }
    }

    /// WebGPU, else WebGL2.
    pub(super) fn is_webgpu(&self) -> bool {
        self.device.is_webgpu()
    }

    pub(super) fn resize(&mut self, width: u32, height: u32) {
        self.size_px = [width, height].map(|px| px.clamp(1, self.most_px));
        self.device.resize(self.size_px[0], self.size_px[1]);
    }

    pub(super) fn set_scene(&mut self, scene: &Scene, palette: &Palette, emphasis: &Emphasis) {
        let built = marks::build(scene, palette, emphasis);
        (self.count, self.first_disc, self.afar) = (built.all.len() as u32, built.first_disc, built.afar);
        self.device.set_marks(bytemuck::cast_slice(&built.all));
        self.device.set_body(scene.cover().as_flattened(), scene.body.len() as u32);
        self.set_layers(&scene.layers);
    }

    /// Doesn't send meshes again that the device already has.
    fn set_layers(&mut self, layers: &[FilledLayer]) {
        let mut before = std::mem::take(&mut self.meshes);
        let wanted = layers.iter().filter(|layer| layer.openings || !layer.mesh.triangles.is_empty());
        let mut rows = Vec::new();
        for layer in wanted {
            let known = before.iter().position(|(mesh, _)| Arc::ptr_eq(mesh, &layer.mesh));
            let number = match known {
                Some(index) => before.swap_remove(index).1,
                None => self.send(&layer.mesh),
            };
            self.meshes.push((layer.mesh.clone(), number));
            rows.extend([number, u32::from_le_bytes(layer.colour.0), u32::from(layer.openings)]);
        }
        self.device.set_layers(&rows);
    }

    fn send(&mut self, mesh: &Mesh) -> u32 {
        let edges: Vec<[u32; 2]> = mesh.edges().collect();
        let triangles = mesh.triangles.as_flattened();
        self.device.add_mesh(mesh.corners_mm.as_flattened(), triangles, edges.as_flattened())
    }

    pub(super) fn set_over(&mut self, over: &[Line]) {
        let marks: Vec<Mark> = over.iter().map(marks::line).collect();
        self.device.set_over(bytemuck::cast_slice(&marks));
    }

    pub(super) fn set_discs(&self, scene: &Scene, range: Range<usize>, emphasis: &Emphasis) {
        let first = (self.first_disc + range.start) as u32;
        let Some(discs) = scene.discs.get(range.clone()) else { return };
        let written: Vec<Mark> =
            range.zip(discs).map(|(index, disc)| marks::disc(index, disc, emphasis)).collect();
        self.device.write_marks(first, bytemuck::cast_slice(&written));
    }

    pub(super) fn paint(&mut self, look: &Look<'_>) -> Painted {
        let Some(solid) = look.solid else { return self.paint_flat(look) };
        let sharp = self.hardware || look.sharp;
        let drawn_px = if sharp { self.size_px } else { self.size_px.map(|px| px.div_ceil(COARSE_PX)) };
        // A software renderer is slow: one ray per pixel instead of four.
        let samples = if self.hardware { 2.0 } else { 1.0 };
        let numbers = SpaceNumbers::of(solid, drawn_px, samples, look.palette.background);
        match self.device.paint_space(bytemuck::bytes_of(&numbers)) {
            Painted::Shown if !sharp => Painted::Coarse,
            painted => painted,
        }
    }

    fn paint_flat(&mut self, look: &Look<'_>) -> Painted {
        let window = (self.size_px, look.density);
        let ground = (look.scene.plate, look.grid);
        let numbers = FlatNumbers::of(look.camera, window, ground, look.progress, look.palette);
        let px_per_mm = look.camera.px_per_mm * look.density;
        let ([before, lines], discs) = self.afar.drawn(self.count, px_per_mm);
        let ranges = [before, lines, discs].map(|range| [range.start, range.end]);
        let head = look.head_mm.map(|at| marks::head(at, look.palette));
        self.device.paint_flat(
            bytemuck::bytes_of(&numbers),
            ranges.as_flattened(),
            bytemuck::cast_slice(head.as_slice()),
            px_per_mm >= EDGED_FROM_PX_PER_MM,
        )
    }

    pub(super) fn lose(&self) {
        self.device.lose();
    }
}
