//! Permitted effects of opening the port on the controller, stored per machine: most boards reset, some
//! must not. Moves nothing; applies from the next opening.

use crate::i18n::t;
use crate::page::{link, read};
use crate::widgets::menu_word;
use annulus_core::grbl::{RESET_KEY, ResetOnOpen};
use annulus_core::machine::Value;
use annulus_core::wire::Ask;
use leptos::ev;
use leptos::html::{div, label, p, select, span};
use leptos::prelude::*;

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
