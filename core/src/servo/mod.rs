//! A closed-loop axis: staged fuzzy PID, plain PID for comparison, the servo, and complete runs.
//!
//! ```text
//!  reference ──▶(−)── e ──▶ controller ── u, V ──▶(+)──▶ plant ──▶ position y, mm
//!                ▲            ▲  stage, contact     ▲ load, V        │
//!                └────────────┴─────────────────────┴────────────────┘
//! ```
//!
//! Source: Ma Jie and You Youpeng, article on a drilling motion controller (structure, stages). Membership,
//! rules, gains and plant are reconstructed; see the manual's page on the Lab.

mod fuzzy;
mod pid;
mod plant;
mod run;
mod stroke;

use crate::error;
pub use fuzzy::{FuzzyRules, LEVELS, Table, Tables, infer};
pub use pid::{CycleStage, Fuzzy, Gains, Memory, ServoController, control, retuned_pid, staged_fuzzy};
pub use plant::{Plant, PlantState, Zoh, default_plant};
pub use run::{
    Load, LoadMetrics, ServoSample, StepMetrics, StepRun, load_metrics, step_metrics, step_response,
};
pub use stroke::{Reference, ReferenceMoment, StrokeMetrics, StrokeRun, StrokeSample, stroke};

use crate::diagnostic::Diagnostic;

pub const MOST_SAMPLES: usize = 1_000_000;

fn within(field: &str, value: f64, low: f64, high: f64) -> Result<(), Diagnostic> {
    if value >= low && value <= high {
        return Ok(());
    }
    let why = error!("servo.bad_parameter", field = field, value = value, ..);
    Err(why.with("low", low).with("high", high))
}

/// Number of samples over `duration_s`; refuses zero and too many.
fn samples_of(duration_s: f64, sample_s: f64) -> Result<usize, Diagnostic> {
    let count = duration_s / sample_s;
    if count.is_finite() && (0.5..=MOST_SAMPLES as f64).contains(&count) {
        return Ok(libm::round(count) as usize);
    }
    let why = error!("servo.too_long", duration = duration_s, ..);
    Err(why.with("sample", sample_s).with("most", MOST_SAMPLES))
}
