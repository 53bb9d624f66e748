//! Motion: the dynamics table step by step, a comparison of profiles, table and spindles over time.

mod cycle;
mod dynamics;
mod profiles;
mod steps;

use crate::i18n::{say, t};
use crate::lab::edits::{INTERRUPTS, INTERRUPTS_HZ};
use crate::lab::motion::{self, StateRow};
use crate::lab::panel::PanelPart;
use crate::model::LabEvent;
use crate::page::{read, send, shared};
use crate::screens::lab::fields::Field;
use crate::widgets::{choice, segmented};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{self, Dynamics, axis_name};
use leptos::html::div;
use leptos::prelude::*;

fn name_of(part: PanelPart) -> String {
    match part {
        PanelPart::Dynamics => say!("page.lab.motion.dynamics"),
        PanelPart::Profiles => say!("page.lab.motion.profiles"),
        PanelPart::Cycle => say!("page.lab.motion.cycle"),
    }
}

pub(super) fn motion() -> impl IntoView {
    let part = || read(|m| m.lab.part);
    let choices = PanelPart::ALL.map(|this| {
        choice(move || part() == this, move || name_of(this), move |_| send(LabEvent::Part { part: this }))
            .into_any()
    });
    div().class("lab-sheet").child((
        div().class("lab-tools").child(segmented(t!("page.lab.motion.parts"), Vec::from(choices))),
        move || match part() {
            PanelPart::Dynamics => dynamics::dynamics().into_any(),
            PanelPart::Profiles => profiles::profiles().into_any(),
            PanelPart::Cycle => cycle::cycle().into_any(),
        },
    ))
}

/// The edited dynamics table, and the core's checks of it.
#[derive(Clone, Copy)]
struct Shown {
    rows: Memo<Vec<StateRow>>,
    /// None if a cell isn't a number.
    table: Memo<Option<Dynamics>>,
    /// The core's errors, then its warnings.
    findings: Memo<Vec<Diagnostic>>,
    /// True if the table may be used.
    sound: Memo<bool>,
    interrupts: Field,
    steps: Field,
}

fn shown() -> Shown {
    let rows = Memo::new(move |_| {
        let typed = shared(|m| &m.lab.bench).with(|bench| bench.dynamics.clone());
        typed.unwrap_or_else(|| shared(|m| &m.machine).with(|machine| motion::rows(&machine.dynamics)))
    });
    let table = Memo::new(move |_| rows.with(|rows| motion::dynamics(rows).ok()));
    let checked = Memo::new(move |_| table.with(|table| table.as_ref().map(machine::dynamics::check)));
    let findings = Memo::new(move |_| match checked.get() {
        Some(Ok(diagnostics) | Err(diagnostics)) => diagnostics,
        None => Vec::new(),
    });
    let interrupt_hz = Memo::new(|_| read(|m| f64::from(m.machine.interrupt_hz)));
    Shown {
        rows,
        table,
        findings,
        sound: Memo::new(move |_| matches!(checked.get(), Some(Ok(_)))),
        interrupts: Field {
            name: INTERRUPTS,
            unit: "Hz",
            range: (*INTERRUPTS_HZ.start(), *INTERRUPTS_HZ.end()),
            own: interrupt_hz,
        },
        steps: Field {
            name: "move.takts",
            unit: "",
            range: (-20_000.0, 20_000.0),
            own: Memo::new(|_| 100.0),
        },
    }
}

fn axes() -> [String; 3] {
    [0, 1, 2].map(axis_name)
}
