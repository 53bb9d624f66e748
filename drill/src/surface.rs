//! The height map of the board on a drill of our own, as it is kept, and programs that follow it (N17).
//!
//! ```text
//! Touched ─▶ KeptSurface ─ same job, same zero, same height? ─▶ the program with its depth as the board's, told in the pre-flight
//! ```
//!
//! Comes in: a program, how the drill stands. Goes out: what becomes of the program, and what there is to read of that. It is the
//! program as it was planned that is kept and journaled: what follows a map is made of it each time, so none is levelled twice. Does
//! not know who touched the board.

use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::Program;
use annulus_core::level::{HeightMap, TOLERANCE, key_of, level, same_job};
use annulus_core::machine::Machine;
use annulus_core::units::Length;
use annulus_core::wire::{PreflightRow, RowVerdict};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A height map, and where its zero of Z was.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeptSurface {
    /// The map.
    pub map: HeightMap,
    /// Height of the board's surface in machine coordinates that its heights are over.
    pub height: Length,
}

impl KeptSurface {
    /// Whether it can be believed.
    pub fn is_whole(&self) -> bool {
        self.map.is_whole() && (-Length::LIMIT..=Length::LIMIT).contains(&self.height)
    }

    /// Why it does not fit to `machine` with its work zero at these steps; none where it does.
    pub(crate) fn misplaced(&self, machine: &Machine, zero_steps: Option<[i64; 2]>) -> Option<Diagnostic> {
        let Some(zero) = zero_steps else {
            return Some(Diagnostic::error("level.other_zero").with("mm", "?"));
        };
        let zero = [0, 1].map(|axis: usize| machine.axis(axis).scale.length(zero[axis]));
        let other_height =
            || (self.height != machine.process.surface).then(|| Diagnostic::error("level.other_height"));
        self.map.refused(&self.map.job, zero, true).or_else(other_height)
    }
}

/// What became of a program.
pub(crate) struct Followed {
    /// The program that is to be run.
    pub(crate) program: Program,
    /// The map that it follows.
    pub(crate) follows: Option<Arc<KeptSurface>>,
    /// What there is to read of that.
    pub(crate) told: Option<PreflightRow>,
}

/// How a drill stands to a program whose depth may follow its board.
pub(crate) struct Ground<'a> {
    pub(crate) machine: &'a Machine,
    /// Machine steps of the work zero.
    pub(crate) zero_steps: Option<[i64; 2]>,
    /// The map that was kept.
    pub(crate) kept: Option<&'a Arc<KeptSurface>>,
    /// Of a job that is taken up: the key of the map that it was begun with, if it was with one.
    pub(crate) begun: Option<Option<&'a str>>,
}

/// The `program` as it is run there: its depth follows the map that was kept, where it was measured for this job. A job that is
/// taken up follows what it was begun with.
pub(crate) fn followed(program: Program, ground: &Ground<'_>) -> Followed {
    let row = |verdict, finding| PreflightRow { finding, verdict };
    let as_planned = |program, told| Followed { program, follows: None, told };
    let kept = match (ground.begun, ground.kept) {
        (Some(None), _) | (None, None) => return as_planned(program, None),
        (Some(Some(before)), Some(kept)) if kept.map.key() == before => kept,
        (Some(Some(_)), _) => {
            let told = row(RowVerdict::Fail, Diagnostic::error("level.other_map"));
            return as_planned(program, Some(told));
        }
        (None, Some(kept)) if !same_job(&kept.map.job, &key_of(&program)) => {
            let told = row(RowVerdict::Warn, Diagnostic::warning("level.not_used"));
            return as_planned(program, Some(told));
        }
        (None, Some(kept)) => kept,
    };
    let fits = kept.misplaced(ground.machine, ground.zero_steps).map_or(Ok(()), Err);
    match fits.and_then(|()| level(&program, &kept.map, TOLERANCE)) {
        Err(why) => as_planned(program, Some(row(RowVerdict::Fail, why))),
        Ok(levelled) => {
            let mm = format!("{:.3}", levelled.correction.largest().mm());
            let told = row(RowVerdict::Warn, Diagnostic::warning("level.follows").with("mm", mm));
            Followed { program: levelled.program, follows: Some(Arc::clone(kept)), told: Some(told) }
        }
    }
}
