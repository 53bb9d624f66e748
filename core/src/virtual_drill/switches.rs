//! Realistic limit switches: each closes at a slightly different position every time (the reason for index
//! pulses), chatters for a moment after each change, and a noisy line flips single readings.
//!
//! ```text
//! on its edge    ______________████████
//! this time      ___________███████████       a few steps early or late; drawn again after each release
//!
//! switch         ______█████████████████
//! reading        ______█_██_█_██████████      chatter: up to 3 ms, closed at the first touch
//! noisy line     ___█__█_██_█__█████_███      1 % of the readings are inverted
//! ```
//!
//! Deterministic: depends only on the seed and the calls.

use crate::chance::Chance;
use crate::job::Input;
use crate::steps::TICK_HZ;

/// Longest chatter, in ticks: 3 ms.
const CHATTER: u64 = TICK_HZ * 3 / 1000;

/// Length of one reading during chatter, in ticks: 0.2 ms.
const CELL: u64 = TICK_HZ / 5000;

const INPUTS: usize = 32;

#[derive(Clone, Debug, PartialEq)]
pub struct Switches {
    seed: u64,
    flips: f64,
    bouncing: u32,
    word: Option<u32>,
    /// Tick of the latest change of each input.
    changed: [Option<u64>; INPUTS],
    readings: u64,
}

impl Switches {
    /// `bouncing` is the set of inputs that chatter; `flipped_share` of all readings is wrong.
    pub fn new(seed: u64, bouncing: u32, flipped_share: f64) -> Self {
        Self { seed, flips: flipped_share, bouncing, word: None, changed: [None; INPUTS], readings: 0 }
    }

    /// Sets the share of wrong readings.
    pub fn flip(&mut self, flipped_share: f64) {
        self.flips = flipped_share;
    }

    /// The switches have the states `word` from `tick` on.
    pub fn stand(&mut self, tick: u64, word: u32) {
        let before = self.word.replace(word).unwrap_or(word);
        if word == before {
            return;
        }
        for (input, changed) in (0..).zip(&mut self.changed) {
            if (word ^ before) & 1_u32 << input != 0 {
                *changed = Some(tick);
            }
        }
    }

    /// Reading at `tick`, with the switches in the states `word`.
    pub fn read(&mut self, tick: u64, word: u32) -> u32 {
        self.stand(tick, word);
        self.readings += 1;
        let mut read = word;
        for (input, changed) in (0..).zip(self.changed) {
            let bit = 1_u32 << input;
            let since = changed.filter(|_| self.bouncing & bit != 0).map(|at| tick.saturating_sub(at));
            if let Some(since) = since.filter(|since| *since < CHATTER)
                && since >= CELL
                && Chance::at(self.seed ^ input, tick / CELL).bits() & 1 == 1
            {
                read ^= bit;
            }
            if self.flips > 0.0 && Chance::at(self.seed ^ (64 + input), self.readings).unit() < self.flips {
                read ^= bit;
            }
        }
        read
    }
}

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
    said: u32,
    times: u64,
}

impl Scatter {
    pub(super) fn new(seed: u64) -> Self {
        Self { seed, off: [0; 3], said: 0, times: 0 }
    }

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
