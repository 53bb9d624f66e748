//! A carved board on the GPU: its depths as a texture of whole numbers, one triangle over the window, one shader.
//!
//! ```text
//! tiles of depths ─ write ─▶ texture R16Uint ─┐    (and a second one for what is cut from below)
//! rays, tool ─▶ numbers of the frame ─────────┴─▶ relief.wgsl     the same on WebGPU and WebGL2
//! ```
//!
//! Comes in: a [`ReliefField`], [`Patch`]es, an [`Orbit`]. Goes out: a draw. Does not know what cut it.

use super::off_screen::{Fit, Laying, OffScreen, begin};
use super::orbit::Orbit;
use super::palette::Colour;
use super::relief::{Cutting, PATCH, Patch, Relief, ReliefField};

/// How long a tool is drawn, in its diameters and at least, mm.
const LONG_DIAMETERS: f32 = 7.0;
const LEAST_LONG_MM: f32 = 8.0;
/// Along each side, so many pixels of the window are one of a picture that is not sharp.
const COARSE_PX: u32 = 3;

/// What a frame is drawn with. The shader has the same struct.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct FrameNumbers {
    eye: [f32; 4],
    forward: [f32; 4],
    right: [f32; 4],
    up: [f32; 4],
    low: [f32; 2],
    cell: f32,
    thickness: f32,
    cells: [f32; 2],
    copper_mm: f32,
    both: f32,
    tip: [f32; 4],
    tool: [f32; 4],
    window: [f32; 2],
    samples: f32,
    under: f32,
    ground: [f32; 4],
}

/// From where, onto what.
pub(super) struct Sight<'a> {
    pub(super) relief: &'a Relief,
    pub(super) orbit: &'a Orbit,
    pub(super) tool: Option<Cutting>,
    pub(super) window_px: [u32; 2],
    pub(super) ground: Colour,
    /// A ray for every pixel, and not for every few.
    pub(super) sharp: bool,
}

/// The pipeline and, once there is a board, its depths.
pub(super) struct Carved {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    numbers: wgpu::Buffer,
    depths: Option<(wgpu::Texture, wgpu::BindGroup)>,
    /// Something is cut from below.
    under: bool,
    /// Samples along a pixel's side.
    samples: f32,
    /// What a picture that is not sharp is drawn on; made when there is one.
    coarse: Option<(Laying, OffScreen)>,
    format: wgpu::TextureFormat,
}

impl Carved {
    /// For targets of this format; a processor that paints in software sends one ray a pixel.
    pub(super) fn new(device: &wgpu::Device, format: wgpu::TextureFormat, hardware: bool) -> Self {
        let shader = device.create_shader_module(wgpu::include_wgsl!("relief.wgsl"));
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        let numbers_kind = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset: false,
            min_binding_size: None,
        };
        let depths_kind = wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Uint,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("carved"),
            entries: &[entry(0, numbers_kind), entry(1, depths_kind), entry(2, depths_kind)],
        });
        let numbers = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("sight"),
            size: size_of::<FrameNumbers>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let pipeline = pipeline(device, &layout, &shader, format);
        Self {
            pipeline,
            layout,
            numbers,
            depths: None,
            under: false,
            samples: if hardware { 2.0 } else { 1.0 },
            coarse: None,
            format,
        }
    }

    /// Another board, or none. False where it is too large for the device.
    pub(super) fn set(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        field: Option<&ReliefField>,
    ) -> bool {
        self.depths = None;
        let Some(field) = field else { return true };
        let [width, height] = field.relief.tiles().map(|tiles| (tiles * PATCH) as u32);
        let most = device.limits().max_texture_dimension_2d;
        if width == 0 || height == 0 || width.max(height) > most {
            return false;
        }
        let texture = depth_texture(device, [width, height]);
        self.under = !field.under().is_empty();
        let under = depth_texture(device, if self.under { [width, height] } else { [1, 1] });
        let [view, below] =
            [&texture, &under].map(|texture| texture.create_view(&wgpu::TextureViewDescriptor::default()));
        let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: self.numbers.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&view) },
                wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::TextureView(&below) },
            ],
        });
        self.depths = Some((texture, group));
        field.cut().for_each(|patch| self.patch(queue, &patch));
        field.under().iter().for_each(|patch| write(queue, &under, patch));
        true
    }

    /// Writes one tile.
    pub(super) fn patch(&self, queue: &wgpu::Queue, patch: &Patch) {
        if let Some((texture, _)) = &self.depths {
            write(queue, texture, patch);
        }
    }

    /// Draws what one sees over `view`. False where there is no board to look at.
    pub(super) fn draw(
        &mut self,
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        encoder: &mut wgpu::CommandEncoder,
        view: &wgpu::TextureView,
        sight: &Sight<'_>,
    ) -> bool {
        if self.depths.is_none() {
            return false;
        }
        let few_px = sight.window_px.map(|px| px.div_ceil(COARSE_PX));
        let drawn_px = if sight.sharp { sight.window_px } else { few_px };
        let numbers = numbers(sight, drawn_px, self.samples, self.under);
        queue.write_buffer(&self.numbers, 0, bytemuck::bytes_of(&numbers));
        if sight.sharp {
            self.cast(&mut begin(encoder, view, None));
            return true;
        }
        if self.coarse.as_ref().is_none_or(|(_, picture)| picture.size_px != few_px) {
            let laying = Laying::new(device, self.format, Fit::Stretched);
            let picture = laying.picture(device, few_px, 1);
            self.coarse = Some((laying, picture));
        }
        if let Some((laying, picture)) = &self.coarse {
            self.cast(&mut picture.begin(encoder));
            laying.lay(&mut begin(encoder, view, None), picture);
        }
        true
    }

    fn cast(&self, pass: &mut wgpu::RenderPass<'_>) {
        if let Some((_, group)) = &self.depths {
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, group, &[]);
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

/// Writes one tile into a texture.
fn write(queue: &wgpu::Queue, texture: &wgpu::Texture, patch: &Patch) {
    let blank;
    let depths = match &patch.depths_um {
        Some(depths) => depths.as_ref(),
        None => {
            blank = [0_u16; PATCH * PATCH];
            &blank[..]
        }
    };
    let [x, y] = patch.first.map(|cell| cell as u32);
    let size = texture.size();
    if x + PATCH as u32 > size.width || y + PATCH as u32 > size.height || depths.len() != PATCH * PATCH {
        return;
    }
    queue.write_texture(
        wgpu::TexelCopyTextureInfo {
            texture,
            mip_level: 0,
            origin: wgpu::Origin3d { x, y, z: 0 },
            aspect: wgpu::TextureAspect::All,
        },
        bytemuck::cast_slice(depths),
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some(2 * PATCH as u32),
            rows_per_image: Some(PATCH as u32),
        },
        wgpu::Extent3d { width: PATCH as u32, height: PATCH as u32, depth_or_array_layers: 1 },
    );
}

fn numbers(sight: &Sight<'_>, drawn_px: [u32; 2], samples: f32, under: bool) -> FrameNumbers {
    let window = drawn_px.map(|px| px as f32);
    let rays = sight.orbit.rays(window.map(f64::from));
    let four = |spot: [f64; 3]| [spot[0] as f32, spot[1] as f32, spot[2] as f32, 0.0];
    let relief = sight.relief;
    let tip = sight.tool.map_or([0.0; 4], |tool| [tool.tip_mm[0], tool.tip_mm[1], tool.tip_mm[2], 1.0]);
    let long = |tool: Cutting| (2.0 * LONG_DIAMETERS * tool.radius_mm).max(LEAST_LONG_MM);
    let tool = sight.tool.map_or([0.0; 4], |tool| [tool.end_mm, tool.radius_mm, tool.slope, long(tool)]);
    FrameNumbers {
        eye: four(rays.eye),
        forward: four(rays.forward),
        right: four(rays.right),
        up: four(rays.up),
        low: relief.low_mm,
        cell: relief.cell_mm,
        thickness: relief.thickness_mm,
        cells: relief.cells.map(|cells| cells as f32),
        copper_mm: relief.copper_mm,
        both: f32::from(u8::from(relief.both_sides)),
        tip,
        tool,
        window,
        samples,
        under: f32::from(u8::from(under)),
        ground: sight.ground.linear(),
    }
}

fn pipeline(
    device: &wgpu::Device,
    group: &wgpu::BindGroupLayout,
    shader: &wgpu::ShaderModule,
    format: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(group)],
        immediate_size: 0,
    });
    let target = wgpu::ColorTargetState { format, blend: None, write_mask: wgpu::ColorWrites::ALL };
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("carved"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: shader,
            entry_point: Some("corner"),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: shader,
            entry_point: Some("colour"),
            compilation_options: Default::default(),
            targets: &[Some(target)],
        }),
        multiview_mask: None,
        cache: None,
    })
}
