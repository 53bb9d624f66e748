//! Values of fields, and their types.

use crate::locale::typed;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The value of a field in files and messages.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Value {
    /// In the field's unit.
    Number(f64),
    Text(String),
    /// In the field's unit.
    Numbers(Vec<f64>),
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

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ValueKind {
    /// Text of at most this many characters.
    Text(usize),
    Number(f64, f64),
    Whole(f64, f64),
    Choice(&'static [&'static str]),
    /// At most 64 numbers, each from … to ….
    Numbers(f64, f64),
    /// At most 64 integers, each from … to ….
    Wholes(f64, f64),
    /// The tools of a tool list, one per line ([`super::RackTool`]).
    Tools,
}

impl ValueKind {
    /// Least and greatest number.
    pub const fn range(self) -> Option<(f64, f64)> {
        match self {
            Self::Number(low, high)
            | Self::Whole(low, high)
            | Self::Numbers(low, high)
            | Self::Wholes(low, high) => Some((low, high)),
            Self::Text(_) | Self::Choice(_) | Self::Tools => None,
        }
    }

    /// The value of a typed text; text that isn't a number stays text, which [`Self::refusal`] refuses.
    pub fn typed(self, text: &str) -> Value {
        let plain = || Value::Text(text.to_owned());
        match self {
            Self::Text(_) | Self::Choice(_) => plain(),
            Self::Number(..) | Self::Whole(..) => typed(text).map_or_else(plain, Value::Number),
            Self::Numbers(..) | Self::Wholes(..) => {
                let numbers: Option<Vec<_>> = text.split_whitespace().map(typed).collect();
                numbers.map_or_else(plain, Value::Numbers)
            }
            Self::Tools => Value::Texts(text.lines().map(str::to_owned).collect()),
        }
    }
}

pub(crate) fn number(value: &Value) -> f64 {
    if let Value::Number(number) = value { *number } else { 0.0 }
}

pub(crate) fn text(value: &Value) -> &str {
    if let Value::Text(text) = value { text } else { "" }
}
