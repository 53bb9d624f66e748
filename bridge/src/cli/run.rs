//! Drills a job.

use super::{Answer, Refusal};

/// Arguments of `annulus run`.
#[derive(Debug, clap::Args)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub(crate) job: super::JobArgs,
    /// How many times faster than life the virtual drill runs.
    #[arg(long, default_value_t = 1.0)]
    pub(crate) speed: f64,
}

/// Runs the command.
pub(crate) fn run(args: &RunArgs, json: bool) -> Result<Answer, Refusal> {
    todo!("{args:?} {json}")
}
