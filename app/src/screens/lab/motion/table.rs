//! The edited dynamics table and the core's checks of it.

use crate::lab::edits::{INTERRUPTS, INTERRUPTS_HZ};
use crate::lab::motion::{self, StateRow};
use crate::page::{read, shared};
use crate::screens::lab::fields::Field;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{self, Dynamics, axis_name};
use leptos::prelude::*;

/// The table and what is derived from it.
#[derive(Clone, Copy)]
pub(super) struct Shown {
    /// Rows as typed.
    pub(super) rows: Memo<Vec<StateRow>>,
    /// None if a cell isn't a number.
    pub(super) table: Memo<Option<Dynamics>>,
    /// The core's errors, then its warnings.
    pub(super) findings: Memo<Vec<Diagnostic>>,
    /// True if the table may be used.
    pub(super) sound: Memo<bool>,
    pub(super) interrupts: Field,
    /// Length of the move in steps.
    pub(super) steps: Field,
}

pub(super) fn shown() -> Shown {
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

/// Names of the axes whose speed is plotted.
pub(super) fn axes() -> [String; 3] {
    [0, 1, 2].map(axis_name)
}
