//! The lines by which a machine with a controller changes tools itself, written once for it; empty where a person changes them (N19).
//!
//! Comes in: the controller, what is typed. Goes out: the wish to keep the lines. Nothing moves by it.

use crate::i18n::{say, t};
use crate::page::link;
use annulus_core::controller::{CHANGER_KEY, TOOL_MARK};
use annulus_core::machine::Value;
use annulus_core::wire::Ask;
use leptos::ev;
use leptos::html::{div, label, p, span, textarea};
use leptos::prelude::*;

/// The lines.
pub(super) fn changer() -> impl IntoView {
    let line = link::link();
    let shown = Memo::new(move |_| {
        line.controller.with(|controller| controller.who.as_ref().map(|who| who.changer.join("\n")))
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
                .prop("disabled", move || !line.may_act() || line.busy())
                .prop("value", move || shown.get().unwrap_or_default())
                .on(ev::change, keep),
        )),
        p().class("quiet").child(move || say!("page.changer.is", mark = TOOL_MARK)),
    ))
}
