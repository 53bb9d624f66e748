//! What opening the port of a controller may do to its board, chosen once for its machine: most begin anew with it, and some are not to (N19).
//!
//! Comes in: the controller. Goes out: the wish to keep a choice. Nothing moves by it, and it counts from the next time that the port is opened.

use crate::i18n::t;
use crate::page::link;
use crate::widgets::menu_word;
use annulus_core::controller::{RESET_KEY, ResetOnOpen};
use annulus_core::machine::Value;
use annulus_core::wire::Ask;
use leptos::ev;
use leptos::html::{div, label, p, select, span};
use leptos::prelude::*;

/// The choice.
pub(super) fn opening() -> impl IntoView {
    let line = link::link();
    let never = Memo::new(move |_| {
        let told = line.controller.with(|controller| controller.who.as_ref().map(|who| who.reset_on_open));
        told == Some(ResetOnOpen::Never)
    });
    let choose = |event: web_sys::Event| {
        let word = Value::Text(event_target_value(&event));
        link::ask(Ask::Configure { changes: vec![(RESET_KEY.to_owned(), word)] });
    };
    let words = (
        menu_word(ResetOnOpen::Usual.word(), move || !never.get(), t!("page.opening.usual")),
        menu_word(ResetOnOpen::Never.word(), move || never.get(), t!("page.opening.never")),
    );
    div().class("lengths").child((
        label().class("field").child((
            span().child(t!("page.opening.title")),
            select()
                .attr("name", "reset-on-open")
                .prop("disabled", move || !line.may_act() || line.busy())
                .on(ev::change, choose)
                .child(words),
        )),
        p().class("quiet").child(t!("page.opening.is")),
    ))
}
