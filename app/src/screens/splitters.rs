//! The edges between panels and picture: dragged, or moved by keys.
//!
//! ```text
//! │ panel ║ picture ║ panel │      arrows 16 px, Home and End to the limits, Enter resets
//! ```

use crate::i18n::{say, t};
use crate::model::FrameEvent;
use crate::model::window::PANEL_PX;
use crate::page::{read, send, watch};
use leptos::ev::{self, KeyboardEvent, PointerEvent};
use leptos::html::div;
use leptos::prelude::*;
use wasm_bindgen::JsCast;
use web_sys::HtmlElement;

/// Distance of one arrow press, CSS pixels.
const STEP_PX: i32 = 16;

/// Width of a panel on the screen, CSS pixels; 0 if there is none.
fn width_px(right: bool) -> i32 {
    let panel = document().query_selector(if right { "main > .panel.right" } else { "main > .panel.left" });
    let panel = panel.ok().flatten().and_then(|panel| panel.dyn_into::<HtmlElement>().ok());
    panel.map_or(0, |panel| panel.offset_width())
}

fn draw(right: bool, px: i32) {
    let px = px.clamp(i32::from(PANEL_PX.0), i32::from(PANEL_PX.1));
    send(FrameEvent::Panel { right, px: u16::try_from(px).unwrap_or(0) });
}

/// Moves an edge by a key; false for other keys.
fn by_key(event: &KeyboardEvent, right: bool) -> bool {
    let outwards = if right { -STEP_PX } else { STEP_PX };
    let px = match event.key().as_str() {
        "ArrowRight" => width_px(right) + outwards,
        "ArrowLeft" => width_px(right) - outwards,
        "Home" => i32::from(PANEL_PX.0),
        "End" => i32::from(PANEL_PX.1),
        "Enter" => {
            send(FrameEvent::Panel { right, px: 0 });
            return true;
        }
        _ => return false,
    };
    draw(right, px);
    true
}

pub(crate) fn splitters() -> impl IntoView {
    [splitter(false).into_any(), splitter(true).into_any()].into_iter().collect::<Vec<_>>()
}

fn splitter(right: bool) -> impl IntoView {
    // Pointer position and panel width when the drag started.
    let held = StoredValue::new(None::<(i32, i32)>);
    let now = RwSignal::new(i32::from(PANEL_PX.0));
    let px = move || {
        let drawn = watch(|m| &m.frame.panels).with(|panels| panels.px(read(|m| m.frame.tab), right));
        drawn.map_or_else(|| now.get(), i32::from)
    };
    let edge =
        |event: &PointerEvent| event.current_target().and_then(|edge| edge.dyn_into::<HtmlElement>().ok());
    let down = move |event: PointerEvent| {
        if let Some(edge) = edge(&event) {
            let _a_pointer_that_is_gone_is_no_harm = edge.set_pointer_capture(event.pointer_id());
            let _ = edge.focus();
            held.set_value(Some((event.client_x(), width_px(right))));
            event.prevent_default();
        }
    };
    let moved = move |event: PointerEvent| {
        if let Some((from_x, from_px)) = held.get_value() {
            let by = event.client_x() - from_x;
            draw(right, from_px + if right { -by } else { by });
        }
    };
    div()
        .class(if right { "splitter of-right" } else { "splitter of-left" })
        .attr("role", "separator")
        .attr("tabindex", "0")
        .attr("aria-orientation", "vertical")
        .attr("aria-label", move || if right { say!("page.panels.right") } else { say!("page.panels.left") })
        .attr("title", t!("page.panels.how"))
        .attr("aria-valuemin", PANEL_PX.0.to_string())
        .attr("aria-valuemax", PANEL_PX.1.to_string())
        .attr("aria-valuenow", move || px().to_string())
        .attr("aria-valuetext", move || say!("page.panels.wide", px = px()))
        .on(ev::focus, move |_| now.set(width_px(right)))
        .on(ev::pointerdown, down)
        .on(ev::pointermove, moved)
        .on(ev::pointerup, move |_| held.set_value(None))
        .on(ev::pointercancel, move |_| held.set_value(None))
        .on(ev::dblclick, move |_| send(FrameEvent::Panel { right, px: 0 }))
        .on(ev::keydown, move |event: KeyboardEvent| {
            if by_key(&event, right) {
                event.prevent_default();
                event.stop_propagation();
                now.set(width_px(right));
            }
        })
}
