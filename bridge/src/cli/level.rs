//! Probes a board on the drill of this computer and saves its height map, like a page does.

use super::dry_run::{DryRun, Zero};
use super::job;
use super::run::{self, PlayArgs, RealArgs};
use super::{Answer, Refusal};
use annulus_core::error;
use annulus_core::job::touched;
use annulus_core::level::{ProbeGrid, key_of};
use annulus_core::machine::Output;
use annulus_core::units::Length;
use annulus_core::wire::Ask;
use std::time::SystemTime;

/// How far below the previous position to search for the board, and the travel height above the highest one,
/// µm.
const DEPTH_UM: u32 = 2_000;
const CLEAR_UM: u32 = 1_000;

/// Arguments of `annulus level`.
#[derive(Debug, clap::Args)]
pub(crate) struct LevelArgs {
    #[command(flatten)]
    play: PlayArgs,
    #[command(flatten)]
    real: RealArgs,
    /// Set the largest distance between two probed positions.
    #[arg(long = "spacing", alias = "grid", value_name = "MM", default_value_t = 10.0)]
    grid: f64,
    /// Keep the outermost probed positions this far inside the cut area.
    #[arg(long, value_name = "MM", default_value_t = 2.0)]
    margin: f64,
    /// Print what would be probed, then end. Moves nothing.
    #[arg(long)]
    dry_run: bool,
}

/// Probes the board; the drill saves its map.
pub(crate) fn run(args: &LevelArgs, json: bool) -> Result<Answer, Refusal> {
    let job = job::open_for_machine(&args.play.job)?;
    let bounds = touched(&job.program);
    let bounds = bounds.ok_or_else(|| Refusal::content(error!("level.nothing_cut")))?;
    let mm = Length::from_mm;
    let grid = ProbeGrid::over(bounds, mm(args.grid), mm(args.margin)).map_err(Refusal::content)?;
    if args.dry_run {
        let output = run::own_machine(args.play.job.on.name())?.machine.output;
        let zero = match output {
            Output::Virtual => Zero::Homed,
            _ => Zero::of(args.real.zero_at, false),
        };
        let dry = DryRun::on(Some(job.machine.name), output.names()[0], None);
        let (points, diagnostics) = (Some(grid.count()), job.diagnostics);
        return Ok(DryRun { points, zero, diagnostics, ..dry }.answer());
    }
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    let now_s = now.map_or(0, |since| since.as_secs());
    let job_key = key_of(&job.program);
    let ask = Ask::Survey { grid, job: job_key, clear_um: CLEAR_UM, depth_um: DEPTH_UM, now_s };
    run::touch(&args.play, &args.real, (job::low_corner(&job.program), ask), json)
}
