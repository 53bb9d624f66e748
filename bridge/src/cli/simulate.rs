//! Computes and checks the step stream, and reports its duration.

use super::{Answer, Exit, Refusal, diagnostic_lines, diagnostic_objects, rounded};
use crate::cli::job;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::milled_mm;
use annulus_core::sim::{Summary, summary};
use annulus_core::{check, locale, motion, steps};
use serde_json::json;

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
    lawful(check::verify(
        &stream,
        &job.machine,
        check::roomy_zero(&job.machine, job::low_corner(&job.program)),
    ))?;
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
    let mut text = sentences(&numbers, &digest)
        + &together(&numbers, spindles)
        + &milled(&numbers, milled_mm)
        + &diagnostic_lines(&job.diagnostics);
    if args.digest_trace {
        let trace = steps::trace(&stream, TRACED_RUNS);
        object["digest_trace"] = trace.lines().collect();
        text.push_str(&trace);
    }
    Ok(Answer { object, text, exit: Exit::Done })
}

/// Refuses with the first error, if any. The others are printed to standard error first.
fn lawful<T>(verdict: Result<T, Vec<Diagnostic>>) -> Result<(), Refusal> {
    let mut refusals = verdict.err().into_iter().flatten().map(Refusal::content);
    let Some(first) = refusals.next() else { return Ok(()) };
    refusals.for_each(super::say);
    Err(first)
}

/// Text: the drilling rate of all spindles, if there are several.
fn together(numbers: &Summary, spindles: u32) -> String {
    if spindles < 2 {
        return String::new();
    }
    let rows = [
        ("spindles", spindles.to_string()),
        ("per_min", format!("{:.1}", numbers.holes_per_min * f64::from(spindles))),
    ];
    locale::text("en", "simulate.together", &rows.map(|(name, value)| (name.to_owned(), value))) + "\n"
}

/// Text: the milling, if there is any.
fn milled(numbers: &Summary, milled_mm: f64) -> String {
    if numbers.toolpaths == 0 {
        return String::new();
    }
    let rows = [
        ("toolpaths", numbers.toolpaths.to_string()),
        ("mm", format!("{milled_mm:.1}")),
        ("cut", format!("{:.1}", numbers.spent.mill_s - numbers.spent.plunge_s)),
        ("plunge", format!("{:.1}", numbers.spent.plunge_s)),
        ("travel", format!("{:.1}", numbers.spent.between_s)),
    ];
    locale::text("en", "simulate.milled", &rows.map(|(name, value)| (name.to_owned(), value))) + "\n"
}

fn sentences(numbers: &Summary, digest: &str) -> String {
    let minutes = (numbers.total_s / 60.0).floor();
    let rows = [
        ("holes", numbers.holes.to_string()),
        ("minutes", format!("{minutes:.0}")),
        ("seconds", format!("{:.1}", numbers.total_s - 60.0 * minutes)),
        ("per_min", format!("{:.1}", numbers.holes_per_min)),
        ("median", format!("{:.3}", numbers.median_hole_s)),
        ("longest", format!("{:.3}", numbers.longest_hole_s)),
        ("x", numbers.steps[0].to_string()),
        ("y", numbers.steps[1].to_string()),
        ("z", numbers.steps[2].to_string()),
        ("digest", digest.to_owned()),
    ];
    locale::text("en", "simulate.answer", &rows.map(|(name, value)| (name.to_owned(), value))) + "\n"
}
