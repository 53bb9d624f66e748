//! The outputs: locked; unlocked for five minutes at a time, switched or pulsed by buttons.
//!
//! ```text
//! locked ─ Unlock ─▶ 5:00 … 0:00 ─▶ locked        can be extended; leaving the panel locks
//! ```
//!
//! The bridge enforces the lock. Nothing is switched while anything moves.

use crate::format::clock;
use crate::i18n::{say, t};
use crate::page::{link, peek, read, watch};
use crate::widgets::{Icon, icon, push_guarded, push_if, shape};
use annulus_core::wire::Ask;
use leptos::html::{caption, div, h3, p, section, span, table, tbody, td, th, thead, tr};
use leptos::prelude::*;

const LEASE_MINUTES: u8 = 5;

const PULSE_MS: u32 = 200;

pub(super) fn outputs() -> impl IntoView {
    let unlocked = Memo::new(move |_| read(|m| m.link.outputs.left_s.is_some()));
    on_cleanup(move || {
        if peek(|m| m.link.outputs.left_s.is_some()) {
            link::ask(Ask::OutputLease { minutes: 0 });
        }
    });
    let may = link::may_change;
    let words = move || {
        let left = read(|m| m.link.outputs.left_s);
        match left {
            Some(left) if left < 60.0 => say!("page.lab.outputs.soon", left = clock(left)),
            Some(left) => say!("page.lab.outputs.unlocked", left = clock(left)),
            None if !link::may_act() => say!("page.lab.outputs.needs_control"),
            None => say!("page.lab.outputs.locked"),
        }
    };
    section().class("block").attr("aria-label", t!("page.lab.outputs.title")).child((
        h3().child(t!("page.lab.outputs.title")),
        div().class("row spread").child((
            p().class("row").child((
                (move || (!unlocked.get()).then(|| icon(Icon::Lock))),
                span().class("tabular").child(words),
            )),
            div().class("row").child((
                push_if(
                    "button",
                    may,
                    move || {
                        if unlocked.get() {
                            say!("page.lab.outputs.extend")
                        } else {
                            say!("page.lab.outputs.unlock")
                        }
                    },
                    |_| link::ask(Ask::OutputLease { minutes: LEASE_MINUTES }),
                ),
                push_if(
                    "button",
                    move || unlocked.get(),
                    t!("page.lab.outputs.lock"),
                    |_| link::ask(Ask::OutputLease { minutes: 0 }),
                ),
            )),
        )),
        // Screen readers hear when the lock changes, not every second of the countdown.
        div().class("unseen").attr("role", "status").child(move || {
            if unlocked.get() {
                say!("page.lab.outputs.are_unlocked")
            } else {
                say!("page.lab.outputs.are_locked")
            }
        }),
        rows(unlocked),
    ))
}

fn rows(unlocked: Memo<bool>) -> impl IntoView {
    let names = Memo::new(|_| watch(|m| &m.link.outputs).with(|outputs| outputs.names.clone()));
    let rows = move || {
        let names = names.get();
        names.into_iter().enumerate().map(|(at, name)| row(at, name, unlocked).into_any()).collect::<Vec<_>>()
    };
    table().class("io-table").child((
        caption().class("unseen").child(t!("page.lab.outputs.title")),
        thead().child(tr().child((
            th().attr("scope", "col").child(t!("page.lab.outputs.output")),
            th().attr("scope", "col").child(t!("page.lab.io.now")),
            th().attr("scope", "col").child(t!("page.lab.outputs.switch")),
        ))),
        tbody().child(rows),
    ))
}

fn row(at: usize, name: String, unlocked: Memo<bool>) -> impl IntoView {
    let bit = 1_u32.checked_shl(at as u32).unwrap_or(0);
    let on = Memo::new(move |_| watch(|m| &m.link.outputs).with(|outputs| outputs.on & bit != 0));
    let may = move || unlocked.get() && link::may_change();
    let switch = {
        let name = name.clone();
        move |on: bool, pulse_ms: Option<u32>| link::ask(Ask::Output { name: name.clone(), on, pulse_ms })
    };
    let pulse = switch.clone();
    let state = move || if on.get() { say!("page.sensor.on") } else { say!("page.sensor.off") };
    tr().child((
        th().attr("scope", "row").child(name),
        td().child(
            span()
                .class(move || if on.get() { "lamp on" } else { "lamp" })
                .child((shape(""), span().child(state))),
        ),
        td().child(div().class("row").child((
            push_guarded(
                "button small",
                || "output",
                may,
                t!("page.lab.outputs.pulse", ms = PULSE_MS),
                move |_| {
                    pulse(true, Some(PULSE_MS));
                },
            ),
            push_guarded(
                "button small",
                move || if on.get() { "" } else { "output" },
                may,
                move || if on.get() { say!("page.lab.outputs.off") } else { say!("page.lab.outputs.on") },
                move |_| switch(!on.get_untracked(), None),
            ),
        ))),
    ))
}
