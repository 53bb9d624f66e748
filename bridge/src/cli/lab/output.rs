//! Prints a computed case as a short table, JSON, CSV or an SVG plot, or writes it to a file.

use super::super::{Answer, Refusal, sentence};
use annulus_core::error;
use annulus_core::plot::{self, Plot, PlotAxis, PlotMark, PlotPanel, Series};
use serde_json::{Value, json};
use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

/// Options of the output.
#[derive(Debug, clap::Args)]
pub(super) struct OutputArgs {
    /// Print the samples as CSV.
    #[arg(long, conflicts_with = "svg")]
    csv: bool,
    /// Print a plot as SVG.
    #[arg(long)]
    svg: bool,
    /// Write to this file: .svg, .csv or .json.
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Set the width of the plot, in pixels.
    #[arg(long, default_value_t = 900.0, value_name = "PX", allow_negative_numbers = true)]
    width: f64,
    /// Set the height of the plot, in pixels.
    #[arg(long, default_value_t = 760.0, value_name = "PX", allow_negative_numbers = true)]
    height: f64,
}

/// A computed case.
pub(super) struct ComputedCase {
    /// Inputs and results as JSON, without the samples.
    pub(super) object: Value,
    /// Names and values of the text output.
    pub(super) rows: Vec<(String, String)>,
    /// Names of the columns, with their units.
    pub(super) columns: Vec<String>,
    /// The samples, one number per column; `None` for an empty cell.
    pub(super) samples: Vec<Vec<Option<f64>>>,
    pub(super) plot: Plot,
}

/// Looks up a word or sentence of the Lab.
pub(super) fn word(key: &str) -> String {
    sentence(&format!("lab.word.{key}"), &[])
}

/// A panel over time in ms.
pub(super) fn panel(quantity: &str, unit: &str, series: Vec<Series>, marks: Vec<PlotMark>) -> PlotPanel {
    let (x, y) = (PlotAxis::new(&word("time"), "ms"), PlotAxis::new(&word(quantity), unit));
    PlotPanel { x, y, series, marks }
}

/// Prints or writes the case as requested.
pub(super) fn deliver(args: &OutputArgs, mut sheet: ComputedCase) -> Result<Answer, Refusal> {
    sheet.object["columns"] = json!(sheet.columns);
    sheet.object["samples"] = json!(sheet.samples);
    let Some(path) = &args.output else {
        let text = match (args.csv, args.svg) {
            (true, _) => csv(&sheet),
            (_, true) => plot::svg(&sheet.plot, args.width, args.height),
            _ => table(&sheet.rows),
        };
        return Ok(Answer::new(&sheet.object, text));
    };
    let name = path.display().to_string();
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    let bytes = match ending.as_deref() {
        Some("svg") => plot::svg(&sheet.plot, args.width, args.height),
        Some("csv") => csv(&sheet),
        Some("json") => format!("{:#}\n", sheet.object),
        _ => return Err(Refusal::usage(error!("lab.ending", file = name))),
    };
    fs::write(path, bytes).map_err(|error| {
        let why = error!("lab.not_written", file = &name, reason = error);
        Refusal::surroundings(why)
    })?;
    sheet.object["file"] = json!(name);
    sheet.rows.push((word("written"), name));
    Ok(Answer::new(&sheet.object, table(&sheet.rows)))
}

fn table(rows: &[(String, String)]) -> String {
    let widest = rows.iter().map(|(what, _)| what.chars().count()).max().unwrap_or(0);
    rows.iter().map(|(what, how_much)| format!("{what:widest$}  {how_much}\n")).collect()
}

/// Comma-separated, with a header line, and CRLF line ends as in RFC 4180.
fn csv(sheet: &ComputedCase) -> String {
    let quoted = |name: &String| {
        if name.contains([',', '"', '\n']) {
            format!("\"{}\"", name.replace('"', "\"\""))
        } else {
            name.clone()
        }
    };
    let mut out = sheet.columns.iter().map(quoted).collect::<Vec<_>>().join(",") + "\r\n";
    for row in &sheet.samples {
        let mut comma = "";
        for value in row {
            let _ = write!(out, "{comma}");
            if let Some(value) = value.filter(|value| value.is_finite()) {
                let _ = write!(out, "{value}");
            }
            comma = ",";
        }
        out.push_str("\r\n");
    }
    out
}

/// A number as text, with six significant digits.
pub(super) fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let digits = 5 - value.abs().log10().floor() as i32;
    if !(0..=9).contains(&digits) {
        return format!("{value:.5e}");
    }
    let text = format!("{value:.*}", digits as usize);
    let trimmed = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    trimmed.to_owned()
}

/// Seconds as text, in milliseconds.
pub(super) fn ms(seconds: f64) -> String {
    format!("{} ms", short(1e3 * seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn printed_numbers_have_six_significant_digits() {
        let rows = [
            (0.0, "0"),
            (1.0, "1"),
            (0.1234567, "0.123457"),
            (-1234.5678, "-1234.57"),
            (100.0, "100"),
            (2e9, "2.00000e9"),
            (1.5e-7, "1.50000e-7"),
        ];
        for (value, text) in rows {
            assert_eq!(short(value), text);
        }
        assert_eq!(ms(0.05583333333), "55.8333 ms");
    }
}
