//! Tests of the real firmware in an emulated RP2040, over the real link: the pins are compared cycle by
//! cycle.
//!
//! `cargo xtask test adapter` builds the firmware, installs the emulator and runs these tests.
//! `ANNULUS_LONG` runs more of them.

#[path = "../card.rs"]
mod card;
#[path = "../support.rs"]
mod support;

mod edges;
mod phases;
mod rig;
mod stops;
mod touches;
