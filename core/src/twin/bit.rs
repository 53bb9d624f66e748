//! The bit and the board: what is cut, how fast, and what breaks.
//!
//! ```text
//! fastest way down through the board
//!   1.5 × feed ────────┐ life          a sharp bit has a reserve
//!                      └─╲_            past its life it cuts ever slower
//!                          ╲__
//!                             ╲____    the motor is held back, the lower sensor comes late
//! ```
//!
//! Comes in: heights of the tip in Z steps, the spindle's speed. Goes out: whether the bit holds the motor back, and when a
//! hole came through. Does not know where in the plane.

use crate::steps::TICK_HZ;

/// How much faster than the feed a sharp bit cuts.
const SHARP: f64 = 1.5;

/// How soon a bit gets slower once its life is over: at a quarter more holes it cuts half as fast.
const WEAR: f64 = 4.0;

/// The bit in the spindle, and the board below it.
#[derive(Clone, Debug)]
pub struct Bit {
    /// Heights of the board's upper and lower side, Z steps.
    board: (i64, i64),
    /// Feed through the board, steps per second.
    feed_hz: f64,
    /// Holes until it gets dull; none for a bit that stays sharp.
    life: Option<u32>,
    /// Fastest it gets through the board, whatever its wear.
    dull_hz: Option<f64>,
    /// Turning, rpm.
    pub rpm: u32,
    /// Holes it made.
    pub holes: u32,
    /// Pushed without turning, or dragged sideways: it makes no more holes.
    pub broken: bool,
    inside: bool,
    through: bool,
    held_tick: u64,
}

impl Bit {
    /// A sharp bit over a `board`, that is to be fed at `feed_hz`.
    pub fn new(board: (i64, i64), feed_hz: f64, life: Option<u32>, dull_hz: Option<f64>) -> Self {
        Self {
            board,
            feed_hz,
            life,
            dull_hz,
            rpm: 0,
            holes: 0,
            broken: false,
            inside: false,
            through: false,
            held_tick: 0,
        }
    }

    /// A new one of the same kind.
    pub fn change(&mut self) {
        (self.holes, self.broken) = (0, false);
    }

    /// Whether the tip at `z` is below the board's surface.
    pub fn touches(&self, z: i64) -> bool {
        z < self.board.0
    }

    /// The fastest it cuts, steps per second; none when it never holds the motor back.
    pub fn cuts_hz(&self) -> Option<f64> {
        let worn = self.life.map(|life| {
            let life = f64::from(life.max(1));
            let over = (f64::from(self.holes) - life).max(0.0) / life;
            SHARP * self.feed_hz / (1.0 + WEAR * over)
        });
        let limits = [worn, self.dull_hz];
        limits.into_iter().flatten().reduce(f64::min)
    }

    /// Whether it holds back a step down at `z`.
    pub fn holds(&mut self, tick: u64, z: i64) -> bool {
        let Some(hz) = self.cuts_hz() else { return false };
        if z > self.board.0 || z <= self.board.1 {
            return false;
        }
        let held = tick < self.held_tick.saturating_add((TICK_HZ as f64 / hz) as u64);
        if !held {
            self.held_tick = tick;
        }
        held
    }

    /// The head moved in the plane.
    pub fn dragged(&mut self) {
        self.broken |= self.inside;
    }

    /// The tip is at `z` now. Gives the depth in steps when a hole just came through.
    pub fn moved(&mut self, z: i64) -> Option<i64> {
        let inside = self.touches(z);
        self.broken |= inside && !self.inside && self.rpm == 0;
        self.inside = inside;
        if !inside {
            self.through = false;
        } else if z <= self.board.1 && !self.through {
            self.through = true;
            if !self.broken && self.rpm > 0 {
                self.holes += 1;
                return Some(self.board.0 - z);
            }
        }
        None
    }
}
