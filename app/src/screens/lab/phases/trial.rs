//! The table on a virtual motor: pressed, run, and said in a sentence.
//!
//! Comes in: the table, the dynamics and the interrupts as they lie on the bench. Goes out: how many steps were lost, and why.

use super::Table;
use crate::i18n::{say, t};
use crate::lab::trial::{self, TrialOutcome};
use crate::page::open_board;
use crate::widgets::push;
use annulus_core::machine::PhaseTable;
use annulus_core::virtual_drill::Cause;
use leptos::html::{h3, p, section};
use leptos::prelude::*;

fn cause_words(cause: Cause) -> String {
    match cause {
        Cause::TooFast => say!("page.lab.trial.too_fast"),
        Cause::TooSteep => say!("page.lab.trial.too_steep"),
        Cause::NoPull => say!("page.lab.trial.no_pull"),
        Cause::Blocked | Cause::Held | Cause::Fault => say!("page.lab.trial.held"),
    }
}

fn in_words(outcome: TrialOutcome) -> String {
    let TrialOutcome { interrupt_hz, sent, lost, first, off } = outcome;
    match first {
        None => say!("page.lab.trial.clean", sent = sent, hz = interrupt_hz),
        Some((step, cause)) => {
            say!(
                "page.lab.trial.lost",
                lost = lost,
                sent = sent,
                hz = interrupt_hz,
                takt = step,
                why = cause_words(cause),
                off = off
            )
        }
    }
}

/// The button and the answer; the answer is about the bench it was given for.
pub(super) fn trial(table: Table) -> impl IntoView {
    let outcome = RwSignal::new(None::<TrialOutcome>);
    Effect::new(move |_| {
        table.columns.track();
        table.lab.motor.track();
        table.lab.bench.track();
        outcome.set(None);
    });
    let run = move |_| {
        let columns = table.columns.get_untracked();
        let axis = table.lab.motor.get_untracked();
        let machine = open_board().machine.get_untracked();
        let tried = table.lab.bench.with_untracked(|bench| bench.tried(&machine));
        let found = trial::run(&PhaseTable { columns }, &tried, axis);
        outcome.set(Some(found));
    };
    let looks =
        move || if outcome.get().is_some_and(|outcome| outcome.lost > 0) { "refusal" } else { "quiet" };
    section().class("block").attr("aria-label", t!("page.lab.trial.title")).child((
        h3().child(t!("page.lab.trial.title")),
        push("button", t!("page.lab.trial.run"), run),
        p().class(looks).attr("role", "status").child(move || outcome.get().map(in_words)),
    ))
}
