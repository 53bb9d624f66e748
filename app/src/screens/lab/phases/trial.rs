//! Runs the table on a virtual motor and shows the result as a sentence.

use super::Table;
use crate::i18n::{say, t};
use crate::lab::trial::{self, TrialOutcome};
use crate::page::{peek, shared, watch};
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

/// The button and the result. The result disappears when the table, the motor or other edits change.
pub(super) fn trial(table: Table) -> impl IntoView {
    let outcome = RwSignal::new(None::<TrialOutcome>);
    Effect::new(move |_| {
        table.columns.track();
        watch(|m| &m.lab.motor).track();
        shared(|m| &m.lab.bench).track();
        outcome.set(None);
    });
    let run = move |_| {
        let columns = table.columns.get_untracked();
        let axis = peek(|m| m.lab.motor);
        let machine = peek(|m| m.machine.clone());
        let tried = shared(|m| &m.lab.bench).with_untracked(|bench| bench.tried(&machine));
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
