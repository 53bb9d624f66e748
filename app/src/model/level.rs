//! The height map as it would be touched now: how far apart, where, for which job.
//!
//! ```text
//! dialog open, job of the machine, distance ─▶ PlannedMap: grid and key of the job ─ Touch, the clock ─▶ Ask::Survey
//! ```
//!
//! Comes in: wishes, the job that the machine would run. Goes out: the grid, the wish to touch it. Knows no heights.

use super::{Effect, Job, Model, link};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::{Program, touched};
use annulus_core::level::{ProbeGrid, key_of};
use annulus_core::units::Length;
use annulus_core::wire::Ask;
use std::sync::Arc;

/// How far apart the places may be, mm.
pub const SPACINGS_MM: [u8; 4] = [5, 10, 15, 20];
/// How far inside of what is cut they lie, how far the tip is lifted between them, and how much lower one may lie, µm.
const MARGIN: Length = Length::from_um(2_000);
const CLEAR_UM: u32 = 1_000;
const DEPTH_UM: u32 = 2_000;

/// Where the board would be touched, and for which job.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedMap {
    /// The places.
    pub grid: ProbeGrid,
    /// What tells the job from others.
    pub job: String,
}

/// The height map as it would be touched now.
#[derive(Clone, Debug)]
pub struct Leveling {
    /// Its dialog is open.
    pub open: bool,
    /// How far apart the places are, mm.
    pub spacing_mm: u8,
    /// Where the board would be touched, or why not; none without a job.
    pub planned: Option<Result<PlannedMap, Diagnostic>>,
    /// The job and the distance that this is for.
    of: Option<(Arc<Job>, u8)>,
}

impl Default for Leveling {
    fn default() -> Self {
        Self { open: false, spacing_mm: 10, planned: None, of: None }
    }
}

/// What happens about it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LevelEvent {
    /// The dialog is to be open, or closed.
    Show {
        /// Open.
        on: bool,
    },
    /// The places are to be so far apart.
    Space {
        /// How far, mm.
        mm: u8,
    },
    /// The board is to be touched there.
    Touch,
}

/// Takes one event in.
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

/// While the dialog is open the places follow the job and the distance.
pub(super) fn follow(model: &mut Model) {
    if !model.level.open {
        return;
    }
    let wanted = model.start.shown.as_ref().map(|job| (job, model.level.spacing_mm));
    let is_same = |(of, of_mm): &(Arc<Job>, u8)| {
        wanted.as_ref().is_some_and(|(job, mm)| Arc::ptr_eq(of, job) && of_mm == mm)
    };
    if model.level.of.as_ref().is_some_and(is_same) {
        return;
    }
    let planned = wanted.map(|(job, mm)| planned(&job.program, mm));
    let of = wanted.map(|(job, mm)| (Arc::clone(job), mm));
    (model.level.planned, model.level.of) = (planned, of);
}

fn planned(program: &Program, spacing_mm: u8) -> Result<PlannedMap, Diagnostic> {
    let bounds = touched(program).ok_or_else(|| Diagnostic::error("level.nothing_cut"))?;
    let grid = ProbeGrid::over(bounds, Length::from_um(i64::from(spacing_mm) * 1_000), MARGIN)?;
    Ok(PlannedMap { grid, job: key_of(program) })
}
