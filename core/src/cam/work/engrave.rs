//! Lines that the tool centre follows.

use super::Rules;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Engrave {
    pub of: Lines,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Lines {
    /// The centre lines of the silkscreen.
    #[default]
    Legend,
    /// The board's outline.
    Outline,
    /// The edges of the copper.
    Copper,
}

impl Engrave {
    pub(super) fn rules(&self) -> Rules<'_> {
        Rules { separates: self.of == Lines::Copper, ..Rules::default() }
    }
}
