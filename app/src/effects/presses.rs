//! Guards controls that move the machine. Reports them to the model ten times a second and on each change,
//! and blocks presses that the model refuses.
//!
//! A guarded control is an element whose `data-moves` names the action of a press. While it is fresh it is
//! `aria-disabled`; views create it so.

use crate::browser::window;
use crate::model::HandEvent;
use crate::model::presses::{MovingControl, PressEvent};
use crate::page::{peek, send};
use js_sys::Array;
use leptos::prelude::set_interval;
use std::cell::{Cell, RefCell};
use std::rc::Rc;
use std::time::Duration;
use wasm_bindgen::prelude::*;
use web_sys::{
    AddEventListenerOptions, Element, Event, MouseEvent, MutationObserver, MutationObserverInit, Node,
    PointerEvent,
};

const EVERY: Duration = Duration::from_millis(100);
/// Attribute with the action of a press.
const ACT: &str = "data-moves";
const NUMBER: &str = "data-control";
const GUARDED: &str = "[data-moves]";

/// Starts guarding. Called once.
pub(super) fn begin() {
    let looks = Rc::new(Looks::default());
    let every = Rc::clone(&looks);
    set_interval(move || every.look(), EVERY);
    let changed = Rc::clone(&looks);
    observe(move || changed.look());
    let press = Rc::clone(&looks);
    listen("pointerdown", move |event| press.pressed(&event));
    listen("click", move |event| looks.clicked(&event));
}

/// Calls `changed` before the next paint whenever a control is enabled or disabled or its action changes.
fn observe(changed: impl FnMut() + 'static) {
    let Some(document) = window().document() else { return };
    let heard = Closure::<dyn FnMut()>::new(changed);
    let Ok(observer) = MutationObserver::new(heard.as_ref().unchecked_ref()) else { return };
    heard.forget();
    let options = MutationObserverInit::new();
    options.set_subtree(true);
    options.set_attribute_filter(&Array::of2(&"disabled".into(), &ACT.into()));
    let _ = observer.observe_with_options(&document, &options);
}

/// Handles `name` before any element of the page does.
fn listen(name: &str, heard: impl FnMut(Event) + 'static) {
    let options = AddEventListenerOptions::new();
    options.set_capture(true);
    let heard = Closure::<dyn FnMut(Event)>::new(heard);
    let function = heard.as_ref().unchecked_ref();
    let _ =
        window().add_event_listener_with_callback_and_add_event_listener_options(name, function, &options);
    heard.forget();
}

#[derive(Default)]
struct Looks {
    number: Cell<u32>,
    shown: RefCell<Vec<MovingControl>>,
}

impl Looks {
    fn look(&self) {
        let Some(document) = window().document() else { return };
        let Ok(found) = document.query_selector_all(GUARDED) else { return };
        let dialog = document.query_selector("dialog[open]").ok().flatten();
        let elements = (0..found.length()).filter_map(|at| found.get(at)?.dyn_into::<Element>().ok());
        let elements: Vec<(Element, Option<MovingControl>)> =
            elements.map(|element| (element.clone(), self.control(&element, dialog.as_ref()))).collect();
        let controls: Vec<MovingControl> =
            elements.iter().filter_map(|(_, control)| control.clone()).collect();
        if *self.shown.borrow() != controls || peek(|m| !m.presses.fresh.is_empty()) {
            self.shown.replace(controls.clone());
            send(PressEvent::Shown { controls });
        }
        let fresh = peek(|m| m.presses.fresh.clone());
        for (element, control) in elements {
            let is = control.is_some_and(|control| fresh.contains(&control.id));
            let was = element.has_attribute("aria-disabled");
            let _ = match (is, was) {
                (true, false) => element.set_attribute("aria-disabled", "true"),
                (false, true) => element.remove_attribute("aria-disabled"),
                _ => Ok(()),
            };
        }
    }

    /// The element as a control; `None` if it has no action now, is not shown or is covered by an open
    /// dialog.
    fn control(&self, element: &Element, dialog: Option<&Element>) -> Option<MovingControl> {
        let act = element.get_attribute(ACT).filter(|act| !act.is_empty())?;
        let place = element.get_bounding_client_rect();
        let is_under = dialog.is_some_and(|dialog| !dialog.contains(Some(element.unchecked_ref::<Node>())));
        if is_under || place.width() == 0.0 {
            return None;
        }
        let id = element.get_attribute(NUMBER).and_then(|number| number.parse().ok()).unwrap_or_else(|| {
            self.number.set(self.number.get() + 1);
            let _ = element.set_attribute(NUMBER, &self.number.get().to_string());
            self.number.get()
        });
        let [right, down] = scrolled(element);
        let px = |edge: f64, scrolled: i32| edge as i32 + scrolled;
        let edges_px = [
            px(place.left(), right),
            px(place.top(), down),
            px(place.right(), right),
            px(place.bottom(), down),
        ];
        Some(MovingControl { id, act, edges_px, usable: !element.has_attribute("disabled") })
    }

    fn under(&self, event: &Event) -> Option<MovingControl> {
        let target = event.target()?.dyn_into::<Element>().ok()?;
        let element = target.closest(GUARDED).ok().flatten()?;
        self.control(&element, None).filter(|control| control.usable)
    }

    fn pressed(&self, event: &Event) {
        let Some(pointer) = event.dyn_ref::<PointerEvent>() else { return };
        let at_px = Some([f64::from(pointer.client_x()), f64::from(pointer.client_y())]);
        send(PressEvent::Pressed { control: self.under(event), at_px });
        if stopped(event) {
            // A second finger anywhere on the screen ends the first one's move.
            send(HandEvent::OtherDown { pointer: pointer.pointer_id() });
        }
    }

    fn clicked(&self, event: &Event) {
        let Some(control) = self.under(event) else { return };
        // A key or a screen reader clicks without a pointer press.
        let by_key = event.dyn_ref::<MouseEvent>().is_none_or(|click| click.detail() == 0);
        send(if by_key {
            PressEvent::Pressed { control: Some(control), at_px: None }
        } else {
            PressEvent::Clicked { control }
        });
        stopped(event);
    }
}

/// Stops an event that the model refuses.
fn stopped(event: &Event) -> bool {
    let is_refused = peek(|m| m.presses.refused);
    if is_refused {
        event.stop_immediate_propagation();
        event.prevent_default();
    }
    is_refused
}

/// Scroll offset of everything around an element, px.
fn scrolled(element: &Element) -> [i32; 2] {
    let mut far = [0, 0];
    let mut around = element.parent_element();
    while let Some(one) = around {
        far = [far[0] + one.scroll_left(), far[1] + one.scroll_top()];
        around = one.parent_element();
    }
    far
}
