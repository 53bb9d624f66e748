//! The queue of work commands: written in rows or as text, looked through as it is typed, stepped and run.
//!
//! ```text
//! rows │ text      insert, double, move, delete, open, save       step, run, begin anew
//! the grid, or the text
//! what the core says of it
//! ```
//!
//! Comes in: lines of the bench. Goes out: edits; runs in this page's own drill, or asks to the machine.

mod grid;
mod text;
mod tools;
mod verdict;

use crate::i18n::{key, t};
use crate::keys::QueueKey;
use crate::lab::LabPanel;
use crate::lab::queue::{QueueEdit, QueueLine, to_text};
use crate::model::LabEvent;
use crate::model::LinkEvent;
use crate::page::{Lab, open_lab};
use crate::page::{link, send};
use crate::said::Text;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::queue::{CheckedQueue, Mode, Queue, RowResult};
use annulus_core::wire::{Ask, QueuePhase};
use leptos::html::{div, p};
use leptos::prelude::*;

/// The queue on show and what the core says of it.
#[derive(Clone, Copy)]
pub(super) struct Work {
    lab: Lab,
    /// Its lines as typed.
    lines: Memo<Vec<QueueLine>>,
    /// The same as rows that may be run, or what is wrong with them, line by line.
    read: Memo<Result<Queue, Vec<Diagnostic>>>,
    /// What it will do, or the first row that may not be.
    checked: Memo<Option<Result<CheckedQueue, Diagnostic>>>,
}

impl Work {
    fn edit(self, field: Option<&str>, edit: &QueueEdit) {
        let mut at = self.lab.row.get_untracked();
        self.lab.change(field, |bench| {
            let (next, to) = bench.with_queue(edit);
            at = to;
            next
        });
        send(LabEvent::Row { at });
    }

    /// Everything that is wrong with the queue.
    fn refusals(self) -> Vec<Diagnostic> {
        if let Some(wrong) = self.read.with(|read| read.as_ref().err().cloned()) {
            return wrong;
        }
        self.checked
            .with(|checked| checked.as_ref().and_then(|one| one.as_ref().err().cloned()))
            .into_iter()
            .collect()
    }

    /// Why the line at `at` may not be.
    fn refusal_of(self, at: usize) -> Option<Diagnostic> {
        let line = |diagnostic: &Diagnostic| diagnostic.place.as_ref().map(|place| place.line as usize);
        self.refusals().into_iter().find(|diagnostic| line(diagnostic) == Some(at + 1))
    }

    /// What came of the line at `at`.
    fn result_of(self, at: usize) -> Option<RowResult> {
        if self.lab.on_machine.get() {
            return link::link().queue.with(|queue| queue.results.get(at).cloned());
        }
        self.lab.runs.results.with(|results| results.get(at).cloned())
    }

    /// The line that comes next.
    fn next_row(self) -> Option<usize> {
        if self.lab.on_machine.get() {
            link::link().queue.with(|queue| queue.row)
        } else {
            self.lab.runs.next.get()
        }
    }

    /// Whether it may run.
    fn sound(self) -> bool {
        self.lines.with(|lines| !lines.is_empty()) && self.refusals().is_empty()
    }

    /// Whether the machine has this very queue and rests in it.
    fn held_on_machine(self) -> bool {
        let text = self.lines.with(|lines| to_text(lines));
        link::link()
            .queue
            .with(|queue| queue.text == text && matches!(queue.phase, QueuePhase::Ready | QueuePhase::Held))
    }

    /// Runs it on the machine, as far as `mode` says; a queue that the machine does not have is brought first.
    fn run_on_machine(self, mode: Mode) {
        send(LinkEvent::Close { notice: link::Notice::Refused });
        if !untrack(move || self.held_on_machine()) {
            link::ask(Ask::Queue { text: self.lines.with_untracked(|lines| to_text(lines)) });
        }
        link::ask(Ask::QueueRun { mode });
    }

    /// Runs it in the page, as far as `mode` says.
    fn run(mode: Mode) {
        send(LabEvent::Run { mode });
    }
}

fn work() -> Work {
    let lab = open_lab();
    Work { lab, lines: lab.lines, read: lab.read, checked: lab.checked }
}

/// The sheet.
pub(super) fn queue() -> impl IntoView {
    let work = work();
    let as_text = work.lab.as_text;
    // A memo, so that the grid stays while it is typed into.
    let empty = Memo::new(move |_| work.lines.with(Vec::is_empty));
    let rows = move || {
        if empty.get() {
            p().class("quiet empty").child(t!("page.lab.queue.empty")).into_any()
        } else {
            grid::grid(work).into_any()
        }
    };
    div().class("lab-sheet queue-sheet").child((
        tools::tools(work),
        div()
            .class("queue-body")
            .child(move || if as_text.get() { text::text(work).into_any() } else { rows().into_any() }),
        verdict::verdict(work),
    ))
}

/// What a key asks of the queue; elsewhere in the Lab it means nothing.
pub(crate) fn key(pressed: QueueKey) {
    let lab = open_lab();
    if lab.sheet.get_untracked() != LabPanel::Queue {
        return;
    }
    let work = work();
    match pressed {
        QueueKey::Break => work.edit(None, &QueueEdit::Break { at: work.lab.row.get_untracked() }),
        // No key moves a machine: there the buttons do.
        QueueKey::Step | QueueKey::Run if lab.on_machine.get_untracked() => {
            send(LabEvent::Say { text: Text::of(key!("page.lab.queue.no_key")) });
        }
        QueueKey::Step => Work::run(Mode::Step),
        QueueKey::Run => Work::run(Mode::ToBreakpoint),
    }
}
