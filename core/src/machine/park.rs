//! The park position, out of the way for loading and unloading boards.
//!
//! ```text
//! Z all the way up ─▶ spindle off ─▶ X and Y to the position       end of homing, or a custom position
//! ```

use super::field::{NONE, Setting, YES_NO, fields, words};
use super::value::ValueKind::Number;
use super::{Axis, Machine};
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::units::Length;

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Park {
    pub at: ParkAt,
    /// X and Y of the custom position, machine coordinates.
    pub place: [Length; 2],
    pub after_job: bool,
}

/// Kind of park position.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ParkAt {
    #[default]
    Home,
    Place,
}

words!(ParkAt: "home" => ParkAt::Home, "place" => ParkAt::Place);

/// The section "park" of the settings table.
pub(super) const ROWS: &[Setting] = fields! { Machine;
    ("park.at", "", ParkAt::KIND, NONE, park.at)
    ("park.x", "mm", Number(-2_000.0, 2_000.0), NONE, park.place[0])
    ("park.y", "mm", Number(-2_000.0, 2_000.0), NONE, park.place[1])
    ("park.after_job", "", YES_NO, NONE, park.after_job)
};

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
    use super::super::{Value, apply, virtual_drill};

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
