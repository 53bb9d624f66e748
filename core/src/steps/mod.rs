//! Step times. A planned move becomes runs of steps; runs are what the pins replay.
//!
//! Comes in: a timeline. Goes out: a [`StepStream`]. Does not know why a move is made.

pub mod stream;

pub use stream::{AXES, Effect, Run, Segment, Stage, StepStream, Steps, TICK_HZ};
