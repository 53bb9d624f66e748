//! The height map of a board on the drill of this computer: its places are touched as a job of strokes that end on the contact sensor.
//!
//! ```text
//! survey ─ strokes ─▶ a job ─ touches ─▶ survey ─ some stood out ─▶ another job … ─▶ the map, kept
//! ```
//!
//! Comes in: a job, a machine. Goes out: the map. Does not know how anything moves.

use super::job;
use super::run::{self, BoardHow, PlayArgs};
use super::{Answer, Exit, Refusal, height_map};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::touched;
use annulus_core::level::{HeightMap, ProbeGrid, Survey, key_of, strokes};
use annulus_core::units::Length;
use std::time::SystemTime;

/// How far below the work zero the board is looked for; less than boards are thick.
const BELOW: Length = Length::from_um(1_000);

/// Arguments of `annulus level`.
#[derive(Debug, clap::Args)]
pub(crate) struct LevelArgs {
    #[command(flatten)]
    play: PlayArgs,
    /// The board is touched at places that are at most so many mm apart.
    #[arg(long, value_name = "MM", default_value_t = 10.0)]
    grid: f64,
    /// The outermost places lie so many mm inside of what is cut.
    #[arg(long, value_name = "MM", default_value_t = 2.0)]
    margin: f64,
}

/// Touches the board and keeps its map.
pub(crate) fn run(args: &LevelArgs, json: bool) -> Result<Answer, Refusal> {
    let job = job::open_for_machine(&args.play.job)?;
    let bounds = touched(&job.program);
    let bounds = bounds.ok_or_else(|| Refusal::content(Diagnostic::error("level.nothing_cut")))?;
    let mm = Length::from_mm;
    let grid = ProbeGrid::over(bounds, mm(args.grid), mm(args.margin)).map_err(Refusal::content)?;
    let low = job::low_corner(&job.program);
    // What was touched before it was broken off is not kept: the strokes begin anew, or heights would be missing.
    let anew = BoardHow { map: None, from_start: true, loads: false };
    let mut survey = Survey::new(grid);
    let mut zero = [Length::ZERO; 2];
    while survey.next().is_some() {
        let program = strokes(&survey, &job.program, BELOW);
        let wanted = survey.to_do().count();
        let played = run::play(&program, low, &args.play, anew, json)?;
        if played.answer.exit != Exit::Done {
            return Ok(played.answer);
        }
        if played.touches_um.len() != wanted {
            return Err(Refusal::content(Diagnostic::error("level.stopped")));
        }
        for height_um in played.touches_um {
            survey.touch(mm(height_um / 1e3)).map_err(Refusal::content)?;
        }
        zero = played.zero;
    }
    let heights = survey.done().unwrap_or_default();
    let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    let measured_s = now.map_or(0, |since| since.as_secs());
    let map = HeightMap { grid, heights, job: key_of(&job.program), zero, homed: true, measured_s };
    height_map::maps().keep(&map).map_err(Refusal::surroundings)?;
    Ok(Answer { object: height_map::object(&map), text: height_map::text(&map), exit: Exit::Done })
}
