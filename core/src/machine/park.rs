//! Where the head is parked (C7): out of the way, so that a board can be laid on and taken off.
//!
//! ```text
//! Z all the way up ─▶ spindle off ─▶ X and Y to the place       where homing ends, or a place of the machine's own
//! ```
//!
//! Goes out: the place as data, the section "park" of the settings table, and every reason why it cannot be. Does not know when the
//! head goes there.

use super::settings::{Setting, Value, ValueKind};
use super::wiring::whole;
use super::{Axis, Machine};
use crate::diagnostic::Diagnostic;
use crate::units::Length;

/// Where the head is parked, and whether without being asked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Park {
    /// Which place it is.
    pub at: ParkAt,
    /// X and Y of a place of its own, machine coordinates.
    pub place: [Length; 2],
    /// Whether the head goes there by itself when a job is done.
    pub after_job: bool,
}

/// Which place the head is parked at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ParkAt {
    /// Where homing leaves it.
    #[default]
    Home,
    /// A place of its own.
    Place,
}

macro_rules! row {
    ($key:literal, $unit:literal, $kind:expr, $get:expr, $set:expr) => {
        Setting { key: $key, unit: $unit, kind: $kind, shapes_stream: false, get: $get, set: $set }
    };
}
macro_rules! along {
    ($key:literal, $axis:literal) => {
        row!(
            $key,
            "mm",
            ValueKind::Number(-2_000.0, 2_000.0),
            |m| Value::Number(m.park.place[$axis].mm()),
            |m, v| m.park.place[$axis] = Length::from_mm(whole(v))
        )
    };
}

/// The section "park" of the settings table.
pub(super) const ROWS: &[Setting] = &[
    row!(
        "park.at",
        "",
        ValueKind::Choice(&["home", "place"]),
        |m| Value::Text(if m.park.at == ParkAt::Home { "home" } else { "place" }.to_owned()),
        |m, v| m.park.at = if is_word(v, "place") { ParkAt::Place } else { ParkAt::Home }
    ),
    along!("park.x", 0),
    along!("park.y", 1),
    row!(
        "park.after_job",
        "",
        ValueKind::Choice(&["no", "yes"]),
        |m| Value::Text(if m.park.after_job { "yes" } else { "no" }.to_owned()),
        |m, v| m.park.after_job = is_word(v, "yes")
    ),
];

fn is_word(value: &Value, word: &str) -> bool {
    matches!(value, Value::Text(text) if text == word)
}

/// Every reason why the head of `machine` cannot be parked; a place that is not in use may be any.
pub(super) fn validate(machine: &Machine) -> Vec<Diagnostic> {
    let rows: [(&str, Length, &Axis); 2] =
        [("park.x", machine.park.place[0], &machine.x), ("park.y", machine.park.place[1], &machine.y)];
    let in_use = machine.park.at == ParkAt::Place;
    let outside = rows.into_iter().filter(|(_, at, axis)| in_use && !(axis.min..=axis.max).contains(at));
    outside
        .map(|(key, at, axis)| {
            let why = Diagnostic::error("machine.park_out_of_reach").with("key", key).with("value", at.mm());
            why.with("low", axis.min.mm()).with("high", axis.max.mm())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::{apply, virtual_drill};
    use super::*;

    #[test]
    fn a_place_that_is_out_of_reach_names_its_field() {
        let found = |at: &str, x: f64, y: f64| {
            let changes = [
                ("park.at", Value::Text(at.to_owned())),
                ("park.x", Value::Number(x)),
                ("park.y", Value::Number(y)),
            ];
            let changes: Vec<_> = changes.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
            let refusals = apply(&virtual_drill(), &changes).err().unwrap_or_default();
            refusals
                .into_iter()
                .map(|why| {
                    let message = why.message("en");
                    assert!(!message.contains('{') && !why.advice("en").is_empty(), "{message}");
                    (why.code.clone(), why.argument(&["key"]).unwrap_or_default().to_owned())
                })
                .collect::<Vec<_>>()
        };
        let outside = |key: &str| ("machine.park_out_of_reach".to_owned(), key.to_owned());
        assert_eq!(found("place", 0.0, 200.0), []);
        assert_eq!(found("place", -0.001, 0.0), [outside("park.x")]);
        assert_eq!(found("place", 301.0, 201.0), [outside("park.x"), outside("park.y")]);
        assert_eq!(found("home", -500.0, 900.0), [], "nobody goes there");
    }
}
