//! Computes and checks the step stream, and reports its duration.

use super::{Answer, Refusal, diagnostic_lines, diagnostic_objects, rounded, sentence};
use crate::cli::job;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::milled_mm;
use annulus_core::sim::{Summary, summary};
use annulus_core::{check, motion, steps};
use serde_json::json;
use std::fmt::Display;

/// Number of runs that `--digest-trace` prints.
const TRACED_RUNS: usize = 2_000;

/// Arguments of `annulus simulate`.
#[derive(Debug, clap::Args)]
pub(crate) struct SimulateArgs {
    #[command(flatten)]
    pub(crate) job: super::JobArgs,
    /// Print the first runs of the stream, to find where two builds differ.
    #[arg(long)]
    pub(crate) digest_trace: bool,
}

pub(crate) fn run(args: &SimulateArgs) -> Result<Answer, Refusal> {
    let job = job::open_for_machine(&args.job)?;
    let timeline = motion::timeline(&job.program, &job.machine).map_err(Refusal::content)?;
    lawful(motion::laws::laws(&timeline, &job.machine))?;
    let stream = steps::stream(&timeline, &job.machine).map_err(Refusal::content)?;
    let zero = check::roomy_zero(&job.machine, job::low_corner(&job.program));
    lawful(check::verify(&stream, &job.machine, zero))?;
    let numbers = summary(&timeline, &stream, &job.machine);
    let milled_mm: f64 = milled_mm(&job.program).iter().sum();
    let digest = steps::digest(&stream);
    let there = u8::MAX >> (u8::BITS - job.machine.spindles.clamp(1, u8::BITS));
    let spindles = (job.program.spindles & there).count_ones();
    let mut object = json!({
        "tick_hz": steps::TICK_HZ,
        "total_time_s": rounded(numbers.total_s),
        "holes_per_min": rounded(numbers.holes_per_min),
        "spindles": spindles,
        "holes_per_min_all_spindles": rounded(numbers.holes_per_min * f64::from(spindles)),
        "holes_per_min_sequential": rounded(numbers.holes_per_min_sequential),
        "time_per_hole_s": { "median": rounded(numbers.median_hole_s), "max": rounded(numbers.longest_hole_s) },
        "steps": { "x": numbers.steps[0], "y": numbers.steps[1], "z": numbers.steps[2] },
        "stream_bytes": steps::compact(&stream).len(),
        "stream_digest": digest,
        "holes": numbers.holes,
        "toolpaths": numbers.toolpaths,
        "milled_mm": rounded(milled_mm),
        "time_s": {
            "drill": rounded(numbers.spent.drill_s),
            "mill": rounded(numbers.spent.mill_s),
            "between": rounded(numbers.spent.between_s),
            "change": rounded(numbers.spent.change_s),
            "other": rounded(numbers.spent.other_s),
        },
        "toolpath_time_s": {
            "plunge": rounded(numbers.spent.plunge_s),
            "cut": rounded(numbers.spent.mill_s - numbers.spent.plunge_s),
            "travel": rounded(numbers.spent.between_s),
        },
        "diagnostics": diagnostic_objects(&job.diagnostics),
    });
    let mut text = text(&numbers, (spindles, milled_mm), &digest) + &diagnostic_lines(&job.diagnostics);
    if args.digest_trace {
        let trace = steps::trace(&stream, TRACED_RUNS);
        object["digest_trace"] = trace.lines().collect();
        text.push_str(&trace);
    }
    Ok(Answer::new(&object, text).on(&args.job.on, &job.machine))
}

/// Refuses with the first error, if any. The others are printed to standard error first.
fn lawful<T>(verdict: Result<T, Vec<Diagnostic>>) -> Result<(), Refusal> {
    let mut refusals = verdict.err().into_iter().flatten().map(Refusal::content);
    let Some(first) = refusals.next() else { return Ok(()) };
    refusals.for_each(super::say);
    Err(first)
}

fn text(numbers: &Summary, (spindles, milled_mm): (u32, f64), digest: &str) -> String {
    let minutes = (numbers.total_s / 60.0).floor();
    let [x, y, z, ..] = &numbers.steps;
    let mut out = sentence(
        "simulate.answer",
        &[
            ("holes", &numbers.holes),
            ("minutes", &format!("{minutes:.0}")),
            ("seconds", &format!("{:.1}", numbers.total_s - 60.0 * minutes)),
            ("per_min", &format!("{:.1}", numbers.holes_per_min)),
            ("median", &format!("{:.3}", numbers.median_hole_s)),
            ("longest", &format!("{:.3}", numbers.longest_hole_s)),
            ("x", x),
            ("y", y),
            ("z", z),
            ("digest", &digest),
        ],
    ) + "\n";
    if spindles > 1 {
        let per_min = format!("{:.1}", numbers.holes_per_min * f64::from(spindles));
        out += &(sentence("simulate.together", &[("spindles", &spindles), ("per_min", &per_min)]) + "\n");
    }
    if numbers.toolpaths > 0 {
        let rows: [(&str, &dyn Display); 5] = [
            ("toolpaths", &numbers.toolpaths),
            ("mm", &format!("{milled_mm:.1}")),
            ("cut", &format!("{:.1}", numbers.spent.mill_s - numbers.spent.plunge_s)),
            ("plunge", &format!("{:.1}", numbers.spent.plunge_s)),
            ("travel", &format!("{:.1}", numbers.spent.between_s)),
        ];
        out += &(sentence("simulate.milled", &rows) + "\n");
    }
    out
}
