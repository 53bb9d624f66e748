//! The tools of the rack as they are typed: a line each, until all of them are applied.
//!
//! ```text
//! T3  drill  0.8  …  life 2000      one cell typed ─▶ that word of the line is another one ─▶ draft of `rack.tools`
//! ```
//!
//! Comes in: lines, a row, a column, text. Goes out: lines. What is no number stays as it was typed, and is refused as such. Does not
//! know what a tool has done.

use crate::format;
use annulus_core::machine::{Machine, TOOL_FIELDS, TOOL_FORMS};

/// The setting.
pub const RACK_KEY: &str = "rack.tools";
/// Columns that every line has, in its order.
pub const NUMBER: &str = "number";
/// The form.
pub const FORM: &str = "form";
/// The diameter.
pub const DIAMETER: &str = "diameter";
/// What a V-bit has as long as nobody said.
const VEE: &str = " tip 0.1 angle 30";

/// The lines as they are now: typed, else those of the machine.
pub fn lines(typed: Option<&String>, machine: &Machine) -> Vec<String> {
    match typed {
        Some(text) => text.lines().map(str::to_owned).collect(),
        None => machine.rack.iter().map(ToString::to_string).collect(),
    }
}

/// What stands in a column of a line.
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

/// The line with `text` in a column; with none there, nothing is said of it.
pub fn edited(line: &str, column: &str, text: &str) -> String {
    let number = format::typed(text).map(|number| number.to_string());
    let text = number.unwrap_or_else(|| text.split_whitespace().collect());
    let of = |wanted: &str| if wanted == column { text.clone() } else { cell(line, wanted) };
    let said = |text: String| if text.is_empty() { "?".to_owned() } else { text };
    let form = said(of(FORM));
    let mut out = format!("T{} {form} {}", said(of(NUMBER)), said(of(DIAMETER)));
    let is_vee = form == TOOL_FORMS[2];
    for field in &TOOL_FIELDS {
        let value = of(field.word);
        if !value.is_empty() && (is_vee || !["tip", "angle"].contains(&field.word)) {
            out += &format!(" {} {value}", field.word);
        }
    }
    if is_vee && cell(line, FORM) != form { out + VEE } else { out }
}

/// The lines with one more: a drill under the next number.
pub fn added(mut lines: Vec<String>) -> Vec<String> {
    let numbers = lines.iter().filter_map(|line| cell(line, NUMBER).parse::<u32>().ok());
    let next = numbers.max().unwrap_or(0).saturating_add(1);
    lines.push(format!("T{next} {} 1", TOOL_FORMS[0]));
    lines
}
