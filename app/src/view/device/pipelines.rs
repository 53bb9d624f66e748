//! Helpers to create pipelines: shaders, vertex layouts, bindings, blending.

/// How a pipeline writes into the picture.
pub(super) struct Paint {
    pub(super) blend: Option<wgpu::BlendState>,
    pub(super) writes: wgpu::ColorWrites,
}

pub(super) const OVER: Paint =
    Paint { blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING), writes: wgpu::ColorWrites::ALL };

pub(super) const INSTEAD: Paint = Paint { blend: None, writes: wgpu::ColorWrites::ALL };

pub(super) const NUMBERS: wgpu::BindingType = wgpu::BindingType::Buffer {
    ty: wgpu::BufferBindingType::Uniform,
    has_dynamic_offset: false,
    min_binding_size: None,
};

pub(super) const fn texture_of(sample_type: wgpu::TextureSampleType) -> wgpu::BindingType {
    wgpu::BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    }
}

pub(super) type Drawing = ([&'static str; 2], wgpu::PrimitiveTopology);

pub(super) type Make<'a> =
    dyn Fn(&Paint, Drawing, &[Option<wgpu::VertexBufferLayout<'_>>]) -> wgpu::RenderPipeline + 'a;

pub(super) fn numbers_buffer(device: &wgpu::Device, bytes: usize) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("numbers"),
        size: bytes as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// A bind group layout: the stages and types in the order of bindings.
pub(super) fn group_layout(
    device: &wgpu::Device,
    read: &[(wgpu::ShaderStages, wgpu::BindingType)],
) -> wgpu::BindGroupLayout {
    let entry = |(binding, (visibility, ty)): (u32, &(wgpu::ShaderStages, wgpu::BindingType))| {
        wgpu::BindGroupLayoutEntry { binding, visibility: *visibility, ty: *ty, count: None }
    };
    let entries: Vec<_> = (0..).zip(read).map(entry).collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
}

pub(super) fn group<const N: usize>(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    read: [wgpu::BindingResource<'_>; N],
) -> wgpu::BindGroup {
    let entries: Vec<_> =
        (0..).zip(read).map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

pub(super) fn pipeline_layout(
    device: &wgpu::Device,
    groups: &[&wgpu::BindGroupLayout],
) -> wgpu::PipelineLayout {
    let groups: Vec<_> = groups.iter().copied().map(Some).collect();
    device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &groups,
        immediate_size: 0,
    })
}

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
