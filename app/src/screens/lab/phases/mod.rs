//! Phase tables: which half of which winding is on in which step.
//!
//! ```text
//! motor, cycle, preset, edits
//! grid of bits × steps                │ dial with play and step
//! waveforms below the same columns    │ what is wrong with the table, test on the virtual motor
//! what would change ─▶ Apply
//! ```
//!
//! Comes in: the bench, else the machine's table. Goes out: `Configure`, once the core finds nothing wrong.

mod dial;
mod grid;
mod tools;
mod trial;
mod verdict;
mod waves;

use super::apply;
use crate::i18n::t;
use crate::lab::phases::TableEdit;
use crate::page::open_board;
use crate::page::{Lab, open_lab};
use annulus_core::diagnostic::Severity;
use annulus_core::machine::phases::{Commutator, check};
use annulus_core::machine::{Machine, PhaseTable};
use leptos::html::{div, section};
use leptos::prelude::*;

/// The table on show and the step it stands at.
#[derive(Clone, Copy)]
pub(super) struct Table {
    lab: Lab,
    /// Its columns.
    columns: Memo<Vec<u8>>,
    /// What the motor gets, step by step.
    driver: RwSignal<Commutator>,
}

impl Table {
    fn edit(self, edit: &TableEdit) {
        let motor = self.lab.motor.get_untracked();
        let columns = self.columns.get_untracked();
        self.lab.change(None, |bench| bench.with_table(motor, &columns, edit));
    }

    /// The column that is put out.
    fn column(self) -> usize {
        let steps = self.driver.with(Commutator::steps);
        self.columns.with(|columns| steps.saturating_sub(1).rem_euclid(columns.len().max(1) as i64) as usize)
    }
}

/// The machine's own table of `motor`.
fn of_machine(machine: &Machine, motor: usize) -> Vec<u8> {
    machine.axis(motor).phases.columns.clone()
}

/// The settings of the tables, motor by motor.
const KEYS: [&str; 3] = ["x.phases", "y.phases", "z.phases"];

/// The sheet.
pub(super) fn phases() -> impl IntoView {
    let lab = open_lab();
    let columns = Memo::new(move |_| {
        let motor = lab.motor.get();
        let edited = lab.bench.with(|bench| bench.tables.get(motor).cloned().flatten());
        edited.unwrap_or_else(|| open_board().machine.with(|machine| of_machine(machine, motor)))
    });
    let findings = Memo::new(move |_| {
        match check(KEYS[lab.motor.get().min(2)], &PhaseTable { columns: columns.get() }) {
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
    let table = Table { lab, columns, driver };
    div().class("phases").child((
        tools::tools(table),
        div().class("phases-body").child((
            section()
                .class("block phases-table")
                .attr("aria-label", t!("page.lab.phases.title"))
                .child((div().class("phases-scroll").child((grid::grid(table), waves::waves(table))),)),
            div().class("phases-side").child((
                dial::dial(table),
                verdict::verdict(findings),
                trial::trial(table),
            )),
        )),
        apply::apply(move || sound.get()),
    ))
}
