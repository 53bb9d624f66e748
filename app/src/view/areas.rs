//! The layers on the GPU: their triangles, written only when a layer is another one, and a colour each.
//!
//! ```text
//! mesh ─▶ corners, indices     once: of the triangles, and of the edges round them
//! colour ─▶ tints[n]           whenever eye or opacity changes: four bytes
//! ```
//!
//! Comes in: [`FilledLayer`]s, the lowest first. Goes out: draws. Does not know what they show.

use super::buffers::{fill, vertex_buffer};
use super::palette::Colour;
use super::scene::{FilledLayer, Mesh};
use std::sync::Arc;

/// One layer's triangles.
struct Area {
    mesh: Arc<Mesh>,
    corners: wgpu::Buffer,
    indices: wgpu::Buffer,
    edges: wgpu::Buffer,
    edge_ends: u32,
}

/// All layers.
pub(super) struct Layers {
    areas: Vec<Area>,
    tints: wgpu::Buffer,
}

impl Layers {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        Self { areas: Vec::new(), tints: vertex_buffer(device, 64) }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.areas.is_empty()
    }

    /// Shows `layers` and no others. What is on the GPU already is not written again.
    pub(super) fn set(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, layers: &[FilledLayer]) {
        let mut before = std::mem::take(&mut self.areas);
        let wanted = layers.iter().filter(|layer| !layer.mesh.triangles.is_empty());
        let mut tints: Vec<Colour> = Vec::new();
        for layer in wanted {
            tints.push(layer.colour);
            let known = before.iter().position(|area| Arc::ptr_eq(&area.mesh, &layer.mesh));
            self.areas.push(
                known.map_or_else(|| area(device, queue, &layer.mesh), |index| before.swap_remove(index)),
            );
        }
        fill(device, queue, &mut self.tints, bytemuck::cast_slice(&tints));
    }

    /// Each layer by `filled`, and over it its edges by `edged`, where there is such a pipeline.
    pub(super) fn draw(
        &self,
        pass: &mut wgpu::RenderPass<'_>,
        filled: &wgpu::RenderPipeline,
        edged: Option<&wgpu::RenderPipeline>,
    ) {
        for (number, area) in (0..).zip(&self.areas) {
            pass.set_pipeline(filled);
            let tint = number * size_of::<Colour>() as u64;
            pass.set_vertex_buffer(0, area.corners.slice(..));
            pass.set_vertex_buffer(1, self.tints.slice(tint..));
            pass.set_index_buffer(area.indices.slice(..), wgpu::IndexFormat::Uint32);
            pass.draw_indexed(0..3 * area.mesh.triangles.len() as u32, 0, 0..1);
            if let Some(edged) = edged.filter(|_| area.edge_ends > 0) {
                pass.set_pipeline(edged);
                pass.set_index_buffer(area.edges.slice(..), wgpu::IndexFormat::Uint32);
                pass.draw_indexed(0..area.edge_ends, 0, 0..1);
            }
        }
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
