//! The height of the board on Annulus' own drill: the tool that the Z zero is valid for, the saved height
//! map, and programs that follow it.
//!
//! ```text
//! Touched ─▶ KeptSurface ─ same job, same zero, same height? ─▶ the program with corrected depths
//! ```
//!
//! Only the program as planned is saved and journaled. The corrected one is derived each time, so no
//! correction is applied twice.

use annulus_core::control::BoardHeight;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::{Bit, Program};
use annulus_core::level::{HeightMap, TOLERANCE, key_of, level, same_job};
use annulus_core::machine::Machine;
use annulus_core::units::Length;
use annulus_core::wire::{PreflightRow, RowVerdict};
use annulus_core::{error, warning};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct KeptSurface {
    pub map: HeightMap,
    /// Height of the board's surface in machine coordinates; the map's heights are above it.
    pub height: Length,
}

impl KeptSurface {
    /// Returns `true` if its values are valid.
    pub fn is_whole(&self) -> bool {
        self.map.is_whole() && (-Length::LIMIT..=Length::LIMIT).contains(&self.height)
    }

    /// Why it does not fit `machine` with its work zero at these steps; `None` if it fits.
    pub(crate) fn misplaced(&self, machine: &Machine, zero_steps: Option<[i64; 2]>) -> Option<Diagnostic> {
        let Some(zero) = zero_steps else {
            return Some(error!("level.other_zero", mm = "?"));
        };
        let zero = [0, 1].map(|axis: usize| machine.axis(axis).scale.length(zero[axis]));
        let other_height = || (self.height != machine.process.surface).then(|| error!("level.other_height"));
        self.map.refused(&self.map.job, zero, true).or_else(other_height)
    }
}

pub(crate) struct Followed {
    pub(crate) program: Program,
    pub(crate) follows: Option<Arc<KeptSurface>>,
    pub(crate) told: Option<PreflightRow>,
}

/// Inputs that decide whether a program follows a height map.
pub(crate) struct Ground<'a> {
    pub(crate) machine: &'a Machine,
    pub(crate) zero_steps: Option<[i64; 2]>,
    pub(crate) kept: Option<&'a Arc<KeptSurface>>,
    /// For a resumed job: the key of the map that it started with; the inner `None` if it started without
    /// one.
    pub(crate) begun: Option<Option<&'a str>>,
}

/// Corrects the depths of `program` by the saved map, if that was measured for this job. A resumed job uses
/// the map it started with.
pub(crate) fn followed(program: Program, ground: &Ground<'_>) -> Followed {
    let row = |verdict, finding| PreflightRow { finding, verdict };
    let as_planned = |program, told| Followed { program, follows: None, told };
    let kept = match (ground.begun, ground.kept) {
        (Some(None), _) | (None, None) => return as_planned(program, None),
        (Some(Some(before)), Some(kept)) if kept.map.key() == before => kept,
        (Some(Some(_)), _) => {
            let told = row(RowVerdict::Fail, error!("level.other_map"));
            return as_planned(program, Some(told));
        }
        (None, Some(kept)) if !same_job(&kept.map.job, &key_of(&program)) => {
            let told = row(RowVerdict::Warn, warning!("level.not_used"));
            return as_planned(program, Some(told));
        }
        (None, Some(kept)) => kept,
    };
    let fits = kept.misplaced(ground.machine, ground.zero_steps).map_or(Ok(()), Err);
    match fits.and_then(|()| level(&program, &kept.map, TOLERANCE)) {
        Err(why) => as_planned(program, Some(row(RowVerdict::Fail, why))),
        Ok(levelled) => {
            let mm = format!("{:.3}", levelled.correction.largest().mm());
            let told = row(RowVerdict::Warn, warning!("level.follows", mm = mm));
            Followed { program: levelled.program, follows: Some(Arc::clone(kept)), told: Some(told) }
        }
    }
}

/// The tool for which the board height is known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct KnownHeight {
    /// Whether that is the current tool.
    pub height: BoardHeight,
    /// The tool; `None` if zero was set with a tool that no job requested.
    pub of: Option<Bit>,
    /// Steps of Z by which the tool setter is above the board, from a tool of known length; `None` before
    /// one met it.
    pub setter_steps: Option<i64>,
}
