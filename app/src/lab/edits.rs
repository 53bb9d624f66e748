//! Everything the Lab edits. Values that aren't edited are those of the machine.

use super::motion::{self, StateRow};
use super::phases::{self, TableEdit};
use super::queue::{self, QueueLine};
use crate::format;
use annulus_core::machine::{Machine, Value, axis_name};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::RangeInclusive;

/// Motors with a phase table: X, Y, Z.
pub const MOTORS: usize = 3;

pub const INTERRUPTS: &str = "drive.interrupt_frequency";

pub const INTERRUPTS_HZ: RangeInclusive<f64> = 10.0..=20_000.0;

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct LabEdits {
    /// Edited phase tables; none for the machine's table.
    pub tables: [Option<Vec<u8>>; MOTORS],
    /// Dynamics rows as typed; none for the machine's dynamics.
    pub dynamics: Option<Vec<StateRow>>,
    /// Typed texts of the fields, by name; missing fields have their default.
    pub fields: BTreeMap<String, String>,
    pub queue: Vec<QueueLine>,
}

impl LabEdits {
    /// With the table of `motor` edited; `columns` is its current content.
    #[must_use]
    pub fn with_table(&self, motor: usize, columns: &[u8], edit: &TableEdit) -> Self {
        let mut next = self.clone();
        if let Some(table) = next.tables.get_mut(motor) {
            *table = Some(phases::edited(columns, edit));
        }
        next
    }

    #[must_use]
    pub fn with_dynamics(&self, rows: Vec<StateRow>) -> Self {
        Self { dynamics: Some(rows), ..self.clone() }
    }

    /// With the machine's own dynamics and interrupt frequency.
    #[must_use]
    pub fn without_dynamics(&self) -> Self {
        let mut next = Self { dynamics: None, ..self.clone() };
        next.fields.remove(INTERRUPTS);
        next
    }

    #[must_use]
    pub fn with_field(&self, name: &str, text: String) -> Self {
        let mut next = self.clone();
        next.fields.insert(name.to_owned(), text);
        next
    }

    /// With an edit of the work commands; also returns the line to select.
    pub fn with_queue(&self, edit: &queue::QueueEdit) -> (Self, usize) {
        let (lines, at) = queue::edited(&self.queue, edit);
        (Self { queue: lines, ..self.clone() }, at)
    }

    /// Without pending changes to the machine. The experiments stay.
    #[must_use]
    pub fn without_changes(&self) -> Self {
        Self { tables: Default::default(), ..self.without_dynamics() }
    }

    pub fn changes(&self, machine: &Machine) -> Vec<(String, Value)> {
        let tables = self.tables.iter().enumerate().filter_map(|(motor, table)| {
            let columns = table.as_ref().filter(|table| **table != machine.axis(motor).phases.columns)?;
            let bytes = columns.iter().map(|byte| f64::from(*byte)).collect();
            Some((format!("{}.phases", axis_name(motor).to_lowercase()), Value::Numbers(bytes)))
        });
        tables.chain(self.changed_dynamics(machine)).collect()
    }

    /// `machine` with the edited dynamics and interrupt frequency, for trials. Invalid texts are ignored.
    pub fn tried(&self, machine: &Machine) -> Machine {
        let typed = self.dynamics.as_ref().and_then(|rows| motion::dynamics(rows).ok());
        let settable = |hz: &f64| INTERRUPTS_HZ.contains(hz);
        let hz = self.fields.get(INTERRUPTS).and_then(|text| format::typed(text)).filter(settable);
        Machine {
            dynamics: typed.unwrap_or_else(|| machine.dynamics.clone()),
            interrupt_hz: hz.map_or(machine.interrupt_hz, |hz| hz as u32),
            ..machine.clone()
        }
    }

    fn changed_dynamics(&self, machine: &Machine) -> Vec<(String, Value)> {
        let old = &machine.dynamics;
        let typed = self.dynamics.as_ref().and_then(|rows| motion::dynamics(rows).ok());
        let table = typed.filter(|table| table != old).into_iter().flat_map(|table| {
            [("drive.period", table.period), ("drive.enter", table.enter), ("drive.leave", table.leave)]
        });
        let numbers = |list: Vec<u32>| Value::Numbers(list.into_iter().map(f64::from).collect());
        let interrupts = self.fields.get(INTERRUPTS).and_then(|text| format::typed(text));
        let interrupts = interrupts.filter(|hz| *hz != f64::from(machine.interrupt_hz));
        let frequency = interrupts.map(|hz| (INTERRUPTS.to_owned(), Value::Number(hz)));
        table.map(|(key, list)| (key.to_owned(), numbers(list))).chain(frequency).collect()
    }

    /// For the browser's storage.
    pub fn kept(&self) -> String {
        serde_json::to_string(self).unwrap_or_default()
    }

    /// From the browser's storage; empty if the text is invalid.
    pub fn of_kept(text: &str) -> Self {
        let mut bench: Self = serde_json::from_str(text).unwrap_or_default();
        for table in bench.tables.iter_mut().flatten() {
            table.truncate(phases::MOST_COLUMNS);
        }
        bench.queue.truncate(queue::MOST_LINES);
        bench
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lab::motion::Column;
    use crate::lab::phases::{Cell, CellBlock};
    use annulus_core::machine::{apply, lab};

    #[test]
    fn only_typed_values_become_settings() {
        let machine = lab();
        let rows = motion::rows(&machine.dynamics);
        assert_eq!(LabEdits::default().with_dynamics(rows.clone()).changes(&machine), []);
        let slower = motion::with_cell(&rows, 0, Column::Period, "9".into());
        let bench = LabEdits::default().with_dynamics(slower).with_field(INTERRUPTS, "520".into());
        let changed = apply(&machine, &bench.changes(&machine)).unwrap();
        assert_eq!((changed.dynamics.period[0], changed.interrupt_hz), (9, 520));
        let wrong = motion::with_cell(&rows, 0, Column::Period, "x".into());
        assert_eq!(LabEdits::default().with_dynamics(wrong).changes(&machine), []);
        assert_eq!(bench.without_changes().changes(&machine), []);
    }

    #[test]
    fn trial_uses_the_edited_bench_values() {
        let machine = lab();
        assert_eq!(LabEdits::default().tried(&machine), machine);
        let rows = motion::with_cell(&motion::rows(&machine.dynamics), 3, Column::Period, "2".into());
        let bench = LabEdits::default().with_dynamics(rows).with_field(INTERRUPTS, "700".into());
        let tried = bench.tried(&machine);
        assert_eq!((tried.dynamics.period, tried.interrupt_hz), (vec![7, 4, 2, 2], 700));
        for wrong in ["", "x", "0", "1e9", "-5"] {
            let bench = LabEdits::default().with_field(INTERRUPTS, wrong.into());
            assert_eq!(bench.tried(&machine), machine, "{wrong}");
        }
        let table = machine.x.phases.clone();
        let fast = LabEdits::default().with_field(INTERRUPTS, "700".into()).tried(&machine);
        assert_eq!(crate::lab::trial::run(&table, &machine, 0).lost, 0);
        let outcome = crate::lab::trial::run(&table, &fast, 0);
        assert!(outcome.lost > 0 && outcome.interrupt_hz == 700, "{outcome:?}");
    }

    #[test]
    fn saved_bench_is_restored_and_damaged_text_gives_an_empty_one() {
        let cell = Cell { line: 1, column: 2 };
        let bench = LabEdits::default()
            .with_table(1, &[1, 2, 4], &TableEdit::Toggle(CellBlock::at(cell)))
            .with_field("move.length", "12,5".to_owned());
        assert_eq!(bench.tables, [None, Some(vec![1, 2, 6]), None]);
        assert_eq!(LabEdits::of_kept(&bench.kept()), bench);
        assert_eq!(bench.changes(&lab()), [("y.phases".to_owned(), Value::Numbers(vec![1.0, 2.0, 6.0]))]);
        for rubbish in ["", "{", "[]", "{\"tables\":3}", "{\"tables\":[null,null]}"] {
            assert_eq!(LabEdits::of_kept(rubbish), LabEdits::default(), "{rubbish}");
        }
        let long = format!("{{\"tables\":[{:?},null,null]}}", vec![1; 500]);
        assert_eq!(LabEdits::of_kept(&long).tables[0].as_ref().map(Vec::len), Some(phases::MOST_COLUMNS));
        assert_eq!(bench.with_table(9, &[1], &TableEdit::Rotate { by: 1 }), bench);
    }
}
