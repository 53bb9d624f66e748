//! The moment shown in a playback, a job in numbers, and the board as it is carved.
//!
//! Comes in: a timeline and its stream, or a program. Goes out: where everything is at any second ([`Playback`]), how long it
//! all takes ([`Summary`]), what is cut away ([`Stock`]) by any second ([`Carving`]), which line of a written program is done when ([`ProgramLines`]), and
//! what is wrong when ([`Warning`]). Does not know pins.

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
pub use summary::{Spent, Summary, summary, time_by_bit_s};
pub use swept::{Swept, nearest, swept};
pub use warnings::{Fault, ToolRoom, Warning, warnings};
