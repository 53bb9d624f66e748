//! The park position, out of the way for loading and unloading boards.
//!
//! ```text
//! Z all the way up ─▶ spindle off ─▶ X and Y to the position       end of homing, or a custom position
//! ```

use super::value::{Setting, Value, ValueKind, number};
use super::{Axis, Machine};
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::units::Length;

/// Park settings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Park {
    /// Which position.
    pub at: ParkAt,
    /// X and Y of the custom position, machine coordinates.
    pub place: [Length; 2],
    /// Park automatically after a job.
    pub after_job: bool,
}

/// Kind of park position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ParkAt {
    /// The rest position of homing.
    #[default]
    Home,
    /// The custom position.
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
            |m, v| m.park.place[$axis] = Length::from_mm(number(v))
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

/// Problems of the park position of `machine`; an unused custom position may be invalid.
pub(super) fn validate(machine: &Machine) -> Vec<Diagnostic> {
    let rows: [(&str, Length, &Axis); 2] =
        [("park.x", machine.park.place[0], &machine.x), ("park.y", machine.park.place[1], &machine.y)];
    let in_use = machine.park.at == ParkAt::Place;
    let outside = rows.into_iter().filter(|(_, at, axis)| in_use && !(axis.min..=axis.max).contains(at));
    outside
        .map(|(key, at, axis)| {
            let why = error!("machine.park_out_of_reach", key = key, value = at.mm(), ..);
            why.with("low", axis.min.mm()).with("high", axis.max.mm())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::{apply, virtual_drill};
    use super::*;

    #[test]
    fn unreachable_park_position_names_its_field() {
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
