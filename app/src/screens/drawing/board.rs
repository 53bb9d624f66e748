//! From the drawing to a board, to files, and to other drawings.
//!
//! Comes in: whether there is something new. Goes out: wishes.

use super::inputs::tick;
use crate::i18n::{language, say, t};
use crate::keys::Tab;
use crate::model::DrawEvent;
use crate::model::drawing::{DrawingExport, Earlier};
use crate::page::{open_drawing, send};
use crate::screens::welcome::last;
use crate::widgets::{push, push_if};
use js_sys::Date;
use leptos::html::{div, h2, h3, header, li, p, section, span, ul};
use leptos::prelude::*;
use wasm_bindgen::JsValue;

/// The block.
pub(super) fn board() -> impl IntoView {
    let drawing = open_drawing();
    let there = move || drawing.title.with(|(_, count)| *count > 0);
    let usable = move || there() || drawing.over.get().0;
    let export = |what: DrawingExport| move |_| send(DrawEvent::Export { what });
    let over = move || {
        drawing.over.with(|(_, files)| *files).then(|| {
            tick(move || drawing.over.get().0, t!("page.draw.over"), |on| send(DrawEvent::Over { on }))
        })
    };
    section().class("block draw-board").attr("aria-label", t!("page.draw.board")).child((
        header().child(h2().child(t!("page.draw.board"))),
        over,
        move || drawing.elsewhere.get().then(last),
        push_if("button primary", usable, t!("page.draw.use"), |_| send(DrawEvent::Use { tab: Tab::Cam })),
        move || (there() && drawing.ahead.get()).then(|| p().class("quiet").child(t!("page.draw.ahead"))),
        h3().child(t!("page.draw.files")),
        div().class("row").child((
            push_if("button small", there, t!("page.draw.save_board"), export(DrawingExport::Board)),
            push_if("button small", there, t!("page.draw.save_svg"), export(DrawingExport::Svg)),
            push_if("button small", there, t!("page.draw.save_drawing"), export(DrawingExport::Drawing)),
        )),
        h3().child(t!("page.draw.others")),
        div().class("row").child((
            push("button small", t!("page.draw.new"), |_| send(DrawEvent::New)),
            push("button small", t!("page.draw.example"), |_| send(DrawEvent::Example)),
        )),
        earlier(),
    ))
}

/// Drawings that are kept.
fn earlier() -> impl IntoView {
    let drawing = open_drawing();
    let lines = move || drawing.earlier.get().into_iter().map(|one| line(one).into_any()).collect::<Vec<_>>();
    move || {
        (!drawing.earlier.with(Vec::is_empty))
            .then(|| ul().class("draw-earlier").attr("aria-label", t!("page.draw.earlier")).child(lines))
    }
}

fn line(one: Earlier) -> impl IntoView {
    let Earlier { place, elsewhere, .. } = one;
    let words = move || {
        let at =
            String::from(Date::new(&one.at_ms.into()).to_locale_string(&language(), &JsValue::UNDEFINED));
        if one.name.is_empty() {
            say!("page.draw.earlier_bare", at = at)
        } else {
            say!("page.draw.earlier_is", name = one.name, at = at)
        }
    };
    li().class("row").child((
        span()
            .class("grow")
            .child((words, elsewhere.then(|| span().class("quiet").child(t!("page.draw.elsewhere"))))),
        push("button small", t!("page.draw.fetch"), move |_| send(DrawEvent::Fetch { place })),
        (!elsewhere).then(|| {
            push("button small", t!("page.draw.forget"), move |_| send(DrawEvent::Forget { place }))
        }),
    ))
}
