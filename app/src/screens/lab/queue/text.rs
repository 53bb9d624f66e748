//! The queue as text with line numbers. While the user types, the text isn't reformatted.

use crate::i18n::t;
use crate::lab::queue::{QueueEdit, to_text};
use crate::model::LabEvent;
use crate::page::{lab, send};
use leptos::ev;
use leptos::html::{div, pre, textarea};
use leptos::prelude::*;

pub(super) fn text() -> impl IntoView {
    let typing = RwSignal::new(None::<String>);
    let shown = move || typing.get().unwrap_or_else(|| lab::lines().with(|lines| to_text(lines)));
    let numbers = move || {
        let count = shown().lines().count().max(1);
        (1..=count).map(|line| format!("{line}\n")).collect::<String>()
    };
    div().class("queue-text").child((
        pre().attr("aria-hidden", "true").class("tabular").child(numbers),
        textarea()
            .attr("aria-label", t!("page.lab.queue.text"))
            .attr("spellcheck", "false")
            .attr("rows", move || (shown().lines().count() + 2).max(16).to_string())
            .prop("readOnly", lab::locked)
            .prop("value", shown)
            .on(ev::input, move |event| {
                let text = event_target_value(&event);
                typing.set(Some(text.clone()));
                super::edit(Some("queue.text"), &QueueEdit::Text(text));
            })
            .on(ev::blur, move |_| {
                typing.set(None);
                send(LabEvent::Rest);
            }),
    ))
}
