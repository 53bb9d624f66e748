//! Chooses tools and puts the holes in order.

use super::{Answer, Refusal, ToolReport, as_objects, diagnostic_lines, mm, rounded, sentence};
use crate::cli::job;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::travel_mm;
use annulus_core::wire::program;
use serde::Serialize;
use std::fmt::Display;

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
    let tools = figures.rows.iter().map(|row| ToolRow {
        n: row.n,
        file_diameter_mm: mm(row.size),
        rack_diameter_mm: mm(row.bit.diameter),
        holes: row.holes,
        tool: ToolReport::of(&row.bit),
        slots: row.slots,
        toolpaths: row.toolpaths,
    });
    let report = PlanReport {
        travel_before_mm: rounded(figures.travel_before_mm),
        travel_after_mm: rounded(figures.travel_after_mm),
        travel_mm: rounded(travel_mm(&job.program)),
        hop_time_before_s: rounded(figures.hop_time_before_s),
        hop_time_after_s: rounded(figures.hop_time_after_s),
        tools: tools.collect(),
        iterations: figures.iterations,
        program_sha256: program::key(&bytes),
        diagnostics: job.diagnostics,
    };
    Ok(Answer::new(&report, report.text()).on(&args.job.on, &job.machine))
}

#[derive(Serialize)]
struct PlanReport {
    travel_before_mm: f64,
    travel_after_mm: f64,
    travel_mm: f64,
    hop_time_before_s: f64,
    hop_time_after_s: f64,
    tools: Vec<ToolRow>,
    iterations: u64,
    program_sha256: String,
    #[serde(serialize_with = "as_objects")]
    diagnostics: Vec<Diagnostic>,
}

/// One hole size of the files.
#[derive(Serialize)]
struct ToolRow {
    n: usize,
    file_diameter_mm: f64,
    rack_diameter_mm: f64,
    holes: usize,
    tool: ToolReport,
    slots: usize,
    toolpaths: usize,
}

impl PlanReport {
    fn text(&self) -> String {
        let say = |key: &str, args: &[(&str, &dyn Display)]| sentence(key, args) + "\n";
        let holes: usize = self.tools.iter().map(|row| row.holes).sum();
        let bits = self.tools.last().map_or(0, |row| row.n);
        let mut out = say("plan.report.head", &[("holes", &holes), ("bits", &bits)]);
        for row in &self.tools {
            let (n, bit) = (format!("{:>3}", row.n), format!("{:<14}", row.tool.name));
            let size = format!("{:.3}", row.file_diameter_mm);
            for (key, count) in [("bit", row.holes), ("slots", row.slots)].into_iter().filter(|row| row.1 > 0)
            {
                let count = format!("{count:>6}");
                let args: [(&str, &dyn Display); 4] =
                    [("n", &n), ("bit", &bit), ("size", &size), ("holes", &count)];
                out += &say(&format!("plan.report.{key}"), &args);
            }
        }
        let [before, after] = [self.travel_before_mm, self.travel_after_mm].map(|mm| format!("{mm:.1}"));
        out += &say("plan.report.travel", &[("before", &before), ("after", &after)]);
        let [before, after] = [self.hop_time_before_s, self.hop_time_after_s].map(|s| format!("{s:.2}"));
        out += &say("plan.report.time", &[("before", &before), ("after", &after)]);
        out + &diagnostic_lines(&self.diagnostics)
    }
}
