//! Chooses bits and puts the holes in order (S5, N9, N24).
//!
//! Comes in: a JOB. Goes out: the keys of the contract, or a table for people; with `-o` a program file. Does not know
//! how a plan is made.

use super::{Answer, Exit, Refusal, remark_lines, remark_objects, rounded, tool_object};
use crate::job::{self, Job};
use annulus_core::board::Board;
use annulus_core::cam::{Plan, rack};
use annulus_core::locale;
use annulus_core::remark::Remark;
use annulus_core::units::Length;
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

/// Runs the command.
pub(crate) fn run(args: &PlanArgs) -> Result<Answer, Refusal> {
    let job = job::plan(&args.job)?;
    let bytes = program::encode(&job.program);
    if let Some(path) = &args.output {
        job::write_output(path, &bytes)?;
    }
    let Job { plan: Some(plan), board: Some(board), remarks, .. } = &job else {
        return Err(Refusal::content(Remark::new(
            annulus_core::remark::Weight::Loss,
            "plan.nothing_to_drill",
        )));
    };
    let rows = rows(plan, board);
    let tools: Vec<Value> = rows
        .iter()
        .map(|row| {
            json!({ "n": row.n, "file_diameter_mm": rounded(row.size.mm()),
                "rack_diameter_mm": rounded(row.bit.mm()), "holes": row.holes,
                "tool": tool_object(&rack::drill(row.bit)) })
        })
        .collect();
    let object = json!({
        "travel_before_mm": rounded(plan.travel_before_mm),
        "travel_after_mm": rounded(plan.travel_after_mm),
        "hop_time_before_s": rounded(plan.hop_time_before_s),
        "hop_time_after_s": rounded(plan.hop_time_after_s),
        "tools": tools,
        "iterations": plan.iterations,
        "program_sha256": program::key(&bytes),
        "remarks": remark_objects(remarks),
    });
    Ok(Answer { object, text: text(plan, &rows, remarks), exit: Exit::Done })
}

/// One size of the files and the bit that drills it.
struct Row {
    n: usize,
    size: Length,
    bit: Length,
    holes: usize,
}

fn rows(plan: &Plan, board: &Board) -> Vec<Row> {
    let size_of = |hole: u32| board.holes.get(hole as usize).and_then(|hole| hole.diameter);
    let rows = (1..).zip(&plan.bits).flat_map(|(n, bit)| {
        bit.sizes.iter().map(move |&size| {
            let holes = bit.holes.iter().filter(|&&hole| size_of(hole) == Some(size)).count();
            Row { n, size, bit: bit.bit, holes }
        })
    });
    rows.collect()
}

fn text(plan: &Plan, rows: &[Row], remarks: &[Remark]) -> String {
    let say = |key: &str, args: &[(&str, String)]| {
        let args: Vec<_> = args.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
        locale::text("en", key, &args)
    };
    let holes: usize = rows.iter().map(|row| row.holes).sum();
    let mut out =
        say("plan.report.head", &[("holes", holes.to_string()), ("bits", plan.bits.len().to_string())]);
    out.push('\n');
    for row in rows {
        let (n, bit, holes) = (
            format!("{:>3}", row.n),
            format!("{:<10}", rack::drill(row.bit).title("en")),
            format!("{:>6}", row.holes),
        );
        let size = format!("{:.3}", row.size.mm());
        out += &say("plan.report.bit", &[("n", n), ("bit", bit), ("holes", holes), ("size", size)]);
        out.push('\n');
    }
    let lengths = [("before", plan.travel_before_mm), ("after", plan.travel_after_mm)];
    out += &say("plan.report.travel", &lengths.map(|(name, mm)| (name, format!("{mm:.1}"))));
    out.push('\n');
    let times = [("before", plan.hop_time_before_s), ("after", plan.hop_time_after_s)];
    out += &say("plan.report.time", &times.map(|(name, s)| (name, format!("{s:.2}"))));
    out.push('\n');
    out + &remark_lines(remarks)
}
