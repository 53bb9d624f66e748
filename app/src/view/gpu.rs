//! The painter on the GPU, by WebGPU or WebGL2: what stands still, the marks over it, or the board in space instead of both.
//!
//! Comes in: a scene and a frame's numbers. Goes out: pixels in a canvas. Does not know pointers or clocks.
//!
//! Both back ends blend in linear light: where the canvas is not sRGB itself (WebGPU) it is drawn through an sRGB view.
//! Where the adapter can, what stands still is sampled four times a pixel, so that the edges of triangles are smooth too;
//! marks know themselves how much of a pixel is theirs.

use super::camera::Camera;
use super::carved::{Carved, Sight};
use super::marks::{self, Afar, Emphasis, Mark};
use super::off_screen::begin;
use super::orbit::Orbit;
use super::palette::Palette;
use super::pipelines::{Drawing, Paint, pipeline};
use super::relief::{Cutting, Patch, ReliefField};
use super::scene::{Line, OrderProgress, Scene};
use super::still::Still;
use super::strokes::{Kind, Sheaf, Strokes};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use web_sys::HtmlCanvasElement;

/// From this zoom on the layers have edges; `edge_corner` of the shader fades them in.
const EDGED_FROM_PX_PER_MM: f64 = 8.0;

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

impl FrameNumbers {
    /// What of them tells on what stands still.
    fn without_progress(self) -> Self {
        Self { discs: 0, lines: 0, drilling: 0, ..self }
    }
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
    /// It is sharp whatever that takes.
    pub(super) sharp: bool,
}

/// What happened to a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Painted {
    /// It is on the screen.
    Shown,
    /// It is on the screen, less sharp than it can be: this device takes long for the rest.
    Coarse,
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
    still: Still,
    strokes: Strokes,
    numbers: wgpu::Buffer,
    group: wgpu::BindGroup,
    marks: Sheaf,
    first_disc: usize,
    /// What is drawn from afar.
    afar: Afar,
    over: Sheaf,
    head: Sheaf,
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
        // A processor that paints in software has four times the work with them.
        let hardware = adapter.get_info().device_type != wgpu::DeviceType::Cpu;
        let samples = if hardware && can.sample_count_supported(4) { 4 } else { 1 };
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
        let still = Still::new(&device, (view_format, samples), &make);
        let strokes = Strokes::new(&device, view_format, &shader, &group_layout);
        let [marks, over, head] = [(); 3].map(|()| strokes.sheaf(&device));
        Self {
            surface,
            device,
            queue,
            config,
            view_format,
            still,
            strokes,
            numbers,
            group,
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
        let (device, format) = (&self.device, self.view_format);
        let carved = self.carved.get_or_insert_with(|| Carved::new(device, format, self.hardware));
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
    }

    /// Everything anew.
    pub(super) fn set_scene(&mut self, scene: &Scene, palette: &Palette, emphasis: &Emphasis) {
        let built = marks::build(scene, palette, emphasis);
        (self.first_disc, self.afar) = (built.first_disc, built.afar);
        self.strokes.set(&mut self.marks, (&self.device, &self.queue), &built.all);
        self.still.set(&self.device, &self.queue, scene);
    }

    /// Only what lies over the scene anew.
    pub(super) fn set_over(&mut self, over: &[Line]) {
        let marks: Vec<Mark> = over.iter().map(marks::line).collect();
        self.strokes.set(&mut self.over, (&self.device, &self.queue), &marks);
    }

    /// Only these discs anew.
    pub(super) fn set_discs(&self, scene: &Scene, range: Range<usize>, emphasis: &Emphasis) {
        let first = (self.first_disc + range.start) as u32;
        let Some(discs) = scene.discs.get(range.clone()) else { return };
        let written: Vec<Mark> =
            range.zip(discs).map(|(index, disc)| marks::disc(index, disc, emphasis)).collect();
        self.marks.write(&self.queue, first, &written);
    }

    /// Draws one frame.
    pub(super) fn paint(&mut self, look: &Look<'_>) -> Painted {
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
        let numbers = self.frame_numbers(look);
        self.queue.write_buffer(&self.numbers, 0, bytemuck::bytes_of(&numbers));
        if let Some(at) = look.head_mm {
            let head = [marks::head(at, look.palette)];
            self.strokes.set(&mut self.head, (&self.device, &self.queue), &head);
        }
        let view = texture.texture.create_view(&wgpu::TextureViewDescriptor {
            format: Some(self.view_format),
            ..Default::default()
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let sharp = self.hardware || look.sharp;
        let solid = self.draw_solid(&mut encoder, &view, look, sharp);
        if !solid {
            self.draw_flat(&mut encoder, &view, look, &numbers);
        }
        self.queue.submit([encoder.finish()]);
        self.queue.present(texture);
        if solid && !sharp { Painted::Coarse } else { Painted::Shown }
    }

    /// The board in space; false where that is not what is looked at.
    fn draw_solid(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: &wgpu::TextureView,
        look: &Look<'_>,
        sharp: bool,
    ) -> bool {
        let (Some((field, orbit, tool)), Some(carved)) = (look.solid, &mut self.carved) else { return false };
        let window_px = [self.config.width, self.config.height];
        let ground = look.palette.background;
        let sight = Sight { relief: &field.relief, orbit, tool, window_px, ground, sharp };
        carved.draw((&self.device, &self.queue), encoder, view, &sight)
    }

    fn draw_flat(
        &mut self,
        encoder: &mut wgpu::CommandEncoder,
        view: &wgpu::TextureView,
        look: &Look<'_>,
        numbers: &FrameNumbers,
    ) {
        let px_per_mm = look.camera.px_per_mm * look.density;
        let alone = numbers.without_progress();
        let with = (bytemuck::bytes_of(&alone), px_per_mm >= EDGED_FROM_PX_PER_MM);
        let size_px = [self.config.width, self.config.height];
        self.still.draw((&self.device, encoder), &self.group, size_px, with);
        let mut pass = begin(encoder, view, None);
        self.still.lay(&mut pass);
        pass.set_bind_group(0, &self.group, &[]);
        let (lines, discs) = self.afar.drawn(self.marks.count(), px_per_mm);
        self.strokes.draw(&mut pass, Kind::Lines, &self.marks, lines);
        self.strokes.draw(&mut pass, Kind::Discs, &self.marks, [discs]);
        self.strokes.draw(&mut pass, Kind::Lines, &self.over, std::iter::once(0..self.over.count()));
        if look.head_mm.is_some() {
            self.strokes.draw(&mut pass, Kind::Head, &self.head, std::iter::once(0..1));
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
