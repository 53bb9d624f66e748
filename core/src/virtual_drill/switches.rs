//! End switches as they are: they chatter for a moment after they close or open, and a bad line flips single readings.
//!
//! ```text
//! on the switch  ______█████████████████
//! what is read   ______█_██_█_██████████      chatter: up to 3 ms, closed at the first touch
//! bad line       ___█__█_██_█__█████_███      1 % of the readings say the opposite
//! ```
//!
//! Comes in: what the switches should say, with ticks. Goes out: what is read. All of it depends only on the seed and the
//! calls. Does not know places.

use crate::chance::Chance;
use crate::steps::TICK_HZ;

/// Longest chatter, in ticks: 3 ms.
const CHATTER: u64 = TICK_HZ * 3 / 1000;

/// A reading lasts this long while a switch chatters, in ticks: 0.2 ms.
const CELL: u64 = TICK_HZ / 5000;

/// Inputs of a machine.
const INPUTS: usize = 32;

/// All inputs of the drill.
#[derive(Clone, Debug, PartialEq)]
pub struct Switches {
    seed: u64,
    /// Share of single readings that are flipped.
    flips: f64,
    /// Inputs that chatter.
    bouncing: u32,
    word: Option<u32>,
    /// When each input changed.
    changed: [Option<u64>; INPUTS],
    readings: u64,
}

impl Switches {
    /// `bouncing` inputs chatter; of all inputs a share `flipped_share` of the readings is wrong.
    pub fn new(seed: u64, bouncing: u32, flipped_share: f64) -> Self {
        Self { seed, flips: flipped_share, bouncing, word: None, changed: [None; INPUTS], readings: 0 }
    }

    /// From now on such a share of the readings is wrong.
    pub fn flip(&mut self, flipped_share: f64) {
        self.flips = flipped_share;
    }

    /// The switches stand like `word` from `tick` on.
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

    /// What is read at `tick` while the switches stand like `word`.
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
