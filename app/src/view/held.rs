//! Pointers that are down on the picture, and who wants to know what they do.
//!
//! Comes in: what the pointers did. Goes out: the same to whoever asked. Does not know what a press means.

use super::backend::Backend;
use super::camera::Camera;
use super::touch::Touch;
use std::cell::RefCell;
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::{PointerEvent, WheelEvent};

/// A click or tap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressed {
    /// Where on the board.
    pub at_mm: [f64; 2],
    /// The disc there.
    pub disc: Option<usize>,
    /// Shift, Ctrl or Command was held: add to what is selected.
    pub adding: bool,
}

/// A pointer that draws.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointerStroke {
    /// What it does.
    pub touch: Touch,
    /// Where on the board.
    pub at_mm: [f64; 2],
    /// Shift is held.
    pub shift: bool,
    /// Ctrl or Command is held.
    pub ctrl: bool,
}

/// Who wants to know.
pub(super) type Act<T> = Option<Rc<RefCell<dyn FnMut(T)>>>;

/// Pointers that are down, and who wants to know.
#[derive(Default)]
pub(super) struct Gestures {
    pub(super) held: Vec<Held>,
    pub(super) dragged: bool,
    pub(super) on_press: Act<Pressed>,
    pub(super) on_hover: Act<Option<([f64; 2], Option<usize>)>>,
    pub(super) on_camera: Act<Camera>,
    pub(super) on_stroke: Act<PointerStroke>,
    pub(super) on_backend: Act<Backend>,
    /// The first button and a single finger draw; they do not move the picture.
    pub(super) strokes: bool,
    /// Space is held: the first button moves the picture where it would draw.
    pub(super) space: bool,
    /// The pointer that draws now.
    pub(super) stroke: Option<i32>,
    pub(super) listeners: Vec<Closure<dyn FnMut(PointerEvent)>>,
    pub(super) wheel: Option<Closure<dyn FnMut(WheelEvent)>>,
}

/// A pointer that is down.
#[derive(Clone, Copy)]
pub(super) struct Held {
    pub(super) id: i32,
    pub(super) from_px: [f64; 2],
    pub(super) at_px: [f64; 2],
}

/// Nothing of the view is borrowed while `act` runs, so it may call the view.
pub(super) fn tell<T>(act: Act<T>, what: T) {
    if let Some(act) = act
        && let Ok(mut act) = act.try_borrow_mut()
    {
        act(what);
    }
}
