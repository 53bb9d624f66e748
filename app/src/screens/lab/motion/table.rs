//! The table of dynamics on show, and what the core says of it.
//!
//! Comes in: the bench, else the machine's table. Goes out: rows, the table, findings. Knows no layout.

use crate::lab::edits::{INTERRUPTS, INTERRUPTS_HZ};
use crate::lab::motion::{self, StateRow};
use crate::page::{open_board, open_lab};
use crate::screens::lab::fields::Field;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{self, Dynamics, axis_name};
use leptos::prelude::*;

/// What is shown and found out.
#[derive(Clone, Copy)]
pub(super) struct Shown {
    /// The rows as typed.
    pub(super) rows: Memo<Vec<StateRow>>,
    /// The table, where every cell holds a number.
    pub(super) table: Memo<Option<Dynamics>>,
    /// What the core says: refusals, then warnings.
    pub(super) findings: Memo<Vec<Diagnostic>>,
    /// Whether it may be used.
    pub(super) sound: Memo<bool>,
    /// Interrupts a second.
    pub(super) interrupts: Field,
    /// Length of the move, steps.
    pub(super) steps: Field,
}

/// The table on show.
pub(super) fn shown() -> Shown {
    let lab = open_lab();
    let rows = Memo::new(move |_| {
        let typed = lab.bench.with(|bench| bench.dynamics.clone());
        typed.unwrap_or_else(|| open_board().machine.with(|machine| motion::rows(&machine.dynamics)))
    });
    let table = Memo::new(move |_| rows.with(|rows| motion::dynamics(rows).ok()));
    let checked = Memo::new(move |_| table.with(|table| table.as_ref().map(machine::dynamics::check)));
    let findings = Memo::new(move |_| match checked.get() {
        Some(Ok(diagnostics) | Err(diagnostics)) => diagnostics,
        None => Vec::new(),
    });
    let interrupt_hz = Memo::new(|_| open_board().machine.with(|machine| f64::from(machine.interrupt_hz)));
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

/// The axes whose speed is shown.
pub(super) fn axes() -> [String; 3] {
    [0, 1, 2].map(axis_name)
}
