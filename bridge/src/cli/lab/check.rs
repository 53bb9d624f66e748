//! `annulus lab check`: compares Annulus with numbers computed elsewhere.

use super::super::files::trouble;
use super::super::{Answer, Refusal, sentence};
use crate::lab::{self, Report, Tally};
use annulus_core::error;
use serde_json::{Value, json};
use std::fmt::{Display, Write as _};
use std::fs;
use std::io::{self, Read as _};
use std::path::{Path, PathBuf};

/// Arguments of `annulus lab check`.
#[derive(Debug, clap::Args)]
pub(crate) struct CheckArgs {
    /// Check these JSON files of expected numbers.
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
}

pub(crate) fn run(args: &CheckArgs) -> Result<Answer, Refusal> {
    let mut reports = Vec::new();
    for path in &args.files {
        let name = path.display().to_string();
        let text = read(path, &name)?;
        reports.push((name.clone(), lab::check(&name, &text).map_err(Refusal::content)?));
    }
    let cases: usize = reports.iter().map(|(_, report)| report.cases.len()).sum();
    let within: usize = reports.iter().map(|(_, report)| report.within()).sum();
    let object = json!({
        "cases": cases,
        "within": within,
        "files": reports.iter().map(|(name, report)| file_object(name, report)).collect::<Vec<_>>(),
    });
    let text: String = reports.iter().map(|(name, report)| file_text(name, report)).collect();
    let why = error!("lab.outside", outside = cases - within, cases = cases);
    Ok(Answer::new(&object, text).with_error((within < cases).then_some(why)))
}

/// Reads a file of limited size.
pub(super) fn read(path: &Path, name: &str) -> Result<String, Refusal> {
    let trouble = |error: io::Error| trouble(path, &error);
    let mut bytes = Vec::new();
    let file = fs::File::open(path).map_err(trouble)?;
    file.take(lab::MOST_BYTES + 1).read_to_end(&mut bytes).map_err(trouble)?;
    if bytes.len() as u64 > lab::MOST_BYTES {
        let why = error!("lab.too_big", ..).at(name, 0, 0);
        return Err(Refusal::content(why.with("file", name).with("megabytes", lab::MOST_BYTES >> 20)));
    }
    String::from_utf8(bytes).map_err(|error| {
        let before = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = before.iter().filter(|byte| **byte == b'\n').count() + 1;
        let column = before.iter().rev().take_while(|byte| **byte != b'\n').count() + 1;
        let short = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
        let why = error!("lab.not_json", what = "a byte that is no UTF-8 text");
        Refusal::content(why.at(name, short(line), short(column)))
    })
}

/// The largest deviation of a case, relative to its tolerance; null if a value that must be equal differs.
fn ratio(case: &Tally) -> Option<f64> {
    let ratio = case.worst.as_ref().map_or(0.0, |worst| worst.ratio);
    ratio.is_finite().then_some(ratio)
}

fn file_object(name: &str, report: &Report) -> Value {
    let case = |case: &Tally| {
        json!({ "id": case.id, "within": case.is_within(), "values": case.values,
            "worst_ratio": ratio(case), "worst": case.worst })
    };
    let cases: Vec<Value> = report.cases.iter().map(case).collect();
    json!({ "file": name, "schema": report.schema, "cases": report.cases.len(), "within": report.within(),
        "results": cases })
}

fn file_text(name: &str, report: &Report) -> String {
    let mut out = format!("{name} ({})\n", report.schema);
    let widest = report.cases.iter().map(|case| case.id.chars().count()).max().unwrap_or(0);
    for case in &report.cases {
        let mark = if case.is_within() { "  " } else { "! " };
        let _ = write!(out, "{mark}{:widest$}  {:>5}  ", case.id, case.values);
        match &case.worst {
            None => out.push_str("0\n"),
            Some(worst) if case.is_within() => {
                let _ = writeln!(out, "{:.1e}  {}", worst.ratio, worst.what);
            }
            Some(worst) => {
                let off =
                    if worst.ratio.is_finite() { format!("{:.1e}", worst.ratio) } else { "≠".to_owned() };
                let _ = writeln!(out, "{off}  {}: {} != {}", worst.what, worst.found, worst.expected);
            }
        }
    }
    let numbers: [(&str, &dyn Display); 2] = [("within", &report.within()), ("cases", &report.cases.len())];
    out + &sentence("lab.check", &numbers) + "\n"
}
