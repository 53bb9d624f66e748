//! The bar over the queue: how it is shown, edits of the chosen row, file, run.
//!
//! Comes in: the queue. Goes out: edits and orders.

use super::{Work, grid};
use crate::i18n::t;
use crate::lab::queue::{Edit, to_text};
use crate::widgets::{choice, push_if, save_file};
use annulus_core::queue::Mode;
use leptos::html::{div, span};
use leptos::prelude::*;

/// A queue to begin with: home, two holes, three more in a row.
const EXAMPLE: &str = "HOME ALL\nSPINDLE 20000\nREPEAT 3  ; three holes in a row\nMOVE_BY 200 0\nDRILL_DOWN\nDRILL_UP\nEND\nSPINDLE 0\n";

/// The bar.
pub(super) fn tools(work: Work) -> impl IntoView {
    let as_text = work.lab.as_text;
    let free = move || !work.lab.locked.get();
    let any = move || work.lines.with(|lines| !lines.is_empty());
    let edit = move |made: fn(usize) -> Edit| {
        work.edit(None, &made(work.lab.row.get_untracked()));
        grid::focus(work.lab.row.get_untracked());
    };
    let ready = move || free() && work.sound() && !work.lab.runs.running.get();
    let begun = move || work.lab.runs.results.with(|results| !results.is_empty());
    let on_rows = move || free() && any() && !as_text.get();
    div().class("lab-tools").attr("role", "group").attr("aria-label", t!("page.lab.queue.tools")).child((
        div()
            .class("segmented")
            .attr("role", "group")
            .attr("aria-label", t!("page.lab.queue.shown_as"))
            .child((
                choice(move || !as_text.get(), t!("page.lab.queue.rows"), move |_| as_text.set(false)),
                choice(move || as_text.get(), t!("page.lab.queue.text"), move |_| as_text.set(true)),
            )),
        div().class("row").child((
            push_if(
                "button",
                move || free() && !as_text.get(),
                t!("page.lab.queue.insert"),
                move |_| {
                    edit(Edit::Insert);
                },
            ),
            push_if("button", on_rows, t!("page.lab.queue.double"), move |_| edit(Edit::Double)),
            push_if("button", on_rows, t!("page.lab.queue.up"), move |_| edit(|at| Edit::Move(at, false))),
            push_if("button", on_rows, t!("page.lab.queue.down"), move |_| edit(|at| Edit::Move(at, true))),
            push_if("button", on_rows, t!("page.lab.queue.delete"), move |_| edit(Edit::Delete)),
        )),
        span().class("grow"),
        div().class("row").child((
            push_if(
                "button",
                move || free() && !any(),
                t!("page.lab.queue.example"),
                move |_| {
                    work.edit(None, &Edit::Text(EXAMPLE.to_owned()));
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
        div().class("row").child((
            push_if("button", ready, t!("page.lab.queue.step"), move |_| work.run(Mode::Step)),
            push_if("button primary", ready, t!("page.lab.queue.run"), move |_| work.run(Mode::ToBreakpoint)),
            push_if("button", begun, t!("page.lab.queue.anew"), move |_| work.lab.runs.clear()),
        )),
    ))
}
