//! Pictures that are drawn apart and then laid over the window.
//!
//! Comes in: a size in pixels. Goes out: what to draw on, and its draw over the window. Does not know what is on it.

use super::pipelines::{Paint, pipeline};

const LAID: Paint = Paint { blend: None, writes: wgpu::ColorWrites::ALL };

/// Lays such pictures over the window.
pub(super) struct Laying {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    between: wgpu::Sampler,
    format: wgpu::TextureFormat,
}

/// A picture that is not in the window itself.
pub(super) struct OffScreen {
    pub(super) size_px: [u32; 2],
    view: wgpu::TextureView,
    /// Where it is drawn before its samples become pixels; none where a pixel has one sample.
    samples: Option<wgpu::TextureView>,
    group: wgpu::BindGroup,
}

/// How one becomes the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fit {
    /// It is as large.
    Same,
    /// It is smaller.
    Stretched,
}

impl Laying {
    /// Over windows of `format`.
    pub(super) fn new(device: &wgpu::Device, format: wgpu::TextureFormat, fit: Fit) -> Self {
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        let picture = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable: true },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let between = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("off screen"),
            entries: &[entry(0, picture), entry(1, between)],
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let shader = device.create_shader_module(wgpu::include_wgsl!("off_screen.wgsl"));
        let colour = if fit == Fit::Same { "same" } else { "stretched" };
        let drawing = (["corner", colour], wgpu::PrimitiveTopology::TriangleStrip);
        let pipeline = pipeline(device, (&pipeline_layout, &shader), (format, 1), &LAID, drawing, &[]);
        let between = device.create_sampler(&wgpu::SamplerDescriptor {
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Self { pipeline, layout, between, format }
    }

    /// One of so many samples a pixel.
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
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&self.between) },
            ],
        });
        OffScreen { size_px, view, samples, group }
    }

    /// Lays it over the window.
    pub(super) fn lay(&self, pass: &mut wgpu::RenderPass<'_>, picture: &OffScreen) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &picture.group, &[]);
        pass.draw(0..3, 0..1);
    }
}

impl OffScreen {
    /// Begins to draw on it, on black.
    pub(super) fn begin<'a>(&self, encoder: &'a mut wgpu::CommandEncoder) -> wgpu::RenderPass<'a> {
        let resolved = self.samples.as_ref().map(|_| &self.view);
        begin(encoder, self.samples.as_ref().unwrap_or(&self.view), resolved)
    }
}

/// Begins to draw on `view`, on black.
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
