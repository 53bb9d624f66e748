//! A model of the adapter's state machines: words into steps, exact to the cycle.

use crate::support::PULSE;
use annulus_link::player::{BEFORE_PULSE, WITHOUT_PULSE, Words};
use annulus_link::{AXES, CYCLES_PER_TICK};

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Step {
    pub(crate) cycle: u64,
    pub(crate) forward: bool,
}

#[derive(Debug, Default)]
pub(crate) struct Machines {
    now: [u64; AXES],
    pub(crate) steps: [Vec<Step>; AXES],
    /// Since when the direction pin has its level, and the level.
    shown: [(u64, bool); AXES],
    pub(crate) shortest_setup: u64,
    /// Few words at a time, as a ring has an end.
    places: [u32; 7],
}

impl Machines {
    pub(crate) fn new() -> Self {
        Self { shortest_setup: u64::MAX, ..Self::default() }
    }

    pub(crate) fn now(&self) -> [u64; AXES] {
        self.now
    }
}

impl Words for Machines {
    fn put(&mut self, axis: usize, word: u32) {
        let (wait, pulse, forward) = (u64::from(word >> 2), word >> 1 & 1 == 1, word & 1 == 1);
        assert!(wait < 1 << 29, "axis {axis}: a wait that is too long or less than none");
        if self.shown[axis].1 != forward {
            self.shown[axis] = (self.now[axis], forward);
        }
        if pulse {
            let cycle = self.now[axis] + wait + u64::from(BEFORE_PULSE);
            if self.shown[axis].0 > 0 {
                self.shortest_setup = self.shortest_setup.min(cycle - self.shown[axis].0);
            }
            self.steps[axis].push(Step { cycle, forward });
            self.now[axis] = cycle + u64::from(PULSE * CYCLES_PER_TICK);
        } else {
            self.now[axis] += wait + u64::from(WITHOUT_PULSE);
        }
    }

    fn places(&mut self, _axis: usize) -> &mut [u32] {
        &mut self.places
    }

    fn filled(&mut self, axis: usize, count: u32) {
        for place in 0..count as usize {
            self.put(axis, self.places[place]);
        }
    }
}
