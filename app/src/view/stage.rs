//! The state of a picture in the page (pointers that are down, callbacks, the 3D view), and painting one
//! frame of it.

use super::Touch;
use super::backend::{Backend, Painter, PainterChoice};
use super::camera::Camera;
use super::gpu::Look;
use super::marks::Emphasis;
use super::numbers::Painted;
use super::orbit::Orbit;
use super::palette::Palette;
use super::pick::Picker;
use super::relief::{Cutting, ReliefField};
use super::scene::{HoleState, Line, OrderProgress, Scene};
use std::cell::RefCell;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::{HtmlCanvasElement, HtmlElement, PointerEvent, ResizeObserver, WheelEvent};

const FIT_MARGIN_PX: f64 = 36.0;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Frames {
    pub painted: u64,
    /// CPU time of the last frame on the page's thread, ms.
    pub last_ms: f64,
    /// The longest of the last 60 frames, ms.
    pub longest_ms: f64,
    pub losses: u32,
}

pub(super) struct Stage {
    pub(super) host: HtmlElement,
    pub(super) canvas: HtmlCanvasElement,
    pub(super) painter: Painter,
    pub(super) wanted: PainterChoice,
    pub(super) scene: Scene,
    /// The overlay: marks that follow the pointer.
    pub(super) over: Vec<Line>,
    pub(super) palette: Palette,
    pub(super) grid: bool,
    pub(super) camera: Camera,
    pub(super) density: f64,
    /// The host has no size, because the current screen has no picture.
    pub(super) hidden: bool,
    pub(super) emphasis: Emphasis,
    pub(super) progress: OrderProgress,
    pub(super) head_mm: Option<[f32; 2]>,
    pub(super) solid: Solid,
    pub(super) picker: Option<Picker>,
    pub(super) fitted: bool,
    pub(super) frames: Frames,
    /// Losses of a device of the kind in use.
    pub(super) lost_of_kind: u32,
    pub(super) recent_ms: [f64; 60],
    pub(super) frame_asked: Option<i32>,
    /// The requested frame must be sharp: nothing moves.
    pub(super) sharp: bool,
    pub(super) sharp_asked: Option<i32>,
    pub(super) on_rest: Option<Closure<dyn FnMut()>>,
    pub(super) on_frame: Option<Closure<dyn FnMut()>>,
    pub(super) observer: Option<(ResizeObserver, Closure<dyn FnMut()>)>,
    pub(super) on_context_lost: Option<Closure<dyn FnMut()>>,
    pub(super) gestures: Gestures,
}

impl Stage {
    /// Fits the scene, now and at later changes, until the user moves the picture or draws in it.
    pub(super) fn fit(&mut self) {
        self.fitted = true;
        if let Some(bounds) = self.scene.wanted_mm.or_else(|| self.scene.bounds_mm()) {
            self.camera.fit(bounds.map(|corner| corner.map(f64::from)), FIT_MARGIN_PX);
        }
    }

    /// Bounding box of the selection; none without a selection.
    pub(super) fn chosen_mm(&self) -> Option<[[f32; 2]; 2]> {
        let discs = self.emphasis.selected.iter().filter_map(|disc| self.scene.discs.get(*disc as usize));
        let boxes = discs.map(|disc| {
            let ([x, y], r) = (disc.centre_mm, disc.radius_mm);
            [[x - r, y - r], [x + r, y + r]]
        });
        boxes.chain(self.scene.chosen_mm).reduce(|[a, b], [low, high]| {
            [[a[0].min(low[0]), a[1].min(low[1])], [b[0].max(high[0]), b[1].max(high[1])]]
        })
    }

    pub(super) fn rebuild(&mut self) {
        if let Painter::Gpu(gpu) = &mut self.painter {
            gpu.set_scene(&self.scene, &self.palette, &self.emphasis);
        }
        if self.fitted && !self.gestures.strokes {
            self.fit();
        }
    }

    pub(super) fn write_all(&mut self) {
        self.solid.fits = match &mut self.painter {
            Painter::Gpu(gpu) => {
                gpu.set_over(&self.over);
                gpu.set_field(self.solid.field.as_ref())
            }
            Painter::Flat(_) | Painter::None => false,
        };
        self.rebuild();
    }

    /// Uploads the discs with these indices; merges runs of neighbours.
    pub(super) fn rewrite(&mut self, mut indices: Vec<usize>) {
        let Painter::Gpu(gpu) = &self.painter else { return };
        indices.sort_unstable();
        indices.dedup();
        for run in indices.chunk_by(|a, b| b - a <= 8) {
            let last = run[run.len() - 1].min(self.scene.discs.len().saturating_sub(1));
            if run[0] <= last {
                gpu.set_discs(&self.scene, run[0]..last + 1, &self.emphasis);
            }
        }
    }

    pub(super) fn measure(&mut self) {
        let (width, height) = (f64::from(self.host.client_width()), f64::from(self.host.client_height()));
        self.hidden = width == 0.0 || height == 0.0;
        if self.hidden {
            // Don't resize: the picture usually returns at its old size, and resizing a canvas waits for all
            // pending drawing.
            return;
        }
        self.density = web_sys::window().map_or(1.0, |window| window.device_pixel_ratio());
        self.camera.viewport_px = [width.max(1.0), height.max(1.0)];
        let device_px = self.camera.viewport_px.map(|px| (px * self.density).round() as u32);
        if [self.canvas.width(), self.canvas.height()] != device_px || self.frames.painted == 0 {
            self.canvas.set_width(device_px[0]);
            self.canvas.set_height(device_px[1]);
            if let Painter::Gpu(gpu) = &mut self.painter {
                gpu.resize(device_px[0], device_px[1]);
            }
        }
        if self.fitted {
            self.fit();
        }
        self.solid.fit(self.camera.viewport_px);
    }

    pub(super) fn paint(&mut self) -> Painted {
        self.forget_frame();
        if self.hidden {
            self.publish();
            return Painted::Shown;
        }
        let started = now_ms();
        let look = Look {
            camera: &self.camera,
            density: self.density,
            scene: &self.scene,
            over: &self.over,
            palette: &self.palette,
            grid: self.grid,
            progress: self.progress,
            head_mm: self.head_mm,
            solid: self.solid.seen(),
            sharp: self.sharp,
        };
        let painted = match &mut self.painter {
            Painter::Gpu(gpu) => gpu.paint(&look),
            Painter::Flat(flat) => {
                flat.paint(&look, &self.emphasis);
                Painted::Shown
            }
            Painter::None => return Painted::Shown,
        };
        if matches!(painted, Painted::Shown | Painted::Coarse) {
            self.count(now_ms() - started);
            self.publish();
        }
        painted
    }

    /// Cancels the requested frame: this one replaces it.
    fn forget_frame(&mut self) {
        if let (Some(window), Some(asked)) = (web_sys::window(), self.frame_asked.take()) {
            let _ = window.cancel_animation_frame(asked);
        }
    }

    pub(super) fn forget_rest(&mut self) {
        if let (Some(window), Some(asked)) = (web_sys::window(), self.sharp_asked.take()) {
            window.clear_timeout_with_handle(asked);
        }
    }

    fn count(&mut self, took_ms: f64) {
        self.recent_ms[(self.frames.painted % 60) as usize] = took_ms;
        self.frames.painted += 1;
        self.frames.last_ms = took_ms;
        self.frames.longest_ms = self.recent_ms.iter().copied().fold(0.0, f64::max);
    }

    fn publish(&self) {
        let states = self.scene.discs.iter().map(|disc| self.progress.state(disc.order, disc.state));
        let count = |wanted| states.clone().filter(|state| *state == wanted).count();
        let (done, failed) = (count(HoleState::Done), count(HoleState::Failed));
        let rows = [
            ("data-backend", self.painter.backend().name().to_owned()),
            ("data-holes", self.scene.discs.len().to_string()),
            ("data-done", done.to_string()),
            ("data-failed", failed.to_string()),
            ("data-layers", self.scene.layers.len().to_string()),
            ("data-lines", self.scene.lines.len().to_string()),
            ("data-solid", self.solid.describe()),
            ("data-mirrored", self.camera.mirrored.to_string()),
            ("data-selected", self.emphasis.selected.len().to_string()),
            ("data-zoom", format!("{:.4}", self.camera.zoom())),
            ("data-centre", format!("{:.3} {:.3}", self.camera.centre_mm[0], self.camera.centre_mm[1])),
            ("data-frames", self.frames.painted.to_string()),
            ("data-frame-ms", format!("{:.2}", self.frames.last_ms)),
            ("data-losses", self.frames.losses.to_string()),
        ];
        for (name, value) in rows {
            let _ = self.canvas.set_attribute(name, &value);
        }
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        self.forget_frame();
        self.forget_rest();
        if let Some((observer, _)) = &self.observer {
            observer.disconnect();
        }
        self.canvas.remove();
    }
}

fn now_ms() -> f64 {
    web_sys::window().and_then(|window| window.performance()).map_or(0.0, |performance| performance.now())
}

/// The 3D view's state: field, camera, tool.
#[derive(Default)]
pub(super) struct Solid {
    pub(super) field: Option<ReliefField>,
    pub(super) orbit: Orbit,
    pub(super) tool: Option<Cutting>,
    pub(super) fits: bool,
    /// Shown instead of the 2D view.
    pub(super) shown: bool,
    /// Refit when the window changes, until the user moves the camera.
    pub(super) fitted: bool,
}

impl Solid {
    /// The 3D view, if it must be drawn.
    pub(super) fn seen(&self) -> Option<(&ReliefField, &Orbit, Option<Cutting>)> {
        let field = self.field.as_ref().filter(|_| self.shown && self.fits)?;
        Some((field, &self.orbit, self.tool))
    }

    /// Fits the board into the window from the current direction, unless the user has moved the camera.
    pub(super) fn fit(&mut self, viewport_px: [f64; 2]) {
        let Some(field) = self.field.as_ref().filter(|_| self.fitted) else { return };
        self.orbit.fit(field.relief.bounds_mm(), viewport_px);
    }

    /// For an attribute of the canvas: visibility, tilt and turn.
    pub(super) fn describe(&self) -> String {
        let orbit = &self.orbit;
        match self.seen() {
            Some(_) => format!("{:.0} {:.0} {:.1}", orbit.tilt_deg, orbit.turn_deg, orbit.across_mm),
            None => String::new(),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressed {
    pub at_mm: [f64; 2],
    pub disc: Option<usize>,
    /// Shift, Ctrl or Command: add to the selection.
    pub adding: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointerStroke {
    pub touch: Touch,
    pub at_mm: [f64; 2],
    pub shift: bool,
    /// Ctrl or Command.
    pub ctrl: bool,
}

type Act<T> = Option<Rc<RefCell<dyn FnMut(T)>>>;

#[derive(Default)]
pub(super) struct Gestures {
    pub(super) held: Vec<Held>,
    pub(super) dragged: bool,
    pub(super) on_press: Act<Pressed>,
    pub(super) on_hover: Act<Option<([f64; 2], Option<usize>)>>,
    pub(super) on_camera: Act<Camera>,
    pub(super) on_stroke: Act<PointerStroke>,
    pub(super) on_backend: Act<Backend>,
    /// Drawing mode: the first button and a single finger draw instead of moving the picture.
    pub(super) strokes: bool,
    /// Space is held: the first button moves the picture even in drawing mode.
    pub(super) space: bool,
    /// The pointer that is drawing.
    pub(super) stroke: Option<i32>,
    pub(super) listeners: Vec<Closure<dyn FnMut(PointerEvent)>>,
    pub(super) wheel: Option<Closure<dyn FnMut(WheelEvent)>>,
}

#[derive(Clone, Copy)]
pub(super) struct Held {
    pub(super) id: i32,
    pub(super) from_px: [f64; 2],
    pub(super) at_px: [f64; 2],
}

/// Must be called while the view isn't borrowed, because `act` may call the view.
pub(super) fn tell<T>(act: Act<T>, what: T) {
    if let Some(act) = act
        && let Ok(mut act) = act.try_borrow_mut()
    {
        act(what);
    }
}
