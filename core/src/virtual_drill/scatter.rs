//! Limit switches that close at a slightly different position each time: the reason for index pulses.
//!
//! ```text
//! on its edge    ______________████████
//! this time      ___________███████████      a few steps early or late; drawn again after each release
//! ```
//!
//! Deterministic: depends only on the seed and the calls.

use crate::chance::Chance;
use crate::job::Input;

/// Switches of each axis at both ends.
const ENDS: [u32; 3] = [
    Input::XMin.bit() | Input::XMax.bit(),
    Input::YMin.bit() | Input::YMax.bit(),
    Input::ZBottom.bit() | Input::ZTop.bit(),
];

/// Current closing points of the switches of X, Y and Z.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scatter {
    seed: u64,
    /// Shift into the travel, in steps.
    off: [i64; 3],
    /// Latest switch states.
    said: u32,
    /// Releases of any switch.
    times: u64,
}

impl Scatter {
    pub(super) fn new(seed: u64) -> Self {
        Self { seed, off: [0; 3], said: 0, times: 0 }
    }

    /// Shifted edges of `axis`.
    pub(super) fn edges(&self, axis: usize, (low, high): (i64, i64)) -> (i64, i64) {
        (low + self.off[axis], high - self.off[axis])
    }

    /// Takes the new switch states. A released switch closes elsewhere next time, by `most_steps` at most.
    pub(super) fn sensed(&mut self, sensed: u32, most_steps: u32) {
        let let_go = std::mem::replace(&mut self.said, sensed) & !sensed;
        if most_steps == 0 || let_go == 0 {
            return;
        }
        for (off, _) in self.off.iter_mut().zip(ENDS).filter(|(_, ends)| let_go & ends != 0) {
            self.times += 1;
            let span = 2 * u64::from(most_steps) + 1;
            *off = (Chance::at(self.seed, self.times).bits() % span) as i64 - i64::from(most_steps);
        }
    }
}
