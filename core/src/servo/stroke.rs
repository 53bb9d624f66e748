//! A drill cycle of the closed-loop Z axis: down to the board, through it, a dwell, and back. Includes
//! stages, contact signal, feed-forward and cutting load.
//!
//! Depth is measured downwards from the top rest position, mm.
//!
//! ```text
//!  depth   0 \                      approach: P only
//!             \                     contact latches at depth H
//!          H --\---------------/--  cut: P, I, D; the load pushes back
//!       H + D   \_____________/     dwell, then fast return: P, and I near the end
//!               | down | dwell | up | rest
//! ```

use super::pid::{CycleStage, Memory, ServoController, control};
use super::plant::{Plant, PlantState};
use super::{samples_of, within};
use crate::diagnostic::Diagnostic;
use serde::Serialize;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReferenceMoment {
    /// Distance along the move, mm from its start.
    pub s_mm: f64,
    pub v_mm_per_s: f64,
    pub a_mm_per_s2: f64,
}

/// A move from rest to rest as a function of time.
#[derive(Clone, Copy)]
pub struct Reference<'a> {
    pub duration_s: f64,
    /// Reference by seconds from the start; constant after the end.
    pub at: &'a dyn Fn(f64) -> ReferenceMoment,
}

#[derive(Clone, Copy)]
pub struct StrokeRun<'a> {
    pub controller: ServoController,
    pub plant: Plant,
    /// H: from the top rest position to the board's surface, mm.
    pub height_mm: f64,
    /// D: from the surface to the bottom of stroke, mm.
    pub depth_mm: f64,
    /// Move down over H + D.
    pub down: Reference<'a>,
    /// Move up over H + D.
    pub up: Reference<'a>,
    /// Dwell at the bottom of stroke, s.
    pub dwell_s: f64,
    /// Observed time after the return, s.
    pub rest_s: f64,
    /// Feed forward the reference's speed and acceleration.
    pub feed_forward: bool,
    /// Load of cutting, V.
    pub cutting_load_v: f64,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrokeSample {
    pub t_s: f64,
    /// Reference depth, mm.
    pub r_mm: f64,
    /// Actual depth, mm.
    pub y_mm: f64,
    /// Control including feed-forward, V.
    pub u_v: f64,
    pub stage: CycleStage,
}

/// Metrics of a drill cycle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StrokeMetrics {
    /// Time at which the contact signal latched, s; none if the board was not touched.
    pub contact_s: Option<f64>,
    /// Greatest |reference − position| before contact, mm.
    pub max_error_approach_mm: f64,
    pub max_error_cut_mm: f64,
    /// Missing depth when the return starts, mm.
    pub depth_error_mm: f64,
    pub over_travel_mm: f64,
    /// Reference − position in the last sample, mm.
    pub final_error_mm: f64,
}

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

/// Refuses invalid parameters; returns the number of samples.
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
