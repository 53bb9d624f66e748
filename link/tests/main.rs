//! The link and the adapter's own thinking, without hardware.

mod card;
mod frames;
mod line;
mod machines;
mod motion;
mod phases;
mod state_machines;
mod support;
