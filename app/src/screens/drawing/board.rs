//! From the drawing to a board, to files and to other drawings.

use crate::i18n::{language, say, t};
use crate::keys::Tab;
use crate::model::DrawEvent;
use crate::model::drawing::{DrawingExport, Earlier};
use crate::page::{read, send, watch};
use crate::screens::welcome::last;
use crate::widgets::{push, push_if, tick};
use js_sys::Date;
use leptos::html::{div, h2, h3, header, li, p, section, span, ul};
use leptos::prelude::*;
use wasm_bindgen::JsValue;

pub(super) fn board() -> impl IntoView {
    let there = || read(|m| !m.draw.editor.drawing().is_empty());
    let usable = move || there() || read(|m| m.draw.over().0);
    let export = |what: DrawingExport| move |_| send(DrawEvent::Export { what });
    let over = move || {
        read(|m| m.draw.over().1).then(|| {
            tick(move || read(|m| m.draw.over().0), t!("page.draw.over"), |on| send(DrawEvent::Over { on }))
        })
    };
    section().class("block draw-board").attr("aria-label", t!("page.draw.board")).child((
        header().child(h2().child(t!("page.draw.board"))),
        over,
        move || read(|m| m.draw.is_of_files_elsewhere()).then(last),
        push_if("button primary", usable, t!("page.draw.use"), |_| send(DrawEvent::Use { tab: Tab::Cam })),
        move || {
            (there() && read(|m| m.draw.is_ahead())).then(|| p().class("quiet").child(t!("page.draw.ahead")))
        },
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

fn earlier() -> impl IntoView {
    let lines = move || {
        watch(|m| m.draw.earlier()).get().into_iter().map(|one| line(one).into_any()).collect::<Vec<_>>()
    };
    move || {
        (!read(|m| m.draw.earlier().is_empty()))
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
