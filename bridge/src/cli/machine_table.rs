//! The table of `annulus machines`: one row a machine, with its other names and what drives it.

use super::sentence;
use crate::machine_file;
use annulus_core::machine::{self, Axis, Machine, Output};

/// Columns, each a key of `machines.column`.
const COLUMNS: [&str; 4] = ["name", "machine", "travel", "driver"];

/// What drives the machine `name`: `grbl` for its own controller, else its output.
pub(super) fn driver(name: &str, machine: &Machine) -> &'static str {
    let has_own = machine.output == Output::Virtual && machine::mill(machine::preset_name(name)).is_some();
    if has_own { "grbl" } else { machine.output.names()[0] }
}

/// The machine that `name` is only another name of.
pub(super) fn alias_of(name: &str) -> Option<&str> {
    Some(machine::preset_name(name)).filter(|preset| *preset != name)
}

/// The row of the machine `name`.
pub(super) fn row(name: &str, machine: &Machine) -> [String; 4] {
    let aliases = machine_file::words().into_iter().filter(|word| alias_of(word) == Some(name));
    let names: Vec<String> = std::iter::once(name.to_owned()).chain(aliases).collect();
    let travel_mm = |axis: &Axis| (axis.max - axis.min).mm();
    let travel = format!("{:.0} × {:.0} mm", travel_mm(&machine.x), travel_mm(&machine.y));
    let driver = sentence(&format!("machines.driver.{}", driver(name, machine)), &[]);
    [names.join(", "), machine.name.clone(), travel, driver]
}

/// The rows below their headings, in columns.
pub(super) fn text(rows: &[[String; 4]]) -> String {
    let head = COLUMNS.map(|column| sentence(&format!("machines.column.{column}"), &[]));
    let all = || std::iter::once(&head).chain(rows);
    let mut widths = [0; 4];
    for row in all() {
        for (width, cell) in widths.iter_mut().zip(row) {
            *width = cell.chars().count().max(*width);
        }
    }
    let line = |row: &[String; 4]| {
        let cells = row.iter().zip(widths).map(|(cell, width)| format!("{cell:width$}  "));
        cells.collect::<String>().trim_end().to_owned() + "\n"
    };
    all().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn machines_name_their_driver_and_aliases() {
        for (name, expected, names) in [
            ("3018", "grbl", "3018, hobby"),
            ("shapeoko-3", "grbl", "shapeoko-3"),
            ("g540", "parallel", "g540"),
            ("virtual", "virtual_drill", "virtual"),
        ] {
            let machine = machine::preset(name).unwrap();
            assert_eq!(driver(name, &machine), expected, "{name}");
            assert_eq!(row(name, &machine)[0], names);
        }
        assert_eq!((alias_of("hobby"), alias_of("3018")), (Some("3018"), None));
    }

    #[test]
    fn columns_are_aligned() {
        let rows = [["a", "b", "c", "d"], ["long name", "b", "c", "d"]].map(|row| row.map(str::to_owned));
        let text = text(&rows);
        let places: Vec<_> = text.lines().skip(1).map(|line| line.rfind('d')).collect();
        assert!(places[0].is_some() && places[0] == places[1], "{text}");
    }
}
