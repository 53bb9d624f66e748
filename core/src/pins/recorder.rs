//! A board of pins that writes down what is done to it. It ships: for dry runs, and for tests.
//!
//! Comes in: calls. Goes out: the calls as data. Models nothing: its inputs are what it was told.

use super::{AxisSet, Pins};
use crate::steps::{AXES, Steps};

/// One call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Written {
    /// Steps at a tick: the axes, and those of them that count up.
    Step {
        /// When.
        tick: u64,
        /// Which axes.
        axes: AxisSet,
        /// Those of them that count up.
        forward: AxisSet,
    },
    /// Spindle speed at a tick.
    Spindle {
        /// When.
        tick: u64,
        /// Its speed; 0 is off.
        rpm: u32,
    },
    /// An output switched at a tick: its place, and whether on.
    Output {
        /// When.
        tick: u64,
        /// Its place among the machine's outputs.
        place: u8,
        /// On, else off.
        on: bool,
    },
    /// Everything off.
    Safe,
}

/// Writes down every call.
#[derive(Clone, Debug, Default)]
pub struct Recorder {
    /// What was done, in order.
    pub written: Vec<Written>,
    /// Steps counted.
    pub position: Steps,
    /// Inputs from a tick on, in order of time; before the first, none is on.
    pub script: Vec<(u64, u32)>,
}

impl Pins for Recorder {
    fn step(&mut self, at_tick: u64, axes: AxisSet, forward: AxisSet) {
        for axis in 0..AXES {
            if axes >> axis & 1 == 1 {
                self.position[axis] += if forward >> axis & 1 == 1 { 1 } else { -1 };
            }
        }
        self.written.push(Written::Step { tick: at_tick, axes, forward });
    }

    fn spindle(&mut self, at_tick: u64, rpm: u32) {
        self.written.push(Written::Spindle { tick: at_tick, rpm });
    }

    fn inputs(&mut self, at_tick: u64) -> u32 {
        self.script.iter().rev().find(|(from, _)| *from <= at_tick).map_or(0, |(_, inputs)| *inputs)
    }

    fn output(&mut self, at_tick: u64, place: u8, on: bool) {
        self.written.push(Written::Output { tick: at_tick, place, on });
    }

    fn safe(&mut self) {
        self.written.push(Written::Safe);
    }
}
