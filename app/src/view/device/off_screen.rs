//! Pictures drawn off screen and then composed onto the window.

use super::pipelines::{INSTEAD, group, group_layout, pipeline, pipeline_layout, texture_of};

pub(super) struct Laying {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    between: wgpu::Sampler,
    format: wgpu::TextureFormat,
}

pub(super) struct OffScreen {
    pub(super) size_px: [u32; 2],
    view: wgpu::TextureView,
    /// The multisampled texture that resolves into `view`; none with one sample per pixel.
    samples: Option<wgpu::TextureView>,
    group: wgpu::BindGroup,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fit {
    Same,
    Stretched,
}

impl Laying {
    pub(super) fn new(device: &wgpu::Device, format: wgpu::TextureFormat, fit: Fit) -> Self {
        let stage = wgpu::ShaderStages::FRAGMENT;
        let picture = texture_of(wgpu::TextureSampleType::Float { filterable: true });
        let between = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let layout = group_layout(device, &[(stage, picture), (stage, between)]);
        let of_pipeline = pipeline_layout(device, &[&layout]);
        let shader = device.create_shader_module(wgpu::include_wgsl!("off_screen.wgsl"));
        let colour = if fit == Fit::Same { "same" } else { "stretched" };
        let drawing = (["corner", colour], wgpu::PrimitiveTopology::TriangleStrip);
        let pipeline = pipeline(device, (&of_pipeline, &shader), (format, 1), &INSTEAD, drawing, &[]);
        let between = device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Self { pipeline, layout, between, format }
    }

    pub(super) fn picture(&self, device: &wgpu::Device, size_px: [u32; 2], samples: u32) -> OffScreen {
        let [width, height] = size_px;
        let texture = |sample_count, usage| {
            let texture = device.create_texture(&wgpu::TextureDescriptor {
                label: Some("off screen"),
                size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count,
                dimension: wgpu::TextureDimension::D2,
                format: self.format,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | usage,
                view_formats: &[],
            });
            texture.create_view(&wgpu::TextureViewDescriptor::default())
        };
        let view = texture(1, wgpu::TextureUsages::TEXTURE_BINDING);
        let samples = (samples > 1).then(|| texture(samples, wgpu::TextureUsages::empty()));
        let read = [wgpu::BindingResource::TextureView(&view), wgpu::BindingResource::Sampler(&self.between)];
        let group = group(device, &self.layout, read);
        OffScreen { size_px, view, samples, group }
    }

    pub(super) fn lay(&self, pass: &mut wgpu::RenderPass<'_>, picture: &OffScreen) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &picture.group, &[]);
        pass.draw(0..3, 0..1);
    }
}

impl OffScreen {
    pub(super) fn begin<'a>(&self, encoder: &'a mut wgpu::CommandEncoder) -> wgpu::RenderPass<'a> {
        let resolved = self.samples.as_ref().map(|_| &self.view);
        begin(encoder, self.samples.as_ref().unwrap_or(&self.view), resolved)
    }
}

/// Starts a pass on `view`, cleared to black.
pub(super) fn begin<'a>(
    encoder: &'a mut wgpu::CommandEncoder,
    view: &wgpu::TextureView,
    resolve_target: Option<&wgpu::TextureView>,
) -> wgpu::RenderPass<'a> {
    let ops = wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store };
    let attachment = wgpu::RenderPassColorAttachment { view, depth_slice: None, resolve_target, ops };
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(attachment)],
        ..Default::default()
    })
}
