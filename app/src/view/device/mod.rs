//! The renderer on WebGPU or WebGL2: the static picture with marks over it, or the 3D view.
//!
//! ```text
//! marks ──────▶ strokes ─┐         uniforms ─▶ every shader
//! body, layers ▶ still ──┴▶ window ◀─ carved ◀── depths
//! ```
//!
//! A separate WebAssembly file (`bin/painter.rs`), the only one with wgpu.
//!
//! Both back ends blend in linear light: a canvas that isn't sRGB (WebGPU) is drawn through an sRGB view. If
//! supported, the static picture has four samples per pixel for smooth triangle edges. Marks compute their
//! own coverage.

mod areas;
mod carved;
mod off_screen;
mod pipelines;
mod still;
mod strokes;

use super::numbers::{FlatNumbers, Painted, SpaceNumbers};
use carved::Carved;
use futures_channel::oneshot;
use off_screen::begin;
use pipelines::{Drawing, NUMBERS, Paint, group, group_layout, numbers_buffer, pipeline, pipeline_layout};
use std::cell::Cell;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use still::Still;
use strokes::{Kind, Sheaf, Strokes};
use web_sys::HtmlCanvasElement;

pub struct Device {
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
    over: Sheaf,
    head: Sheaf,
    /// Created when the 3D view is first shown.
    carved: Option<Carved>,
    hardware: bool,
    lost: Arc<AtomicBool>,
}

impl Device {
    /// Opens a device on `canvas`. `kind` is `webgpu`, `webgl2` or `best`; fails with the reason. `when_lost`
    /// is called when the device is lost.
    pub async fn open(
        canvas: &HtmlCanvasElement,
        kind: &str,
        when_lost: impl FnOnce() + 'static,
    ) -> Result<Self, String> {
        let mut wanted = wgpu::InstanceDescriptor::new_without_display_handle();
        wanted.backends = backends(kind).await;
        let instance = wgpu::Instance::new(wanted);
        let target = wgpu::SurfaceTarget::Canvas(canvas.clone());
        let surface = instance.create_surface(target).map_err(|error| error.to_string())?;
        let options =
            wgpu::RequestAdapterOptions { compatible_surface: Some(&surface), ..Default::default() };
        let adapter = instance.request_adapter(&options).await.map_err(|error| error.to_string())?;
        let limits = wgpu::Limits::downlevel_webgl2_defaults().using_resolution(adapter.limits());
        let asked = wgpu::DeviceDescriptor { required_limits: limits, ..Default::default() };
        let (device, queue) = adapter.request_device(&asked).await.map_err(|error| error.to_string())?;
        let lost = watch(&device, when_lost);
        let (config, view_format) = surface_config(&surface, &adapter, canvas)?;
        surface.configure(&device, &config);
        let can = adapter.get_texture_format_features(view_format).flags;
        // Multisampling would take a software renderer four times as long.
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
        let layout = pipeline_layout(&device, &[&group_layout]);
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
            over,
            head,
            carved: None,
            hardware,
            lost,
        }
    }

    /// WebGPU, else WebGL2.
    pub fn is_webgpu(&self) -> bool {
        // WebGL2 canvases are sRGB themselves; only a WebGPU canvas needs another view.
        self.view_format != self.config.format
    }

    /// A graphics card, not a software renderer.
    pub fn hardware(&self) -> bool {
        self.hardware
    }

    /// Maximum size of a canvas and of a depth field, in pixels and cells.
    pub fn most_px(&self) -> u32 {
        self.device.limits().max_texture_dimension_2d
    }

    /// In device pixels, from 1 to [`most_px`](Self::most_px).
    pub fn resize(&mut self, width: u32, height: u32) {
        (self.config.width, self.config.height) = (width, height);
        self.surface.configure(&self.device, &self.config);
    }

    /// Replaces the marks of the scene, 32 bytes each.
    pub fn set_marks(&mut self, marks: &[u8]) {
        self.strokes.set(&mut self.marks, (&self.device, &self.queue), marks);
    }

    pub fn set_over(&mut self, marks: &[u8]) {
        self.strokes.set(&mut self.over, (&self.device, &self.queue), marks);
    }

    pub fn write_marks(&self, first: u32, marks: &[u8]) {
        self.marks.write(&self.queue, first, marks);
    }

    /// Replaces the board's body: triangles, two numbers per corner. The first `body` corners are drawn; 0 if
    /// the ground shader draws a plate.
    pub fn set_body(&mut self, corners_mm: &[f32], body: u32) {
        self.still.set_body(&self.device, &self.queue, corners_mm, body);
    }

    /// Uploads a layer's triangles and edge segments, as corner indices. Returns the mesh's number.
    pub fn add_mesh(&mut self, corners_mm: &[f32], triangles: &[u32], edges: &[u32]) -> u32 {
        self.still.add_mesh(&self.device, &self.queue, (corners_mm, triangles, edges))
    }

    /// Replaces the layers, lowest first, three numbers each: mesh, colour as RGBA bytes, 1 if its triangles
    /// are openings. Drops all other meshes.
    pub fn set_layers(&mut self, rows: &[u32]) {
        self.still.set_layers(&self.device, &self.queue, rows);
    }

    /// Replaces the board of the 3D view, without cuts. `under`: there will be cuts from below. Size 0
    /// removes the board.
    pub fn set_depths(&mut self, width: u32, height: u32, under: bool) {
        if width == 0 || height == 0 {
            self.carved = None;
            return;
        }
        let carved = self.carved.get_or_insert_with(|| Carved::new(&self.device, self.view_format));
        carved.set(&self.device, [width, height], under);
    }

    /// Updates a tile that starts at this cell: depths in µm, row by row, square.
    pub fn write_depths(&self, below: bool, x: u32, y: u32, depths_um: &[u16]) {
        if let Some(carved) = &self.carved {
            carved.write(&self.queue, below, [x, y], depths_um);
        }
    }

    /// Draws the 2D view. `ranges` has start and end of the scene's marks to draw: lines twice, then discs.
    /// Layers have edges if `edged`.
    pub fn paint_flat(&mut self, numbers: &[u8], ranges: &[u32], head: &[u8], edged: bool) -> Painted {
        let numbers: FlatNumbers = match bytemuck::try_pod_read_unaligned(numbers) {
            Ok(numbers) => numbers,
            Err(_) => return Painted::Lost,
        };
        self.queue.write_buffer(&self.numbers, 0, bytemuck::bytes_of(&numbers));
        self.strokes.set(&mut self.head, (&self.device, &self.queue), head);
        self.paint(|own, encoder, view| {
            let alone = numbers.without_progress();
            let size_px = [own.config.width, own.config.height];
            let with = (bytemuck::bytes_of(&alone), edged);
            own.still.draw((&own.device, encoder), &own.group, size_px, with);
            let mut pass = begin(encoder, view, None);
            own.still.lay(&mut pass);
            pass.set_bind_group(0, &own.group, &[]);
            for (range, kind) in ranges.chunks_exact(2).zip([Kind::Lines, Kind::Lines, Kind::Discs]) {
                own.strokes.draw(&mut pass, kind, &own.marks, range[0]..range[1]);
            }
            own.strokes.draw(&mut pass, Kind::Lines, &own.over, 0..u32::MAX);
            own.strokes.draw(&mut pass, Kind::Head, &own.head, 0..u32::MAX);
        })
    }

    /// Draws the 3D view from its uniforms. A picture of another size is stretched over the window.
    pub fn paint_space(&mut self, numbers: &[u8]) -> Painted {
        let numbers: SpaceNumbers = match bytemuck::try_pod_read_unaligned(numbers) {
            Ok(numbers) => numbers,
            Err(_) => return Painted::Lost,
        };
        self.paint(|own, encoder, view| {
            let window_px = [own.config.width, own.config.height];
            match &mut own.carved {
                Some(carved) => {
                    carved.draw((&own.device, &own.queue), encoder, (view, window_px), &numbers);
                }
                None => drop(begin(encoder, view, None)),
            }
        })
    }

    /// Acquires the window's texture, calls `draw`, and presents.
    fn paint(
        &mut self,
        draw: impl FnOnce(&mut Self, &mut wgpu::CommandEncoder, &wgpu::TextureView),
    ) -> Painted {
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
        let view = texture.texture.create_view(&wgpu::TextureViewDescriptor {
            format: Some(self.view_format),
            ..Default::default()
        });
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        draw(self, &mut encoder, &view);
        self.queue.submit([encoder.finish()]);
        self.queue.present(texture);
        Painted::Shown
    }

    pub fn lose(&self) {
        self.device.destroy();
        self.lost.store(true, Ordering::Relaxed);
    }
}

async fn backends(kind: &str) -> wgpu::Backends {
    match kind {
        "webgpu" => wgpu::Backends::BROWSER_WEBGPU,
        "webgl2" => wgpu::Backends::GL,
        _ if wgpu::util::is_browser_webgpu_supported().await => wgpu::Backends::BROWSER_WEBGPU,
        _ => wgpu::Backends::GL,
    }
}

/// A flag that is set when the device is lost; then `when_lost` is called too.
fn watch(device: &wgpu::Device, when_lost: impl FnOnce() + 'static) -> Arc<AtomicBool> {
    let lost = Arc::new(AtomicBool::new(false));
    let (told, (tell, hear)) = (lost.clone(), oneshot::channel());
    let tell = Cell::new(Some(tell));
    device.set_device_lost_callback(move |_, _| {
        told.store(true, Ordering::Relaxed);
        if let Some(tell) = tell.take() {
            let _ = tell.send(());
        }
    });
    wasm_bindgen_futures::spawn_local(async move {
        if hear.await.is_ok() {
            when_lost();
        }
    });
    lost
}

fn frame_group(device: &wgpu::Device) -> (wgpu::Buffer, wgpu::BindGroupLayout, wgpu::BindGroup) {
    let numbers = numbers_buffer(device, size_of::<FlatNumbers>());
    let layout = group_layout(device, &[(wgpu::ShaderStages::VERTEX_FRAGMENT, NUMBERS)]);
    let group = group(device, &layout, [numbers.as_entire_binding()]);
    (numbers, layout, group)
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

/// Least size of a buffer; buffers grow with their content.
const LEAST_BYTES: u64 = 32;

/// Writes `bytes` to `buffer`; replaces the buffer if it is too small.
fn fill(device: &wgpu::Device, queue: &wgpu::Queue, buffer: &mut wgpu::Buffer, bytes: &[u8]) {
    if buffer.size() < bytes.len() as u64 {
        *buffer = vertex_buffer(device, bytes.len() as u64);
    }
    queue.write_buffer(buffer, 0, bytes);
}

fn vertex_buffer(device: &wgpu::Device, bytes: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("vertices"),
        size: bytes.max(LEAST_BYTES).next_power_of_two(),
        usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
