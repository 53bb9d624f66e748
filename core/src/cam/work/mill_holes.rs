//! Slots, and holes without a suitable drill.

use super::{Cut, CutDirection, Rules, SMALL_MILL};
use crate::job::Asked;
use crate::units::Length;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MillHoles {
    pub slots: bool,
    /// Round holes without a suitable drill.
    pub holes: bool,
    pub direction: CutDirection,
    /// Names of smaller tools, for features too narrow for the tool.
    pub further: Vec<String>,
}

impl Default for MillHoles {
    fn default() -> Self {
        let further = vec![SMALL_MILL.to_owned()];
        Self { slots: true, holes: true, direction: CutDirection::Climb, further }
    }
}

impl MillHoles {
    pub(super) fn rules(&self) -> Rules<'_> {
        Rules { cut: Cut::Through, further: &self.further, makes_holes: true, ..Rules::default() }
    }

    pub(super) fn ask(&self, asked: &mut Asked, reach: Length) {
        asked.holes = asked.holes.max(Some(self.holes));
        asked.slots = asked.slots.max(Some(self.slots));
        asked.milled = asked.milled.max(reach);
    }
}
