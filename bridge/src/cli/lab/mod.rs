//! `annulus lab`: one case of motion from flags, for a report; and files of expected numbers, recomputed (M1, M2, N24).
//!
//! Comes in: parsed arguments. Goes out: the answer of the subcommand. Does not know the maths.

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
    /// One move under the laws of motion: place, speed, acceleration, jerk.
    Profile(profile::ProfileArgs),
    /// The step automaton, interrupt by interrupt.
    Automaton(automaton::AutomatonArgs),
    /// Table and spindles in time, with and without overlap.
    Cycle(Box<cycle::CycleArgs>),
    /// The closed loop: a step or a stroke, fuzzy PID beside plain PID.
    Servo(servo::ServoArgs),
    /// Recompute every case of files of expected numbers from its inputs, and say how far off each is.
    Check(check::CheckArgs),
}

/// Runs the subcommand.
pub(crate) fn run(args: &LabArgs, json: bool) -> Result<Answer, Refusal> {
    let mut answer = match &args.what {
        What::Profile(args) => profile::run(args),
        What::Automaton(args) => automaton::run(args),
        What::Cycle(args) => cycle::run(args),
        What::Servo(args) => servo::run(args),
        What::Check(args) => return check::run(args),
    }?;
    // Who asked for the object does not need the plot or the table beside it.
    if json {
        answer.text.clear();
    }
    Ok(answer)
}
