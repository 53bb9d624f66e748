//! Settings that belong to the controller: how tool lengths are found, how tools are changed, and whether
//! opening the port may reset it. The pre-flight check reports them.

use crate::files::{File, Files};
use crate::journal::unsealed;
use crate::prepare::row;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::grbl::{
    CHANGER_KEY, LENGTH_KEY, RESET_KEY, ResetOnOpen, SETTER_KEY, ToolLengths, ToolMacro, ToolSetter,
};
use annulus_core::machine::{MILL_KEY, Value};
use annulus_core::wire::{PreflightRow, RowVerdict};
use annulus_core::{error, note};

/// Returns `true` for settings of the controller, `false` for those of the machine that jobs are planned
/// for.
pub(super) fn is_of_controller(key: &str) -> bool {
    [MILL_KEY, LENGTH_KEY, SETTER_KEY, RESET_KEY, CHANGER_KEY].contains(&key)
}

pub(super) fn lengths_of(kept: &[(String, Value)]) -> ToolLengths {
    let of = |wanted: &str| kept.iter().find(|(key, _)| key == wanted).map(|(_, value)| value);
    let setter = match of(SETTER_KEY) {
        Some(Value::Numbers(numbers)) => ToolSetter::of_numbers(numbers),
        _ => None,
    };
    let on_setter = matches!(of(LENGTH_KEY), Some(Value::Text(word)) if word == "setter");
    ToolLengths { on_setter, setter }
}

/// Whether opening the port may reset the controller.
pub(super) fn reset_of(kept: &[(String, Value)]) -> ResetOnOpen {
    let of = kept.iter().find_map(|(key, value)| match value {
        Value::Text(word) if key == RESET_KEY => ResetOnOpen::of(word),
        _ => None,
    });
    of.unwrap_or_default()
}

/// Whether opening the port may reset the controller, as the user chose.
pub fn reset_on_open(files: &mut impl Files) -> ResetOnOpen {
    let kept: Vec<(String, Value)> =
        unsealed(&files.read(File::ControllerSettings).unwrap_or_default()).unwrap_or_default();
    reset_of(&kept)
}

/// The tool-change macro; empty if the user changes tools.
pub(super) fn changer_of(kept: &[(String, Value)]) -> ToolMacro {
    let of = kept.iter().find_map(|(key, value)| match value {
        Value::Texts(lines) if key == CHANGER_KEY => {
            ToolMacro::of_lines(lines.iter().map(String::as_str)).ok()
        }
        _ => None,
    });
    of.unwrap_or_default()
}

/// Returns why a setting is invalid, if it is.
pub(super) fn refused((key, value): &(String, Value)) -> Option<Diagnostic> {
    if key == CHANGER_KEY {
        return match value {
            Value::Texts(lines) => ToolMacro::of_lines(lines.iter().map(String::as_str)).err(),
            // An empty list has no element type, so it arrives as numbers.
            Value::Numbers(none) if none.is_empty() => None,
            _ => Some(ToolMacro::bad(value)),
        };
    }
    if key == RESET_KEY {
        let is_one = matches!(value, Value::Text(word) if ResetOnOpen::of(word).is_some());
        return (!is_one).then(|| error!("grbl.no_such_reset", word = value));
    }
    let is_one = match value {
        Value::Text(word) if key == LENGTH_KEY => ["board", "setter"].contains(&word.as_str()),
        Value::Numbers(numbers) if key == SETTER_KEY => ToolSetter::of_numbers(numbers).is_some(),
        _ => ![LENGTH_KEY, SETTER_KEY].contains(&key.as_str()),
    };
    (!is_one).then(|| error!("setter.bad"))
}

/// The pre-flight row about tool lengths.
pub(super) fn length_row(lengths: &ToolLengths) -> Option<PreflightRow> {
    lengths.on_setter.then(|| match lengths.setter {
        None => row(RowVerdict::Fail, error!("setter.no_place")),
        Some(setter) => {
            let [x, y] = setter.place_mm.map(|mm| format!("{mm:.3}"));
            row(RowVerdict::Pass, note!("setter.measures", x = x, y = y))
        }
    })
}
