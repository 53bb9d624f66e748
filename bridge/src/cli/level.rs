//! The height map of a board on the drill of this computer: its places are touched as a job of strokes that end on the contact sensor.
//!
//! ```text
//! survey ─ strokes ─▶ a job ─ touches ─▶ survey ─ some stood out ─▶ another job … ─▶ the map, kept
//! ```
//!
//! Comes in: a job, a machine. Goes out: the map. Does not know how anything moves.

use super::job;
use super::run::{self, RunArgs};
use super::{Answer, Exit, Refusal};
use crate::controller::maps::Maps;
use crate::machine_file;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::{Program, touched};
use annulus_core::level::{HeightMap, ProbeGrid, Survey, TOLERANCE, key_of, level, strokes};
use annulus_core::units::Length;
use serde_json::{Value, json};
use std::time::SystemTime;

/// How far below the work zero the board is looked for; less than boards are thick.
const BELOW: Length = Length::from_um(1_000);

/// Arguments of `annulus level`.
#[derive(Debug, clap::Args)]
pub(crate) struct LevelArgs {
    #[command(flatten)]
    run: RunArgs,
    /// The board is touched at places that are at most so many mm apart.
    #[arg(long, value_name = "MM", default_value_t = 10.0)]
    grid: f64,
    /// The outermost places lie so many mm inside of what is cut.
    #[arg(long, value_name = "MM", default_value_t = 2.0)]
    margin: f64,
}

fn maps() -> Maps {
    Maps::of_drill(&machine_file::data_folder())
}

/// Touches the board and keeps its map.
pub(crate) fn run(args: &LevelArgs, json: bool) -> Result<Answer, Refusal> {
    let job = job::open_for_machine(&args.run.job)?;
    let bounds = touched(&job.program);
    let bounds = bounds.ok_or_else(|| Refusal::content(Diagnostic::error("level.nothing_cut")))?;
    let mm = Length::from_mm;
    let grid = ProbeGrid::over(bounds, mm(args.grid), mm(args.margin)).map_err(Refusal::content)?;
    let low = job::low_corner(&job.program);
    let mut survey = Survey::new(grid);
    let mut zero = [Length::ZERO; 2];
    while survey.next().is_some() {
        let program = strokes(&survey, &job.program, BELOW);
        let wanted = survey.to_do().count();
        let played = run::play(&program, low, &args.run, None, json)?;
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
    maps().keep(&map).map_err(Refusal::surroundings)?;
    Ok(Answer { object: object(&map), text: text(&map), exit: Exit::Done })
}

/// The program as it follows the map that was kept, that map, and the largest correction.
pub(super) fn followed(program: &Program) -> Result<(Program, HeightMap, Length), Refusal> {
    let map = maps().kept().map_err(Refusal::content)?;
    if map.job != key_of(program) {
        return Err(Refusal::content(Diagnostic::error("level.other_job")));
    }
    let levelled = level(program, &map, TOLERANCE).map_err(Refusal::content)?;
    Ok((levelled.program, map, levelled.correction.largest()))
}

/// The map as a table of µm, the highest Y on top as on the board.
pub(super) fn text(map: &HeightMap) -> String {
    let columns = usize::from(map.grid.columns);
    let rows = map.heights.chunks(columns).rev().map(|row| {
        let words: Vec<String> = row.iter().map(|height| format!("{:>6}", height.nm() / 1_000)).collect();
        words.join("") + "\n"
    });
    let [low, high] = map.span();
    let table: String = rows.collect();
    format!("Height over the work zero, µm:\n{table}From {:.3} to {:.3} mm.\n", low.mm(), high.mm())
}

/// The same for programs.
pub(super) fn object(map: &HeightMap) -> Value {
    let um = |height: &Length| height.nm() as f64 / 1e3;
    let [low, high] = map.span();
    json!({
        "columns": map.grid.columns,
        "rows": map.grid.rows,
        "low_mm": [map.grid.low.x.mm(), map.grid.low.y.mm()],
        "high_mm": [map.grid.high.x.mm(), map.grid.high.y.mm()],
        "heights_um": map.heights.iter().map(um).collect::<Vec<_>>(),
        "lowest_um": um(&low),
        "highest_um": um(&high),
        "map": map.key(),
    })
}
