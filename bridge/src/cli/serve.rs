//! Serves the page on this computer.

use super::{Answer, Refusal};

/// Arguments of `annulus serve`.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct ServeArgs {
    /// Port; 0 takes a free one.
    #[arg(long)]
    pub(crate) port: Option<u16>,
    /// Do not open a browser.
    #[arg(long)]
    pub(crate) no_open: bool,
    /// Machine: a preset's name or a machine file.
    #[arg(long)]
    pub(crate) machine: Option<String>,
    /// How many times faster than life the virtual drill runs.
    #[arg(long)]
    pub(crate) speed: Option<f64>,
}

/// Runs the command.
pub(crate) fn run(args: &ServeArgs, json: bool) -> Result<Answer, Refusal> {
    todo!("{args:?} {json}")
}
