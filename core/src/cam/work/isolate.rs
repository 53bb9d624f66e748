//! Grooves around the copper.

use super::{CutDirection, Rules};
use crate::geometry::Point;
use crate::units::Length;
use serde::{Deserialize, Serialize};

/// Isolation passes around the copper.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Isolate {
    /// Number of grooves side by side, 1 … 20.
    pub passes: u32,
    /// Overlap of neighbouring grooves, in per cent of their width, below 100.
    pub overlap_percent: f64,
    /// Cutting direction of the groove next to the copper.
    pub direction: CutDirection,
    /// How far a closed groove continues beyond its start.
    pub loop_overlap: Length,
    /// One groove in the middle between neighbours: all other copper stays.
    pub voronoi: bool,
    /// Mill away strips of copper between grooves that are too thin to hold.
    pub slivers: bool,
    /// Names of smaller tools, for gaps that the previous tools could not enter.
    pub further: Vec<String>,
    /// Local changes that the user chose.
    pub cures: Vec<LocalIsolation>,
}

/// A local change of isolation at one gap.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LocalIsolation {
    /// One side of the gap, in the coordinates of the board as placed for this operation.
    pub from: Point,
    /// The other side of the gap.
    pub to: Point,
    pub with: Remedy,
}

/// Remedy for a gap too narrow for the tool.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Remedy {
    /// Another tool, by name; a V-bit as deep as fits the gap.
    Bit(String),
    /// The V-bit at this depth.
    Depth(Length),
    /// The narrowest tool of the operation in the middle of the gap, a V-bit no deeper than necessary. Its
    /// excess width is lost from the copper on both sides.
    Centred,
}

impl Default for Isolate {
    fn default() -> Self {
        Self {
            passes: 2,
            overlap_percent: 30.0,
            direction: CutDirection::Climb,
            loop_overlap: Length::from_um(500),
            voronoi: false,
            slivers: true,
            further: Vec::new(),
            cures: Vec::new(),
        }
    }
}

impl Isolate {
    pub(super) fn rules(&self) -> Rules<'_> {
        Rules { further: &self.further, cures: &self.cures, separates: true, ..Rules::default() }
    }

    /// Sets the remedy for the gap between `from` and `to`, replacing an earlier one. True if that is a
    /// change.
    pub fn cure(&mut self, from: Point, to: Point, with: Remedy) -> bool {
        let cure = LocalIsolation { from, to, with };
        let new = !self.cures.contains(&cure);
        if new {
            self.cures.retain(|other| (other.from, other.to) != (from, to));
            self.cures.push(cure);
        }
        new
    }
}
