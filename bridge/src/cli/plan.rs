//! Chooses bits and puts the holes in order.

use super::{Answer, Refusal};

/// Arguments of `annulus plan`.
#[derive(Debug, clap::Args)]
pub(crate) struct PlanArgs {
    #[command(flatten)]
    pub(crate) job: super::JobArgs,
    /// Write the program to this file.
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<std::path::PathBuf>,
}

/// Runs the command.
pub(crate) fn run(args: &PlanArgs) -> Result<Answer, Refusal> {
    todo!("{args:?}")
}
