//! The bit and the board: cutting, wear and breakage.
//!
//! ```text
//! fastest plunge through the board
//!   1.5 × feed ────────┐ life          a sharp bit has a reserve
//!                      └─╲_            past its life it cuts ever slower
//!                          ╲__
//!                             ╲____    the motor is held back, the lower switch comes late
//! ```
//!
//! A bit breaks in any of these cases:
//! - pushed in without turning,
//! - a drill dragged sideways,
//! - deeper than its edges are long,
//! - an advance of more than a quarter of its cutting width per turn.
//!
//! No source gives the length of edges. Assumed are 12 diameters of a drill, 5 of an end mill, and the cone
//! of a V-bit.

use crate::job::bite::MOST_BITE_SHARE;
use crate::job::{self, Cutter};
use crate::steps::TICK_HZ;
use crate::units::Length;

/// Speed of a sharp bit, relative to the feed.
const SHARP_FACTOR: f64 = 1.5;

/// Loss of speed once the life is over: at a quarter more holes the bit cuts half as fast.
const WEAR_FACTOR: f64 = 4.0;

/// Narrowest cut assumed, mm.
const LEAST_WIDTH_MM: f64 = 0.05;

const MEASURED_MM: f64 = 0.1;

/// Height above the bottom of its hole up to which the board holds a bit, mm. Needed because a held motor
/// falls back by an electrical cycle, which lifts the bit a little.
const BOTTOM_MM: f64 = 0.3;

/// Depth to which a bit that does not turn may press into the copper without breaking, mm.
const PRESSED_MM: f64 = 0.05;

/// Length of the edges of a drill and of an end mill, in diameters.
const DRILL_EDGE_DIAMETERS: f64 = 12.0;
const MILL_EDGE_DIAMETERS: f64 = 5.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Breakage {
    /// Pushed in without turning.
    Still,
    /// A drill was dragged sideways.
    Dragged,
    /// Advanced faster than it can cut.
    TooFast,
    /// Deeper than the length of its edges.
    TooDeep,
    /// Dropped, or pushed onto something, at the magazine.
    Crashed,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tip {
    pub tick: u64,
    pub z: i64,
    /// X, Y, Z in mm.
    pub mm: [f64; 3],
}

#[derive(Clone, Debug)]
pub struct MountedBit {
    /// Upper and lower side of the board at the tip, in Z steps.
    board: (i64, i64),
    /// Upper and lower side of a flat board, in Z steps.
    flat: (i64, i64),
    /// Excess height of the board here, and excess length of the bit, in Z steps.
    raised: i64,
    stands_out: i64,
    mm_per_step: f64,
    /// Feed through the board, steps per second.
    feed_hz: f64,
    /// Holes until the bit gets dull; none for a bit that stays sharp.
    life: Option<u32>,
    /// Upper limit of the speed through the board, independent of wear.
    dull_hz: Option<f64>,
    /// Kind of bit; none until [`Self::change`].
    kind: Option<job::Bit>,
    pub rpm: u32,
    pub holes: u32,
    /// Cause of breakage; a broken bit makes no holes.
    pub broken: Option<Breakage>,
    is_out: bool,
    inside: bool,
    beside: bool,
    through: bool,
    /// Moved sideways since it entered the board.
    dragged: bool,
    /// Lowest Z at this XY position, in steps.
    deepest: i64,
    held_tick: u64,
    /// Start of the current speed measurement, while the bit cuts.
    measured: Option<Tip>,
}

impl MountedBit {
    /// A sharp bit over a `board`, for a feed of `feed_hz`; heights in steps of `mm_per_step`.
    pub fn new(
        (board, mm_per_step): ((i64, i64), f64),
        feed_hz: f64,
        life: Option<u32>,
        dull_hz: Option<f64>,
    ) -> Self {
        Self {
            board,
            flat: board,
            raised: 0,
            stands_out: 0,
            mm_per_step,
            feed_hz,
            life,
            dull_hz,
            kind: None,
            rpm: 0,
            holes: 0,
            broken: None,
            is_out: false,
            inside: false,
            beside: false,
            through: false,
            dragged: false,
            deepest: board.0,
            held_tick: 0,
            measured: None,
        }
    }

    /// Inserts a new, sharp bit of this kind.
    pub fn change(&mut self, kind: &job::Bit) {
        (self.holes, self.broken, self.kind, self.is_out) = (0, None, Some(kind.clone()), false);
        self.stands_out = 0;
        self.lies();
    }

    pub fn take_out(&mut self) {
        (self.kind, self.is_out) = (None, true);
    }

    /// Sets the holes until wear starts and the highest speed through the board.
    pub fn blunt(&mut self, life: Option<u32>, dull_hz: Option<f64>) {
        self.life = life;
        self.dull_hz = dull_hz;
    }

    pub fn raise(&mut self, steps: i64) {
        self.raised = steps;
        self.lies();
    }

    /// The bit slips out of its collet by this many steps.
    pub fn slip(&mut self, steps: i64) {
        self.stands_out += steps;
        self.lies();
    }

    /// Updates the board's height relative to the tip.
    fn lies(&mut self) {
        let up = self.raised + self.stands_out;
        self.board = (self.flat.0 + up, self.flat.1 + up);
    }

    /// Sets whether the tip is outside the board in XY.
    pub fn beside(&mut self, beside: bool) {
        self.beside = beside;
    }

    /// True if the tip at `z` is below the surface of the board, within its outline.
    pub fn touches(&self, z: i64) -> bool {
        z < self.board.0 && !self.beside
    }

    /// True if an unbroken bit touches the board at `z`.
    pub fn contacts(&self, z: i64) -> bool {
        self.touches(z) && self.broken.is_none() && !self.is_out
    }

    /// Highest cutting speed, steps per second; none if the bit never holds the motor back.
    pub fn cuts_hz(&self) -> Option<f64> {
        let worn = self.life.map(|life| {
            let life = f64::from(life.max(1));
            let over = (f64::from(self.holes) - life).max(0.0) / life;
            SHARP_FACTOR * self.feed_hz / (1.0 + WEAR_FACTOR * over)
        });
        let limits = [worn, self.dull_hz];
        limits.into_iter().flatten().reduce(f64::min)
    }

    /// True if the board stops a step down at `z`. Well above the bottom of its hole the bit moves freely.
    pub fn holds(&mut self, tick: u64, z: i64) -> bool {
        let Some(hz) = self.cuts_hz() else { return false };
        let free = (z - self.deepest) as f64 * self.mm_per_step > BOTTOM_MM;
        if free || z > self.board.0 || z <= self.board.1 {
            return false;
        }
        let held = tick < self.held_tick.saturating_add((TICK_HZ as f64 / hz) as u64);
        if !held {
            self.held_tick = tick;
        }
        held
    }

    pub fn slid(&mut self, tip: Tip) {
        // At a new XY position, the depth starts again.
        self.deepest = tip.z.min(self.board.0);
        if !self.inside {
            return;
        }
        self.dragged = true;
        match self.kind.as_ref().map(|kind| kind.cutter) {
            Some(Cutter::Mill | Cutter::Vee { .. }) => self.goes_on(tip),
            Some(Cutter::Drill) | None => self.breaks(Breakage::Dragged),
        }
    }

    /// Updates the bit after a move in Z. Returns the depth in steps if the tip just broke through.
    pub fn moved(&mut self, tip: Tip) -> Option<i64> {
        let below = tip.z < self.board.0;
        self.inside = self.touches(tip.z);
        if tip.z < self.deepest && !self.beside {
            self.deepest = tip.z;
            // Only new depth can break it: a bit leaves its own hole unharmed, turning or not.
            if self.rpm == 0 && self.depth_mm(tip.z) > PRESSED_MM {
                self.breaks(Breakage::Still);
            }
            self.goes_on(tip);
            if self.edges_mm().is_some_and(|edges| self.depth_mm(tip.z) > edges) {
                self.breaks(Breakage::TooDeep);
            }
        } else {
            // Not cutting: the next measurement of the speed starts later.
            self.measured = None;
        }
        if !below {
            (self.through, self.dragged) = (false, false);
        } else if tip.z <= self.board.1 && !self.through {
            self.through = true;
            // A broken, stationary or dragged bit makes no proper hole.
            if self.broken.is_none() && self.rpm > 0 && !self.dragged {
                self.holes += 1;
                return Some(self.board.0 - tip.z);
            }
        }
        None
    }

    /// Greatest depth below the surface at this XY position, mm.
    pub fn deepest_mm(&self) -> f64 {
        self.depth_mm(self.deepest).max(0.0)
    }

    fn depth_mm(&self, z: i64) -> f64 {
        (self.board.0 - z) as f64 * self.mm_per_step
    }

    fn breaks(&mut self, why: Breakage) {
        self.broken.get_or_insert(why);
    }

    fn edges_mm(&self) -> Option<f64> {
        let kind = self.kind.as_ref()?;
        Some(match kind.cutter {
            Cutter::Drill => DRILL_EDGE_DIAMETERS * kind.diameter.mm(),
            Cutter::Mill => MILL_EDGE_DIAMETERS * kind.diameter.mm(),
            Cutter::Vee { .. } => kind.depth_for(kind.diameter).map_or(0.0, Length::mm),
        })
    }

    /// Breaks the bit if it cuts its way to `tip` too fast.
    fn goes_on(&mut self, tip: Tip) {
        let Some(kind) = &self.kind else { return };
        let from = *self.measured.get_or_insert(tip);
        let squared: f64 = from.mm.iter().zip(tip.mm).map(|(a, b)| (b - a) * (b - a)).sum();
        let way_mm = libm::sqrt(squared);
        if way_mm < MEASURED_MM {
            return;
        }
        let seconds = tip.tick.saturating_sub(from.tick) as f64 / TICK_HZ as f64;
        let turns = seconds * f64::from(self.rpm) / 60.0;
        let width_mm = kind.width_at(Length::from_mm(self.depth_mm(tip.z))).mm().max(LEAST_WIDTH_MM);
        self.measured = Some(tip);
        if way_mm > MOST_BITE_SHARE * width_mm * turns {
            self.breaks(Breakage::TooFast);
        }
    }
}
