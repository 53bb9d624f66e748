//! A whole stroke of the closed-loop Z axis: down to the board, through it, a dwell, back; with stages, contact signal,
//! feed-forward and the load of cutting.
//!
//! Comes in: controller, plant, heights, and the down and up moves as functions of time. Goes out: a sample a row and
//! [`StrokeMetrics`]. Depth counts downward from the rest on top, mm. Does not know how moves are planned.
//!
//! ```text
//!  depth   0 \                      approach: P alone
//!             \                     contact latches where the place is at H or deeper
//!          H --\---------------/--  cut: P, I, D; the load pushes back
//!       H + D   \_____________/     dwell, then the fast return: P, and I near the end
//!               | down | dwell | up | rest
//! ```

use super::pid::{CycleStage, Memory, ServoController, control};
use super::plant::{Plant, PlantState};
use super::{samples_of, within};
use crate::diagnostic::Diagnostic;

/// Where a reference is at a moment.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReferenceMoment {
    /// Way along the move, mm from its start.
    pub s_mm: f64,
    /// Speed, mm/s.
    pub v_mm_per_s: f64,
    /// Acceleration, mm/s².
    pub a_mm_per_s2: f64,
}

/// A move from rest to rest as a function of time.
#[derive(Clone, Copy)]
pub struct Reference<'a> {
    /// How long it takes, s.
    pub duration_s: f64,
    /// Where it is, by the second from its start. After the end it has to stay there.
    pub at: &'a dyn Fn(f64) -> ReferenceMoment,
}

/// A stroke.
#[derive(Clone, Copy)]
pub struct StrokeRun<'a> {
    /// The controller.
    pub controller: ServoController,
    /// The axis.
    pub plant: Plant,
    /// H: from the rest on top to the board's surface, mm.
    pub height_mm: f64,
    /// D: from the surface to the lowest place, mm.
    pub depth_mm: f64,
    /// The move down over H + D.
    pub down: Reference<'a>,
    /// The move up over H + D.
    pub up: Reference<'a>,
    /// Pause at the lowest place, s.
    pub dwell_s: f64,
    /// How long it is watched after the return, s.
    pub rest_s: f64,
    /// Whether speed and acceleration of the reference are fed forward.
    pub feed_forward: bool,
    /// What cutting costs, V.
    pub cutting_load_v: f64,
}

/// One sample of a stroke: as it stands before the plant moves on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrokeSample {
    /// Second.
    pub t_s: f64,
    /// Where it should be, mm of depth.
    pub r_mm: f64,
    /// Where it is, mm of depth.
    pub y_mm: f64,
    /// Control, with what was fed forward, V.
    pub u_v: f64,
    /// Stage.
    pub stage: CycleStage,
}

/// How a stroke went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrokeMetrics {
    /// When the contact signal latched, s; none: the board was never touched.
    pub contact_s: Option<f64>,
    /// Greatest |reference − place| before the contact, mm.
    pub max_error_approach_mm: f64,
    /// Greatest |reference − place| from the contact to the return, mm.
    pub max_error_cut_mm: f64,
    /// What is missing to the full depth when the return is commanded, mm.
    pub depth_error_mm: f64,
    /// How far it went below the lowest place, mm.
    pub over_travel_mm: f64,
    /// Reference − place in the last sample, mm.
    pub final_error_mm: f64,
}

/// Runs the stroke.
pub fn stroke(run: &StrokeRun<'_>) -> Result<(Vec<StrokeSample>, StrokeMetrics), Diagnostic> {
    let count = check(run)?;
    let sample_s = run.controller.sample_s;
    let plant = run.plant.every(sample_s);
    let up_from_s = run.down.duration_s + run.dwell_s;
    let full_mm = run.height_mm + run.depth_mm;
    let (mut state, mut memory, mut stage) = (PlantState::default(), Memory::default(), CycleStage::Approach);
    let mut samples = Vec::with_capacity(count);
    for k in 0..count {
        let t_s = k as f64 * sample_s;
        let target = target(run, t_s, up_from_s, full_mm);
        let now = match stage {
            _ if t_s >= up_from_s => CycleStage::Return,
            CycleStage::Approach if state.y_mm >= run.height_mm => CycleStage::Cut,
            latched => latched,
        };
        if now != stage && run.controller.fuzzy.is_some() {
            memory.change_stage();
        }
        stage = now;
        let ahead_v =
            if run.feed_forward { run.plant.ahead_v(target.v_mm_per_s, target.a_mm_per_s2) } else { 0.0 };
        let u_v = control(&run.controller, &mut memory, stage, target.s_mm, state.y_mm, ahead_v);
        samples.push(StrokeSample { t_s, r_mm: target.s_mm, y_mm: state.y_mm, u_v, stage });
        let cuts = state.y_mm >= run.height_mm && stage != CycleStage::Return;
        state = plant.step(state, u_v - if cuts { run.cutting_load_v } else { 0.0 });
    }
    let metrics = metrics(&samples, full_mm);
    Ok((samples, metrics))
}

/// Refuses what cannot be run; the number of samples.
fn check(run: &StrokeRun<'_>) -> Result<usize, Diagnostic> {
    run.controller.check()?;
    run.plant.check()?;
    within("height", run.height_mm, 0.0, 1e6)?;
    within("depth", run.depth_mm, 0.0, 1e6)?;
    within("dwell", run.dwell_s, 0.0, 1e6)?;
    within("rest", run.rest_s, 0.0, 1e6)?;
    within("load", run.cutting_load_v, 0.0, 1e6)?;
    within("down", run.down.duration_s, 0.0, 1e6)?;
    within("up", run.up.duration_s, 0.0, 1e6)?;
    let total_s = run.down.duration_s + run.dwell_s + run.up.duration_s + run.rest_s;
    samples_of(total_s, run.controller.sample_s)?;
    // To the first sample at or after the end.
    Ok(libm::ceil(total_s / run.controller.sample_s) as usize + 1)
}

fn target(run: &StrokeRun<'_>, t_s: f64, up_from_s: f64, full_mm: f64) -> ReferenceMoment {
    if t_s < run.down.duration_s {
        return (run.down.at)(t_s);
    }
    if t_s < up_from_s {
        return ReferenceMoment { s_mm: full_mm, ..ReferenceMoment::default() };
    }
    let back = (run.up.at)(t_s - up_from_s);
    ReferenceMoment {
        s_mm: full_mm - back.s_mm,
        v_mm_per_s: -back.v_mm_per_s,
        a_mm_per_s2: -back.a_mm_per_s2,
    }
}

fn metrics(samples: &[StrokeSample], full_mm: f64) -> StrokeMetrics {
    let worst = |stage: CycleStage| {
        let errors = samples.iter().filter(|sample| sample.stage == stage);
        errors.map(|sample| (sample.r_mm - sample.y_mm).abs()).fold(0.0, f64::max)
    };
    let contact = samples.iter().find(|sample| sample.stage == CycleStage::Cut);
    let returning = samples.iter().find(|sample| sample.stage == CycleStage::Return).or(samples.last());
    StrokeMetrics {
        contact_s: contact.map(|sample| sample.t_s),
        max_error_approach_mm: worst(CycleStage::Approach),
        max_error_cut_mm: worst(CycleStage::Cut),
        depth_error_mm: returning.map_or(full_mm, |sample| full_mm - sample.y_mm),
        over_travel_mm: samples.iter().map(|sample| sample.y_mm - full_mm).fold(0.0, f64::max),
        final_error_mm: samples.last().map_or(0.0, |sample| sample.r_mm - sample.y_mm),
    }
}
