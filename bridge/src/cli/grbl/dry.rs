//! `--dry-run` at a controller: run, resume and level.

use super::{BoardArgs, ResumeArgs, RunArgs, files, how::How, ledger, program, refuse_interrupted};
use crate::cli::dry_run::{DryRun, Zero};
use crate::cli::{Answer, Refusal};
use crate::machine_file;
use annulus_core::error;
use annulus_core::grbl::{Routine, SectionKind, cut_bounds};
use annulus_core::level::ProbeGrid;
use annulus_core::units::Length;
use program::Preview;

pub(super) fn run(args: &RunArgs) -> Result<Answer, Refusal> {
    let preview = preview(&args.board)?;
    refuse_interrupted(&ledger()?, &preview.routine.key, args.from_start)?;
    Ok(of_board(&args.board, preview)?.answer())
}

pub(super) fn level(args: &BoardArgs) -> Result<Answer, Refusal> {
    let preview = preview(args)?;
    let bounds = cut_bounds(&preview.routine);
    let bounds = bounds.ok_or_else(|| Refusal::content(error!("level.nothing_cut")))?;
    let [spacing, margin] = [args.touches.grid, args.touches.margin].map(Length::from_mm);
    let grid = ProbeGrid::over(bounds, spacing, margin).map_err(Refusal::content)?;
    let own = of_board(args, preview)?;
    // Probing cuts nothing.
    let own = DryRun { holes: 0, toolpaths: 0, tool_changes: 0, time_s: None, ..own };
    Ok(DryRun { points: Some(grid.count()), ..own }.answer())
}

pub(super) fn resume(args: &ResumeArgs) -> Result<Answer, Refusal> {
    let ledger = ledger()?;
    let none = || Refusal::content(error!("grbl.nothing_interrupted"));
    let before = ledger.interrupted().ok_or_else(none)?;
    let programs = program::read_again(&program::files_of(&ledger, &files()))?;
    if programs.routine.key != before.key {
        return Err(Refusal::content(error!("grbl.other_job", name = &before.name)));
    }
    let (holes, toolpaths) = programs.routine.cuts();
    let mill = args.machine.map(|sold| sold.0.title.to_owned());
    Ok(DryRun {
        holes: holes.saturating_sub(before.holes) as usize,
        toolpaths: toolpaths.saturating_sub(before.toolpaths) as usize,
        tool_changes: changes(&programs.routine, before.done),
        zero: zero(&args.how)?,
        ..DryRun::on(mill, DRIVER, args.how.port.port.clone())
    }
    .answer())
}

/// The name of a controller in JSON.
const DRIVER: &str = "controller";

fn preview(args: &BoardArgs) -> Result<Preview, Refusal> {
    super::no_controller(&args.job.on, args.how.port.port.as_deref())?;
    program::preview(&args.job, &args.more)
}

fn of_board(args: &BoardArgs, preview: Preview) -> Result<DryRun, Refusal> {
    let is_named = args.job.on.machine.is_some() || preview.time_s.is_some();
    let machine = machine_file::named(args.job.on.name())?.machine.name;
    let (holes, toolpaths) = preview.routine.cuts();
    Ok(DryRun {
        holes: holes as usize,
        toolpaths: toolpaths as usize,
        time_s: preview.time_s,
        tool_changes: changes(&preview.routine, 0),
        zero: zero(&args.how)?,
        diagnostics: preview.diagnostics,
        ..DryRun::on(is_named.then_some(machine), DRIVER, args.how.port.port.clone())
    })
}

/// Number of tool changes from section `from` on.
fn changes(routine: &Routine, from: usize) -> usize {
    let left = routine.sections.iter().skip(from);
    left.filter(|section| matches!(section.kind, SectionKind::Change(_))).count()
}

/// The work zero; a zero in machine coordinates needs Z too.
fn zero(how: &How) -> Result<Zero, Refusal> {
    if let Some(place) = how.zero_at {
        place.whole()?;
    }
    Ok(Zero::of(how.zero_at, how.zero_here))
}
