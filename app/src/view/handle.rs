//! The handle by which the page has a picture: what it shows, where one looks from, what lies under the pointer.
//!
//! Comes in: scene, palette, marks. Goes out: frames that are asked for. Does not know what the discs are, nor how it came to
//! stand in the page.

use super::backend::{Backend, Painter};
use super::camera::Camera;
use super::held::{PointerStroke, Pressed, tell};
use super::marks::Emphasis;
use super::palette::Palette;
use super::pick::Picker;
use super::scene::{HoleState, Line, OrderProgress, Scene, UNORDERED};
use super::stage::{Frames, Stage};
use std::cell::RefCell;
use std::rc::{Rc, Weak};
use wasm_bindgen::prelude::*;

/// How far beside a disc a pointer still means it, in CSS pixels.
const PICK_TOLERANCE_PX: f64 = 6.0;
/// So much of the board is across at least where what is chosen is looked at, in mm.
const CHOSEN_MM: f32 = 6.0;
/// A place is in sight where it is so far from the edge, in CSS pixels.
const BROUGHT_PX: f64 = 24.0;
/// Free room around it, in CSS pixels.
const CHOSEN_MARGIN_PX: f64 = 60.0;

/// The picture. Cheap to clone: all clones are the same picture. It goes when the last clone goes.
#[derive(Clone)]
pub struct View(pub(super) Rc<RefCell<Stage>>);

thread_local! {
    /// Every picture there is, so that a lost device, which can only send a message, finds its own.
    static STAGES: RefCell<Vec<Weak<RefCell<Stage>>>> = const { RefCell::new(Vec::new()) };
}

/// Keeps `view` among those that a lost device wakes.
pub(super) fn keep(view: &View) {
    STAGES.with_borrow_mut(|stages| stages.push(Rc::downgrade(&view.0)));
}

/// Asks every picture for a frame.
pub(super) fn wake_all() {
    STAGES.with_borrow_mut(|stages| {
        stages.retain(|stage| stage.strong_count() > 0);
        stages.iter().filter_map(Weak::upgrade).for_each(|stage| View(stage).repaint());
    });
}

impl View {
    /// Shows something else. Selection and progress are taken back; the camera stays, and what is drawn in stays under the
    /// pointer from then on.
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
        // It may have been fitted anew.
        self.moved();
    }

    /// What lies over the scene, for example under the pointer. Writes nothing else to the GPU.
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

    /// Changes the states of some discs, by index; nothing else is written to the GPU.
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

    /// Gives the discs of `order` their numbers in it: `order[0]` is drilled first. The others take no part.
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

    /// Puts a halo around these discs, and around no others.
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

    /// How far the plan has come. Costs a frame and nothing more.
    pub fn set_progress(&self, progress: OrderProgress) {
        self.0.borrow_mut().progress = progress;
        self.repaint();
    }

    /// Where the head is; none hides it.
    pub fn set_head(&self, at_mm: Option<[f32; 2]>) {
        self.0.borrow_mut().head_mm = at_mm;
        self.repaint();
    }

    /// Other colours. Discs and lines keep theirs, which came with the scene.
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

    /// Text that says what the picture shows, for those who do not see it.
    pub fn describe(&self, text: &str) {
        let _ = self.0.borrow().canvas.set_attribute("aria-label", text);
    }

    /// Where one looks from.
    pub fn camera(&self) -> Camera {
        self.0.borrow().camera
    }

    /// Looks from somewhere else. The size of the window stays the real one.
    pub fn set_camera(&self, camera: Camera) {
        self.move_camera(|own| {
            *own = Camera { viewport_px: own.viewport_px, mirrored: own.mirrored, ..camera }
        });
    }

    /// Looks from below, or from above. What is in the middle stays there.
    pub fn set_mirrored(&self, mirrored: bool) {
        self.0.borrow_mut().camera.mirrored = mirrored;
        self.moved();
    }

    /// Puts a place in the middle, with at least so many mm of the board across.
    pub fn look_at(&self, at_mm: [f64; 2], across_mm: f64) {
        self.move_camera(|camera| {
            camera.centre_mm = at_mm;
            camera.set_zoom(camera.viewport_px[0].min(camera.viewport_px[1]) / across_mm);
        });
    }

    /// Zooms about the middle of the window.
    pub fn zoom_by(&self, factor: f64) {
        if self.move_orbit(|orbit, window| orbit.zoom_at(window.map(|px| px / 2.0), factor, window)) {
            return;
        }
        self.move_camera(|camera| camera.zoom_at(camera.viewport_px.map(|px| px / 2.0), factor));
    }

    /// Shows everything. The picture stays fitted when the window changes, until somebody moves it or draws in it.
    pub fn fit(&self) {
        self.0.borrow_mut().fit();
        self.moved();
    }

    /// Moves no further than it takes to have a place in sight.
    pub fn bring(&self, at_mm: [f64; 2]) {
        let camera = self.camera();
        let near = |(at, size): (f64, f64)| (BROUGHT_PX..=size - BROUGHT_PX).contains(&at);
        let [at, size] = [camera.to_px(at_mm), camera.viewport_px];
        if !(near((at[0], size[0])) && near((at[1], size[1]))) {
            self.move_camera(|camera| camera.centre_mm = at_mm);
        }
    }

    /// Shows what is chosen with room around it; nothing changes where nothing is.
    pub fn fit_chosen(&self) {
        let Some([low, high]) = self.0.borrow().chosen_mm() else { return };
        let room = |axis: usize| f64::from(CHOSEN_MM - (high[axis] - low[axis])).max(0.0) / 2.0;
        let corner = |at: [f32; 2], sign: f64| [0, 1].map(|axis| f64::from(at[axis]) + sign * room(axis));
        self.move_camera(|camera| camera.fit([corner(low, -1.0), corner(high, 1.0)], CHOSEN_MARGIN_PX));
    }

    /// As large as the board is, on a screen of 96 pixels an inch.
    pub fn actual_size(&self) {
        self.move_camera(|camera| camera.zoom_at(camera.viewport_px.map(|px| px / 2.0), 1.0 / camera.zoom()));
    }

    /// The ground has a grid, or none.
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

    /// The disc at a place in the window, in CSS pixels from the canvas's upper left corner.
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

    /// Called with the disc under a click or tap, or none beside all.
    pub fn on_press(&self, act: impl FnMut(Pressed) + 'static) {
        self.0.borrow_mut().gestures.on_press = Some(Rc::new(RefCell::new(act)));
    }

    /// Called with the place of the board and the disc under the pointer; none when it leaves.
    pub fn on_hover(&self, act: impl FnMut(Option<([f64; 2], Option<usize>)>) + 'static) {
        self.0.borrow_mut().gestures.on_hover = Some(Rc::new(RefCell::new(act)));
    }

    /// Called after the camera moved.
    pub fn on_camera(&self, act: impl FnMut(Camera) + 'static) {
        self.0.borrow_mut().gestures.on_camera = Some(Rc::new(RefCell::new(act)));
    }

    /// Called with what paints from now on, after a device was lost.
    pub fn on_backend(&self, act: impl FnMut(Backend) + 'static) {
        self.0.borrow_mut().gestures.on_backend = Some(Rc::new(RefCell::new(act)));
    }

    /// Called with what the pointer does while it draws, see [`set_strokes`](Self::set_strokes).
    pub fn on_stroke(&self, act: impl FnMut(PointerStroke) + 'static) {
        self.0.borrow_mut().gestures.on_stroke = Some(Rc::new(RefCell::new(act)));
    }

    /// The first button and a single finger draw, or they move the picture. The other buttons and two fingers always do that.
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

    /// Space is held, or let go: with it the first button moves the picture where it would draw.
    pub fn set_space(&self, on: bool) {
        self.0.borrow_mut().gestures.space = on;
    }

    /// Which painter is used.
    pub fn backend(&self) -> Backend {
        self.0.borrow().painter.backend()
    }

    /// How painting went.
    pub fn frames(&self) -> Frames {
        self.0.borrow().frames
    }

    /// Throws the device away; the picture comes back on a new one, as after the graphics card slept.
    pub fn lose_device(&self) {
        if let Painter::Gpu(gpu) = &self.0.borrow().painter {
            gpu.lose();
        }
        self.repaint();
    }

    /// Asks for a frame, once.
    pub(super) fn repaint(&self) {
        // A device may be lost while the picture is borrowed; whoever borrowed it asks for a frame afterwards.
        let Ok(mut stage) = self.0.try_borrow_mut() else { return };
        stage.sharp = false;
        if stage.frame_asked.is_some() {
            return;
        }
        let (Some(window), Some(act)) = (web_sys::window(), &stage.on_frame) else { return };
        stage.frame_asked = window.request_animation_frame(act.as_ref().unchecked_ref()).ok();
    }
}
