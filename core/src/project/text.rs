//! Common parts of all TOML files of Annulus: values, and positions of errors.

use crate::machine::Value;
use toml::de::DeValue;

/// Converts a TOML value. An unsupported kind becomes a text with the name of that kind, which every row
/// refuses.
pub fn value(found: &DeValue<'_>) -> Value {
    match found {
        DeValue::String(text) => Value::Text(text.to_string()),
        DeValue::Array(items) => {
            let numbers: Vec<_> = items.iter().filter_map(|item| number(item.get_ref())).collect();
            let lines: Vec<_> =
                items.iter().filter_map(|item| item.get_ref().as_str().map(str::to_owned)).collect();
            if numbers.len() == items.len() {
                Value::Numbers(numbers)
            } else if lines.len() == items.len() {
                Value::Texts(lines)
            } else {
                Value::Text("a list".to_owned())
            }
        }
        other => number(other).map_or_else(|| Value::Text(other.type_str().to_owned()), Value::Number),
    }
}

fn number(found: &DeValue<'_>) -> Option<f64> {
    match found {
        DeValue::Integer(number) => i64::from_str_radix(&number.as_str().replace('_', ""), number.radix())
            .ok()
            .map(|whole| whole as f64),
        DeValue::Float(number) => number.as_str().replace('_', "").parse::<f64>().ok(),
        _ => None,
    }
}

/// Line and column of the byte `at`, both from 1; the column counts bytes.
pub fn line_and_column(bytes: &[u8], at: usize) -> (u32, u32) {
    let before = bytes.get(..at).unwrap_or(bytes);
    let line = before.iter().filter(|byte| **byte == b'\n').count();
    let column = before.iter().rev().take_while(|byte| **byte != b'\n').count();
    (u32::try_from(line + 1).unwrap_or(u32::MAX), u32::try_from(column + 1).unwrap_or(u32::MAX))
}

pub fn literal(value: &Value) -> String {
    match value {
        Value::Number(number) => number.to_string(),
        Value::Text(text) => toml::Value::String(text.clone()).to_string(),
        Value::Numbers(numbers) => {
            let words: Vec<_> = numbers.iter().map(f64::to_string).collect();
            format!("[{}]", words.join(", "))
        }
        Value::Texts(lines) => {
            let rows: Vec<_> = lines.iter().map(|line| toml::Value::String(line.clone())).collect();
            let rows: String = rows.iter().map(|row| format!("  {row},\n")).collect();
            format!("[\n{rows}]")
        }
    }
}
