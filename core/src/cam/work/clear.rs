//! Removal of all copper outside the design.

use super::{CutDirection, Operation, Rules, Work};
use crate::board::COPPER_THICKNESS;
use crate::job::{Cleared, Cutter};
use crate::units::Length;
use serde::{Deserialize, Serialize};

/// Remove all copper outside the design.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Clear {
    /// Distance of neighbouring toolpaths, in per cent of the cut's width, above 0, at most 100.
    pub stepover_percent: f64,
    /// Extra distance from the copper.
    pub margin: Length,
    pub direction: CutDirection,
    /// Names of smaller tools, for areas that the previous tools did not reach.
    pub further: Vec<String>,
}

impl Default for Clear {
    fn default() -> Self {
        Self {
            stepover_percent: 60.0,
            margin: Length::ZERO,
            direction: CutDirection::Climb,
            further: Vec::new(),
        }
    }
}

impl Clear {
    pub(super) fn rules(&self) -> Rules<'_> {
        Rules { further: &self.further, separates: true, ..Rules::default() }
    }

    /// Its narrowest cut. Unknown tools are skipped.
    pub(super) fn cleared(&self, operation: &Operation, work: &Work) -> Option<Cleared> {
        let depth = if operation.depth > Length::ZERO { operation.depth } else { Length::LIMIT };
        let bits = operation.bit_names().into_iter().filter_map(|name| work.bit(name));
        let mills = bits.filter(|bit| bit.cutter != Cutter::Drill);
        let kept = (self.margin, work.setup.margin);
        mills.filter_map(|bit| Cleared::by(bit, depth, COPPER_THICKNESS, kept)).min_by_key(|cut| cut.surface)
    }
}
