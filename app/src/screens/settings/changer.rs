//! The tool change macro of a controller, stored per machine; empty if the user changes tools. Moves nothing.

use crate::i18n::{say, t};
use crate::page::{link, shared};
use annulus_core::grbl::{CHANGER_KEY, TOOL_MARK};
use annulus_core::machine::Value;
use annulus_core::wire::Ask;
use leptos::ev;
use leptos::html::{div, label, p, span, textarea};
use leptos::prelude::*;

pub(super) fn changer() -> impl IntoView {
    let shown = Memo::new(move |_| {
        shared(|m| &m.link.controller.who).with(|who| who.as_ref().map(|who| who.changer.join("\n")))
    });
    let keep = |event: web_sys::Event| {
        let lines = event_target_value(&event).lines().map(str::to_owned).collect();
        link::ask(Ask::Configure { changes: vec![(CHANGER_KEY.to_owned(), Value::Texts(lines))] });
    };
    div().class("lengths").child((
        label().class("field").child((
            span().child(t!("page.changer.title")),
            textarea()
                .attr("name", "tool-changer")
                .attr("rows", "4")
                .attr("spellcheck", "false")
                .attr("placeholder", "M6 T{tool}")
                .prop("disabled", || !link::may_change())
                .prop("value", move || shown.get().unwrap_or_default())
                .on(ev::change, keep),
        )),
        p().class("quiet").child(move || say!("page.changer.is", mark = TOOL_MARK)),
    ))
}
