//! The page's handle to a picture: content, camera, picking.

use super::backend::{Backend, Painter};
use super::camera::Camera;
use super::marks::Emphasis;
use super::palette::Palette;
use super::pick::Picker;
use super::scene::{HoleState, Line, OrderProgress, Scene, UNORDERED};
use super::stage::{Frames, PointerStroke, Pressed, Stage, tell};
use std::cell::RefCell;
use std::rc::{Rc, Weak};
use wasm_bindgen::prelude::*;

const PICK_TOLERANCE_PX: f64 = 6.0;
const CHOSEN_MM: f32 = 6.0;
/// A position this far from the edge counts as in view, CSS pixels.
const BROUGHT_PX: f64 = 24.0;
const CHOSEN_MARGIN_PX: f64 = 60.0;

/// The picture. Clones share it; it is dropped with the last clone.
#[derive(Clone)]
pub struct View(pub(super) Rc<RefCell<Stage>>);

thread_local! {
    /// All pictures. A lost device can only call a plain function, which then wakes all of them.
    static STAGES: RefCell<Vec<Weak<RefCell<Stage>>>> = const { RefCell::new(Vec::new()) };
}

/// Adds `view` to the pictures that a lost device wakes.
pub(super) fn keep(view: &View) {
    STAGES.with_borrow_mut(|stages| stages.push(Rc::downgrade(&view.0)));
}

pub(super) fn wake_all() {
    STAGES.with_borrow_mut(|stages| {
        stages.retain(|stage| stage.strong_count() > 0);
        stages.iter().filter_map(Weak::upgrade).for_each(|stage| View(stage).repaint());
    });
}

impl View {
    /// Replaces the scene and clears selection and progress. The camera stays; in drawing mode a fitted
    /// picture no longer refits, so that nothing moves under the pointer.
    pub fn set_scene(&self, scene: Scene) {
        {
            let mut stage = self.0.borrow_mut();
            stage.fitted &= !stage.gestures.strokes;
            stage.scene = scene;
            stage.emphasis = Emphasis::default();
            stage.progress = OrderProgress::default();
            stage.picker = None;
            stage.rebuild();
        }
        // The rebuild may have refitted the camera.
        self.moved();
    }

    /// Replaces the overlay, such as marks under the pointer. Writes nothing else to the GPU.
    pub fn set_over(&self, lines: Vec<Line>) {
        {
            let stage = &mut *self.0.borrow_mut();
            if stage.over.is_empty() && lines.is_empty() {
                return;
            }
            stage.over = lines;
            if let Painter::Gpu(gpu) = &mut stage.painter {
                gpu.set_over(&stage.over);
            }
        }
        self.repaint();
    }

    /// Changes the states of some discs, by index. Writes nothing else to the GPU.
    pub fn set_states(&self, changes: &[(usize, HoleState)]) {
        {
            let mut stage = self.0.borrow_mut();
            for (index, state) in changes {
                if let Some(disc) = stage.scene.discs.get_mut(*index) {
                    disc.state = *state;
                }
            }
            let indices = changes.iter().map(|(index, _)| *index).collect();
            stage.rewrite(indices);
        }
        self.repaint();
    }

    /// Numbers the discs in this order: `order[0]` is drilled first. Other discs become unordered.
    pub fn set_order(&self, order: &[usize]) {
        {
            let mut stage = self.0.borrow_mut();
            stage.scene.discs.iter_mut().for_each(|disc| disc.order = UNORDERED);
            for (number, index) in order.iter().enumerate() {
                if let Some(disc) = stage.scene.discs.get_mut(*index) {
                    disc.order = number as u32;
                }
            }
            stage.rebuild();
        }
        self.repaint();
    }

    pub fn set_selected(&self, discs: &[usize]) {
        {
            let mut stage = self.0.borrow_mut();
            let mut now: Vec<u32> = discs.iter().map(|index| *index as u32).collect();
            now.sort_unstable();
            let before = std::mem::replace(&mut stage.emphasis.selected, now);
            let changed =
                before.iter().chain(&stage.emphasis.selected).map(|index| *index as usize).collect();
            stage.rewrite(changed);
        }
        self.repaint();
    }

    pub(super) fn set_hovered(&self, disc: Option<usize>) {
        let now = disc.map(|index| index as u32);
        {
            let mut stage = self.0.borrow_mut();
            if stage.emphasis.hovered == now {
                return;
            }
            let before = std::mem::replace(&mut stage.emphasis.hovered, now);
            stage.rewrite(before.iter().chain(&now).map(|index| *index as usize).collect());
        }
        self.repaint();
    }

    /// Sets the progress of the plan. Repaints, but writes no scene data.
    pub fn set_progress(&self, progress: OrderProgress) {
        self.0.borrow_mut().progress = progress;
        self.repaint();
    }

    /// Position of the tool; none hides it.
    pub fn set_head(&self, at_mm: Option<[f32; 2]>) {
        self.0.borrow_mut().head_mm = at_mm;
        self.repaint();
    }

    /// Replaces the colours. Discs and lines keep theirs, which are part of the scene.
    pub fn set_palette(&self, palette: Palette) {
        {
            let mut stage = self.0.borrow_mut();
            if stage.palette == palette {
                return;
            }
            stage.palette = palette;
            stage.rebuild();
        }
        self.repaint();
    }

    pub fn describe(&self, text: &str) {
        let _ = self.0.borrow().canvas.set_attribute("aria-label", text);
    }

    pub fn camera(&self) -> Camera {
        self.0.borrow().camera
    }

    /// Replaces the camera, except the window size and mirroring.
    pub fn set_camera(&self, camera: Camera) {
        self.move_camera(|own| {
            *own = Camera { viewport_px: own.viewport_px, mirrored: own.mirrored, ..camera }
        });
    }

    /// Looks from below or from above. The middle stays in the middle.
    pub fn set_mirrored(&self, mirrored: bool) {
        self.0.borrow_mut().camera.mirrored = mirrored;
        self.moved();
    }

    /// Centers on a position, with `across_mm` of the board in view.
    pub fn look_at(&self, at_mm: [f64; 2], across_mm: f64) {
        self.move_camera(|camera| {
            camera.centre_mm = at_mm;
            camera.set_zoom(camera.viewport_px[0].min(camera.viewport_px[1]) / across_mm);
        });
    }

    pub fn zoom_by(&self, factor: f64) {
        if self.move_orbit(|orbit, window| orbit.zoom_at(window.map(|px| px / 2.0), factor, window)) {
            return;
        }
        self.move_camera(|camera| camera.zoom_at(camera.viewport_px.map(|px| px / 2.0), factor));
    }

    /// Shows everything. Refits when the window changes, until the user moves the picture or draws in it.
    pub fn fit(&self) {
        self.0.borrow_mut().fit();
        self.moved();
    }

    /// Centers on a position, unless it is already in view.
    pub fn bring(&self, at_mm: [f64; 2]) {
        let camera = self.camera();
        let near = |(at, size): (f64, f64)| (BROUGHT_PX..=size - BROUGHT_PX).contains(&at);
        let [at, size] = [camera.to_px(at_mm), camera.viewport_px];
        if !(near((at[0], size[0])) && near((at[1], size[1]))) {
            self.move_camera(|camera| camera.centre_mm = at_mm);
        }
    }

    /// Shows the selection with a margin; no effect without a selection.
    pub fn fit_chosen(&self) {
        let Some([low, high]) = self.0.borrow().chosen_mm() else { return };
        let room = |axis: usize| f64::from(CHOSEN_MM - (high[axis] - low[axis])).max(0.0) / 2.0;
        let corner = |at: [f32; 2], sign: f64| [0, 1].map(|axis| f64::from(at[axis]) + sign * room(axis));
        self.move_camera(|camera| camera.fit([corner(low, -1.0), corner(high, 1.0)], CHOSEN_MARGIN_PX));
    }

    /// Actual size, on a screen of 96 pixels per inch.
    pub fn actual_size(&self) {
        self.move_camera(|camera| camera.zoom_at(camera.viewport_px.map(|px| px / 2.0), 1.0 / camera.zoom()));
    }

    pub fn set_grid(&self, on: bool) {
        self.0.borrow_mut().grid = on;
        self.repaint();
    }

    pub(super) fn move_camera(&self, change: impl FnOnce(&mut Camera)) {
        {
            let mut stage = self.0.borrow_mut();
            stage.fitted = false;
            change(&mut stage.camera);
        }
        self.moved();
    }

    pub(super) fn moved(&self) {
        let act = self.0.borrow().gestures.on_camera.clone();
        tell(act, self.camera());
        self.repaint();
    }

    /// The disc at a window position, in CSS pixels from the canvas's upper left corner.
    pub fn pick(&self, at_px: [f64; 2]) -> Option<usize> {
        let mut stage = self.0.borrow_mut();
        if stage.picker.is_none() {
            stage.picker = Some(Picker::new(&stage.scene.discs));
        }
        let viewport = stage.camera.viewport_px;
        let solid = stage.solid.seen().map(|(_, orbit, _)| (orbit.to_mm(at_px, viewport), orbit.across_mm));
        let (at_mm, px_per_mm) = match solid {
            Some((at, across_mm)) => (at?, viewport[1] / across_mm),
            None => (stage.camera.to_mm(at_px), stage.camera.px_per_mm),
        };
        let tolerance = PICK_TOLERANCE_PX / px_per_mm;
        stage.picker.as_ref().and_then(|picker| picker.nearest(at_mm, tolerance))
    }

    pub fn on_press(&self, act: impl FnMut(Pressed) + 'static) {
        self.0.borrow_mut().gestures.on_press = Some(Rc::new(RefCell::new(act)));
    }

    /// Called with the board position and the disc under the pointer; none when the pointer leaves.
    pub fn on_hover(&self, act: impl FnMut(Option<([f64; 2], Option<usize>)>) + 'static) {
        self.0.borrow_mut().gestures.on_hover = Some(Rc::new(RefCell::new(act)));
    }

    pub fn on_camera(&self, act: impl FnMut(Camera) + 'static) {
        self.0.borrow_mut().gestures.on_camera = Some(Rc::new(RefCell::new(act)));
    }

    /// Called with the new back end after a device was lost.
    pub fn on_backend(&self, act: impl FnMut(Backend) + 'static) {
        self.0.borrow_mut().gestures.on_backend = Some(Rc::new(RefCell::new(act)));
    }

    /// Called with pointer events in drawing mode, see [`set_strokes`](Self::set_strokes).
    pub fn on_stroke(&self, act: impl FnMut(PointerStroke) + 'static) {
        self.0.borrow_mut().gestures.on_stroke = Some(Rc::new(RefCell::new(act)));
    }

    /// Turns drawing mode on or off. In drawing mode, the first button and a single finger draw; other
    /// buttons and two fingers still move the picture.
    pub fn set_strokes(&self, on: bool) {
        {
            let stage = &mut *self.0.borrow_mut();
            (stage.gestures.strokes, stage.gestures.stroke) = (on, None);
            stage.fitted |= !on;
        }
        if on {
            self.set_hovered(None);
        }
    }

    /// While Space is held, the first button moves the picture even in drawing mode.
    pub fn set_space(&self, on: bool) {
        self.0.borrow_mut().gestures.space = on;
    }

    pub fn backend(&self) -> Backend {
        self.0.borrow().painter.backend()
    }

    pub fn frames(&self) -> Frames {
        self.0.borrow().frames
    }

    /// Destroys the device for tests; the picture recovers on a new one, as after a suspend.
    pub fn lose_device(&self) {
        if let Painter::Gpu(gpu) = &self.0.borrow().painter {
            gpu.lose();
        }
        self.repaint();
    }

    pub(super) fn repaint(&self) {
        // A device can be lost while the picture is borrowed; the borrower requests a frame itself
        // afterwards.
        let Ok(mut stage) = self.0.try_borrow_mut() else { return };
        stage.sharp = false;
        if stage.frame_asked.is_some() {
            return;
        }
        let (Some(window), Some(act)) = (web_sys::window(), &stage.on_frame) else { return };
        stage.frame_asked = window.request_animation_frame(act.as_ref().unchecked_ref()).ok();
    }
}
