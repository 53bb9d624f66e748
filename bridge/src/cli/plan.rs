//! Chooses tools and puts the holes in order.

use super::{Answer, Exit, Refusal, diagnostic_lines, diagnostic_objects, rounded, tool_object};
use crate::cli::job;
use annulus_core::cam::figures::Figures;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::travel_mm;
use annulus_core::locale;
use annulus_core::wire::program;
use serde_json::{Value, json};

/// Arguments of `annulus plan`.
#[derive(Debug, clap::Args)]
pub(crate) struct PlanArgs {
    #[command(flatten)]
    pub(crate) job: super::JobArgs,
    /// Write the program to this file.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<std::path::PathBuf>,
}

pub(crate) fn run(args: &PlanArgs) -> Result<Answer, Refusal> {
    let (job, figures) = job::plan(&args.job)?;
    let bytes = program::encode(&job.program);
    if let Some(path) = &args.output {
        job::write_output(path, &bytes)?;
    }
    let rows = figures.rows.iter();
    let tools: Vec<Value> = rows
        .map(|row| {
            json!({ "n": row.n, "file_diameter_mm": rounded(row.size.mm()),
                "rack_diameter_mm": rounded(row.bit.diameter.mm()), "holes": row.holes,
                "tool": tool_object(&row.bit), "slots": row.slots, "toolpaths": row.toolpaths })
        })
        .collect();
    let object = json!({
        "travel_before_mm": rounded(figures.travel_before_mm),
        "travel_after_mm": rounded(figures.travel_after_mm),
        "travel_mm": rounded(travel_mm(&job.program)),
        "hop_time_before_s": rounded(figures.hop_time_before_s),
        "hop_time_after_s": rounded(figures.hop_time_after_s),
        "tools": tools,
        "iterations": figures.iterations,
        "program_sha256": program::key(&bytes),
        "diagnostics": diagnostic_objects(&job.diagnostics),
    });
    Ok(Answer { object, text: text(&figures, &job.diagnostics), exit: Exit::Done })
}

fn text(figures: &Figures, diagnostics: &[Diagnostic]) -> String {
    let say = |key: &str, args: &[(&str, String)]| {
        let args: Vec<_> = args.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
        locale::text("en", key, &args) + "\n"
    };
    let rows = &figures.rows;
    let holes: usize = rows.iter().map(|row| row.holes).sum();
    let bits = rows.last().map_or(0, |row| row.n);
    let mut out = say("plan.report.head", &[("holes", holes.to_string()), ("bits", bits.to_string())]);
    for row in rows {
        let (n, bit) = (format!("{:>3}", row.n), format!("{:<14}", row.bit.title("en")));
        let size = format!("{:.3}", row.size.mm());
        for (key, count) in [("bit", row.holes), ("slots", row.slots)].into_iter().filter(|row| row.1 > 0) {
            let count = format!("{count:>6}");
            let args =
                [("n", n.clone()), ("bit", bit.clone()), ("size", size.clone()), ("holes", count.clone())];
            out += &say(&format!("plan.report.{key}"), &args);
        }
    }
    let lengths = [("before", figures.travel_before_mm), ("after", figures.travel_after_mm)];
    out += &say("plan.report.travel", &lengths.map(|(name, mm)| (name, format!("{mm:.1}"))));
    let times = [("before", figures.hop_time_before_s), ("after", figures.hop_time_after_s)];
    out += &say("plan.report.time", &times.map(|(name, s)| (name, format!("{s:.2}"))));
    out + &diagnostic_lines(diagnostics)
}
