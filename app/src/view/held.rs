//! Pointers that are down on the picture, and the callbacks for them.

use super::Touch;
use super::backend::Backend;
use super::camera::Camera;
use std::cell::RefCell;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::{PointerEvent, WheelEvent};

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressed {
    /// Board position.
    pub at_mm: [f64; 2],
    pub disc: Option<usize>,
    /// Shift, Ctrl or Command: add to the selection.
    pub adding: bool,
}

/// A pointer event in drawing mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointerStroke {
    pub touch: Touch,
    /// Board position.
    pub at_mm: [f64; 2],
    pub shift: bool,
    /// Ctrl or Command.
    pub ctrl: bool,
}

/// A callback.
pub(super) type Act<T> = Option<Rc<RefCell<dyn FnMut(T)>>>;

/// Pointers that are down, and the callbacks.
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
