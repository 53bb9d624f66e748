//! Reads files and says what is in them (row A1, A2, P1, N1 … N5).

use super::{Answer, Refusal};

/// Arguments of `annulus inspect`.
#[derive(Debug, clap::Args)]
pub(crate) struct InspectArgs {
    /// Files, folders or zips.
    #[arg(required = true, value_name = "PATH")]
    pub(crate) paths: Vec<std::path::PathBuf>,
    #[command(flatten)]
    pub(crate) reading: super::ReadingArgs,
}

/// Runs the command.
pub(crate) fn run(args: &InspectArgs) -> Result<Answer, Refusal> {
    todo!("{args:?}")
}
