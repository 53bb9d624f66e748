//! Lists the machines that are known.

use super::{Answer, Refusal};

/// Arguments of `annulus machines`.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct MachinesArgs {}

/// Runs the command.
pub(crate) fn run(args: &MachinesArgs) -> Result<Answer, Refusal> {
    todo!("{args:?}")
}
