//! The moment shown in a playback, a job in numbers, and the board as it is carved.
//!
//! Comes in: a timeline and its stream, or a program. Goes out: where everything is at any second ([`Playback`]), how long it
//! all takes ([`Summary`]), and what is cut away ([`Stock`]). Does not know pins.

mod carve;
mod cuts;
mod playback;
mod summary;

pub use carve::{Stock, TILE, Tile};
pub use cuts::{Cut, Shape, cuts, reach};
pub use playback::{Drilled, LegStart, Milled, Moment, Playback};
pub use summary::{Spent, Summary, summary, time_by_bit_s};
