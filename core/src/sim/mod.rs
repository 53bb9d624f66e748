//! Playback of a program, job statistics, and the simulated stock.

mod carve;
mod carving;
mod cuts;
mod lines;
mod playback;
mod summary;
mod swept;
mod warnings;

pub use carve::{Stock, TILE, Tile};
pub use carving::Carving;
pub use cuts::{Cut, CutShape, Way, cuts, reach};
pub use lines::ProgramLines;
pub use playback::{Counted, DrilledHole, LegStart, Milled, Moment, Playback};
pub use summary::{Spent, Summary, summary, time_by_bit_s, times_s};
pub use swept::{Swept, nearest, swept};
pub use warnings::{Fault, ToolRoom, Warning, warnings};
