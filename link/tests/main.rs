//! Tests of the link and the adapter's logic, without hardware.

mod card;
mod frames;
mod line;
mod machines;
mod motion;
mod phases;
mod state_machines;
mod support;
