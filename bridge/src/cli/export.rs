//! Writes a program in another controller's words.

use super::{Answer, Refusal};

/// Arguments of `annulus export`.
#[derive(Debug, clap::Args)]
pub(crate) struct ExportArgs {
    #[command(flatten)]
    pub(crate) job: super::JobArgs,
    /// Controller: excellon or grbl.
    #[arg(long, value_name = "NAME")]
    pub(crate) to: String,
    /// Where to write: a file, or a folder.
    #[arg(short, long, value_name = "FILE|DIR")]
    pub(crate) output: std::path::PathBuf,
}

/// Runs the command.
pub(crate) fn run(args: &ExportArgs) -> Result<Answer, Refusal> {
    todo!("{args:?}")
}
