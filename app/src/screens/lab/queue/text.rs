//! The queue as one text, with the numbers of its lines.
//!
//! Comes in: the lines. Goes out: an edit of them all. While the person types, the text stays as typed.

use super::Work;
use crate::i18n::t;
use crate::lab::queue::{QueueEdit, to_text};
use crate::model::LabEvent;
use crate::page::send;
use leptos::ev;
use leptos::html::{div, pre, textarea};
use leptos::prelude::*;

/// The field.
pub(super) fn text(work: Work) -> impl IntoView {
    let typing = RwSignal::new(None::<String>);
    let shown = move || typing.get().unwrap_or_else(|| work.lines.with(|lines| to_text(lines)));
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
            .prop("readOnly", move || work.lab.locked.get())
            .prop("value", shown)
            .on(ev::input, move |event| {
                let text = event_target_value(&event);
                typing.set(Some(text.clone()));
                work.edit(Some("queue.text"), &QueueEdit::Text(text));
            })
            .on(ev::blur, move |_| {
                typing.set(None);
                send(LabEvent::Rest);
            }),
    ))
}
