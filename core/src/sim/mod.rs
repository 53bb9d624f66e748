//! The moment shown in a playback, and a job in numbers.
//!
//! Comes in: a timeline and its stream. Goes out: where everything is at any second ([`Playback`]), and how long it all
//! takes ([`Summary`]). Does not know pins.

mod playback;
mod summary;

pub use playback::{Drilled, LegStart, Moment, Playback};
pub use summary::{Summary, summary};
