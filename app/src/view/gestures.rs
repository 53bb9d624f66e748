//! Pointer input on the picture: wheel and pinch zoom, a drag pans, a press without a drag picks. In drawing
//! mode, the first button and a single finger draw instead, unless Space is held.
//!
//! ```text
//! down ─▶ held ── moved > 4 px ──▶ panning ── up ─▶ nothing
//!            └────────── up ─────▶ pressed
//! ```

use super::Touch;
use super::handle::View;
use super::stage::{Held, PointerStroke, Pressed, tell};
use std::rc::Rc;
use wasm_bindgen::prelude::*;
use web_sys::{AddEventListenerOptions, HtmlCanvasElement, PointerEvent, WheelEvent};

/// A shorter move is a press, not a drag.
const STILL_PX: f64 = 4.0;

type Handler = fn(&View, &PointerEvent);

/// Attaches the listeners to the current canvas, which can be a new one.
pub(super) fn listen(view: &View) {
    let canvas = view.0.borrow().canvas.clone();
    let handlers: [(&str, Handler); 5] = [
        ("pointerdown", down),
        ("pointermove", moved),
        ("pointerup", up),
        ("pointercancel", cancelled),
        ("pointerleave", left),
    ];
    let mut listeners = Vec::new();
    for (name, act) in handlers {
        let stage = Rc::downgrade(&view.0);
        let listener = Closure::<dyn FnMut(PointerEvent)>::new(move |event: PointerEvent| {
            if let Some(stage) = stage.upgrade() {
                act(&View(stage), &event);
            }
        });
        let _ = canvas.add_event_listener_with_callback(name, listener.as_ref().unchecked_ref());
        listeners.push(listener);
    }
    let wheel = listen_to_wheel(view, &canvas);
    let gestures = &mut view.0.borrow_mut().gestures;
    gestures.listeners = listeners;
    gestures.wheel = Some(wheel);
    gestures.held.clear();
}

fn listen_to_wheel(view: &View, canvas: &HtmlCanvasElement) -> Closure<dyn FnMut(WheelEvent)> {
    let stage = Rc::downgrade(&view.0);
    let listener = Closure::<dyn FnMut(WheelEvent)>::new(move |event: WheelEvent| {
        let Some(stage) = stage.upgrade() else { return };
        event.prevent_default();
        let lines = if event.delta_mode() == WheelEvent::DOM_DELTA_LINE { 16.0 } else { 1.0 };
        // A notch of a mouse wheel is about 100 pixels; a trackpad pinch arrives as small steps with Ctrl.
        let speed = if event.ctrl_key() { 0.01 } else { 0.0018 };
        let factor = libm::exp(-(event.delta_y() * lines).clamp(-400.0, 400.0) * speed);
        let at = [f64::from(event.offset_x()), f64::from(event.offset_y())];
        let view = View(stage);
        if !view.move_orbit(|orbit, window| orbit.zoom_at(at, factor, window)) {
            view.move_camera(|camera| camera.zoom_at(at, factor));
        }
    });
    let options = AddEventListenerOptions::new();
    // A passive listener could not keep the page from scrolling.
    options.set_passive(false);
    let _ = canvas.add_event_listener_with_callback_and_add_event_listener_options(
        "wheel",
        listener.as_ref().unchecked_ref(),
        &options,
    );
    listener
}

fn place(event: &PointerEvent) -> [f64; 2] {
    [f64::from(event.offset_x()), f64::from(event.offset_y())]
}

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (dx, dy) = (a[0] - b[0], a[1] - b[1]);
    libm::sqrt(dx * dx + dy * dy)
}

fn down(view: &View, event: &PointerEvent) {
    let (draws, broken) = {
        let stage = &mut *view.0.borrow_mut();
        let _ = stage.canvas.set_pointer_capture(event.pointer_id());
        let (at_px, gestures) = (place(event), &mut stage.gestures);
        let alone = gestures.held.is_empty();
        let moves = gestures.strokes && gestures.space;
        let draws = gestures.strokes && alone && event.button() == 0 && !moves;
        // A second pointer turns drawing into moving the picture.
        let broken = gestures.stroke.take().is_some();
        stage.fitted &= !draws;
        gestures.stroke = draws.then(|| event.pointer_id());
        gestures.dragged = !alone || draws || moves || event.button() != 0;
        gestures.held.push(Held { id: event.pointer_id(), from_px: at_px, at_px });
        (draws, broken)
    };
    if broken {
        stroke(view, event, Touch::Cancel);
    } else if draws {
        stroke(view, event, Touch::Down);
    }
}

fn stroke(view: &View, event: &PointerEvent, touch: Touch) {
    let act = view.0.borrow().gestures.on_stroke.clone();
    let at_mm = view.place_of(place(event));
    let ctrl = event.ctrl_key() || event.meta_key();
    tell(act, PointerStroke { touch, at_mm, shift: event.shift_key(), ctrl });
}

fn draws(view: &View, event: &PointerEvent) -> bool {
    view.0.borrow().gestures.stroke == Some(event.pointer_id())
}

fn moved(view: &View, event: &PointerEvent) {
    let at = place(event);
    if draws(view, event) {
        return stroke(view, event, Touch::Move);
    }
    let held = view.0.borrow().gestures.held.clone();
    let Some(index) = held.iter().position(|held| held.id == event.pointer_id()) else {
        let strokes = view.0.borrow().gestures.strokes;
        return if strokes { stroke(view, event, Touch::Hover) } else { hover(view, at) };
    };
    let before = held[index].at_px;
    let start = apart(held[index].from_px, at);
    {
        let gestures = &mut view.0.borrow_mut().gestures;
        gestures.held[index].at_px = at;
        if !gestures.dragged && start <= STILL_PX {
            return;
        }
        gestures.dragged = true;
    }
    let other = held.iter().find(|held| held.id != event.pointer_id());
    // In the 3D view, one finger turns the board; two fingers, other buttons or Shift pan.
    let pans = event.shift_key() || event.buttons() & 6 != 0;
    let in_space = view.move_orbit(|orbit, window| match other {
        None if pans => orbit.pan_px(before, at, window),
        None => orbit.turn_px([at[0] - before[0], at[1] - before[1]]),
        Some(other) => {
            let middle = |at: [f64; 2]| [(at[0] + other.at_px[0]) / 2.0, (at[1] + other.at_px[1]) / 2.0];
            orbit.pan_px(middle(before), middle(at), window);
            let factor = apart(at, other.at_px) / apart(before, other.at_px).max(1.0);
            orbit.zoom_at(middle(at), factor, window);
        }
    });
    if in_space {
        return;
    }
    view.move_camera(|camera| match other {
        None => camera.pan_px([at[0] - before[0], at[1] - before[1]]),
        Some(other) => {
            camera.pan_px([(at[0] - before[0]) / 2.0, (at[1] - before[1]) / 2.0]);
            let middle = [(at[0] + other.at_px[0]) / 2.0, (at[1] + other.at_px[1]) / 2.0];
            camera.zoom_at(middle, apart(at, other.at_px) / apart(before, other.at_px).max(1.0));
        }
    });
}

fn release(view: &View, id: i32) -> bool {
    let gestures = &mut view.0.borrow_mut().gestures;
    let known = gestures.held.iter().any(|held| held.id == id);
    gestures.held.retain(|held| held.id != id);
    gestures.stroke = gestures.stroke.filter(|own| *own != id);
    known && !gestures.dragged
}

fn up(view: &View, event: &PointerEvent) {
    if draws(view, event) {
        release(view, event.pointer_id());
        return stroke(view, event, Touch::Up);
    }
    if !release(view, event.pointer_id()) {
        return;
    }
    let at_px = place(event);
    let pressed = Pressed {
        at_mm: view.place_of(at_px),
        disc: view.pick(at_px),
        adding: event.shift_key() || event.ctrl_key() || event.meta_key(),
    };
    let act = view.0.borrow().gestures.on_press.clone();
    tell(act, pressed);
}

fn cancelled(view: &View, event: &PointerEvent) {
    if draws(view, event) {
        stroke(view, event, Touch::Cancel);
    }
    release(view, event.pointer_id());
}

fn hover(view: &View, at_px: [f64; 2]) {
    let disc = view.pick(at_px);
    view.set_hovered(disc);
    let act = view.0.borrow().gestures.on_hover.clone();
    tell(act, Some((view.place_of(at_px), disc)));
}

fn left(view: &View, _: &PointerEvent) {
    view.set_hovered(None);
    let act = view.0.borrow().gestures.on_hover.clone();
    tell(act, None);
}
