//! Prints a fresh one-time address for a running bridge.

use super::{Answer, Refusal};

/// Arguments of `annulus link`.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct LinkArgs {}

/// Runs the command.
pub(crate) fn run(args: &LinkArgs) -> Result<Answer, Refusal> {
    todo!("{args:?}")
}
