//! The bar over the queue: how it is shown, edits of the chosen row, file, run.
//!
//! Comes in: the queue. Goes out: edits and orders.

use super::{Work, grid};
use crate::i18n::{say, t};
use crate::lab::queue::{QueueEdit, to_text};
use crate::model::LabEvent;
use crate::page::{link, send};
use crate::widgets::{choice, push_if, save_file};
use annulus_core::control::State;
use annulus_core::queue::Mode;
use annulus_core::wire::{Ask, QueuePhase};
use leptos::html::{div, span};
use leptos::prelude::*;

/// A queue to begin with: home, two holes, three more in a row.
const EXAMPLE: &str = "HOME ALL\nSPINDLE 20000\nREPEAT 3  ; three holes in a row\nMOVE_BY 200 0\nDRILL_DOWN\nDRILL_UP\nEND\nSPINDLE 0\n";

/// The bar.
pub(super) fn tools(work: Work) -> impl IntoView {
    let as_text = work.lab.as_text;
    let free = move || !work.lab.locked.get();
    let any = move || work.lines.with(|lines| !lines.is_empty());
    let edit = move |made: fn(usize) -> QueueEdit| {
        work.edit(None, &made(work.lab.row.get_untracked()));
        grid::focus(work.lab.row.get_untracked());
    };
    let on_rows = move || free() && any() && !as_text.get();
    div().class("lab-tools").attr("role", "group").attr("aria-label", t!("page.lab.queue.tools")).child((
        div()
            .class("segmented")
            .attr("role", "group")
            .attr("aria-label", t!("page.lab.queue.shown_as"))
            .child((
                choice(
                    move || !as_text.get(),
                    t!("page.lab.queue.rows"),
                    |_| send(LabEvent::AsText { on: false }),
                ),
                choice(
                    move || as_text.get(),
                    t!("page.lab.queue.text"),
                    |_| send(LabEvent::AsText { on: true }),
                ),
            )),
        div().class("row").child((
            push_if(
                "button",
                move || free() && !as_text.get(),
                t!("page.lab.queue.insert"),
                move |_| {
                    edit(|at| QueueEdit::Insert { at });
                },
            ),
            push_if("button", on_rows, t!("page.lab.queue.double"), move |_| {
                edit(|at| QueueEdit::Double { at });
            }),
            push_if("button", on_rows, t!("page.lab.queue.up"), move |_| {
                edit(|at| QueueEdit::Move { at, down: false });
            }),
            push_if("button", on_rows, t!("page.lab.queue.down"), move |_| {
                edit(|at| QueueEdit::Move { at, down: true });
            }),
            push_if("button", on_rows, t!("page.lab.queue.delete"), move |_| {
                edit(|at| QueueEdit::Delete { at });
            }),
        )),
        span().class("grow"),
        div().class("row").child((
            push_if(
                "button",
                move || free() && !any(),
                t!("page.lab.queue.example"),
                move |_| {
                    work.edit(None, &QueueEdit::Text(EXAMPLE.to_owned()));
                },
            ),
            push_if("button", any, t!("page.lab.queue.save"), move |_| {
                save_file(
                    "annulus-queue.txt",
                    "text/plain",
                    &work.lines.with_untracked(|lines| to_text(lines)),
                );
            }),
        )),
        runs(work),
    ))
}

/// Where it runs, and the orders.
fn runs(work: Work) -> impl IntoView {
    let (lab, line) = (work.lab, link::link());
    let on_machine = lab.on_machine;
    let ready = move || {
        if !work.sound() {
            false
        } else if on_machine.get() {
            let held = line.state() == Some(State::Paused) && work.held_on_machine();
            line.may_act() && (held || !line.busy())
        } else {
            !lab.locked.get() && !lab.runs.running.get()
        }
    };
    let begun = move || {
        if on_machine.get() {
            line.may_act() && !line.busy() && line.queue.with(|queue| queue.phase != QueuePhase::None)
        } else {
            lab.runs.results.with(|results| !results.is_empty())
        }
    };
    let go = move |mode: Mode| {
        if on_machine.get_untracked() { work.run_on_machine(mode) } else { Work::run(mode) }
    };
    let anew = move |_| {
        if on_machine.get_untracked() { link::ask(Ask::QueueClear) } else { send(LabEvent::Anew) }
    };
    let key =
        move |words: String, key: &str| if on_machine.get() { words } else { format!("{words} ({key})") };
    div().class("row").child((
        div()
            .class("segmented")
            .attr("role", "group")
            .attr("aria-label", t!("page.lab.queue.runs_on"))
            .child((
                choice(
                    move || !on_machine.get(),
                    t!("page.lab.queue.in_page"),
                    |_| send(LabEvent::OnMachine { on: false }),
                ),
                choice(
                    move || on_machine.get(),
                    t!("page.lab.queue.on_machine"),
                    |_| send(LabEvent::OnMachine { on: true }),
                ),
            )),
        push_if("button", ready, move || key(say!("page.lab.queue.step"), "F10"), move |_| go(Mode::Step)),
        push_if(
            "button primary",
            ready,
            move || key(say!("page.lab.queue.run"), "F8"),
            move |_| go(Mode::ToBreakpoint),
        ),
        push_if("button", begun, t!("page.lab.queue.anew"), anew),
    ))
}
