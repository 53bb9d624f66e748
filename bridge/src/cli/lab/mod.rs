//! `annulus lab`: computes one case of motion from flags, or checks files of expected numbers.

mod automaton;
mod check;
mod cycle;
mod output;
mod profile;
mod servo;

use super::{Answer, Refusal};

/// Arguments of `annulus lab`.
#[derive(Debug, clap::Args)]
pub(crate) struct LabArgs {
    #[command(subcommand)]
    what: What,
}

/// What to compute.
#[derive(Debug, clap::Subcommand)]
enum What {
    /// Compute one move under the laws of motion: position, speed, acceleration, jerk.
    Profile(profile::ProfileArgs),
    /// Compute the step automaton, interrupt by interrupt.
    Automaton(automaton::AutomatonArgs),
    /// Compute table and spindles in time, with and without overlap.
    Cycle(Box<cycle::CycleArgs>),
    /// Compute the closed loop: a step or a drill cycle, fuzzy PID next to plain PID.
    Servo(servo::ServoArgs),
    /// Recompute every case in files of expected numbers, and report the deviations.
    Check(check::CheckArgs),
}

pub(crate) fn run(args: &LabArgs, json: bool) -> Result<Answer, Refusal> {
    let mut answer = match &args.what {
        What::Profile(args) => profile::run(args),
        What::Automaton(args) => automaton::run(args),
        What::Cycle(args) => cycle::run(args),
        What::Servo(args) => servo::run(args),
        What::Check(args) => return check::run(args),
    }?;
    // JSON output needs no plot or table.
    if json {
        answer.text.clear();
    }
    Ok(answer)
}
