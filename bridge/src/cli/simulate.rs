//! Computes the step stream and says how long it takes.

use super::{Answer, Refusal};

/// Arguments of `annulus simulate`.
#[derive(Debug, clap::Args)]
pub(crate) struct SimulateArgs {
    #[command(flatten)]
    pub(crate) job: super::JobArgs,
    /// Print the first runs of the stream, so that two builds can find where they part.
    #[arg(long)]
    pub(crate) digest_trace: bool,
}

/// Runs the command.
pub(crate) fn run(args: &SimulateArgs) -> Result<Answer, Refusal> {
    todo!("{args:?}")
}
