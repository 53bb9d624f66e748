//! The 3D view on the GPU: depths as an integer texture, one triangle over the window, one shader.
//!
//! ```text
//! tiles of depths ─ write ─▶ texture R16Uint ─┐    (and a second one for cuts from below)
//! rays, tool ─▶ uniforms ─────────────────────┴─▶ relief.wgsl     identical on WebGPU and WebGL2
//! ```

use super::super::numbers::SpaceNumbers;
use super::super::relief::PATCH;
use super::off_screen::{Fit, Laying, OffScreen, begin};
use super::pipelines::{
    INSTEAD, NUMBERS, group, group_layout, numbers_buffer, pipeline, pipeline_layout, texture_of,
};

pub(super) struct Carved {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    numbers: wgpu::Buffer,
    depths: Option<Depths>,
    /// The target for coarse frames; created at first use.
    coarse: Option<(Laying, OffScreen)>,
    format: wgpu::TextureFormat,
}

/// Cuts from above and from below.
struct Depths {
    above: wgpu::Texture,
    below: wgpu::Texture,
    group: wgpu::BindGroup,
}

impl Carved {
    pub(super) fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        let stage = wgpu::ShaderStages::FRAGMENT;
        let depths = texture_of(wgpu::TextureSampleType::Uint);
        let layout = group_layout(device, &[(stage, NUMBERS), (stage, depths), (stage, depths)]);
        let shader = device.create_shader_module(wgpu::include_wgsl!("relief.wgsl"));
        let of_pipeline = pipeline_layout(device, &[&layout]);
        let drawing = (["corner", "colour"], wgpu::PrimitiveTopology::TriangleList);
        Self {
            pipeline: pipeline(device, (&of_pipeline, &shader), (format, 1), &INSTEAD, drawing, &[]),
            layout,
            numbers: numbers_buffer(device, size_of::<SpaceNumbers>()),
            depths: None,
            coarse: None,
            format,
        }
    }

    /// Replaces the board, without cuts. `under`: reserve a texture for cuts from below.
    pub(super) fn set(&mut self, device: &wgpu::Device, cells: [u32; 2], under: bool) {
        let above = depth_texture(device, cells);
        let below = depth_texture(device, if under { cells } else { [1, 1] });
        let [seen, under] =
            [&above, &below].map(|texture| texture.create_view(&wgpu::TextureViewDescriptor::default()));
        let read = [
            self.numbers.as_entire_binding(),
            wgpu::BindingResource::TextureView(&seen),
            wgpu::BindingResource::TextureView(&under),
        ];
        let group = group(device, &self.layout, read);
        self.depths = Some(Depths { above, below, group });
    }

    pub(super) fn write(&self, queue: &wgpu::Queue, below: bool, first: [u32; 2], depths_um: &[u16]) {
        if let Some(depths) = &self.depths {
            write(queue, if below { &depths.below } else { &depths.above }, first, depths_um);
        }
    }

    pub(super) fn draw(
        &mut self,
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        encoder: &mut wgpu::CommandEncoder,
        (view, window_px): (&wgpu::TextureView, [u32; 2]),
        numbers: &SpaceNumbers,
    ) {
        queue.write_buffer(&self.numbers, 0, bytemuck::bytes_of(numbers));
        let drawn_px = numbers.drawn_px();
        if drawn_px == window_px {
            self.cast(&mut begin(encoder, view, None));
            return;
        }
        if self.coarse.as_ref().is_none_or(|(_, picture)| picture.size_px != drawn_px) {
            let laying = Laying::new(device, self.format, Fit::Stretched);
            let picture = laying.picture(device, drawn_px, 1);
            self.coarse = Some((laying, picture));
        }
        if let Some((laying, picture)) = &self.coarse {
            self.cast(&mut picture.begin(encoder));
            laying.lay(&mut begin(encoder, view, None), picture);
        }
    }

    fn cast(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let Some(depths) = &self.depths {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &depths.group, &[]);
            pass.draw(0..3, 0..1);
        }
    }
}

/// A texture for depths in µm.
fn depth_texture(device: &wgpu::Device, [width, height]: [u32; 2]) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("depths"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::R16Uint,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

/// Writes one tile; ignored if it is outside the texture.
fn write(queue: &wgpu::Queue, texture: &wgpu::Texture, [x, y]: [u32; 2], depths_um: &[u16]) {
    let (side, size) = (PATCH as u32, texture.size());
    if x + side > size.width || y + side > size.height || depths_um.len() != PATCH * PATCH {
        return;
    }
    queue.write_texture(
        wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: 0,
            origin: wgpu::Origin3d { x, y, z: 0 },
            aspect: wgpu::TextureAspect::All,
        },
        bytemuck::cast_slice(depths_um),
        wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(2 * side), rows_per_image: Some(side) },
        wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
    );
}
