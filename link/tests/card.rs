//! The reference for phase outputs: an I/O card that plays a stream with core's player and core's
//! commutator.

use annulus_core::machine::phases::{Commutator, FORCING};
use annulus_core::machine::{PhaseTable, virtual_drill};
use annulus_core::pins::{AxisSet, Clock, Motors, Operator, Order, Outcome, Pins, Playhead, play};
use annulus_core::steps::{Segment, Steps};
use annulus_link::message::{COLUMNS, Windings};
use annulus_link::phases::MOTORS;

/// Patterns of a motor's pins, each with its first tick or cycle.
pub(crate) type Shown = Vec<(u64, u8)>;

pub(crate) fn windings(axis: usize, table: &PhaseTable, forcing: u32) -> Windings {
    let mut columns = [0; COLUMNS];
    columns[..table.columns.len()].copy_from_slice(&table.columns);
    Windings { axis: axis as u8, forcing, count: table.columns.len() as u8, columns }
}

pub(crate) fn pattern(byte: u8) -> u8 {
    byte & 0b1111 | (byte & FORCING) >> 1
}

pub(crate) struct Card {
    motors: [Commutator; MOTORS],
    is_on: [bool; MOTORS],
    forced_at: [u64; MOTORS],
    forcing: u64,
    pub(crate) shown: [Shown; MOTORS],
}

impl Card {
    pub(crate) fn new(tables: &[PhaseTable; MOTORS], forcing: u32) -> Self {
        Self {
            motors: tables.each_ref().map(|table| Commutator::new(table.clone(), 0)),
            is_on: [false; MOTORS],
            forced_at: [0; MOTORS],
            forcing: u64::from(forcing),
            shown: Default::default(),
        }
    }

    pub(crate) fn played(mut self, segments: &[Segment]) -> [Shown; MOTORS] {
        let motors = Motors::of(&virtual_drill());
        let mut line = Playhead::default();
        for segment in segments {
            let outcome = play(segment, &motors, &mut line, &mut self, &mut Free(0), &mut Idle);
            assert_eq!(outcome, Outcome::Completed);
            self.rest(line.tick);
        }
        self.shown
    }

    fn until(&self, axis: usize) -> Option<u64> {
        (self.motors[axis].byte() & FORCING != 0 && self.is_on[axis])
            .then(|| self.forced_at[axis] + self.forcing)
    }

    fn note(&mut self, tick: u64) {
        for axis in 0..MOTORS {
            let now = if self.is_on[axis] { pattern(self.motors[axis].byte()) } else { 0 };
            let shown = &mut self.shown[axis];
            shown.pop_if(|last| last.0 == tick);
            if shown.last().map_or(0, |last| last.1) != now {
                shown.push((tick, now));
            }
        }
    }
}

impl Pins for Card {
    fn step(&mut self, at_tick: u64, axes: AxisSet, forward: AxisSet) {
        for axis in (0..MOTORS).filter(|axis| axes >> axis & 1 == 1) {
            self.motors[axis].step(forward >> axis & 1 == 1);
            (self.is_on[axis], self.forced_at[axis]) = (true, at_tick);
        }
        self.attend(at_tick);
    }
    fn spindle(&mut self, _: u64, _: u32) {}
    fn inputs(&mut self, _: u64) -> u32 {
        0
    }
    fn due(&self) -> Option<u64> {
        (0..MOTORS).filter_map(|axis| self.until(axis)).min()
    }
    fn attend(&mut self, at_tick: u64) {
        for axis in 0..MOTORS {
            if self.until(axis).is_some_and(|until| until <= at_tick) {
                self.motors[axis].hold();
            }
        }
        self.note(at_tick);
    }
    fn rest(&mut self, at_tick: u64) {
        self.motors.iter_mut().for_each(|motor| _ = motor.hold());
        self.note(at_tick);
    }
    fn safe(&mut self) {}
}

/// A clock that never waits.
struct Free(u64);

impl Clock for Free {
    fn now(&mut self) -> u64 {
        self.0
    }
    fn wait_until(&mut self, tick: u64) -> u64 {
        self.0 = self.0.max(tick);
        self.0
    }
}

/// An operator that never interferes.
struct Idle;

impl Operator for Idle {
    fn order(&mut self) -> Order {
        Order::Go
    }
    fn passed(&mut self, _: u64, _: &Steps, _: u32) {}
}
