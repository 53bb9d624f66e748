//! The one table of machine settings (A11, C2): key, unit, range, meaning, how to get and set. The file, the page, the
//! manual and the tests all read it. The sentence for each key is `setting.<key with dots as underscores>` in the
//! locale tables.
//!
//! Comes in: keys and values. Goes out: a [`Machine`] or diagnostics naming the field. Does not know any file format.

use super::table::SECTIONS;
use super::tools::rack_of;
use super::{Machine, validate};
use crate::diagnostic::Diagnostic;
use crate::locale;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A setting's value as people write it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// A number in the setting's unit.
    Number(f64),
    /// A word or a line of text.
    Text(String),
    /// Several numbers in the setting's unit.
    Numbers(Vec<f64>),
    /// Several lines of text.
    Texts(Vec<String>),
}

impl fmt::Display for Value {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(out, "{number}"),
            Self::Text(text) => out.write_str(text),
            Self::Numbers(numbers) => {
                let words: Vec<_> = numbers.iter().map(f64::to_string).collect();
                out.write_str(&words.join(" "))
            }
            Self::Texts(lines) => out.write_str(&lines.join("\n")),
        }
    }
}

/// What a value may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ValueKind {
    /// Text of at most so many characters.
    Text(usize),
    /// A number from … to ….
    Number(f64, f64),
    /// A whole number from … to ….
    Whole(f64, f64),
    /// One of these words.
    Choice(&'static [&'static str]),
    /// A list of numbers, each from … to …, at most 64 of them.
    Numbers(f64, f64),
    /// The same of whole numbers.
    Wholes(f64, f64),
    /// The tools of a rack, a line each ([`super::RackTool`]).
    Tools,
}

/// Sections of the table that say how hardware is wired.
const WIRED: [&str; 4] = ["card.", "parallel.", "adapter.", "converter."];

/// Whether the setting `key` decides which hardware is touched: only the machine's file changes it, never a page.
pub fn is_in_file_only(key: &str) -> bool {
    ["machine.output", "machine.card_address"].contains(&key)
        || WIRED.iter().any(|section| key.starts_with(section))
}

/// Whether the setting `key` says how an adapter is wired: a page that drives it alone, without a file of the machine, changes that.
pub fn is_adapter_wiring(key: &str) -> bool {
    key.starts_with("adapter.") && key != "adapter.port"
}

/// One row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Section and name, for example `x.max_speed`.
    pub key: &'static str,
    /// Unit of the numbers, empty for words.
    pub unit: &'static str,
    /// What is allowed.
    pub kind: ValueKind,
    /// Whether the step stream depends on it, so that it belongs into the fingerprint.
    pub shapes_stream: bool,
    pub(super) get: fn(&Machine) -> Value,
    pub(super) set: fn(&mut Machine, &Value),
}

impl Setting {
    /// Its value in `machine`.
    pub fn value(&self, machine: &Machine) -> Value {
        (self.get)(machine)
    }

    /// Key of its sentence in the locale tables.
    pub fn sentence_key(&self) -> String {
        format!("setting.{}", self.key.replace('.', "_"))
    }

    /// Why `value` cannot be, if it cannot.
    fn refusal(&self, value: &Value) -> Option<Diagnostic> {
        self.kind.refusal(self.key, self.unit, value)
    }
}

impl ValueKind {
    /// Why `value` cannot be the value of `key`, which is in `unit`, if it cannot.
    pub fn refusal(self, key: &str, unit: &str, value: &Value) -> Option<Diagnostic> {
        let diagnostic = |what: &str| {
            let code = format!("machine.setting_{what}");
            let measure = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            let diagnostic = Diagnostic::error(&code).with("key", key).with("value", value);
            Some(diagnostic.with("unit", unit).with("measure", measure))
        };
        let inside = |number: f64, low: f64, high: f64| number.is_finite() && (low..=high).contains(&number);
        let range = |low: f64, high: f64| diagnostic("range").map(|r| r.with("low", low).with("high", high));
        match (self, value) {
            (ValueKind::Tools, rack) => rack_of(rack).err(),
            (ValueKind::Text(longest), Value::Text(text)) => {
                if text.chars().count() > longest || text.chars().any(char::is_control) {
                    return diagnostic("text").map(|r| r.with("longest", longest));
                }
                None
            }
            (ValueKind::Number(low, high), Value::Number(number)) => {
                if inside(*number, low, high) {
                    None
                } else {
                    range(low, high)
                }
            }
            (ValueKind::Whole(low, high), Value::Number(number)) => {
                if inside(*number, low, high) && libm::trunc(*number) == *number {
                    None
                } else {
                    range(low, high)
                }
            }
            (ValueKind::Choice(words), Value::Text(text)) => {
                if words.contains(&text.as_str()) {
                    return None;
                }
                diagnostic("choice").map(|r| r.with("words", words.join(", ")))
            }
            (ValueKind::Numbers(low, high), Value::Numbers(numbers)) => {
                if numbers.len() <= 64 && numbers.iter().all(|n| inside(*n, low, high)) {
                    return None;
                }
                range(low, high)
            }
            (ValueKind::Wholes(low, high), Value::Numbers(numbers)) => {
                let whole = |n: &f64| inside(*n, low, high) && libm::trunc(*n) == *n;
                if numbers.len() <= 64 && numbers.iter().all(whole) {
                    return None;
                }
                range(low, high)
            }
            (kind, Value::Text(text))
                if !matches!(kind, ValueKind::Choice(_)) && locale::has_two_marks(text) =>
            {
                diagnostic("marks")
            }
            _ => diagnostic("kind"),
        }
    }
}

/// Every setting in the order of the table.
pub fn settings() -> impl Iterator<Item = &'static Setting> {
    SECTIONS.iter().flat_map(|(_, rows)| rows.iter())
}

/// The setting called `key`, or that was called so once: a rack was a list of diameters before it was one of tools.
pub fn setting(key: &str) -> Option<&'static Setting> {
    let key = if key == "rack.bits" { "rack.tools" } else { key };
    settings().find(|setting| setting.key == key)
}

/// All values of `machine`, in the order of the table.
pub fn read(machine: &Machine) -> Vec<(String, Value)> {
    settings().map(|setting| (setting.key.to_owned(), setting.value(machine))).collect()
}

/// `machine` with `changes` made, or every reason why not. Nothing is changed when anything is refused.
pub fn apply(machine: &Machine, changes: &[(String, Value)]) -> Result<Machine, Vec<Diagnostic>> {
    let mut changed = machine.clone();
    let mut refusals = Vec::new();
    for (key, value) in changes {
        let Some(setting) = setting(key) else {
            refusals.push(Diagnostic::error("machine.setting_unknown").with("key", key));
            continue;
        };
        match setting.refusal(value) {
            Some(refusal) => refusals.push(refusal),
            None => (setting.set)(&mut changed, value),
        }
    }
    refusals.extend(validate(&changed));
    if refusals.is_empty() { Ok(changed) } else { Err(refusals) }
}

#[cfg(test)]
mod tests {
    use super::super::{presets, virtual_drill};
    use super::*;

    #[test]
    fn every_setting_survives_a_round_trip_and_has_a_sentence() {
        for (_, machine) in presets() {
            assert_eq!(apply(&virtual_drill(), &read(&machine)).unwrap(), machine);
        }
        for setting in settings() {
            let key = setting.sentence_key();
            assert!(crate::locale::lookup("en", &key).is_some(), "no sentence {key}");
        }
    }

    #[test]
    fn no_page_changes_the_wiring() {
        // Of every kind of output something is said that only the file may say; the virtual drill is wired to nothing.
        let Some(ValueKind::Choice(outputs)) = setting("machine.output").map(|row| row.kind) else {
            unreachable!()
        };
        let wired: Vec<_> = WIRED.iter().map(|section| section.trim_end_matches('.')).collect();
        let outputs: Vec<_> = outputs.iter().filter(|output| **output != "virtual").copied().collect();
        // And of the port that the spindle's converter is at.
        assert_eq!([&outputs[..], &["converter"]].concat(), wired);
        for section in WIRED {
            assert!(settings().filter(|row| row.key.starts_with(section)).count() > 3, "{section}");
        }
        let fixed = settings().map(|row| row.key).filter(|key| is_in_file_only(key));
        let others: Vec<_> =
            fixed.filter(|key| !WIRED.iter().any(|section| key.starts_with(section))).collect();
        assert_eq!(others, ["machine.output", "machine.card_address"]);
    }

    #[test]
    fn a_bad_value_names_its_field_and_changes_nothing() {
        let rows: [(&str, Value, &str); 17] = [
            ("x.max_speed", Value::Number(f64::NAN), "machine.setting_range"),
            ("x.max_speed", Value::Number(0.0), "machine.setting_range"),
            ("x.max_speed", Value::Text("fast".into()), "machine.setting_kind"),
            ("x.max_speed", Value::Text("1,234.5".into()), "machine.setting_marks"),
            ("x.home_end", Value::Text("left".into()), "machine.setting_choice"),
            ("x.min", Value::Number(900.0), "machine.range_inside_out"),
            ("stroke.feed", Value::Number(400.0), "machine.feed_too_fast"),
            ("motion.order", Value::Number(0.0), "machine.setting_range"),
            ("motion.down_speed", Value::Number(-1.0), "machine.setting_range"),
            ("motion.down_speed", Value::Number(4000.0), "machine.faster_than_drive"),
            ("overlap.clear", Value::Number(2.0), "machine.clear_too_high"),
            ("stroke.end", Value::Text("sensor".into()), "machine.overlap_without_count"),
            ("stroke.feed_height", Value::Number(3.0), "machine.feed_height_too_high"),
            ("drive.pulse_width", Value::Number(11.0), "machine.pulse_too_long"),
            ("drive.period", Value::Numbers(vec![7.0, 4.0]), "automaton.lengths"),
            ("x.phases", Value::Numbers(vec![5.5]), "machine.setting_range"),
            ("x.colour", Value::Number(1.0), "machine.setting_unknown"),
        ];
        for (key, value, code) in rows {
            let refusals = apply(&virtual_drill(), &[(key.to_owned(), value)]).unwrap_err();
            assert_eq!(refusals[0].code, code);
            assert!(refusals[0].message("en").contains(key), "{}", refusals[0].message("en"));
        }
    }
}
