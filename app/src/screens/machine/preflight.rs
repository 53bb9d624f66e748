//! Before the first move: the bridge gets the program and checks it, and the user reads the results.
//!
//! ```text
//! Start… ─▶ upload ─▶ Arm ─▶ results and fingerprint ─▶ [Start the job]   (only this button moves anything)
//! ```

use super::checked::checked;
use super::words;
use crate::i18n::{advice, message, say, t};
use crate::model::{StartEvent, start};
use crate::page::{link, read, send, watch};
use crate::widgets::{Dialog, dialog, icon, push, push_guarded};
use annulus_core::control::State;
use annulus_core::wire::{PreflightRow, RowVerdict};
use leptos::ev;
use leptos::html::{div, input, label, li, p, span, strong, ul};
use leptos::prelude::*;

fn close() {
    send(StartEvent::Close);
}

fn now() -> Option<Vec<PreflightRow>> {
    let awake = read(|m| m.frame.awake);
    watch(|m| &m.start.preflight).with(|preflight| {
        watch(|m| &m.link.armed).with(|armed| start::rows_now(preflight.as_ref(), armed.as_ref(), awake))
    })
}

fn may_start() -> bool {
    let reads = link::state() == Some(State::Checking);
    !reads
        && watch(|m| &m.start.ticked).with(|ticked| now().is_some_and(|rows| start::may_start(&rows, ticked)))
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

pub(super) fn preflight() -> impl IntoView {
    let rows = Memo::new(move |_| now());
    let body = move || match rows.get() {
        Some(rows) => ul().class("preflight").child(rows.into_iter().map(row).collect::<Vec<_>>()).into_any(),
        None => p().class("quiet").child(waiting()).into_any(),
    };
    let from = move || {
        let from = read(|m| m.start.preflight.as_ref().map_or(0, |preflight| preflight.from_leg));
        if from == 0 { say!("page.preflight.start") } else { say!("page.preflight.resume") }
    };
    let foot = (
        push("button", t!("page.cancel"), |_| close()),
        push_guarded("button primary", || "start", may_start, from, |_| send(StartEvent::Start)),
    );
    dialog(
        Signal::derive(move || read(|m| m.start.preflight.is_some())),
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

fn waiting() -> impl Fn() -> String {
    move || {
        watch(|m| &m.link.refused).get().map_or_else(|| say!("page.preflight.checking"), |why| message(&why))
    }
}
