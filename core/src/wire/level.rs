//! The height map of the board on the machine, as a page hears of it.
//!
//! Comes in and goes out: plain data. Does not know who touches the board.

use crate::diagnostic::Diagnostic;
use crate::level::ProbeGrid;
use crate::units::Length;
use serde::{Deserialize, Serialize};

/// What is known of the surface of the board, or becomes known just now.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct HeightMapReport {
    /// Where it is touched; none where nothing is known.
    pub grid: Option<ProbeGrid>,
    /// Height over the work zero, place by place; none where it was not touched yet.
    pub heights: Vec<Option<Length>>,
    /// For which job ([`crate::level::key_of`]).
    pub job: String,
    /// When it was measured, seconds since 1970.
    pub measured_s: u64,
    /// The board is being touched just now.
    pub goes: bool,
    /// The place that is touched next.
    pub next: Option<u32>,
    /// Touches that are done, and how many there will be as far as is known.
    pub done: u32,
    /// The same.
    pub of: u32,
    /// Why it does not fit to the machine as it stands.
    pub refused: Option<Diagnostic>,
}
