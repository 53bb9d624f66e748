//! Phase tables: which half of which winding is on in which step.
//!
//! ```text
//! motor, cycle, preset, edits
//! grid of bits × steps                │ dial with play and step
//! waveforms below the same columns    │ errors of the table, test on the virtual motor
//! pending changes ─▶ Apply
//! ```

mod dial;
mod grid;
mod tools;
mod trial;

use super::apply;
use crate::i18n::{advice, message, t};
use crate::lab::phases::TableEdit;
use crate::page::{lab, peek, read, shared};
use crate::widgets::{Icon, icon};
use annulus_core::diagnostic::{Diagnostic, Severity};
use annulus_core::machine::phases::{Commutator, check};
use annulus_core::machine::{Machine, PhaseTable};
use leptos::html::{div, h3, li, p, section, span, strong, ul};
use leptos::prelude::*;

#[derive(Clone, Copy)]
pub(super) struct Table {
    columns: Memo<Vec<u8>>,
    /// The output to the motor, step by step.
    driver: RwSignal<Commutator>,
}

impl Table {
    fn edit(self, edit: &TableEdit) {
        let motor = peek(|m| m.lab.motor);
        let columns = self.columns.get_untracked();
        lab::change(None, |bench| bench.with_table(motor, &columns, edit));
    }

    fn column(self) -> usize {
        let steps = self.driver.with(Commutator::steps);
        self.columns.with(|columns| steps.saturating_sub(1).rem_euclid(columns.len().max(1) as i64) as usize)
    }
}

fn of_machine(machine: &Machine, motor: usize) -> Vec<u8> {
    machine.axis(motor).phases.columns.clone()
}

const KEYS: [&str; 3] = ["x.phases", "y.phases", "z.phases"];

pub(super) fn phases() -> impl IntoView {
    let columns = Memo::new(move |_| {
        let motor = read(|m| m.lab.motor);
        let edited = shared(|m| &m.lab.bench).with(|bench| bench.tables.get(motor).cloned().flatten());
        edited.unwrap_or_else(|| shared(|m| &m.machine).with(|machine| of_machine(machine, motor)))
    });
    let findings = Memo::new(move |_| {
        match check(KEYS[read(|m| m.lab.motor).min(2)], &PhaseTable { columns: columns.get() }) {
            Ok(warnings) => warnings,
            Err(refusals) => refusals,
        }
    });
    let sound =
        Memo::new(move |_| findings.with(|all| all.iter().all(|one| one.severity != Severity::Error)));
    let driver = RwSignal::new(Commutator::new(PhaseTable { columns: columns.get_untracked() }, 1));
    Effect::new(move |_| {
        let table = PhaseTable { columns: columns.get() };
        driver.update(|driver| *driver = Commutator::new(table, driver.steps()));
    });
    let table = Table { columns, driver };
    div().class("phases").child((
        tools::tools(table),
        div().class("phases-body").child((
            section()
                .class("block phases-table")
                .attr("aria-label", t!("page.lab.phases.title"))
                .child((div().class("phases-scroll").child((grid::grid(table), grid::waves(table))),)),
            div().class("phases-side").child((dial::dial(table), verdict(findings), trial::trial(table))),
        )),
        apply::apply(move || sound.get()),
    ))
}

fn verdict(findings: Memo<Vec<Diagnostic>>) -> impl IntoView {
    let count = move || findings.with(Vec::len);
    section().class("block findings").attr("aria-label", t!("page.lab.phases.findings")).child((
        h3().child(t!("page.lab.phases.findings")),
        p().class("row").attr("role", "status").child(move || {
            if count() == 0 {
                (icon(Icon::Check).into_any(), span().child(t!("page.lab.phases.sound")).into_any())
            } else {
                let many = t!("page.lab.phases.wrong", count = count());
                (icon(Icon::Warning).into_any(), span().child(many).into_any())
            }
        }),
        ul().child(move || {
            findings.get().into_iter().map(|finding| line(finding).into_any()).collect::<Vec<_>>()
        }),
    ))
}

fn line(finding: Diagnostic) -> impl IntoView {
    let cure = finding.clone();
    li().child((strong().child(move || message(&finding)), p().class("quiet").child(move || advice(&cure))))
}
