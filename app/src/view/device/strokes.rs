//! Marks on the GPU: two triangles each; the vertex shader reads the mark from a texture.
//!
//! ```text
//! texture RGBA32Uint      a.x a.y b.x b.y │ radius_mm radius_px colour bits │ next mark …    1,024 a row
//! vertex 6 m + 0 … 5  ─▶  mark m
//! ```
//!
//! No instancing: software renderers set up each instance as a separate draw, at 50 µs per mark.

use super::pipelines::{OVER, group, group_layout, pipeline, pipeline_layout, texture_of};
use std::ops::Range;

/// Marks per texture row; the shader has the same number.
const ROW: u32 = 1024;
const BYTES: u32 = 32;
/// Texels per mark, 16 bytes each.
const TEXELS: u32 = BYTES / 16;
/// Vertices per mark: two triangles.
const CORNERS: u32 = 6;

pub(super) struct Strokes {
    lines: wgpu::RenderPipeline,
    discs: wgpu::RenderPipeline,
    head: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    Lines,
    Discs,
    Head,
}

/// A texture of marks.
pub(super) struct Sheaf {
    texture: wgpu::Texture,
    group: wgpu::BindGroup,
    count: u32,
}

impl Strokes {
    /// For windows of `format`. `frame` is the bind group layout of the uniforms.
    pub(super) fn new(
        device: &wgpu::Device,
        format: wgpu::TextureFormat,
        shader: &wgpu::ShaderModule,
        frame: &wgpu::BindGroupLayout,
    ) -> Self {
        let texels = texture_of(wgpu::TextureSampleType::Uint);
        let layout = group_layout(device, &[(wgpu::ShaderStages::VERTEX, texels)]);
        let of_pipelines = pipeline_layout(device, &[frame, &layout]);
        let [lines, discs, head] = ["line_colour", "disc_colour", "head_colour"].map(|colour| {
            let drawing = (["stroke_corner", colour], wgpu::PrimitiveTopology::TriangleList);
            pipeline(device, (&of_pipelines, shader), (format, 1), &OVER, drawing, &[])
        });
        Self { lines, discs, head, layout }
    }

    pub(super) fn sheaf(&self, device: &wgpu::Device) -> Sheaf {
        self.with_rows(device, 1)
    }

    fn with_rows(&self, device: &wgpu::Device, rows: u32) -> Sheaf {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("marks"),
            size: wgpu::Extent3d { width: ROW * TEXELS, height: rows, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: wgpu::TextureFormat::Rgba32Uint,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let group = group(device, &self.layout, [wgpu::BindingResource::TextureView(&view)]);
        Sheaf { texture, group, count: 0 }
    }

    /// Replaces all marks; drops those beyond the maximum texture size.
    pub(super) fn set(
        &self,
        sheaf: &mut Sheaf,
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        marks: &[u8],
    ) {
        let most = device.limits().max_texture_dimension_2d;
        let count = marks.len() as u32 / BYTES;
        let rows = count.div_ceil(ROW).min(most);
        if rows > sheaf.texture.height() {
            *sheaf = self.with_rows(device, rows.next_power_of_two().min(most));
        }
        sheaf.count = count.min(rows * ROW);
        sheaf.write(queue, 0, marks);
    }

    /// Draws a range of marks. The uniforms must be bound.
    pub(super) fn draw(&self, pass: &mut wgpu::RenderPass<'_>, kind: Kind, sheaf: &Sheaf, range: Range<u32>) {
        let (first, end) = (range.start.min(sheaf.count), range.end.min(sheaf.count));
        if first >= end {
            return;
        }
        pass.set_pipeline(match kind {
            Kind::Lines => &self.lines,
            Kind::Discs => &self.discs,
            Kind::Head => &self.head,
        });
        pass.set_bind_group(1, &sheaf.group, &[]);
        pass.draw(first * CORNERS..end * CORNERS, 0..1);
    }
}

impl Sheaf {
    /// Overwrites marks from index `first` on, row by row.
    pub(super) fn write(&self, queue: &wgpu::Queue, mut first: u32, mut marks: &[u8]) {
        let room = (self.count.saturating_sub(first) * BYTES) as usize;
        marks = &marks[..marks.len().min(room)];
        while !marks.is_empty() {
            let (column, left) = (first % ROW, marks.len() as u32 / BYTES);
            let whole = if column == 0 { left / ROW } else { 0 };
            let (width, height) = if whole > 0 { (ROW, whole) } else { ((ROW - column).min(left), 1) };
            if width == 0 {
                return;
            }
            let (now, rest) = marks.split_at((width * height * BYTES) as usize);
            queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture: &self.texture,
                    mip_level: 0,
                    origin: wgpu::Origin3d { x: column * TEXELS, y: first / ROW, z: 0 },
                    aspect: wgpu::TextureAspect::All,
                },
                now,
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(width * BYTES),
                    rows_per_image: None,
                },
                wgpu::Extent3d { width: width * TEXELS, height, depth_or_array_layers: 1 },
            );
            (first, marks) = (first + width * height, rest);
        }
    }
}
