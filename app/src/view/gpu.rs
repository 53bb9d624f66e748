//! The painter on the GPU: WebGPU or WebGL2, a pipeline each for the ground, the board's body, its layers and the marks.
//!
//! Comes in: instances and a frame's numbers. Goes out: pixels in a canvas. Does not know pointers or clocks.
//!
//! Both back ends blend in linear light: where the canvas is not sRGB itself (WebGPU) it is drawn through an sRGB view.
//! Where the adapter can, every pixel is sampled four times, so that the edges of triangles are smooth too.

use super::areas::{Cover, Layers};
use super::buffers::{Instances, fill, vertex_buffer};
use super::camera::Camera;
use super::carved::{Carved, Sight};
use super::marks::{self, Afar, Emphasis, Mark};
use super::orbit::Orbit;
use super::palette::Palette;
use super::pipelines::{Drawing, OVER, Paint, pipeline};
use super::relief::{Cutting, Patch, ReliefField};
use super::scene::{Line, OrderProgress, Scene};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use web_sys::HtmlCanvasElement;

const MARK_SIZE: u64 = size_of::<Mark>() as u64;
/// From this zoom on the layers have edges; `edge_corner` of the shader fades them in.
const EDGED_FROM_PX_PER_MM: f64 = 8.0;
const CORNER_SIZE: u64 = size_of::<[f32; 2]>() as u64;

/// Everything a frame is drawn with, but the marks. The shader has the same struct.
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct FrameNumbers {
    centre_mm: [f32; 2],
    half_px: [f32; 2],
    px_per_mm: f32,
    density: f32,
    grid_mm: f32,
    grid_fade: f32,
    plate_mm: [f32; 4],
    corner_mm: f32,
    has_plate: f32,
    discs: u32,
    lines: u32,
    drilling: u32,
    hand: f32,
    unused: [u32; 2],
    colours: [[f32; 4]; 10],
}

/// What a frame is drawn from.
pub(super) struct Look<'a> {
    pub(super) camera: &'a Camera,
    pub(super) density: f64,
    pub(super) scene: &'a Scene,
    pub(super) over: &'a [Line],
    pub(super) palette: &'a Palette,
    pub(super) grid: bool,
    pub(super) progress: OrderProgress,
    pub(super) head_mm: Option<[f32; 2]>,
    /// The board in space instead of all that.
    pub(super) solid: Option<(&'a ReliefField, &'a Orbit, Option<Cutting>)>,
}

/// What happened to a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Painted {
    /// It is on the screen.
    Shown,
    /// Not now; ask again.
    Later,
    /// The device is gone; a new painter is needed.
    Lost,
}

/// A canvas with a device behind it.
pub(super) struct Gpu {
    surface: wgpu::Surface<'static>,
    device: wgpu::Device,
    queue: wgpu::Queue,
    config: wgpu::SurfaceConfiguration,
    view_format: wgpu::TextureFormat,
    ground: wgpu::RenderPipeline,
    body: wgpu::RenderPipeline,
    strokes: wgpu::RenderPipeline,
    samples: u32,
    smooth: Option<wgpu::TextureView>,
    numbers: wgpu::Buffer,
    group: wgpu::BindGroup,
    /// The board's body, that of a plate too.
    triangles: wgpu::Buffer,
    cover_count: u32,
    /// How many corners are drawn as the body: a plate is part of the ground.
    corner_count: u32,
    layers: Layers,
    marks: Instances,
    first_disc: usize,
    /// What is drawn from afar.
    afar: Afar,
    over: Instances,
    head: wgpu::Buffer,
    /// Made when a board in space is first looked at.
    carved: Option<Carved>,
    hardware: bool,
    lost: Arc<AtomicBool>,
}

impl Gpu {
    /// A device for `canvas` on one of `backends`, or why there is none. `when_lost` is called when it goes.
    pub(super) async fn new(
        canvas: &HtmlCanvasElement,
        backends: wgpu::Backends,
        when_lost: fn(),
    ) -> Result<Self, String> {
        let mut wanted = wgpu::InstanceDescriptor::new_without_display_handle();
        wanted.backends = backends;
        let instance = wgpu::Instance::new(wanted);
        let target = wgpu::SurfaceTarget::Canvas(canvas.clone());
        let surface = instance.create_surface(target).map_err(|error| error.to_string())?;
        let options =
            wgpu::RequestAdapterOptions { compatible_surface: Some(&surface), ..Default::default() };
        let adapter = instance.request_adapter(&options).await.map_err(|error| error.to_string())?;
        let limits = wgpu::Limits::downlevel_webgl2_defaults().using_resolution(adapter.limits());
        let asked = wgpu::DeviceDescriptor { required_limits: limits, ..Default::default() };
        let (device, queue) = adapter.request_device(&asked).await.map_err(|error| error.to_string())?;
        let lost = Arc::new(AtomicBool::new(false));
        let told = lost.clone();
        device.set_device_lost_callback(move |_, _| {
            told.store(true, Ordering::Relaxed);
            when_lost();
        });
        let (config, view_format) = surface_config(&surface, &adapter, canvas)?;
        surface.configure(&device, &config);
        let can = adapter.get_texture_format_features(view_format).flags;
        // Seen in Chromium: samples that become pixels through another view than the canvas' own stay linear, too dark.
        let own_view = view_format == config.format;
        // A processor that paints in software has four times the work with them.
        let hardware = adapter.get_info().device_type != wgpu::DeviceType::Cpu;
        let samples = if own_view && hardware && can.sample_count_supported(4) { 4 } else { 1 };
        Ok(Self::assemble(surface, (device, queue), (config, view_format, samples), hardware, lost))
    }

    fn assemble(
        surface: wgpu::Surface<'static>,
        (device, queue): (wgpu::Device, wgpu::Queue),
        (config, view_format, samples): (wgpu::SurfaceConfiguration, wgpu::TextureFormat, u32),
        hardware: bool,
        lost: Arc<AtomicBool>,
    ) -> Self {
        let shader = device.create_shader_module(wgpu::include_wgsl!("marks.wgsl"));
        let (numbers, group_layout, group) = frame_group(&device);
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(&group_layout)],
            immediate_size: 0,
        });
        let make = |paint: &Paint, drawing: Drawing, buffers: &[Option<wgpu::VertexBufferLayout<'_>>]| {
            pipeline(&device, (&layout, &shader), (view_format, samples), paint, drawing, buffers)
        };
        let (strip, list) = (wgpu::PrimitiveTopology::TriangleStrip, wgpu::PrimitiveTopology::TriangleList);
        let ground = make(&OVER, (["ground_corner", "ground_colour"], strip), &[]);
        let corners = wgpu::VertexBufferLayout {
            array_stride: CORNER_SIZE,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &wgpu::vertex_attr_array![0 => Float32x2],
        };
        let body = make(&OVER, (["body_corner", "body_colour"], list), &[Some(corners)]);
        let attributes = wgpu::vertex_attr_array![0 => Float32x4, 1 => Float32x2, 2 => Unorm8x4, 3 => Uint32];
        let instances = wgpu::VertexBufferLayout {
            array_stride: MARK_SIZE,
            step_mode: wgpu::VertexStepMode::Instance,
            attributes: &attributes,
        };
        let strokes = make(&OVER, (["stroke_corner", "stroke_colour"], strip), &[Some(instances)]);
        let triangles = vertex_buffer(&device, CORNER_SIZE);
        let (marks, over) = (Instances::new(&device), Instances::new(&device));
        let head = vertex_buffer(&device, MARK_SIZE);
        let layers = Layers::new(&device, &make);
        let smooth = smooth(&device, &config, view_format, samples);
        Self {
            surface,
            device,
            queue,
            config,
            view_format,
            ground,
            body,
            strokes,
            samples,
            smooth,
            numbers,
            group,
            triangles,
            cover_count: 0,
            corner_count: 0,
            layers,
            marks,
            first_disc: 0,
            afar: Afar::default(),
            over,
            head,
            carved: None,
            hardware,
            lost,
        }
    }

    /// Another board in space, or none. False where it is too large for the device.
    pub(super) fn set_field(&mut self, field: Option<&ReliefField>) -> bool {
        if self.carved.is_none() && field.is_none() {
            return true;
        }
        let target = (self.view_format, self.samples);
        let carved = self.carved.get_or_insert_with(|| Carved::new(&self.device, target, self.hardware));
        carved.set(&self.device, &self.queue, field)
    }

    /// One tile of the board in space.
    pub(super) fn patch(&self, patch: &Patch) {
        if let Some(carved) = &self.carved {
            carved.patch(&self.queue, patch);
        }
    }

    /// Which of the two it is.
    pub(super) fn is_webgpu(&self) -> bool {
        // WebGL2 canvases are sRGB themselves; only a WebGPU canvas needs another view.
        self.view_format != self.config.format
    }

    /// The canvas has another size, in device pixels.
    pub(super) fn resize(&mut self, width: u32, height: u32) {
        let most = self.device.limits().max_texture_dimension_2d;
        self.config.width = width.clamp(1, most);
        self.config.height = height.clamp(1, most);
        self.surface.configure(&self.device, &self.config);
        self.smooth = smooth(&self.device, &self.config, self.view_format, self.samples);
    }

    /// Everything anew.
    pub(super) fn set_scene(&mut self, scene: &Scene, palette: &Palette, emphasis: &Emphasis) {
        let built = marks::build(scene, palette, emphasis);
        (self.first_disc, self.afar) = (built.first_disc, built.afar);
        self.marks.set(&self.device, &self.queue, &built.all);
        let cover = scene.cover();
        (self.cover_count, self.corner_count) = (cover.len() as u32, scene.body.len() as u32);
        fill(&self.device, &self.queue, &mut self.triangles, bytemuck::cast_slice(&cover));
        self.layers.set(&self.device, &self.queue, &scene.layers);
    }

    /// Only what lies over the scene anew.
    pub(super) fn set_over(&mut self, over: &[Line]) {
        let marks: Vec<Mark> = over.iter().map(marks::line).collect();
        self.over.set(&self.device, &self.queue, &marks);
    }

    /// Only these discs anew.
    pub(super) fn set_discs(&self, scene: &Scene, range: Range<usize>, emphasis: &Emphasis) {
        let start = (self.first_disc + range.start) as u64 * MARK_SIZE;
        let Some(discs) = scene.discs.get(range.clone()) else { return };
        let written: Vec<Mark> =
            range.zip(discs).map(|(index, disc)| marks::disc(index, disc, emphasis)).collect();
        self.queue.write_buffer(&self.marks.buffer, start, bytemuck::cast_slice(&written));
    }

    /// Draws one frame.
    pub(super) fn paint(&self, look: &Look<'_>) -> Painted {
        use wgpu::CurrentSurfaceTexture as Current;
        if self.lost.load(Ordering::Relaxed) {
            return Painted::Lost;
        }
        let texture = match self.surface.get_current_texture() {
            Current::Success(texture) | Current::Suboptimal(texture) => texture,
            Current::Timeout | Current::Occluded => return Painted::Later,
            Current::Outdated => {
                self.surface.configure(&self.device, &self.config);
                return Painted::Later;
            }
            Current::Lost | Current::Validation => return Painted::Lost,
        };
        self.queue.write_buffer(&self.numbers, 0, bytemuck::bytes_of(&self.frame_numbers(look)));
        if let Some(at) = look.head_mm {
            self.queue.write_buffer(&self.head, 0, bytemuck::bytes_of(&marks::head(at, look.palette)));
        }
        let view = texture.texture.create_view(&wgpu::TextureViewDescriptor {
            format: Some(self.view_format),
            ..Default::default()
        });
        let solid = look.solid.is_some_and(|(field, orbit, tool)| {
            let window_px = [self.config.width, self.config.height];
            let ground = look.palette.background;
            let sight = Sight { relief: &field.relief, orbit, tool, window_px, ground };
            self.carved.as_ref().is_some_and(|carved| carved.look(&self.queue, &sight))
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let px_per_mm = look.camera.px_per_mm * look.density;
        self.draw(&mut encoder, &view, (solid, px_per_mm), look.head_mm.is_some());
        self.queue.submit([encoder.finish()]);
        self.queue.present(texture);
        Painted::Shown
    }

    fn draw(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        view: &wgpu::TextureView,
        (solid, px_per_mm): (bool, f64),
        with_head: bool,
    ) {
        let attachment = wgpu::RenderPassColorAttachment {
            view: self.smooth.as_ref().unwrap_or(view),
            depth_slice: None,
            resolve_target: self.smooth.as_ref().map(|_| view),
            ops: wgpu::Operations {
                load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                store: wgpu::StoreOp::Store,
            },
        };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(attachment)],
            ..Default::default()
        });
        if let Some(carved) = self.carved.as_ref().filter(|_| solid) {
            return carved.draw(&mut pass);
        }
        pass.set_bind_group(0, &self.group, &[]);
        pass.set_pipeline(&self.ground);
        pass.draw(0..3, 0..1);
        if self.corner_count > 0 {
            pass.set_pipeline(&self.body);
            pass.set_vertex_buffer(0, self.triangles.slice(..));
            pass.draw(0..self.corner_count, 0..1);
        }
        if !self.layers.is_empty() {
            let cover = Cover { corners: &self.triangles, count: self.cover_count };
            self.layers.draw(&mut pass, &cover, px_per_mm >= EDGED_FROM_PX_PER_MM);
        }
        pass.set_pipeline(&self.strokes);
        self.marks.draw_some(&mut pass, self.afar.drawn(self.marks.count(), px_per_mm));
        self.over.draw(&mut pass);
        if with_head {
            pass.set_vertex_buffer(0, self.head.slice(..));
            pass.draw(0..4, 0..1);
        }
    }

    fn frame_numbers(&self, look: &Look<'_>) -> FrameNumbers {
        let (camera, palette) = (look.camera, look.palette);
        let (grid_mm, grid_fade) = camera.grid();
        let plate = look.scene.plate;
        let corners = plate.map_or([0.0; 4], |p| [p.min_mm[0], p.min_mm[1], p.max_mm[0], p.max_mm[1]]);
        let colours = [
            palette.background,
            palette.plate,
            palette.edge,
            palette.grid,
            palette.bore,
            palette.done,
            palette.current,
            palette.failed,
            palette.selected,
            palette.travelled,
        ];
        FrameNumbers {
            centre_mm: camera.centre_mm.map(|mm| mm as f32),
            half_px: [self.config.width as f32 / 2.0, self.config.height as f32 / 2.0],
            px_per_mm: (camera.px_per_mm * look.density) as f32,
            density: look.density as f32,
            grid_mm: if look.grid { grid_mm as f32 } else { 0.0 },
            grid_fade: grid_fade as f32,
            plate_mm: corners,
            corner_mm: plate.map_or(0.0, |plate| plate.corner_mm),
            has_plate: f32::from(u8::from(plate.is_some())),
            discs: look.progress.discs,
            lines: look.progress.lines,
            drilling: u32::from(look.progress.drilling),
            hand: camera.hand() as f32,
            unused: [0; 2],
            colours: colours.map(super::palette::Colour::linear),
        }
    }

    /// Throws the device away.
    pub(super) fn lose(&self) {
        self.device.destroy();
        self.lost.store(true, Ordering::Relaxed);
    }
}

/// The numbers of a frame as the shader sees them.
fn frame_group(device: &wgpu::Device) -> (wgpu::Buffer, wgpu::BindGroupLayout, wgpu::BindGroup) {
    let numbers = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("frame"),
        size: size_of::<FrameNumbers>() as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let group_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: None,
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        }],
    });
    let group = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &group_layout,
        entries: &[wgpu::BindGroupEntry { binding: 0, resource: numbers.as_entire_binding() }],
    });
    (numbers, group_layout, group)
}

/// Where a frame is drawn before its samples become pixels; none where a pixel has one sample.
fn smooth(
    device: &wgpu::Device,
    config: &wgpu::SurfaceConfiguration,
    format: wgpu::TextureFormat,
    samples: u32,
) -> Option<wgpu::TextureView> {
    let made = || {
        device.create_texture(&wgpu::TextureDescriptor {
            label: Some("samples"),
            size: wgpu::Extent3d { width: config.width, height: config.height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: samples,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        })
    };
    (samples > 1).then(|| made().create_view(&wgpu::TextureViewDescriptor::default()))
}

fn surface_config(
    surface: &wgpu::Surface<'_>,
    adapter: &wgpu::Adapter,
    canvas: &HtmlCanvasElement,
) -> Result<(wgpu::SurfaceConfiguration, wgpu::TextureFormat), String> {
    let (width, height) = (canvas.width().max(1), canvas.height().max(1));
    let mut config = surface
        .get_default_config(adapter, width, height)
        .ok_or("this canvas cannot be drawn to by the adapter")?;
    let view_format = config.format.add_srgb_suffix();
    if view_format != config.format {
        config.view_formats.push(view_format);
    }
    Ok((config, view_format))
}
