//! How the length of each tool of a job will become known, and the same job above a board whose height
//! another tool found. Moves nothing.

use super::{Context, Prepared, bit_of_leg, row};
use annulus_core::check;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::{Bit, Mark, Program};
use annulus_core::machine::{Machine, Output};
use annulus_core::wire::{PreflightRow, RowVerdict};
use annulus_core::{code, error, note};

/// The tools that the job needs from `from_leg`, in order of use.
fn asked(program: &Program, from_leg: usize) -> Vec<&Bit> {
    let later =
        program.legs.iter().skip(from_leg + usize::from(from_leg > 0)).filter_map(|leg| match leg.mark {
            Mark::ToolChange(bit) => program.bits.get(bit as usize),
            _ => None,
        });
    let mut all: Vec<&Bit> = bit_of_leg(program, from_leg).into_iter().chain(later).collect();
    all.dedup();
    all
}

/// The rows about the lengths of tools that the user changes.
pub(super) fn rows(program: &Program, context: &Context, from_leg: usize) -> Vec<PreflightRow> {
    let machine = &context.machine;
    let tools = asked(program, from_leg);
    let Some(first) = tools.first() else { return Vec::new() };
    if machine.has_equal_lengths() {
        // A job with one tool needs no declaration of equal lengths.
        let verdict = if machine.output == Output::Virtual { RowVerdict::Pass } else { RowVerdict::Warn };
        let word = if machine.is_changed_by_hand() {
            code!("preflight.lengths_equal")
        } else {
            code!("preflight.lengths_own")
        };
        return (tools.len() > 1).then(|| row(verdict, Diagnostic::note(word))).into_iter().collect();
    }
    let of = context.known.of.as_ref();
    let first_is_known = context.known.height.may_cut() && of.is_none_or(|of| of == *first);
    let told = |code: &str| Diagnostic::note(code).with("bit", first.titled());
    let mut rows = vec![if first_is_known {
        row(RowVerdict::Warn, told(code!("preflight.length_of_first")))
    } else {
        row(RowVerdict::Pass, told(code!("preflight.length_asked")))
    }];
    let others = tools.len() - 1;
    if others > 0 {
        rows.push(row(RowVerdict::Pass, note!("preflight.lengths_asked", count = others)));
    }
    rows
}

impl Prepared {
    /// The same steps above the board as `machine` has it, checked again at the new height.
    pub(crate) fn rebased(&self, machine: &Machine) -> Result<Self, Diagnostic> {
        let mut zero = machine.on_surface();
        zero[..2].copy_from_slice(&self.zero[..2]);
        let checked = check::verify_each(&self.stream.start(), || self.stream.segments(), machine, zero);
        checked.map_err(|found| {
            let none = || error!("control.busy");
            found.into_iter().next().unwrap_or_else(none)
        })?;
        Ok(Self {
            key: self.key.clone(),
            bytes: self.bytes.clone(),
            program: self.program.clone(),
            follows: self.follows.clone(),
            stream: self.stream.clone(),
            digest: self.digest.clone(),
            left_ticks: self.left_ticks.clone(),
            zero,
            checks: self.checks.clone(),
            context: Context { machine: machine.clone(), ..self.context.clone() },
            feed_percent: self.feed_percent,
        })
    }
}
