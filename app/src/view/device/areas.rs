//! The layers on the GPU: a mesh, uploaded once, and a colour each.
//!
//! ```text
//! mesh ─▶ corners, indices     uploaded once, under a number: the triangles and their edges
//! colour ─▶ tints[n]           four bytes; uploaded whenever visibility or opacity changes
//!
//! a film with openings uses the alpha of the picture itself, which is 1 before and after:
//!   body ─▶ its share │ openings ─▶ 0 │ body ─▶ its colour by that alpha │ both ─▶ 1
//! ```

use super::pipelines::{Make, OVER, Paint};
use super::{fill, vertex_buffer};
use std::collections::BTreeMap;

/// RGBA, one byte each.
type Tint = [u8; 4];
const TINT_BYTES: u64 = size_of::<Tint>() as u64;

/// Coordinates, two per corner; corner indices of triangles; corner indices of edge segments.
pub(super) type Corners<'a> = (&'a [f32], &'a [u32], &'a [u32]);

struct Area {
    corners: wgpu::Buffer,
    indices: wgpu::Buffer,
    triangle_ends: u32,
    edges: wgpu::Buffer,
    edge_ends: u32,
}

/// The body of the board, three corners per triangle.
pub(super) struct Cover<'a> {
    pub(super) corners: &'a wgpu::Buffer,
    pub(super) count: u32,
}

pub(super) struct Layers {
    filled: wgpu::RenderPipeline,
    edged: wgpu::RenderPipeline,
    /// Writes only alpha.
    share: wgpu::RenderPipeline,
    /// Writes only colour, blended by the picture's alpha.
    film: wgpu::RenderPipeline,
    areas: BTreeMap<u32, Area>,
    next: u32,
    order: Vec<(u32, Drawn)>,
    tints: wgpu::Buffer,
}

/// Index of the tint, or of the first of a film's three tints.
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
            areas: BTreeMap::new(),
            next: 0,
            order: Vec::new(),
            tints: vertex_buffer(device, 64),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.order.is_empty()
    }

    pub(super) fn add(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, mesh: Corners<'_>) -> u32 {
        self.next += 1;
        self.areas.insert(self.next, area(device, queue, mesh));
        self.next
    }

    /// Shows these layers only, three numbers each: mesh, tint, 1 if the triangles are openings. Drops all
    /// other meshes.
    pub(super) fn set(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, rows: &[u32]) {
        let mut tints: Vec<Tint> = Vec::new();
        self.order.clear();
        for row in rows.chunks_exact(3) {
            let (number, tint, openings) = (row[0], row[1].to_le_bytes(), row[2] == 1);
            let first = tints.len() as u64;
            tints.push(tint);
            if openings {
                let [red, green, blue, _] = tint;
                tints.extend([[red, green, blue, 0], [red, green, blue, 255]]);
            }
            self.order.push((number, if openings { Drawn::Film(first) } else { Drawn::Filled(first) }));
        }
        self.areas.retain(|number, _| self.order.iter().any(|(shown, _)| shown == number));
        fill(device, queue, &mut self.tints, tints.as_flattened());
    }

    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>, cover: &Cover<'_>, edged: bool) {
        for (number, drawn) in &self.order {
            let Some(area) = self.areas.get(number) else { continue };
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
        pass.draw_indexed(0..area.triangle_ends, 0, 0..1);
    }
}

fn area(device: &wgpu::Device, queue: &wgpu::Queue, (corners_mm, triangles, edges): Corners<'_>) -> Area {
    let bytes: &[u8] = bytemuck::cast_slice(corners_mm);
    let mut corners = vertex_buffer(device, bytes.len() as u64);
    fill(device, queue, &mut corners, bytes);
    Area {
        corners,
        indices: index_buffer(device, queue, bytemuck::cast_slice(triangles)),
        triangle_ends: triangles.len() as u32,
        edges: index_buffer(device, queue, bytemuck::cast_slice(edges)),
        edge_ends: edges.len() as u32,
    }
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
