//! Before the first move: the program goes to the bridge, the bridge checks it, a person reads the rows.
//!
//! ```text
//! Start… ─▶ upload ─▶ Arm ─▶ rows and digest ─▶ [Start the job]   (only this button moves anything)
//! ```
//!
//! Comes in: the planned job. Goes out: `Arm`, and `Start` once nothing fails and every warning is ticked.

use super::checked::checked;
use super::words;
use crate::i18n::{advice, message, say, t};
use crate::model::{StartEvent, start};
use crate::page::link;
use crate::page::{frame, send};
use crate::widgets::{Dialog, dialog, icon, push, push_if};
use annulus_core::control::State;
use annulus_core::wire::{PreflightRow, RowVerdict};
use leptos::ev;
use leptos::html::{div, input, label, li, p, span, strong, ul};
use leptos::prelude::*;

fn close() {
    send(StartEvent::Close);
}

fn now() -> Option<Vec<PreflightRow>> {
    let line = link::link();
    let awake = frame().awake.get();
    line.preflight
        .with(|preflight| line.armed.with(|armed| start::rows_now(preflight.as_ref(), armed.as_ref(), awake)))
}

fn may_start() -> bool {
    let reads = link::link().state() == Some(State::Checking);
    !reads && link::link().ticked.with(|ticked| now().is_some_and(|rows| start::may_start(&rows, ticked)))
}

fn row(row: PreflightRow) -> impl IntoView {
    let look = words::verdict(row.verdict);
    let (word, warning) = (look.word, start::ticked_as(&row.finding));
    let (what, cure) = (row.finding.clone(), row.finding);
    let needs_tick = row.verdict == RowVerdict::Warn;
    let advised = (row.verdict != RowVerdict::Pass).then(|| p().class("advice").child(move || advice(&cure)));
    let tick = needs_tick.then(|| {
        let flip = move |_| send(StartEvent::Tick { warning: warning.clone() });
        label().class("tick").child((
            input().attr("type", "checkbox").on(ev::change, flip),
            span().child(t!("page.preflight.seen")),
        ))
    });
    li().child((
        span()
            .class(format!("tag {}", look.tone))
            .child((icon(look.icon), span().child(move || crate::i18n::text(word, &[])))),
        div().child((strong().child(move || message(&what)), advised)),
        tick,
    ))
}

/// The dialog.
pub(super) fn preflight() -> impl IntoView {
    let line = link::link();
    let rows = Memo::new(move |_| now());
    let body = move || match rows.get() {
        Some(rows) => ul().class("preflight").child(rows.into_iter().map(row).collect::<Vec<_>>()).into_any(),
        None => p().class("quiet").child(waiting(line)).into_any(),
    };
    let from = move || {
        let from = link::link()
            .preflight
            .with(|preflight| preflight.as_ref().map_or(0, |preflight| preflight.from_leg));
        if from == 0 { say!("page.preflight.start") } else { say!("page.preflight.resume") }
    };
    let foot = (
        push("button", t!("page.cancel"), |_| close()),
        push_if("button primary", may_start, from, |_| send(StartEvent::Start)),
    );
    dialog(
        Signal::derive(move || link::link().preflight.with(Option::is_some)),
        close,
        Dialog {
            name: "preflight",
            role: "dialog",
            title: Box::new(t!("page.preflight.title")),
            body: (body, checked()).into_any(),
            foot: foot.into_any(),
        },
    )
}

fn waiting(line: link::Link) -> impl Fn() -> String {
    move || line.refused.get().map_or_else(|| say!("page.preflight.checking"), |why| message(&why))
}
