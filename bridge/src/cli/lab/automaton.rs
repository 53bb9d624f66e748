//! `annulus lab automaton`: computes the step automaton, interrupt by interrupt.

use super::super::{Answer, Refusal};
use super::output::{ComputedCase, OutputArgs, deliver, ms, panel, short, word};
use crate::{lab, machine_file};
use annulus_core::error;
use annulus_core::machine::{Dynamics, dynamics};
use annulus_core::plot::{Plot, PlotMark, Series, SeriesLook};
use annulus_core::steps::automaton::Automaton;
use serde_json::json;
use std::path::Path;

/// Maximum number of interrupts.
const MOST_INTERRUPTS: u64 = 10_000_000;
/// Maximum number of listed steps.
const MOST_STEPS: usize = 200_000;

/// Arguments of `annulus lab automaton`.
#[derive(Debug, clap::Args)]
pub(crate) struct AutomatonArgs {
    /// Use this table of dynamics: arendt (as printed), or a JSON file with period, enter and leave.
    #[arg(long, default_value = "arendt", value_name = "NAME|FILE")]
    table: String,
    /// Use the table and the interrupt frequency of this machine, a name or a file.
    #[arg(short, long, value_name = "NAME", conflicts_with = "table")]
    machine: Option<String>,
    /// Set the target of the axis, in steps.
    #[arg(long, default_value_t = 100, allow_negative_numbers = true, value_name = "N",
        value_parser = clap::value_parser!(i64).range(-1_000_000_000..=1_000_000_000))]
    target: i64,
    /// Write another target N just before interrupt I. Repeatable.
    #[arg(long, allow_hyphen_values = true, value_name = "I:N")]
    retarget: Vec<String>,
    /// Set the interrupt frequency, in Hz.
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    interrupt_hz: Option<f64>,
    #[command(flatten)]
    output: OutputArgs,
}

/// A step: interrupt, position, state.
type Row = (u64, i64, i32);

pub(crate) fn run(args: &AutomatonArgs) -> Result<Answer, Refusal> {
    let (table, hz) = table(args)?;
    let diagnostics = dynamics::check(&table).map_err(|all| {
        let first = all.into_iter().next();
        Refusal::content(first.unwrap_or_else(|| error!("lab.bad_table")))
    })?;
    let changes = changes(&args.retarget)?;
    let (rows, served) = steps(table.clone(), args.target, &changes)?;
    let sheet = sheet(args, &table, hz, &changes, &rows, served);
    let mut answer = deliver(&args.output, sheet)?;
    answer.object["diagnostics"] = json!(super::super::diagnostic_objects(&diagnostics));
    Ok(answer)
}

/// The table and its interrupt frequency.
fn table(args: &AutomatonArgs) -> Result<(Dynamics, f64), Refusal> {
    let (table, usual_hz) = match (&args.machine, args.table.as_str()) {
        (Some(name), _) => {
            let machine = machine_file::named(name)?.machine;
            let hz = f64::from(machine.interrupt_hz);
            (machine.dynamics, hz)
        }
        (None, "arendt") => (Dynamics::arendt(), 500.0),
        (None, path) => {
            let text = super::check::read(Path::new(path), path)?;
            (lab::dynamics_file(path, &text).map_err(Refusal::content)?, 500.0)
        }
    };
    let hz = args.interrupt_hz.unwrap_or(usual_hz);
    if (1.0..=1e6).contains(&hz) {
        return Ok((table, hz));
    }
    Err(Refusal::content(error!("lab.bad_frequency", found = hz)))
}

/// Parses `I:N` … as interrupts and targets, in order.
fn changes(texts: &[String]) -> Result<Vec<(u64, i64)>, Refusal> {
    let one = |text: &String| {
        let parsed = text.split_once(':').and_then(|(interrupt, target)| {
            let interrupt = interrupt.parse().ok().filter(|at| (1..=MOST_INTERRUPTS).contains(at))?;
            Some((interrupt, target.parse().ok().filter(|to: &i64| to.abs() <= 1_000_000_000)?))
        });
        parsed.ok_or_else(|| {
            let why = error!("lab.bad_retarget", found = text, ..);
            Refusal::usage(why.with("most", MOST_INTERRUPTS))
        })
    };
    let mut changes = texts.iter().map(one).collect::<Result<Vec<_>, _>>()?;
    changes.sort_by_key(|(interrupt, _)| *interrupt);
    Ok(changes)
}

/// Every step until the last target is reached, and the number of interrupts.
fn steps(table: Dynamics, target: i64, changes: &[(u64, i64)]) -> Result<(Vec<Row>, u64), Refusal> {
    let mut axis = Automaton::new(table, 0);
    axis.retarget(target);
    let mut changes = changes.iter().peekable();
    let (mut interrupt, mut rows) = (0, Vec::new());
    while !axis.is_at_rest() || changes.peek().is_some() {
        interrupt += 1;
        if interrupt > MOST_INTERRUPTS || rows.len() >= MOST_STEPS {
            let why = error!("lab.long_move", most = MOST_STEPS);
            return Err(Refusal::content(why));
        }
        while let Some((_, target)) = changes.next_if(|(when, _)| *when == interrupt) {
            axis.retarget(*target);
        }
        if let Some(step) = axis.interrupt() {
            rows.push((interrupt, step.position, step.state));
        }
    }
    Ok((rows, interrupt))
}

fn sheet(
    args: &AutomatonArgs,
    table: &Dynamics,
    hz: f64,
    changes: &[(u64, i64)],
    rows: &[Row],
    served: u64,
) -> ComputedCase {
    let last = rows.last().map_or(0, |row| row.0);
    let object = json!({ "table": table, "interrupt_hz": hz, "target": args.target,
        "retarget": changes, "takts": rows.len(), "total_interrupts": last, "served_interrupts": served,
        "duration_s": last as f64 / hz, "final_position": rows.last().map_or(0, |row| row.1) });
    let fastest = rows.windows(2).map(|pair| hz / (pair[1].0 - pair[0].0) as f64).fold(0.0, f64::max);
    let mut text = vec![
        (word("takts"), rows.len().to_string()),
        (word("interrupts"), last.to_string()),
        (word("time"), format!("{} ({} Hz)", ms(last as f64 / hz), short(hz))),
        (word("rate"), format!("{} /s", short(fastest))),
    ];
    text.extend(rows.last().map(|row| (word("position"), row.1.to_string())));
    let samples = rows
        .iter()
        .map(|row| [row.0 as f64, row.0 as f64 / hz, row.1 as f64, f64::from(row.2)].map(Some).to_vec());
    ComputedCase {
        object,
        rows: text,
        columns: ["interrupt", "t_s", "position_takts", "state"].map(str::to_owned).to_vec(),
        samples: samples.collect(),
        plot: plot(hz, changes, rows),
    }
}

fn plot(hz: f64, changes: &[(u64, i64)], rows: &[Row]) -> Plot {
    let ms = |interrupt: u64| 1e3 * interrupt as f64 / hz;
    let start = [0.0, 0.0];
    let stairs = |value: fn(&Row) -> f64| {
        let points = [start].into_iter().chain(rows.iter().map(|row| [ms(row.0), value(row)]));
        vec![Series::line("", points.collect()).looking(SeriesLook::Stairs)]
    };
    // The rate over an interval is the rate of the step at its end.
    let mut rate = vec![start];
    let mut before = 0;
    for row in rows {
        let steps_per_s = if row.0 > before { hz / (row.0 - before) as f64 } else { f64::NAN };
        rate.extend([[ms(before), steps_per_s], [ms(row.0), steps_per_s]]);
        before = row.0;
    }
    let marks: Vec<PlotMark> =
        changes.iter().map(|(at, to)| PlotMark::At(ms(*at), format!("{} {to}", word("target")))).collect();
    Plot {
        title: format!("{}, {} Hz", word("automaton_title"), short(hz)),
        panels: vec![
            panel("position", &word("takts"), stairs(|row| row.1 as f64), marks),
            panel("state", "", stairs(|row| f64::from(row.2)), Vec::new()),
            panel("rate", "1/s", vec![Series::line("", rate)], Vec::new()),
        ],
    }
}
