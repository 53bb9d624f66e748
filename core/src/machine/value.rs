//! Values of settings, and the rows of their table.

use super::Machine;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The value of a setting in files and messages.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// In the setting's unit.
    Number(f64),
    /// A word or a line of text.
    Text(String),
    /// In the setting's unit.
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

/// Type and range of a value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ValueKind {
    /// Text of at most this many characters.
    Text(usize),
    /// A number from … to ….
    Number(f64, f64),
    /// An integer from … to ….
    Whole(f64, f64),
    /// One of these words.
    Choice(&'static [&'static str]),
    /// At most 64 numbers, each from … to ….
    Numbers(f64, f64),
    /// At most 64 integers, each from … to ….
    Wholes(f64, f64),
    /// The tools of a tool list, one per line ([`super::RackTool`]).
    Tools,
}

/// One row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Section and name, for example `x.max_speed`.
    pub key: &'static str,
    /// Unit of the numbers; empty for words.
    pub unit: &'static str,
    pub kind: ValueKind,
    /// True if the step stream depends on it, so that it is part of the fingerprint.
    pub shapes_stream: bool,
    pub(super) get: fn(&Machine) -> Value,
    pub(super) set: fn(&mut Machine, &Value),
}

impl Setting {
    /// The value in `machine`.
    pub fn value(&self, machine: &Machine) -> Value {
        (self.get)(machine)
    }

    /// Message key of the name.
    pub fn name_key(&self) -> String {
        format!("setting.{}", self.key.replace('.', "_"))
    }

    /// Message key of what the name doesn't say.
    pub fn help_key(&self) -> String {
        format!("setting_help.{}", self.key.replace('.', "_"))
    }
}

pub(super) fn number(value: &Value) -> f64 {
    if let Value::Number(number) = value { *number } else { 0.0 }
}

pub(super) fn text(value: &Value) -> &str {
    if let Value::Text(text) = value { text } else { "" }
}
