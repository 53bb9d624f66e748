//! Holes for the machine's drills.

use super::super::HoleOrder;
use super::{Cut, Rules};
use crate::job::Asked;
use crate::machine::Machine;
use crate::units::Length;
use serde::{Deserialize, Serialize};

/// Default point angle of a drill, in degrees.
pub const POINT_DEG: f64 = 130.0;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Drill {
    pub holes: Holes,
    pub order: HoleOrder,
    /// Largest difference between a hole and its drill; `None`: the machine's `rack.tolerance`.
    pub tolerance: Option<Length>,
    /// Depth of a peck, after which the drill retracts to clear chips; 0 for none.
    pub peck: Length,
    /// Point angle of the drills in degrees: through a board they go deeper by the height of the point; 180
    /// is flat.
    pub point_deg: f64,
    /// Point angle of individual drills, by diameter.
    pub points: Vec<(Length, f64)>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Holes {
    /// The holes of the board.
    #[default]
    Board,
    /// The pin holes, symmetric about the flip axis.
    Alignment,
}

impl Default for Drill {
    fn default() -> Self {
        Self {
            holes: Holes::Board,
            order: HoleOrder::Shortest,
            tolerance: None,
            peck: Length::ZERO,
            point_deg: POINT_DEG,
            points: Vec::new(),
        }
    }
}

impl Drill {
    pub(super) fn rules(&self) -> Rules<'_> {
        let makes_pins = self.holes == Holes::Alignment;
        Rules { cut: Cut::Drilled, makes_holes: true, makes_pins, ..Rules::default() }
    }

    pub(super) fn ask(&self, asked: &mut Asked, reach: Length, machine: &Machine) {
        if self.holes == Holes::Alignment {
            asked.pins = true;
            return;
        }
        asked.holes = Some(true);
        asked.tolerance = asked.tolerance.max(self.tolerance_on(machine));
        asked.drilled = asked.drilled.max(reach);
    }

    /// Largest difference between a hole and its drill, on `machine`.
    pub fn tolerance_on(&self, machine: &Machine) -> Length {
        self.tolerance.unwrap_or(machine.rack_tolerance)
    }
}
