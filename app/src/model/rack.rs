//! The rack's tools while they are edited: one line each, until all are applied.
//!
//! ```text
//! T3  drill  0.8  …  life 2000      a typed cell ─▶ replaces that word of the line ─▶ draft of `rack.tools`
//! ```
//!
//! Text that is not a number stays as typed and is refused by the settings.

use crate::format;
use annulus_core::machine::{Machine, TOOL_FIELDS, TOOL_FORMS};

pub const RACK_KEY: &str = "rack.tools";
/// Columns of every line, in this order.
pub const NUMBER: &str = "number";
pub const FORM: &str = "form";
pub const DIAMETER: &str = "diameter";
const VEE: &str = " tip 0.1 angle 30";

/// The edited lines, else those of the machine.
pub fn lines(typed: Option<&String>, machine: &Machine) -> Vec<String> {
    match typed {
        Some(text) => text.lines().map(str::to_owned).collect(),
        None => machine.rack.iter().map(ToString::to_string).collect(),
    }
}

pub fn cell(line: &str, column: &str) -> String {
    let mut words = line.split_whitespace();
    let fixed = [NUMBER, FORM, DIAMETER].iter().position(|fixed| *fixed == column);
    let word = match fixed {
        Some(at) => words.nth(at),
        None => words.skip_while(|word| *word != column).nth(1),
    };
    let word = word.unwrap_or_default();
    if column == NUMBER { word.trim_start_matches('T') } else { word }.to_owned()
}

/// The line with `text` in a column; empty text removes an optional field.
pub fn edited(line: &str, column: &str, text: &str) -> String {
    let number = format::typed(text).map(|number| number.to_string());
    let text = number.unwrap_or_else(|| text.split_whitespace().collect());
    let of = |wanted: &str| if wanted == column { text.clone() } else { cell(line, wanted) };
    let said = |text: String| if text.is_empty() { "?".to_owned() } else { text };
    let form = said(of(FORM));
    let mut out = format!("T{} {form} {}", said(of(NUMBER)), said(of(DIAMETER)));
    let is_vee = form == TOOL_FORMS[2];
    for field in TOOL_FIELDS {
        let value = of(field.key);
        if !value.is_empty() && (is_vee || !["tip", "angle"].contains(&field.key)) {
            out += &format!(" {} {value}", field.key);
        }
    }
    if is_vee && cell(line, FORM) != form { out + VEE } else { out }
}

pub fn added(mut lines: Vec<String>) -> Vec<String> {
    let numbers = lines.iter().filter_map(|line| cell(line, NUMBER).parse::<u32>().ok());
    let next = numbers.max().unwrap_or(0).saturating_add(1);
    lines.push(format!("T{next} {} 1", TOOL_FORMS[0]));
    lines
}
