//! Checks this computer.

use super::{Answer, Refusal};

/// Arguments of `annulus doctor`.
#[derive(Debug, Default, clap::Args)]
pub(crate) struct DoctorArgs {}

/// Runs the command.
pub(crate) fn run(args: &DoctorArgs) -> Result<Answer, Refusal> {
    todo!("{args:?}")
}
