//! The layers on the GPU: their triangles, written only when a layer is another one, and a colour each.
//!
//! ```text
//! mesh ─▶ corners, indices     once: of the triangles, and of the edges round them
//! colour ─▶ tints[n]           whenever eye or opacity changes: four bytes
//!
//! a film with openings, by the alpha of the picture itself, which is 1 before and after:
//!   body ─▶ its share │ openings ─▶ 0 │ body ─▶ its colour by that alpha │ both ─▶ 1
//! ```
//!
//! Comes in: [`FilledLayer`]s, the lowest first. Goes out: draws. Does not know what they show.

use super::buffers::{fill, vertex_buffer};
use super::palette::Colour;
use super::pipelines::{Make, OVER, Paint};
use super::scene::{FilledLayer, Mesh};
use std::sync::Arc;

const TINT_BYTES: u64 = size_of::<Colour>() as u64;

/// One layer's triangles.
struct Area {
    mesh: Arc<Mesh>,
    corners: wgpu::Buffer,
    indices: wgpu::Buffer,
    edges: wgpu::Buffer,
    edge_ends: u32,
}

/// The body of the board, three corners each triangle.
pub(super) struct Cover<'a> {
    pub(super) corners: &'a wgpu::Buffer,
    pub(super) count: u32,
}

/// All layers.
pub(super) struct Layers {
    filled: wgpu::RenderPipeline,
    edged: wgpu::RenderPipeline,
    /// Only the alpha of the picture.
    share: wgpu::RenderPipeline,
    /// Only the colours of the picture, by its own alpha.
    film: wgpu::RenderPipeline,
    areas: Vec<(Area, Drawn)>,
    tints: wgpu::Buffer,
}

/// How an area is drawn: its tint, or the first of three of a film.
#[derive(Clone, Copy)]
enum Drawn {
    Filled(u64),
    Film(u64),
}

const SHARE: Paint = Paint { blend: None, writes: wgpu::ColorWrites::ALPHA };
const BY_SHARE: wgpu::BlendComponent = wgpu::BlendComponent {
    src_factor: wgpu::BlendFactor::DstAlpha,
    dst_factor: wgpu::BlendFactor::OneMinusDstAlpha,
    operation: wgpu::BlendOperation::Add,
};
const FILM: Paint = Paint {
    blend: Some(wgpu::BlendState { color: BY_SHARE, alpha: BY_SHARE }),
    writes: wgpu::ColorWrites::COLOR,
};

impl Layers {
    pub(super) fn new(device: &wgpu::Device, make: &Make<'_>) -> Self {
        let corners = wgpu::VertexBufferLayout {
            array_stride: size_of::<[f32; 2]>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &wgpu::vertex_attr_array![0 => Float32x2],
        };
        let tints = wgpu::VertexBufferLayout {
            array_stride: TINT_BYTES,
            step_mode: wgpu::VertexStepMode::Instance,
            attributes: &wgpu::vertex_attr_array![1 => Unorm8x4],
        };
        let buffers = [Some(corners), Some(tints)];
        let filling = (["layer_corner", "layer_colour"], wgpu::PrimitiveTopology::TriangleList);
        let edge = (["edge_corner", "layer_colour"], wgpu::PrimitiveTopology::LineList);
        Self {
            filled: make(&OVER, filling, &buffers),
            edged: make(&OVER, edge, &buffers),
            share: make(&SHARE, filling, &buffers),
            film: make(&FILM, filling, &buffers),
            areas: Vec::new(),
            tints: vertex_buffer(device, 64),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.areas.is_empty()
    }

    /// Shows `layers` and no others. What is on the GPU already is not written again.
    pub(super) fn set(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, layers: &[FilledLayer]) {
        let mut before = std::mem::take(&mut self.areas);
        let wanted = layers.iter().filter(|layer| layer.openings || !layer.mesh.triangles.is_empty());
        let mut tints: Vec<Colour> = Vec::new();
        for layer in wanted {
            let first = tints.len() as u64;
            tints.push(layer.colour);
            if layer.openings {
                tints.extend([layer.colour.alpha(0), layer.colour.alpha(255)]);
            }
            let known = before.iter().position(|(area, _)| Arc::ptr_eq(&area.mesh, &layer.mesh));
            let area =
                known.map_or_else(|| area(device, queue, &layer.mesh), |index| before.swap_remove(index).0);
            self.areas.push((area, if layer.openings { Drawn::Film(first) } else { Drawn::Filled(first) }));
        }
        fill(device, queue, &mut self.tints, bytemuck::cast_slice(&tints));
    }

    /// Each layer, and over it its edges where they are `edged`.
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>, cover: &Cover<'_>, edged: bool) {
        for (area, drawn) in &self.areas {
            match *drawn {
                Drawn::Film(first) => self.draw_film(pass, cover, area, first),
                Drawn::Filled(tint) => {
                    pass.set_pipeline(&self.filled);
                    self.draw_area(pass, area, tint);
                }
            }
            if edged && area.edge_ends > 0 && matches!(drawn, Drawn::Filled(_)) {
                pass.set_pipeline(&self.edged);
                pass.set_index_buffer(area.edges.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed(0..area.edge_ends, 0, 0..1);
            }
        }
    }

    fn draw_film(&self, pass: &mut wgpu::RenderPass<'_>, cover: &Cover<'_>, area: &Area, first: u64) {
        let [own, none, full] = [first, first + 1, first + 2];
        pass.set_pipeline(&self.share);
        self.draw_cover(pass, cover, own);
        self.draw_area(pass, area, none);
        pass.set_pipeline(&self.film);
        self.draw_cover(pass, cover, full);
        pass.set_pipeline(&self.share);
        self.draw_cover(pass, cover, full);
        self.draw_area(pass, area, full);
    }

    fn draw_cover(&self, pass: &mut wgpu::RenderPass<'_>, cover: &Cover<'_>, tint: u64) {
        pass.set_vertex_buffer(0, cover.corners.slice(..));
        pass.set_vertex_buffer(1, self.tints.slice(tint * TINT_BYTES..));
        pass.draw(0..cover.count, 0..1);
    }

    fn draw_area(&self, pass: &mut wgpu::RenderPass<'_>, area: &Area, tint: u64) {
        pass.set_vertex_buffer(0, area.corners.slice(..));
        pass.set_vertex_buffer(1, self.tints.slice(tint * TINT_BYTES..));
        pass.set_index_buffer(area.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass.draw_indexed(0..3 * area.mesh.triangles.len() as u32, 0, 0..1);
    }
}

fn area(device: &wgpu::Device, queue: &wgpu::Queue, mesh: &Arc<Mesh>) -> Area {
    let corner_bytes: &[u8] = bytemuck::cast_slice(&mesh.corners_mm);
    let mut corners = vertex_buffer(device, corner_bytes.len() as u64);
    fill(device, queue, &mut corners, corner_bytes);
    let indices = index_buffer(device, queue, bytemuck::cast_slice(&mesh.triangles));
    let ends: Vec<[u32; 2]> = mesh.edges().collect();
    let edges = index_buffer(device, queue, bytemuck::cast_slice(&ends));
    Area { mesh: mesh.clone(), corners, indices, edges, edge_ends: 2 * ends.len() as u32 }
}

fn index_buffer(device: &wgpu::Device, queue: &wgpu::Queue, bytes: &[u8]) -> wgpu::Buffer {
    let indices = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("indices"),
        size: (bytes.len() as u64).next_multiple_of(4).max(4),
        usage: wgpu::BufferUsages::INDEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    queue.write_buffer(&indices, 0, bytes);
    indices
}
