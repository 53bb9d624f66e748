//! The pipelines of the flat picture: which shaders, of what corners, and how what they draw goes into the picture.
//!
//! Comes in: names of shaders, layouts of buffers. Goes out: pipelines. Does not know what is drawn with them.

/// How what a pipeline draws goes into the picture.
pub(super) struct Paint {
    pub(super) blend: Option<wgpu::BlendState>,
    pub(super) writes: wgpu::ColorWrites,
}

/// Over what is there.
pub(super) const OVER: Paint =
    Paint { blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING), writes: wgpu::ColorWrites::ALL };

/// The names of its two shaders, and of what its corners are.
pub(super) type Drawing = ([&'static str; 2], wgpu::PrimitiveTopology);

/// Makes a pipeline of the picture.
pub(super) type Make<'a> =
    dyn Fn(&Paint, Drawing, &[Option<wgpu::VertexBufferLayout<'_>>]) -> wgpu::RenderPipeline + 'a;

/// A pipeline of the picture for targets of this format and so many samples.
pub(super) fn pipeline(
    device: &wgpu::Device,
    (layout, shader): (&wgpu::PipelineLayout, &wgpu::ShaderModule),
    (format, samples): (wgpu::TextureFormat, u32),
    paint: &Paint,
    ([vertex, fragment], topology): Drawing,
    buffers: &[Option<wgpu::VertexBufferLayout<'_>>],
) -> wgpu::RenderPipeline {
    let target = wgpu::ColorTargetState { format, blend: paint.blend, write_mask: paint.writes };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(fragment),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module: shader,
            entry_point: Some(vertex),
            compilation_options: Default::default(),
            buffers,
        },
        primitive: wgpu::PrimitiveState { topology, ..Default::default() },
        depth_stencil: None,
        multisample: wgpu::MultisampleState { count: samples, ..Default::default() },
        fragment: Some(wgpu::FragmentState {
            module: shader,
            entry_point: Some(fragment),
            compilation_options: Default::default(),
            targets: &[Some(target)],
        }),
        multiview_mask: None,
        cache: None,
    })
}
