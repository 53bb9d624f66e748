//! The static part of the 2D view: ground, board body and layers, drawn into a separate picture.

use super::areas::{Corners, Cover, Layers};
use super::off_screen::{Fit, Laying, OffScreen};
use super::pipelines::{Make, OVER};
use super::{fill, vertex_buffer};

const CORNER_SIZE: u64 = size_of::<[f32; 2]>() as u64;

pub(super) struct Still {
    ground: wgpu::RenderPipeline,
    body: wgpu::RenderPipeline,
    layers: Layers,
    /// The board's body, including a plate.
    triangles: wgpu::Buffer,
    cover_count: u32,
    /// Number of corners drawn as the body; 0 for a plate, which the ground shader draws.
    corner_count: u32,
    laying: Laying,
    samples: u32,
    picture: Option<OffScreen>,
    /// The uniforms of the current picture; none if it must be redrawn.
    drawn_with: Option<Vec<u8>>,
}

impl Still {
    /// For windows of `format`. `make` creates pipelines with this many samples.
    pub(super) fn new(
        device: &wgpu::Device,
        (format, samples): (wgpu::TextureFormat, u32),
        make: &Make<'_>,
    ) -> Self {
        let (strip, list) = (wgpu::PrimitiveTopology::TriangleStrip, wgpu::PrimitiveTopology::TriangleList);
        let corners = wgpu::VertexBufferLayout {
            array_stride: CORNER_SIZE,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &wgpu::vertex_attr_array![0 => Float32x2],
        };
        Self {
            ground: make(&OVER, (["ground_corner", "ground_colour"], strip), &[]),
            body: make(&OVER, (["body_corner", "body_colour"], list), &[Some(corners)]),
            layers: Layers::new(device, make),
            triangles: vertex_buffer(device, CORNER_SIZE),
            cover_count: 0,
            corner_count: 0,
            laying: Laying::new(device, format, Fit::Same),
            samples,
            picture: None,
            drawn_with: None,
        }
    }

    /// Replaces the body, two numbers per corner; the first `body` corners are drawn.
    pub(super) fn set_body(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        corners_mm: &[f32],
        body: u32,
    ) {
        self.cover_count = corners_mm.len() as u32 / 2;
        self.corner_count = body.min(self.cover_count);
        fill(device, queue, &mut self.triangles, bytemuck::cast_slice(corners_mm));
        self.drawn_with = None;
    }

    pub(super) fn add_mesh(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, mesh: Corners<'_>) -> u32 {
        self.layers.add(device, queue, mesh)
    }

    pub(super) fn set_layers(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, rows: &[u32]) {
        self.layers.set(device, queue, rows);
        self.drawn_with = None;
    }

    /// Redraws the picture for a window of `size_px`, unless it exists with the same input `with`: uniforms,
    /// and whether layers have edges.
    pub(super) fn draw(
        &mut self,
        (device, encoder): (&wgpu::Device, &mut wgpu::CommandEncoder),
        numbers: &wgpu::BindGroup,
        size_px: [u32; 2],
        (with, edged): (&[u8], bool),
    ) {
        if self.picture.as_ref().is_none_or(|picture| picture.size_px != size_px) {
            self.picture = Some(self.laying.picture(device, size_px, self.samples));
            self.drawn_with = None;
        }
        let Some(picture) = self.picture.as_ref().filter(|_| self.drawn_with.as_deref() != Some(with)) else {
            return;
        };
        let mut pass = picture.begin(encoder);
        pass.set_bind_group(0, numbers, &[]);
        pass.set_pipeline(&self.ground);
        pass.draw(0..3, 0..1);
        if self.corner_count > 0 {
            pass.set_pipeline(&self.body);
            pass.set_vertex_buffer(0, self.triangles.slice(..));
            pass.draw(0..self.corner_count, 0..1);
        }
        if !self.layers.is_empty() {
            let cover = Cover { corners: &self.triangles, count: self.cover_count };
            self.layers.draw(&mut pass, &cover, edged);
        }
        drop(pass);
        self.drawn_with = Some(with.to_vec());
    }

    pub(super) fn lay(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let Some(picture) = &self.picture {
            self.laying.lay(pass, picture);
        }
    }
}
