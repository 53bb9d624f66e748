//! End switches that do not close at the same place twice: what an index pulse is there for (C4).
//!
//! ```text
//! on its edge    ______________████████
//! this time      ___________███████████      a few steps early, or late; anew whenever it has let go
//! ```
//!
//! Comes in: what switches say. Goes out: where they close, machine steps. All of it depends only on the seed and the calls.

use crate::chance::Chance;
use crate::job::Input;

/// The switches of each axis, low end and high end.
const ENDS: [u32; 3] = [
    Input::XMin.bit() | Input::XMax.bit(),
    Input::YMin.bit() | Input::YMax.bit(),
    Input::ZBottom.bit() | Input::ZTop.bit(),
];

/// Where the switches of X, Y and Z close this time.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Scatter {
    seed: u64,
    /// How far further in than on their edges, in steps.
    off: [i64; 3],
    /// What was said last.
    said: u32,
    /// How often any let go.
    times: u64,
}

impl Scatter {
    pub(super) fn new(seed: u64) -> Self {
        Self { seed, off: [0; 3], said: 0, times: 0 }
    }

    /// The edges of `axis` as they are this time.
    pub(super) fn edges(&self, axis: usize, (low, high): (i64, i64)) -> (i64, i64) {
        (low + self.off[axis], high - self.off[axis])
    }

    /// The switches say `sensed`; one that has let go closes elsewhere next time, by `most_steps` at most.
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
