//! STOP. Pressed means sent: on pointer-down, before anything is drawn.
//!
//! Comes in: nothing. Goes out: the button, or the words that there is no machine; the shout when nobody answered. It is
//! never disabled, and stands in the corner of what is seen of the page, also where a part of it is magnified.

use super::{Icon, icon, push};
use crate::i18n::t;
use crate::model::LinkEvent;
use crate::page::{link, send};
use annulus_core::diagnostic::Diagnostic;
use leptos::ev;
use leptos::html::{button, div, span};
use leptos::prelude::*;
use wasm_bindgen::prelude::*;
use web_sys::{Event, EventTarget};

#[wasm_bindgen]
extern "C" {
    /// The part of the window that is seen when two fingers magnify the page.
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

/// The corner with the button. It stands in the top bar and again in every dialog, which makes the bar unreachable.
pub fn stop_zone() -> impl IntoView {
    (div().class("stop-zone").child(stop_button()), not_confirmed())
}

/// STOP was pressed and nobody answered.
fn not_confirmed() -> impl IntoView {
    let unconfirmed = link::link().stop_unconfirmed;
    move || {
        unconfirmed.get().then(|| {
            div().class("not-confirmed").attr("role", "alert").child((
                icon(Icon::Alarm),
                span().child(t!("page.stop.not_confirmed")),
                push("button", t!("page.close"), |_| send(LinkEvent::Close { notice: link::Notice::Stop })),
            ))
        })
    }
}

fn stop_button() -> impl IntoView {
    // A machine that another tab of this site has can be stopped too.
    let there = Memo::new(move |_| {
        let other = |why: &Diagnostic| why.code == "drill.other_tab";
        let line = link::link();
        line.ever.get() || line.refused.with(|why| why.as_ref().is_some_and(other))
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

/// Keeps the corner where it is seen, and as large, while the page is magnified. For the life of the page.
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

/// Tells the style sheet how far the seen part lies from the corner of the window.
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
