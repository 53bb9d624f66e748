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
//! A bit breaks when it is pushed in without turning; when a drill is dragged sideways; when it cuts deeper than its edges
//! are long; and when it goes on by more than a quarter of the width that it cuts with each turn. How long the edges are is
//! nowhere written: they are taken to be 12 diameters of a drill, 5 of a mill, and the cone of a vee.
//!
//! Comes in: heights of the tip in Z steps and its place in mm, the spindle's speed, the kind of bit where it is known. Goes
//! out: whether the bit holds the motor back, when a hole came through, and why it broke. Does not know motors.

use crate::job::bite::MOST_BITE_SHARE;
use crate::job::{self, Cutter};
use crate::steps::TICK_HZ;
use crate::units::Length;

/// How much faster than the feed a sharp bit cuts.
const SHARP_FACTOR: f64 = 1.5;

/// How soon a bit gets slower once its life is over: at a quarter more holes it cuts half as fast.
const WEAR_FACTOR: f64 = 4.0;

/// No cut is taken to be narrower than this, mm.
const LEAST_WIDTH_MM: f64 = 0.05;

/// Way over which its speed is measured, mm.
const MEASURED_MM: f64 = 0.1;

/// A motor that is held back is thrown back by a turn of the current: so far above the bottom of its hole a bit is still
/// held, mm.
const BOTTOM_MM: f64 = 0.3;

/// A bit that stands still may be pressed so far into the copper: it touches the board.
const PRESSED_MM: f64 = 0.05;

/// Edges of a drill and of a mill, in diameters.
const DRILL_EDGE_DIAMETERS: f64 = 12.0;
const MILL_EDGE_DIAMETERS: f64 = 5.0;

/// Why a bit broke.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Breakage {
    /// It was pushed in without turning.
    Still,
    /// A drill was dragged sideways.
    Dragged,
    /// It went on faster than it can cut.
    TooFast,
    /// It was deeper than its edges are long.
    TooDeep,
    /// It was dropped, or pushed onto something, at the magazine.
    Crashed,
}

/// Where the tip is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tip {
    /// When, in ticks.
    pub tick: u64,
    /// Steps of Z.
    pub z: i64,
    /// X, Y, Z in mm.
    pub mm: [f64; 3],
}

/// The bit in the spindle, and the board below it.
#[derive(Clone, Debug)]
pub struct MountedBit {
    /// Heights of the board's upper and lower side where the tip is, Z steps.
    board: (i64, i64),
    /// The same of a board that is flat.
    flat: (i64, i64),
    /// So much higher the board lies here, and so much further than it should the bit stands out, Z steps.
    raised: i64,
    stands_out: i64,
    mm_per_step: f64,
    /// Feed through the board, steps per second.
    feed_hz: f64,
    /// Holes until it gets dull; none for a bit that stays sharp.
    life: Option<u32>,
    /// Fastest it gets through the board, whatever its wear.
    dull_hz: Option<f64>,
    /// Of which kind, once somebody said so.
    kind: Option<job::Bit>,
    /// Turning, rpm.
    pub rpm: u32,
    /// Holes it made.
    pub holes: u32,
    /// Why it makes no more holes, if so.
    pub broken: Option<Breakage>,
    /// There is no bit in the spindle.
    is_out: bool,
    inside: bool,
    /// Over the edge of the board.
    beside: bool,
    through: bool,
    /// Moved sideways since it went in.
    dragged: bool,
    /// The lowest it was at this place, Z steps.
    deepest: i64,
    held_tick: u64,
    /// From where its speed is measured, while it cuts.
    measured: Option<Tip>,
}

impl MountedBit {
    /// A sharp bit over a `board`, that is to be fed at `feed_hz`; heights in steps of `mm_per_step`.
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

    /// A new, sharp one of this kind.
    pub fn change(&mut self, kind: &job::Bit) {
        (self.holes, self.broken, self.kind, self.is_out) = (0, None, Some(kind.clone()), false);
        self.stands_out = 0;
        self.lies();
    }

    /// It is taken out of the spindle.
    pub fn take_out(&mut self) {
        (self.kind, self.is_out) = (None, true);
    }

    /// From now on it stays sharp for so many holes more, and gets through the board no faster than that.
    pub fn blunt(&mut self, life: Option<u32>, dull_hz: Option<f64>) {
        self.life = life;
        self.dull_hz = dull_hz;
    }

    /// The board lies so many steps higher at the place where the tip is now.
    pub fn raise(&mut self, steps: i64) {
        self.raised = steps;
        self.lies();
    }

    /// It slips so many steps out of its collet.
    pub fn slip(&mut self, steps: i64) {
        self.stands_out += steps;
        self.lies();
    }

    /// The board is where its tip meets it.
    fn lies(&mut self) {
        let up = self.raised + self.stands_out;
        self.board = (self.flat.0 + up, self.flat.1 + up);
    }

    /// It is over the edge of the board from now on, or over the board again.
    pub fn beside(&mut self, beside: bool) {
        self.beside = beside;
    }

    /// Whether the tip at `z` is below the board's surface and not beside it.
    pub fn touches(&self, z: i64) -> bool {
        z < self.board.0 && !self.beside
    }

    /// Whether there is a whole tip, and it touches the board at `z`.
    pub fn contacts(&self, z: i64) -> bool {
        self.touches(z) && self.broken.is_none() && !self.is_out
    }

    /// The fastest it cuts, steps per second; none when it never holds the motor back.
    pub fn cuts_hz(&self) -> Option<f64> {
        let worn = self.life.map(|life| {
            let life = f64::from(life.max(1));
            let over = (f64::from(self.holes) - life).max(0.0) / life;
            SHARP_FACTOR * self.feed_hz / (1.0 + WEAR_FACTOR * over)
        });
        let limits = [worn, self.dull_hz];
        limits.into_iter().flatten().reduce(f64::min)
    }

    /// Whether it holds back a step down at `z`. Well above the bottom of its own hole nothing does.
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

    /// The head moved in the plane.
    pub fn slid(&mut self, tip: Tip) {
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

    /// The tip went up or down. Gives the depth in steps when a hole just came through.
    pub fn moved(&mut self, tip: Tip) -> Option<i64> {
        let below = tip.z < self.board.0;
        self.inside = self.touches(tip.z);
        if tip.z < self.deepest && !self.beside {
            self.deepest = tip.z;
            // Out of its own hole it comes whole, turning or not.
            if self.rpm == 0 && self.depth_mm(tip.z) > PRESSED_MM {
                self.breaks(Breakage::Still);
            }
            self.goes_on(tip);
            if self.edges_mm().is_some_and(|edges| self.depth_mm(tip.z) > edges) {
                self.breaks(Breakage::TooDeep);
            }
        } else {
            self.measured = None;
        }
        if !below {
            (self.through, self.dragged) = (false, false);
        } else if tip.z <= self.board.1 && !self.through {
            self.through = true;
            if self.broken.is_none() && self.rpm > 0 && !self.dragged {
                self.holes += 1;
                return Some(self.board.0 - tip.z);
            }
        }
        None
    }

    /// How deep it went below the surface at this place, mm.
    pub fn deepest_mm(&self) -> f64 {
        self.depth_mm(self.deepest).max(0.0)
    }

    fn depth_mm(&self, z: i64) -> f64 {
        (self.board.0 - z) as f64 * self.mm_per_step
    }

    fn breaks(&mut self, why: Breakage) {
        self.broken.get_or_insert(why);
    }

    /// How long its edges are, mm, where its kind is known.
    fn edges_mm(&self) -> Option<f64> {
        let kind = self.kind.as_ref()?;
        Some(match kind.cutter {
            Cutter::Drill => DRILL_EDGE_DIAMETERS * kind.diameter.mm(),
            Cutter::Mill => MILL_EDGE_DIAMETERS * kind.diameter.mm(),
            Cutter::Vee { .. } => kind.depth_for(kind.diameter).map_or(0.0, Length::mm),
        })
    }

    /// It cuts its way to `tip`: too fast?
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
