//! Cutting out the board.

use super::{Cut, CutDirection, Operation, Rules, Work};
use crate::geometry::Point;
use crate::job::AskedEdge;
use crate::units::Length;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CutOut {
    /// Side of the outline for the tool's path.
    pub side: CutSide,
    pub direction: CutDirection,
    /// Number of tabs, spread evenly along the outline; 0 for none.
    pub tabs: u32,
    pub tab_width: Length,
    /// Height of a tab above the bottom of the board; with mouse-bites a tab is as high as the board.
    pub tab_height: Length,
    /// Middles of user-placed tabs, each at the nearest point of the outline; if there are any, none are
    /// spread.
    pub tab_at: Vec<Point>,
    /// Rows of holes across the tabs, so that they break.
    pub bites: bool,
    pub bite_hole: Length,
    /// Distance of mouse-bite holes.
    pub bite_pitch: Length,
    /// Ramp angle in degrees along the path; 0 for straight down.
    pub ramp_deg: f64,
    /// Names of smaller tools, for inner contours and inlets that the previous tools could not enter.
    pub further: Vec<String>,
}

/// Side of the outline for the tool's path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CutSide {
    /// The board keeps its size.
    #[default]
    Outside,
    /// The tool centre is on the line.
    On,
}

impl Default for CutOut {
    fn default() -> Self {
        let mm = Length::from_mm;
        Self {
            side: CutSide::Outside,
            direction: CutDirection::Climb,
            tabs: 4,
            tab_width: mm(2.0),
            tab_height: mm(0.6),
            tab_at: Vec::new(),
            bites: false,
            bite_hole: mm(0.5),
            bite_pitch: mm(0.8),
            ramp_deg: 3.0,
            further: Vec::new(),
        }
    }
}

impl CutOut {
    pub(super) fn rules(&self) -> Rules<'_> {
        let tabs = Some(self.tabs_left());
        Rules { cut: Cut::Through, further: &self.further, tabs, ..Rules::default() }
    }

    fn tabs_left(&self) -> u32 {
        if self.tab_at.is_empty() { self.tabs } else { self.tab_at.len() as u32 }
    }

    pub(super) fn edge(&self, depth: Length, (work, operation): (&Work, &Operation)) -> AskedEdge {
        let widest =
            operation.bit_names().into_iter().filter_map(|name| work.bit(name)).map(|bit| bit.diameter).max();
        let tab = (self.tab_width + widest.unwrap_or_default()).nm();
        let tabs = i64::from(self.tabs).max(self.tab_at.len() as i64);
        let holds = self.bites || self.tab_height > Length::ZERO;
        let main = work.bit(&operation.bit).map(|bit| bit.diameter);
        AskedEdge {
            depth,
            on_line: self.side == CutSide::On,
            spared: Length::from_nm(tab.saturating_mul(tabs)),
            zones: !work.setup.exclusions.is_empty(),
            bit: main.or(widest).unwrap_or_default(),
            bites: self.bites,
            tabs: if holds { self.tabs_left() } else { 0 },
            tabs_together: !self.tab_at.is_empty(),
            tab_width: self.tab_width,
        }
    }
}
