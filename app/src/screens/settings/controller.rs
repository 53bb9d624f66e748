//! Settings of a controller, stored per machine: the tool change macro, the machine profile, and what opening
//! the port may do. Moves nothing.

use crate::i18n::{say, t};
use crate::page::{link, read, shared};
use crate::widgets::menu_word;
use annulus_core::grbl::{CHANGER_KEY, RESET_KEY, ResetOnOpen, TOOL_MARK};
use annulus_core::machine::{MILL_KEY, MILLS, Value};
use annulus_core::wire::Ask;
use leptos::ev;
use leptos::html::{div, label, p, select, span, textarea};
use leptos::prelude::*;

/// The tool change macro; empty if the user changes tools.
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

/// The machine profile: the controller's own settings are compared with it before a job. Changes nothing in
/// the controller.
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

/// Whether opening the port may reset the controller: most do, some must not. Applies from the next opening.
pub(super) fn opening() -> impl IntoView {
    let never = || {
        read(|m| m.link.controller.who.as_ref().is_some_and(|who| who.reset_on_open == ResetOnOpen::Never))
    };
    let choose = |event: web_sys::Event| {
        let word = Value::Text(event_target_value(&event));
        link::ask(Ask::Configure { changes: vec![(RESET_KEY.to_owned(), word)] });
    };
    let words = (
        menu_word(ResetOnOpen::Usual.word(), move || !never(), t!("page.opening.usual")),
        menu_word(ResetOnOpen::Never.word(), never, t!("page.opening.never")),
    );
    div().class("lengths").child((
        label().class("field").child((
            span().child(t!("page.opening.title")),
            select()
                .attr("name", "reset-on-open")
                .prop("disabled", || !link::may_change())
                .on(ev::change, choose)
                .child(words),
        )),
        p().class("quiet").child(t!("page.opening.is")),
    ))
}
