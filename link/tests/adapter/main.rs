//! The real firmware in an emulated RP2040, spoken to with the real link: what comes out of the pins, cycle by cycle.
//!
//! `cargo xtask test adapter` builds the firmware, installs the emulator and runs this. `ANNULUS_LONG` does more of it.

#[path = "../card.rs"]
mod card;
#[path = "../support.rs"]
mod support;

mod edges;
mod phases;
mod rig;
mod stops;
mod touches;
