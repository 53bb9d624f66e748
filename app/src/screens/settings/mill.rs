//! The machine profile of a controller: the controller's own settings are compared with it before a job.
//! Changes nothing in the controller.

use crate::i18n::{say, t};
use crate::page::{link, shared};
use crate::widgets::menu_word;
use annulus_core::machine::{MILL_KEY, MILLS, Value};
use annulus_core::wire::Ask;
use leptos::ev;
use leptos::html::{label, p, select, span};
use leptos::prelude::*;

pub(super) fn mill() -> impl IntoView {
    let now =
        move || shared(|m| &m.link.controller.who).with(|who| who.as_ref()?.mill.clone()).unwrap_or_default();
    let choose = |event: web_sys::Event| {
        let name = Value::Text(event_target_value(&event));
        link::ask(Ask::Configure { changes: vec![(MILL_KEY.to_owned(), name)] });
    };
    let words = move || {
        let none = menu_word("", move || now().is_empty(), move || say!("page.settings.mill_none"));
        let mills = MILLS.iter().map(|mill| {
            menu_word(mill.name, move || now() == mill.name, move || mill.title.to_owned()).into_any()
        });
        std::iter::once(none.into_any()).chain(mills).collect::<Vec<_>>()
    };
    label().class("field").child((
        span().child(t!("page.settings.mill")),
        select()
            .attr("name", "mill")
            .prop("disabled", || !link::may_change())
            .on(ev::change, choose)
            .child(words()),
        p().class("quiet").child(t!("page.settings.mill_about")),
    ))
}
