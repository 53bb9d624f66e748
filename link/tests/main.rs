//! The link and the adapter's own thinking, without hardware.

mod frames;
mod line;
mod machines;
mod motion;
mod state_machines;
mod support;
