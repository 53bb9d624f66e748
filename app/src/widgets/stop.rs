//! The STOP button. Sends on pointer-down, before anything is drawn.
//!
//! Never disabled; remains in the corner of the visible part of the page, even while the page is zoomed.

use super::{Icon, icon, push};
use crate::i18n::t;
use crate::model::LinkEvent;
use crate::model::link::Notice;
use crate::page::{link, read, send};
use annulus_core::code;
use leptos::ev;
use leptos::html::{button, div, span};
use leptos::prelude::*;
use wasm_bindgen::prelude::*;
use web_sys::{Event, EventTarget};

#[wasm_bindgen]
extern "C" {
    /// The part of the window that is visible under pinch zoom.
    #[wasm_bindgen(extends = EventTarget)]
    type VisualViewport;
    #[wasm_bindgen(thread_local_v2, js_name = visualViewport)]
    static SEEN: Option<VisualViewport>;
    #[wasm_bindgen(method, getter)]
    fn scale(this: &VisualViewport) -> f64;
    #[wasm_bindgen(method, getter)]
    fn width(this: &VisualViewport) -> f64;
    #[wasm_bindgen(method, getter)]
    fn height(this: &VisualViewport) -> f64;
    #[wasm_bindgen(method, getter, js_name = offsetLeft)]
    fn left(this: &VisualViewport) -> f64;
    #[wasm_bindgen(method, getter, js_name = offsetTop)]
    fn top(this: &VisualViewport) -> f64;
}

/// The corner with the button: in the top bar and in every dialog, because a dialog makes the bar
/// unreachable.
pub fn stop_zone() -> impl IntoView {
    (div().class("stop-zone").child(stop_button()), not_confirmed())
}

fn not_confirmed() -> impl IntoView {
    move || {
        read(|m| m.link.stop_unconfirmed).then(|| {
            div().class("not-confirmed").attr("role", "alert").child((
                icon(Icon::Alarm),
                span().child(t!("page.stop.not_confirmed")),
                push("button", t!("page.close"), |_| send(LinkEvent::Close { notice: Notice::Stop })),
            ))
        })
    }
}

fn stop_button() -> impl IntoView {
    // A machine controlled from another tab of this site can be stopped too.
    let there = Memo::new(move |_| {
        read(|m| {
            m.link.ever || m.link.refused.as_ref().is_some_and(|why| why.code == code!("drill.other_tab"))
        })
    });
    move || {
        if there.get() {
            let press = button()
                .attr("type", "button")
                .class("stop")
                .attr("title", t!("page.stop.tip"))
                .attr("aria-keyshortcuts", "Control+Shift+E")
                .on(ev::pointerdown, |event| {
                    link::stop();
                    event.prevent_default();
                })
                .on(ev::click, |event| {
                    // From a keyboard or a screen reader: there was no pointer-down.
                    if event.detail() == 0 {
                        link::stop();
                    }
                })
                .child(t!("page.stop.label"));
            press.into_any()
        } else {
            div().class("stop-none").child(t!("page.stop.no_machine")).into_any()
        }
    }
}

/// Keeps the corner visible at its usual size while the page is zoomed, for the life of the page.
pub fn follow_window() {
    SEEN.with(|seen| {
        let Some(seen) = seen else { return };
        let moved = Closure::<dyn FnMut(Event)>::new(|_| {
            SEEN.with(|seen| seen.iter().for_each(place));
        });
        for event in ["resize", "scroll"] {
            let _ = seen.add_event_listener_with_callback(event, moved.as_ref().unchecked_ref());
        }
        moved.forget();
    });
}

/// Passes the offset of the visible part to the style sheet.
fn place(seen: &VisualViewport) {
    let root = document().document_element().and_then(|root| root.dyn_into::<web_sys::HtmlElement>().ok());
    let Some(root) = root else { return };
    let end = f64::from(root.client_width()) - seen.left() - seen.width();
    let foot = f64::from(root.client_height()) - seen.top() - seen.height();
    let style = root.style();
    let _ = style.set_property("--stop-end", &format!("{}px", end.max(0.0)));
    let _ = style.set_property("--stop-foot", &format!("{}px", foot.max(0.0)));
    let _ = style.set_property("--stop-top", &format!("{}px", seen.top().max(0.0)));
    let _ = style.set_property("--stop-scale", &(1.0 / seen.scale().max(1.0)).to_string());
}
