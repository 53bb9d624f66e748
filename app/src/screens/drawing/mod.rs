//! The Draw screen: a board drawn by hand, or over files that are open.
//!
//! ```text
//! + tools, pen ──+ picture ─────────────────────────────+ numbers ──────────+
//! | tree         | cross-hair, what is chosen           | what can be done  |
//! |              +--------------------------------------+ the board, files  |
//! |              | place: typed or pointed at, smallest |                   |
//! +──────────────+──────────────────────────────────────+───────────────────+
//! ```
//!
//! Comes in: the drawing as signals. Goes out: what the person does with it. Boards are made of it elsewhere.

mod actions;
mod array;
mod board;
mod fields;
mod imported;
mod inputs;
mod picture;
mod readout;
mod tools;
mod tree;

pub(in crate::screens) use actions::may;
pub(crate) use picture::{in_picture, stroke};
pub(crate) use tools::draw_edge;

use crate::drawing::DrawKey;
use crate::model::DrawEvent;
use crate::page::send;
use crate::widgets::dialog_is_open;
use leptos::html::div;
use leptos::prelude::*;
use wasm_bindgen::JsCast;
use web_sys::HtmlElement;

/// The panels beside the picture.
pub(crate) fn drawing() -> impl IntoView {
    (
        div().class("panel left draw-left").child((tools::tools(), tree::tree())),
        div().class("bottom draw-bottom").child(readout::readout()),
        div().class("panel right draw-right").child((
            fields::fields(),
            imported::imported(),
            actions::actions(),
            board::board(),
        )),
        array::array(),
    )
}

/// Puts the focus on the first element that `selector` finds.
fn focus(selector: &str) {
    let found = document().query_selector(selector).ok().flatten();
    if let Some(element) = found.and_then(|found| found.dyn_into::<HtmlElement>().ok()) {
        let _ = element.focus();
    }
}

/// The keys go to the picture from now on.
fn focus_picture() {
    if let Ok(Some(stage)) = document().query_selector("main .stage") {
        let _ = stage.set_attribute("tabindex", "-1");
    }
    focus("main .stage");
}

/// Escape leaves what is being drawn, unless it is meant for a field or a dialog.
pub(crate) fn escape() {
    let elsewhere = |one: &web_sys::Element| one.matches("input, select, textarea").unwrap_or(false);
    if !dialog_is_open() && !document().active_element().is_some_and(|one| elsewhere(&one)) {
        send(DrawEvent::Escape);
    }
}

/// What a key asks of the drawing.
pub(crate) fn key(key: DrawKey) {
    match key {
        DrawKey::Rename => fields::rename(),
        DrawKey::Numbers => focus(".draw-fields :is(input, select)"),
        DrawKey::Type { from_last: by } => readout::type_place(by),
        key => send(DrawEvent::Key { key }),
    }
}
