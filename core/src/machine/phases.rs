//! Phase bytes of a two-phase motor, step by step.
//!
//! ```text
//! bit  0 1   2 3   4   5 6   7          angle of the field, in eighths of an electrical cycle
//!      1a 1b 2a 2b –   a b   –
//!      └ 5 V ────┘    24 V                           0: 1a
//!      never 1a with 1b, never              7: 1a,2a   │   1: 1a,2b
//!      2a with 2b: they cancel            6: 2a ───────┼─────── 2: 2b
//!                                           5: 1b,2a   │   3: 1b,2b
//!      forward: the angle grows                      4: 1b
//! ```
//!
//! A winding gets 24 V for one step after its current changed. That depends on the direction, so the two bits
//! follow the actual change instead of the table. At the first interrupt without a step they are cleared,
//! so that no winding stays on 24 V at rest.
//!
//! Source: R. Arendt's laboratory drill; reference part A.2.

use super::PhaseTable;
use crate::diagnostic::Diagnostic;
use crate::{code, warning};

/// Most columns of a table.
pub const MOST_COLUMNS: usize = 64;

/// 5 V bits: both halves of both windings.
pub const WINDINGS: u8 = 0b0000_1111;

pub const FORCING: u8 = 0b0110_0000;

/// The two windings: 5 V bits and 24 V bit.
const WINDING: [(u8, u8); 2] = [(0b0011, 0b0010_0000), (0b1100, 0b0100_0000)];

/// Built-in tables, by name.
pub const PRESETS: [&str; 4] = ["boost_12", "full_two", "full_one", "half"];

/// A built-in table: one of [`PRESETS`].
pub fn preset(name: &str) -> Option<PhaseTable> {
    let columns: &[u8] = match name {
        "boost_12" => return Some(PhaseTable::arendt()),
        "full_two" => return Some(PhaseTable::full_step()),
        "full_one" => &[0x01, 0x08, 0x02, 0x04],
        "half" => &[0x05, 0x01, 0x09, 0x08, 0x0A, 0x02, 0x06, 0x04],
        _ => return None,
    };
    Some(PhaseTable { columns: columns.to_vec() })
}

/// Column index at position `steps`: the first step forward from 0 is column 0. None for an empty table.
pub fn index(table: &PhaseTable, steps: i64) -> Option<usize> {
    let length = i64::try_from(table.columns.len()).ok().filter(|length| *length > 0)?;
    usize::try_from(steps.saturating_sub(1).rem_euclid(length)).ok()
}

/// The table's column at position `steps`; 0 for an empty table.
pub fn column(table: &PhaseTable, steps: i64) -> u8 {
    index(table, steps).and_then(|index| table.columns.get(index)).copied().unwrap_or(0)
}

/// The output byte at position `steps` after `before`: the column's 5 V bits, plus 24 V on every winding that
/// changed, if the table ever forces that winding.
pub fn byte(table: &PhaseTable, steps: i64, before: u8) -> u8 {
    let now = column(table, steps) & WINDINGS;
    let forcing = WINDING.iter().filter(|(halves, _)| now & halves != 0 && (now ^ before) & halves != 0);
    now | forcing.fold(0, |bits, (_, bit)| bits | bit) & forced(table)
}

/// The 24 V bits that the table uses in any column.
fn forced(table: &PhaseTable) -> u8 {
    table.columns.iter().fold(0, |bits, column| bits | column) & FORCING
}

/// Angle of the field in eighths of an electrical cycle, 0 … 7; none if no winding pulls.
pub fn angle(byte: u8) -> Option<u8> {
    let pull = |(halves, _): (u8, u8)| match byte & halves {
        only if only == halves & 0b0101 => 1,
        only if only == halves & 0b1010 => -1,
        _ => 0,
    };
    match (pull(WINDING[0]), pull(WINDING[1])) {
        (1, 0) => Some(0),
        (1, -1) => Some(1),
        (0, -1) => Some(2),
        (-1, -1) => Some(3),
        (-1, 0) => Some(4),
        (-1, 1) => Some(5),
        (0, 1) => Some(6),
        (1, 1) => Some(7),
        _ => None,
    }
}

/// Shortest rotation between two angles, −3 … 4 eighths. At 4, the field is straight across and does not
/// pull.
pub fn turn(from: i64, to: i64) -> i64 {
    let forward = to.saturating_sub(from).rem_euclid(8);
    if forward > 4 { forward - 8 } else { forward }
}

/// Electrical cycles per cycle of the table, at least 1; each is four full steps. For a table that [`check`]
/// refuses, a guess.
pub fn turns(table: &PhaseTable) -> i64 {
    let angles: Vec<i64> = table.columns.iter().filter_map(|byte| angle(*byte)).map(i64::from).collect();
    let next = angles.iter().cycle().skip(1);
    let way: i64 = angles.iter().zip(next).map(|(from, to)| turn(*from, *to).abs()).sum();
    (way / 8).max(1)
}

/// Checks that `table` may drive a motor: warnings, or all errors, each with the setting's `key`. Columns
/// count from 1.
pub fn check(key: &str, table: &PhaseTable) -> Result<Vec<Diagnostic>, Vec<Diagnostic>> {
    let named = |diagnostics: Vec<Diagnostic>| {
        diagnostics.into_iter().map(|diagnostic| diagnostic.with("key", key)).collect()
    };
    let error = |code: &str| Diagnostic::error(code);
    let length = table.columns.len();
    if !(1..=MOST_COLUMNS).contains(&length) {
        let diagnostic = error(code!("phases.length")).with("columns", length).with("most", MOST_COLUMNS);
        return Err(named(vec![diagnostic]));
    }
    let mut refusals: Vec<Diagnostic> = table
        .columns
        .iter()
        .enumerate()
        .flat_map(|(index, byte)| column_refusals(index + 1, *byte))
        .collect();
    if refusals.is_empty() {
        refusals.extend(forcing_refusals(table));
        match rotation(table) {
            Ok(warnings) if refusals.is_empty() => return Ok(named(warnings)),
            Ok(_) => {}
            Err(wrong) => refusals.extend(wrong),
        }
    }
    Err(named(refusals))
}

fn column_refusals(column: usize, byte: u8) -> Vec<Diagnostic> {
    let at = |code: &str| Diagnostic::error(code).with("column", column);
    let mut diagnostics = Vec::new();
    if byte & !(WINDINGS | FORCING) != 0 {
        diagnostics.push(at(code!("phases.unused_bit")).with("byte", format!("{byte:02X}")));
    }
    for (winding, (halves, bit)) in (1..).zip(WINDING) {
        if byte & halves == halves {
            diagnostics.push(at(code!("phases.both_halves")).with("winding", winding));
        }
        if byte & halves == 0 && byte & bit != 0 {
            diagnostics.push(at(code!("phases.forcing_undriven")).with("winding", winding));
        }
    }
    if byte & WINDINGS == 0 {
        diagnostics.push(at(code!("phases.nothing_driven")));
    }
    diagnostics
}

/// If any column has the 24 V bit of a winding, exactly the columns that switch it, going forward, must have
/// the bit.
fn forcing_refusals(table: &PhaseTable) -> Vec<Diagnostic> {
    let mut diagnostics = Vec::new();
    for step in 1..=table.columns.len() {
        let position = step as i64;
        let (printed, due) = (column(table, position), byte(table, position, column(table, position - 1)));
        for (winding, (_, bit)) in (1..).zip(WINDING) {
            if (printed ^ due) & bit != 0 {
                let code = if printed & bit == 0 {
                    code!("phases.forcing_missing")
                } else {
                    code!("phases.forcing_extra")
                };
                diagnostics.push(Diagnostic::error(code).with("column", step).with("winding", winding));
            }
        }
    }
    diagnostics
}

/// The field must turn in one direction, at most a quarter turn per step, and close after whole cycles.
fn rotation(table: &PhaseTable) -> Result<Vec<Diagnostic>, Vec<Diagnostic>> {
    let at = |position: i64| angle(column(table, position)).map_or(0, i64::from);
    let moves: Vec<(usize, i64)> = (1..=table.columns.len())
        .map(|step| (step, turn(at(step as i64 - 1), at(step as i64))))
        .filter(|(_, turn)| *turn != 0)
        .collect();
    let error = |code: &str| Diagnostic::error(code);
    let sum: i64 = moves.iter().map(|(_, turn)| turn).sum();
    let too_far = moves.iter().filter(|(_, turn)| turn.abs() > 2);
    let mut refusals: Vec<Diagnostic> = too_far
        .map(|(column, turn)| {
            error(code!("phases.jump")).with("column", column).with("degrees", turn.abs() * 45)
        })
        .collect();
    if moves.is_empty() {
        refusals.push(error(code!("phases.never_turns")));
    } else if refusals.is_empty() {
        let forward = if sum == 0 { moves[0].1.signum() } else { sum.signum() };
        let back = moves.iter().filter(|(_, turn)| turn.signum() != forward);
        refusals.extend(back.map(|(column, _)| error(code!("phases.turns_back")).with("column", column)));
    }
    if !refusals.is_empty() {
        return Err(refusals);
    }
    let backwards = (sum < 0).then(|| warning!("phases.backwards", ..));
    Ok(backwards.into_iter().collect())
}

/// Commutation of one motor: its position and output byte.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Commutator {
    table: PhaseTable,
    steps: i64,
    byte: u8,
}

impl Commutator {
    /// At rest on the column of position `steps`, without forcing.
    pub fn new(table: PhaseTable, steps: i64) -> Self {
        let byte = column(&table, steps) & WINDINGS;
        Self { table, steps, byte }
    }

    pub fn steps(&self) -> i64 {
        self.steps
    }

    /// Current output byte.
    pub fn byte(&self) -> u8 {
        self.byte
    }

    /// Steps to the next or previous column. Returns the output byte.
    pub fn step(&mut self, forward: bool) -> u8 {
        self.steps = self.steps.saturating_add(if forward { 1 } else { -1 });
        self.byte = byte(&self.table, self.steps, self.byte);
        self.byte
    }

    /// An interrupt without a step: hold at 5 V. Returns the output byte.
    pub fn hold(&mut self) -> u8 {
        self.byte &= WINDINGS;
        self.byte
    }
}
