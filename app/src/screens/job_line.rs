//! The open board in one line, on every screen: machine, proof or running task, problems, next step, export.
//!
//! ```text
//! Virtual drill   ✓ Proved: 8 of 8 nets isolated, smallest gap 0.31 mm   [Problems: 2] [Next: simulate] [Export…]
//! ```

use super::board::show_problems;
use super::top_bar;
use crate::i18n::{self, key, say, t};
use crate::keys::Tab;
use crate::model::{Event, ExportEvent, FrameEvent, NextStep, ProofState};
use crate::page::{board, read, send};
use crate::widgets::{Icon, icon, push};
use leptos::html::{a, div, progress, span};
use leptos::prelude::*;

/// Without a board, only a running task.
pub(super) fn job_line() -> impl IntoView {
    let open = Memo::new(|_| read(|m| m.board.document.is_some()));
    let machine = move || {
        open.get().then(|| {
            a().class("machine-link")
                .attr("href", "#/machine")
                .attr("title", t!("page.next.machine"))
                .child(top_bar::machine_name)
        })
    };
    let steps = move || {
        open.get().then(|| {
            (
                problems(),
                next(),
                push("button small", t!("page.next.export"), |_| send(ExportEvent::Panel { on: true })),
            )
        })
    };
    (machine, div().class("proof grow").child(state()), steps)
}

/// The running task; else the proof.
fn state() -> impl IntoView {
    let busy = Memo::new(|_| read(|m| m.task().is_some()));
    move || if busy.get() { task().into_any() } else { proof().into_any() }
}

fn task() -> impl IntoView {
    let word = || read(|m| m.task().map(|task| task.word));
    let words = move || word().map(|word| i18n::text(word, &[])).unwrap_or_default();
    (
        span().class("cut").attr("role", "status").child(words),
        progress()
            .attr("max", "1")
            .attr("aria-label", words)
            .prop("value", || read(|m| m.task().map_or(0.0, |task| task.share))),
        push("button small quiet", t!("page.cancel"), |_| send(Event::Cancelled)),
    )
}

fn tone(state: ProofState) -> &'static str {
    match state {
        ProofState::Proved => "tag tone-run",
        ProofState::Open => "tag tone-pause",
        ProofState::Refused => "tag tone-alarm",
        ProofState::Nothing | ProofState::Waits => "tag",
    }
}

fn sign(state: ProofState) -> Option<Icon> {
    match state {
        ProofState::Proved => Some(Icon::Check),
        ProofState::Open => Some(Icon::Warning),
        ProofState::Refused => Some(Icon::Alarm),
        ProofState::Nothing | ProofState::Waits => None,
    }
}

fn proof() -> impl IntoView {
    let sentence = board::proof_sentence();
    let state = move || sentence.with(|sentence| sentence.as_ref().map(|sentence| sentence.state));
    let words = move || {
        sentence.with(|sentence| {
            sentence.as_ref().map(|sentence| i18n::sentence(&sentence.text)).unwrap_or_default()
        })
    };
    // The title shows the words that a narrow window cuts off.
    span()
        .class(move || state().map_or("tag", tone))
        .attr("role", "status")
        .attr("title", words)
        .child((move || state().and_then(sign).map(icon), span().class("cut").child(words)))
}

/// The number of all problems; pressing it lists them.
fn problems() -> impl IntoView {
    let count = Memo::new(|_| board::problem_count());
    move || {
        (count.get() > 0).then(|| {
            let text = move || say!("page.problems.count", count = count.get());
            push("button small quiet", text, |_| show_problems())
        })
    }
}

fn word(step: NextStep) -> &'static str {
    match step {
        NextStep::Files => key!("page.next.files"),
        NextStep::Problems => key!("page.next.problems"),
        NextStep::Toolpaths => key!("page.next.toolpaths"),
        NextStep::Simulate => key!("page.next.simulate"),
        NextStep::Run => key!("page.next.run"),
    }
}

/// One button for all steps, so that it keeps the focus.
fn next() -> impl IntoView {
    let step = board::next_step();
    let words = move || step.get().map(|step| i18n::text(word(step), &[])).unwrap_or_default();
    push("button small next", words, move |_| {
        let show = |tab| send(FrameEvent::Show { tab });
        match step.get_untracked() {
            Some(NextStep::Files | NextStep::Problems) => show_problems(),
            Some(NextStep::Toolpaths) => show(Tab::Cam),
            Some(NextStep::Simulate) => show(Tab::Simulate),
            Some(NextStep::Run) => show(Tab::Machine),
            None => {}
        }
    })
}
