//! The empty page: drop files, open files, try the sample, or go on with what was open before.
//!
//! Comes in: nothing. Goes out: files chosen.

use crate::i18n::{language, t};
use crate::keys::Tab;
use crate::model::{FilesEvent, FrameEvent, KeepEvent, Offer};
use crate::page::open_board;
use crate::page::send;
use crate::widgets::{Icon, icon, push};
use js_sys::Date;
use leptos::ev;
use leptos::html::{button, div, h2, p, section, span, strong};
use leptos::prelude::*;
use wasm_bindgen::JsValue;

/// The sheet.
pub(crate) fn welcome() -> impl IntoView {
    let sample =
        button().attr("type", "button").class("tile").on(ev::click, |_| send(FilesEvent::Sample)).child((
            icon(Icon::Annulus),
            span().child((
                strong().child(t!("page.welcome.sample")),
                span().class("quiet").child(t!("page.welcome.sample_is")),
            )),
        ));
    let draw = button()
        .attr("type", "button")
        .class("tile")
        .on(ev::click, |_| send(FrameEvent::Show { tab: Tab::Draw }))
        .child((
            icon(Icon::Pencil),
            span().child((
                strong().child(t!("page.welcome.draw")),
                span().class("quiet").child(t!("page.welcome.draw_is")),
            )),
        ));
    let machine = button()
        .attr("type", "button")
        .class("tile")
        .on(ev::click, |_| send(FrameEvent::Show { tab: Tab::Machine }))
        .child((
            icon(Icon::Plug),
            span().child((
                strong().child(t!("page.welcome.machine")),
                span().class("quiet").child(t!("page.welcome.machine_is")),
            )),
        ));
    div().class("whole welcome").child(div().class("sheet").child((
        move || open_board().offer.get().map(kept),
        div().class("drop").child((
            icon(Icon::Annulus),
            h2().child(t!("page.welcome.title")),
            p().class("quiet").child(t!("page.welcome.kinds")),
            push("button large primary", t!("page.welcome.open"), |_| send(FilesEvent::Choose)),
        )),
        div().class("tiles").child((sample, draw, machine)),
        p().class("promise").child((icon(Icon::Lock), t!("page.welcome.promise"))),
    )))
}

/// The offer of what was open before.
fn kept(offer: Offer) -> impl IntoView {
    let at = Date::new(&offer.at_ms.into()).to_locale_string(&language(), &JsValue::UNDEFINED);
    let (name, at) = (offer.name.clone(), String::from(at));
    let again = offer.clone();
    section().class("kept").attr("aria-label", t!("page.kept.title")).child((
        p().class("grow").attr("role", "status").child(t!("page.kept.offer", name = name, at = at)),
        push("button", t!("page.kept.restore"), move |_| send(KeepEvent::Restore { offer: again.clone() })),
        push("button", t!("page.kept.discard"), move |_| send(KeepEvent::Discard { offer: offer.clone() })),
    ))
}
