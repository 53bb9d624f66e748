//! The planned height map: its spacing, positions and job.
//!
//! ```text
//! dialog open, machine's job, spacing ─▶ PlannedMap: grid and job key ─ Probe, the clock ─▶ Ask::Survey
//! ```

use super::{Effect, Job, Model, link};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::job::{Program, touched};
use annulus_core::level::{ProbeGrid, key_of};
use annulus_core::units::Length;
use annulus_core::wire::Ask;
use std::sync::Arc;

pub const SPACINGS_MM: [u8; 4] = [5, 10, 15, 20];
/// Distance of the grid from the edge of the cut area.
const MARGIN: Length = Length::from_um(2_000);
/// Height of travel above the highest point probed, µm.
const CLEAR_UM: u32 = 1_000;
/// How far a point may be below the one before, µm.
const DEPTH_UM: u32 = 2_000;

#[derive(Clone, Debug, PartialEq)]
pub struct PlannedMap {
    pub grid: ProbeGrid,
    pub job: String,
}

#[derive(Clone, Debug)]
pub struct Leveling {
    pub open: bool,
    pub spacing_mm: u8,
    /// The planned map, or why there is none; `None` without a job.
    pub planned: Option<Result<PlannedMap, Diagnostic>>,
    of: Option<(Arc<Job>, u8)>,
}

impl Default for Leveling {
    fn default() -> Self {
        Self { open: false, spacing_mm: 10, planned: None, of: None }
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LevelEvent {
    Show {
        on: bool,
    },
    Space {
        mm: u8,
    },
    /// Probe the board. The machine moves.
    Touch,
}

pub(super) fn update(model: &mut Model, event: LevelEvent) -> Vec<Effect> {
    match event {
        LevelEvent::Show { on } => model.level.open = on,
        LevelEvent::Space { mm } => model.level.spacing_mm = mm,
        LevelEvent::Touch => return touch(model),
    }
    Vec::new()
}

fn touch(model: &mut Model) -> Vec<Effect> {
    let Some(Ok(PlannedMap { grid, job })) = model.level.planned.clone() else { return Vec::new() };
    let now_s = (model.clock.wall_ms / 1e3) as u64;
    link::ask(model, &Ask::Survey { grid, job, clear_um: CLEAR_UM, depth_um: DEPTH_UM, now_s })
}

/// While the dialog is open, updates the grid from job and spacing.
pub(super) fn follow(model: &mut Model) -> Vec<Effect> {
    let wanted = model.start.shown.as_ref().map(|job| (job, model.level.spacing_mm));
    let is_same = |(of, of_mm): &(Arc<Job>, u8)| {
        wanted.as_ref().is_some_and(|(job, mm)| Arc::ptr_eq(of, job) && of_mm == mm)
    };
    if model.level.open && !model.level.of.as_ref().is_some_and(is_same) {
        let planned = wanted.map(|(job, mm)| planned(&job.program, mm));
        let of = wanted.map(|(job, mm)| (Arc::clone(job), mm));
        (model.level.planned, model.level.of) = (planned, of);
    }
    Vec::new()
}

fn planned(program: &Program, spacing_mm: u8) -> Result<PlannedMap, Diagnostic> {
    let bounds = touched(program).ok_or_else(|| error!("level.nothing_cut"))?;
    let grid = ProbeGrid::over(bounds, Length::from_um(i64::from(spacing_mm) * 1_000), MARGIN)?;
    Ok(PlannedMap { grid, job: key_of(program) })
}
