//! The Draw screen: a board drawn from nothing, or over open files.
//!
//! ```text
//! + tools, pen ──+ picture ─────────────────────────────+ fields ───────────+
//! | tree         | cross-hair, selection                | commands          |
//! |              +--------------------------------------+ the board, files  |
//! |              | position typed or pointed, smallest  |                   |
//! +──────────────+──────────────────────────────────────+───────────────────+
//! ```

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

fn focus(selector: &str) {
    let found = document().query_selector(selector).ok().flatten();
    if let Some(element) = found.and_then(|found| found.dyn_into::<HtmlElement>().ok()) {
        let _ = element.focus();
    }
}

fn focus_picture() {
    if let Ok(Some(stage)) = document().query_selector("main .stage") {
        let _ = stage.set_attribute("tabindex", "-1");
    }
    focus("main .stage");
}

/// Cancels what is being drawn, unless Escape is meant for a field or a dialog.
pub(crate) fn escape() {
    let elsewhere = |one: &web_sys::Element| one.matches("input, select, textarea").unwrap_or(false);
    if !dialog_is_open() && !document().active_element().is_some_and(|one| elsewhere(&one)) {
        send(DrawEvent::Escape);
    }
}

pub(crate) fn key(key: DrawKey) {
    match key {
        DrawKey::Rename => fields::rename(),
        DrawKey::Numbers => focus(".draw-fields :is(input, select)"),
        DrawKey::Type { from_last: by } => readout::type_place(by),
        key => send(DrawEvent::Key { key }),
    }
}
