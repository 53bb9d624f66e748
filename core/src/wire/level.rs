//! Message about the height map of the board.

use crate::diagnostic::Diagnostic;
use crate::level::ProbeGrid;
use crate::units::Length;
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HeightMapReport {
    /// Grid of the points; none without a height map.
    pub grid: Option<ProbeGrid>,
    /// Height of each point over the work zero; none if it isn't probed yet.
    pub heights: Vec<Option<Length>>,
    /// Key of the job ([`crate::level::key_of`]).
    pub job: String,
    /// Time of the measurement, seconds since 1970.
    pub measured_s: u64,
    /// A measurement is running.
    pub goes: bool,
    /// Next point to probe.
    pub next: Option<u32>,
    /// Touches done, and the number expected.
    pub done: u32,
    pub of: u32,
    /// Why the map doesn't fit the current state of the machine.
    pub refused: Option<Diagnostic>,
}
