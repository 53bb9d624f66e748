//! Response of the closed loop to a step or a load, and its metrics.
//!
//! ```text
//!  y ^        ,-.   overshoot
//!    |  _____/___\_________________ r ± 2 %      settling: the last sample outside
//!    |      /     '-'
//!    |     /  rise: the first sample at 90 % of r
//!    +----+-------------------------> t          the loop starts at rest at 0 with cleared memory
//! ```

use super::pid::{CycleStage, Memory, ServoController, control};
use super::plant::{Plant, PlantState};
use super::{samples_of, within};
use crate::diagnostic::Diagnostic;
use serde::Serialize;

/// A load on the axis, as an equivalent control voltage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Load {
    /// In V; negative acts against the positive direction.
    pub volts: f64,
    pub from_s: f64,
    /// End of the load, s; none: until the end of the run.
    pub to_s: Option<f64>,
}

/// A step of the setpoint, or a load at a setpoint of 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepRun {
    pub controller: ServoController,
    pub plant: Plant,
    /// Stage of the axis.
    pub stage: CycleStage,
    /// Target, mm from 0.
    pub setpoint_mm: f64,
    /// Observed time, s.
    pub duration_s: f64,
    pub load: Load,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ServoSample {
    /// End of the sample, s.
    pub t_s: f64,
    /// Position at the end, mm.
    pub y_mm: f64,
    /// Control during the sample, V.
    pub u_v: f64,
}

/// Metrics of a step response.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct StepMetrics {
    /// Overshoot, % of the step.
    pub overshoot_pct: f64,
    /// End of the last sample outside ±2 %, s; 0 if none was outside.
    pub settling_s: f64,
    /// End of the first sample at 90 %, s; none if it was not reached.
    pub rise90_s: Option<f64>,
    /// Mean of reference − position over the last 50 ms, mm.
    pub steady_error_mm: f64,
    /// Integral of |reference − position| over time, mm·s.
    pub iae_mm_s: f64,
}

/// Metrics of a load.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LoadMetrics {
    /// Greatest deviation from the setpoint, mm.
    pub max_deviation_mm: f64,
    /// Final position, mm from the setpoint.
    pub final_mm: f64,
    /// Position at the end of the load, mm from the setpoint.
    pub at_window_end_mm: f64,
}

/// Simulates the loop. The load acts in every sample that starts within its time.
pub fn step_response(run: &StepRun) -> Result<Vec<ServoSample>, Diagnostic> {
    run.controller.check()?;
    run.plant.check()?;
    within("setpoint", run.setpoint_mm, -1e6, 1e6)?;
    within("load", run.load.volts, -1e6, 1e6)?;
    within("load-from", run.load.from_s, 0.0, 1e6)?;
    within("load-to", run.load.to_s.unwrap_or(run.load.from_s), run.load.from_s, 1e6)?;
    let sample_s = run.controller.sample_s;
    let count = samples_of(run.duration_s, sample_s)?;
    let plant = run.plant.every(sample_s);
    // A small margin, because the start of a sample is a rounded product.
    let hair = 1e-6 * sample_s;
    let loaded = |t: f64| t >= run.load.from_s - hair && run.load.to_s.is_none_or(|to| t < to - hair);
    let (mut state, mut memory) = (PlantState::default(), Memory::default());
    let mut samples = Vec::with_capacity(count);
    for k in 0..count {
        let u_v = control(&run.controller, &mut memory, run.stage, run.setpoint_mm, state.y_mm, 0.0);
        let load_v = if loaded(k as f64 * sample_s) { run.load.volts } else { 0.0 };
        state = plant.step(state, u_v + load_v);
        samples.push(ServoSample { t_s: (k + 1) as f64 * sample_s, y_mm: state.y_mm, u_v });
    }
    Ok(samples)
}

/// Metrics of a step to `setpoint_mm`, sampled every `sample_s`. None for a setpoint of 0.
pub fn step_metrics(samples: &[ServoSample], setpoint_mm: f64, sample_s: f64) -> Option<StepMetrics> {
    if setpoint_mm == 0.0 || samples.is_empty() {
        return None;
    }
    let r = setpoint_mm;
    let beyond = samples.iter().map(|sample| (sample.y_mm - r) / r).fold(0.0, f64::max);
    let outside = samples.iter().rfind(|sample| (sample.y_mm - r).abs() > 0.02 * r.abs());
    let risen = samples.iter().find(|sample| sample.y_mm / r >= 0.9);
    let last = (libm::round(0.05 / sample_s) as usize).clamp(1, samples.len());
    let tail = &samples[samples.len() - last..];
    Some(StepMetrics {
        overshoot_pct: 100.0 * beyond,
        settling_s: outside.map_or(0.0, |sample| sample.t_s),
        rise90_s: risen.map(|sample| sample.t_s),
        steady_error_mm: tail.iter().map(|sample| r - sample.y_mm).sum::<f64>() / last as f64,
        iae_mm_s: samples.iter().map(|sample| (r - sample.y_mm).abs()).sum::<f64>() * sample_s,
    })
}

/// Metrics of a load that ends at `to_s` (none: at the end of the run). None without samples.
pub fn load_metrics(
    samples: &[ServoSample],
    setpoint_mm: f64,
    to_s: Option<f64>,
    sample_s: f64,
) -> Option<LoadMetrics> {
    let last = samples.last()?;
    let end = to_s.map_or(samples.len(), |to| libm::round(to / sample_s).max(1.0) as usize);
    let at_end = &samples[end.min(samples.len()) - 1];
    Some(LoadMetrics {
        max_deviation_mm: samples.iter().map(|one| (one.y_mm - setpoint_mm).abs()).fold(0.0, f64::max),
        final_mm: last.y_mm - setpoint_mm,
        at_window_end_mm: at_end.y_mm - setpoint_mm,
    })
}
