//! Lists the tools of a machine and their wear, and resets the wear of new tools.
//!
//! While a bridge runs, use its page instead: the journal has one owner.

use super::{Answer, MachineArgs, Refusal, ToolReport, counted, grbl, mm, rounded};
use crate::drill::JOURNAL;
use crate::journal;
use crate::machine_file;
use annulus_core::error;
use annulus_core::job::worn::Wear;
use annulus_core::machine::{Machine, RackTool, ToolWear};
use annulus_host::Keeper;
use serde_json::json;
use std::fmt::Write;

/// Arguments of `annulus tools`.
#[derive(Debug, clap::Args)]
pub(crate) struct ToolsArgs {
    #[command(subcommand)]
    command: ToolsCommand,
}

#[derive(Debug, clap::Subcommand)]
enum ToolsCommand {
    /// List the tools of the machine with their wear and life.
    List(MachineArgs),
    /// Reset the wear of new tools, by their numbers.
    Reset(ResetArgs),
}

/// Arguments of `annulus tools reset`.
#[derive(Debug, clap::Args)]
struct ResetArgs {
    /// Reset these tools, numbered as in `annulus tools list`.
    #[arg(value_name = "NUMBER", required = true)]
    numbers: Vec<u32>,
    #[command(flatten)]
    on: MachineArgs,
}

pub(crate) fn run(args: &ToolsArgs) -> Result<Answer, Refusal> {
    match &args.command {
        ToolsCommand::List(on) => {
            let machine = machine_file::named(on.name())?.machine;
            Ok(answer(&machine, &wear()?, grbl::ledger()?.wear()).on(on, &machine))
        }
        ToolsCommand::Reset(args) => reset(args),
    }
}

/// Wear of the tools, from the journal.
fn wear() -> Result<Vec<ToolWear>, Refusal> {
    let path = machine_file::data_folder().join(JOURNAL);
    let found = journal::look_into(&path).map_err(Refusal::surroundings)?;
    Ok(found.map(|(_, contents)| contents.wear).unwrap_or_default())
}

fn reset(args: &ResetArgs) -> Result<Answer, Refusal> {
    let machine = machine_file::named(args.on.name())?.machine;
    let tool = |number: &u32| {
        let tool = machine.rack.iter().find(|tool| tool.number == *number);
        let why = || Refusal::usage(error!("control.no_such_tool", number = number));
        tool.ok_or_else(why)
    };
    let tools = args.numbers.iter().map(tool).collect::<Result<Vec<_>, _>>()?;
    // Before anything is changed.
    let mut ledger = grbl::own_ledger()?;
    let path = machine_file::data_folder().join(JOURNAL);
    let mut known = Vec::new();
    if let Some((mut journal, mut contents)) = journal::look_into(&path).map_err(Refusal::surroundings)? {
        for tool in &tools {
            let new = ToolWear::new(&machine.name, tool);
            journal.keep_wear(&new).map_err(Refusal::surroundings)?;
            new.keep(&mut contents.wear);
        }
        known = contents.wear;
    }
    if !ledger.wear().is_empty() {
        for tool in tools {
            ledger.keep_wear(ToolWear::new(&machine.name, tool)).map_err(Refusal::surroundings)?;
        }
    }
    Ok(answer(&machine, &known, ledger.wear()).on(&args.on, &machine))
}

fn answer(machine: &Machine, wear: &[ToolWear], at_controllers: &[ToolWear]) -> Answer {
    let mut text = String::new();
    let mut rows = Vec::new();
    for tool in &machine.rack {
        let more = ToolWear::of(at_controllers, &machine.name, tool);
        let more = Wear { hits: more.hits, milled_um: more.milled_um };
        let wear = ToolWear::of(wear, &machine.name, tool).plus(more);
        let ToolReport { form, diameter_mm, angle_deg, tip_mm, name } = ToolReport::of(&tool.bit());
        let _ = writeln!(text, "T{:<4} {name:<24} {}", tool.number, done(tool, &wear));
        rows.push(json!({
            "form": form, "diameter_mm": diameter_mm, "angle_deg": angle_deg, "tip_mm": tip_mm, "name": name,
            "number": tool.number, "down_mm_per_s": tool.down_mm_per_s, "up_mm_per_s": tool.up_mm_per_s,
            "spindle_rpm": tool.spindle_rpm, "run_out_mm": mm(tool.run_out), "life": tool.life,
            "place": tool.place, "hits": wear.hits, "milled_mm": rounded(wear.milled_um as f64 / 1e3),
            "worn": wear.is_over(tool.life),
        }));
    }
    Answer::new(&json!({ "machine": machine.name, "tools": rows }), text)
}

/// Text: the wear of a tool.
fn done(tool: &RackTool, wear: &ToolWear) -> String {
    let worn = if wear.is_over(tool.life) { ": worn" } else { "" };
    match (tool.wears_by_way(), tool.life) {
        (false, 0) => counted(wear.done(), "hole"),
        (false, life) => format!("{} of {}{worn}", wear.done(), counted(life, "hole")),
        (true, 0) => format!("{} m", wear.done()),
        (true, life) => format!("{} of {life} m{worn}", wear.done()),
    }
}
