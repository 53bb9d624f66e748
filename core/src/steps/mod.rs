//! Step times. A planned move becomes runs of steps; runs are what the pins replay.
//!
//! Comes in: a timeline. Goes out: a [`StepStream`]. Does not know why a move is made.

pub mod stream;

pub use crate::job::{Effect, Stage};
pub use crate::machine::{AXES, Steps};
pub use stream::{Run, Segment, StepStream, TICK_HZ};
