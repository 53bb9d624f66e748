//! The toolbar of the queue: view, row edits, file, run.

use super::grid;
use crate::i18n::{say, t};
use crate::lab::queue::{QueueEdit, to_text};
use crate::model::LabEvent;
use crate::page::{lab, link, peek, read, send, watch};
use crate::widgets::{choice, push_guarded, push_if, save_file, segmented};
use annulus_core::control::State;
use annulus_core::queue::Mode;
use annulus_core::wire::{Ask, QueuePhase};
use leptos::html::{div, span};
use leptos::prelude::*;

const EXAMPLE: &str = "HOME ALL\nSPINDLE 20000\nREPEAT 3  ; three holes in a row\nMOVE_BY 200 0\nDRILL_DOWN\nDRILL_UP\nEND\nSPINDLE 0\n";

pub(super) fn tools() -> impl IntoView {
    let as_text = watch(|m| &m.lab.as_text);
    let free = move || !lab::locked();
    let any = move || lab::lines().with(|lines| !lines.is_empty());
    let edit = move |made: fn(usize) -> QueueEdit| {
        super::edit(None, &made(peek(|m| m.lab.row)));
        grid::focus(peek(|m| m.lab.row));
    };
    let on_rows = move || free() && any() && !as_text.get();
    div().class("lab-tools").attr("role", "group").attr("aria-label", t!("page.lab.queue.tools")).child((
        segmented(
            t!("page.lab.queue.shown_as"),
            (
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
            ),
        ),
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
                    super::edit(None, &QueueEdit::Text(EXAMPLE.to_owned()));
                },
            ),
            push_if("button", any, t!("page.lab.queue.save"), move |_| {
                save_file(
                    "annulus-queue.txt",
                    "text/plain",
                    &lab::lines().with_untracked(|lines| to_text(lines)),
                );
            }),
        )),
        runs(),
    ))
}

fn runs() -> impl IntoView {
    let on_machine = || read(|m| m.lab.on_machine);
    let ready = move || {
        if !super::sound() {
            false
        } else if on_machine() {
            let held = link::state() == Some(State::Paused) && super::held_on_machine();
            link::may_act() && (held || !link::busy())
        } else {
            !lab::locked() && !read(|m| m.lab.run.running)
        }
    };
    let begun = move || {
        if on_machine() {
            link::may_change() && read(|m| m.link.queue.status.phase != QueuePhase::None)
        } else {
            read(|m| !m.lab.run.results.is_empty())
        }
    };
    let go = |mode: Mode| {
        if peek(|m| m.lab.on_machine) { super::run_on_machine(mode) } else { super::run(mode) }
    };
    // Running in the page moves nothing, so its buttons aren't guarded.
    let moves = move || if on_machine() { "queue" } else { "" };
    let anew = |_| {
        if peek(|m| m.lab.on_machine) { link::ask(Ask::QueueClear) } else { send(LabEvent::Anew) }
    };
    let key = move |words: String, key: &str| if on_machine() { words } else { format!("{words} ({key})") };
    div().class("row").child((
        segmented(
            t!("page.lab.queue.runs_on"),
            (
                choice(
                    move || !on_machine(),
                    t!("page.lab.queue.in_page"),
                    |_| send(LabEvent::OnMachine { on: false }),
                ),
                choice(on_machine, t!("page.lab.queue.on_machine"), |_| {
                    send(LabEvent::OnMachine { on: true });
                }),
            ),
        ),
        push_guarded(
            "button",
            moves,
            ready,
            move || key(say!("page.lab.queue.step"), "F10"),
            move |_| go(Mode::Step),
        ),
        push_guarded(
            "button primary",
            moves,
            ready,
            move || key(say!("page.lab.queue.run"), "F8"),
            move |_| go(Mode::ToBreakpoint),
        ),
        push_if("button", begun, t!("page.lab.queue.anew"), anew),
    ))
}
