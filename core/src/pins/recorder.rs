//! Pins that record every call, for dry runs and tests.
//!
//! Models nothing: its inputs follow a script.

use super::{AxisSet, Pins};
use crate::steps::{AXES, Steps};

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Written {
    Step {
        tick: u64,
        axes: AxisSet,
        /// Axes that count up; all others in `axes` count down.
        forward: AxisSet,
    },
    Spindle {
        tick: u64,
        /// Speed in rpm; 0 is off.
        rpm: u32,
    },
    Output {
        tick: u64,
        /// Index among the machine's outputs.
        place: u8,
        on: bool,
    },
    Safe,
}

#[derive(Clone, Debug, Default)]
pub struct Recorder {
    pub written: Vec<Written>,
    pub position: Steps,
    /// Input bits from a tick on, in order of time; all are off before the first.
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
