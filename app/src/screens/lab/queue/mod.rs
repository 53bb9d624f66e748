//! The queue of work commands: edited as rows or as text, checked while it is typed, stepped and run.
//!
//! ```text
//! rows │ text      insert, double, move, delete, open, save       step, run, restart
//! the grid, or the text
//! the core's checks
//! ```

mod grid;
mod tools;
mod verdict;

use crate::i18n::{key, t};
use crate::keys::QueueKey;
use crate::lab::LabPanel;
use crate::lab::queue::{QueueEdit, to_text};
use crate::model::link::Notice;
use crate::model::{LabEvent, LinkEvent};
use crate::page::{lab, link, peek, read, send, shared, watch};
use crate::said::Text;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::queue::{CheckedQueue, Mode, RowResult};
use annulus_core::wire::{Ask, QueuePhase};
use leptos::ev;
use leptos::html::{div, p, pre, textarea};
use leptos::prelude::*;

fn edit(field: Option<&str>, edit: &QueueEdit) {
    let mut at = peek(|m| m.lab.row);
    lab::change(field, |bench| {
        let (next, to) = bench.with_queue(edit);
        at = to;
        next
    });
    send(LabEvent::Row { at });
}

fn refusals() -> Vec<Diagnostic> {
    if let Some(wrong) = lab::queue().with(|queue| queue.as_ref().err().cloned()) {
        return wrong;
    }
    let refused =
        |checked: &Option<Result<CheckedQueue, Diagnostic>>| checked.as_ref()?.as_ref().err().cloned();
    lab::checked().with(refused).into_iter().collect()
}

fn refusal_of(at: usize) -> Option<Diagnostic> {
    let line = |diagnostic: &Diagnostic| diagnostic.place.as_ref().map(|place| place.line as usize);
    refusals().into_iter().find(|diagnostic| line(diagnostic) == Some(at + 1))
}

fn result_of(at: usize) -> Option<RowResult> {
    if read(|m| m.lab.on_machine) {
        return watch(|m| &m.link.queue.results).with(|results| results.get(at).cloned());
    }
    shared(|m| &m.lab.run.results).with(|results| results.get(at).cloned())
}

fn next_row() -> Option<usize> {
    read(|m| if m.lab.on_machine { m.link.queue.status.row.map(|row| row as usize) } else { m.lab.run.next })
}

fn sound() -> bool {
    lab::lines().with(|lines| !lines.is_empty()) && refusals().is_empty()
}

fn held_on_machine() -> bool {
    let text = lab::lines().with(|lines| to_text(lines));
    watch(|m| &m.link.queue.text).with(|held| *held == text)
        && read(|m| matches!(m.link.queue.status.phase, QueuePhase::Ready | QueuePhase::Held))
}

/// Runs the queue on the machine as far as `mode` allows; uploads it first if the machine doesn't have it.
fn run_on_machine(mode: Mode) {
    send(LinkEvent::Close { notice: Notice::Refused });
    if !untrack(held_on_machine) {
        link::ask(Ask::Queue { text: lab::lines().with_untracked(|lines| to_text(lines)) });
    }
    link::ask(Ask::QueueRun { mode });
}

/// Runs the queue in the page as far as `mode` allows.
fn run(mode: Mode) {
    send(LabEvent::Run { mode });
}

pub(super) fn queue() -> impl IntoView {
    let as_text = watch(|m| &m.lab.as_text);
    // A memo, so that the grid isn't rebuilt while the user types in it.
    let empty = Memo::new(move |_| lab::lines().with(Vec::is_empty));
    let rows = move || {
        if empty.get() {
            p().class("quiet empty").child(t!("page.lab.queue.empty")).into_any()
        } else {
            grid::grid().into_any()
        }
    };
    div().class("lab-sheet queue-sheet").child((
        tools::tools(),
        div()
            .class("queue-body")
            .child(move || if as_text.get() { text().into_any() } else { rows().into_any() }),
        verdict::verdict(),
    ))
}

/// Handles a key of the queue; ignores it on other panels.
pub(crate) fn key(pressed: QueueKey) {
    if peek(|m| m.lab.sheet != LabPanel::Queue) {
        return;
    }
    match pressed {
        QueueKey::Break => edit(None, &QueueEdit::Break { at: peek(|m| m.lab.row) }),
        // Safety: keys never move a machine. Only the buttons do.
        QueueKey::Step | QueueKey::Run if peek(|m| m.lab.on_machine) => {
            send(LabEvent::Say { text: Text::of(key!("page.lab.queue.no_key")) });
        }
        QueueKey::Step => run(Mode::Step),
        QueueKey::Run => run(Mode::ToBreakpoint),
    }
}

/// The queue as text with line numbers. While the user types, the text isn't reformatted.
fn text() -> impl IntoView {
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
                edit(Some("queue.text"), &QueueEdit::Text(text));
            })
            .on(ev::blur, move |_| {
                typing.set(None);
                send(LabEvent::Rest);
            }),
    ))
}
