//! Life of a picture in the page: creation, painting on demand, recovery of lost devices.
//!
//! ```text
//! set_… ──▶ repaint ──▶ requestAnimationFrame ─┬▶ paint ─┬─ shown
//!                               ResizeObserver ─┘         └─ device lost: new canvas, same scene, callback
//!                                                            lost too often: WebGPU ▶ WebGL2 ▶ 2D
//! ```

use super::backend::{Painter, PainterChoice, set_up};
use super::camera::Camera;
use super::gestures;
use super::handle::{View, keep, wake_all};
use super::marks::Emphasis;
use super::numbers::Painted;
use super::palette::Palette;
use super::scene::{OrderProgress, Scene};
use super::stage::{Frames, Gestures, Solid, Stage, tell};
use std::cell::RefCell;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::{HtmlElement, ResizeObserver};

/// After more losses than this, a worse kind of device is used.
const MOST_LOSSES: u32 = 3;
/// A coarse frame is repainted sharp after this time without a change, ms.
const REST_MS: i32 = 250;

impl View {
    /// A picture that fills `host`, which must have a size. Fails only if there is not even a 2D canvas.
    pub async fn new(host: &HtmlElement, wanted: PainterChoice, palette: Palette) -> Result<Self, String> {
        let (canvas, painter) = set_up(host, wanted, wake_all).await?;
        let view = Self(Rc::new(RefCell::new(Stage {
            host: host.clone(),
            canvas,
            painter,
            wanted,
            scene: Scene::default(),
            over: Vec::new(),
            palette,
            grid: true,
            camera: Camera::default(),
            density: 1.0,
            hidden: false,
            emphasis: Emphasis::default(),
            progress: OrderProgress::default(),
            head_mm: None,
            solid: Solid::default(),
            picker: None,
            fitted: true,
            frames: Frames::default(),
            lost_of_kind: 0,
            recent_ms: [0.0; 60],
            frame_asked: None,
            sharp: false,
            sharp_asked: None,
            on_frame: None,
            on_rest: None,
            observer: None,
            on_context_lost: None,
            gestures: Gestures::default(),
        })));
        keep(&view);
        view.watch_frames_and_size();
        view.listen_to_canvas();
        view.measure();
        Ok(view)
    }

    fn watch_frames_and_size(&self) {
        // The stage owns these closures, so they must not own the stage.
        let stage = Rc::downgrade(&self.0);
        let on_frame = Closure::new(move || {
            if let Some(stage) = stage.upgrade() {
                View(stage).paint();
            }
        });
        let stage = Rc::downgrade(&self.0);
        let on_rest = Closure::new(move || {
            if let Some(stage) = stage.upgrade() {
                let view = View(stage);
                view.repaint();
                view.0.borrow_mut().sharp = true;
            }
        });
        let stage = Rc::downgrade(&self.0);
        let on_size = Closure::<dyn FnMut()>::new(move || {
            if let Some(stage) = stage.upgrade() {
                let view = View(stage);
                view.measure();
                // Resizing clears the canvas: paint before the browser shows it.
                view.paint();
            }
        });
        let mut stage = self.0.borrow_mut();
        (stage.on_frame, stage.on_rest) = (Some(on_frame), Some(on_rest));
        if let Ok(observer) = ResizeObserver::new(on_size.as_ref().unchecked_ref()) {
            observer.observe(&stage.host);
            stage.observer = Some((observer, on_size));
        }
    }

    fn listen_to_canvas(&self) {
        gestures::listen(self);
        let stage = Rc::downgrade(&self.0);
        let on_lost = Closure::<dyn FnMut()>::new(move || {
            if let Some(stage) = stage.upgrade() {
                View(stage).lose_device();
            }
        });
        let mut stage = self.0.borrow_mut();
        let listener = on_lost.as_ref().unchecked_ref();
        // WebGPU reports a lost device itself; WebGL2 only by this event.
        let _ = stage.canvas.add_event_listener_with_callback("webglcontextlost", listener);
        stage.on_context_lost = Some(on_lost);
    }

    fn measure(&self) {
        self.0.borrow_mut().measure();
        self.moved();
    }

    pub(super) fn paint(&self) {
        let painted = self.0.borrow_mut().paint();
        match painted {
            Painted::Shown => {}
            Painted::Coarse => self.sharpen_at_rest(),
            Painted::Later => self.repaint(),
            Painted::Lost => self.restore(),
        }
    }

    /// Requests a sharp frame for when nothing changes any longer.
    fn sharpen_at_rest(&self) {
        let stage = &mut *self.0.borrow_mut();
        stage.forget_rest();
        let (Some(window), Some(act)) = (web_sys::window(), &stage.on_rest) else { return };
        let act = act.as_ref().unchecked_ref();
        stage.sharp_asked = window.set_timeout_with_callback_and_timeout_and_arguments_0(act, REST_MS).ok();
    }

    /// Creates a new canvas and renderer for the same scene.
    fn restore(&self) {
        let (host, wanted) = {
            let mut stage = self.0.borrow_mut();
            let lost = std::mem::replace(&mut stage.painter, Painter::None).backend();
            stage.canvas.remove();
            stage.frames.losses += 1;
            stage.lost_of_kind += 1;
            if stage.lost_of_kind > MOST_LOSSES {
                (stage.wanted, stage.lost_of_kind) = (lost.below(), 0);
            }
            (stage.host.clone(), stage.wanted)
        };
        let stage = Rc::downgrade(&self.0);
        wasm_bindgen_futures::spawn_local(async move {
            let Ok((canvas, painter)) = set_up(&host, wanted, wake_all).await else { return };
            let Some(stage) = stage.upgrade() else { return canvas.remove() };
            {
                let mut stage = stage.borrow_mut();
                let label = stage.canvas.get_attribute("aria-label");
                stage.canvas = canvas;
                stage.painter = painter;
                if let Some(label) = label {
                    let _ = stage.canvas.set_attribute("aria-label", &label);
                }
                stage.write_all();
            }
            let view = Self(stage);
            view.listen_to_canvas();
            view.measure();
            let act = view.0.borrow().gestures.on_backend.clone();
            tell(act, view.backend());
        });
    }
}
