//! Words where pins drive windings: patterns of the motors' tables in the place of pulses.
//!
//! ```text
//! step   ──────▲───────────────▲────         the next column of the table, the windings that it switches forced
//! word   ──────┤forced ├ held ─┤forced       forcing ends with the next step, when it is over, or where the path rests
//! ```
//!
//! Comes in: a slice of the path, tables. Goes out: words. Does not know volts.

use super::{Axis, Player, Span, Words};
use crate::message::Windings;
use crate::phases::{PhaseMotor, phase_word, tables_crc};

impl Player {
    /// Takes up the table of a motor at rest; whether there is such a motor and it may be driven by it.
    pub fn wind(&mut self, table: &Windings) -> bool {
        self.motors.get_mut(usize::from(table.axis)).is_some_and(|motor| motor.take(table))
    }

    /// What the tables of all motors are known by.
    pub fn tables_crc(&self) -> u32 {
        tables_crc(&self.motors.each_ref().map(|motor| *motor.table()))
    }

    /// Whether pins drive windings from now on. Said at rest; where it is new, nothing is on.
    pub fn drive(&mut self, is_phases: bool) {
        if self.is_phases != is_phases {
            self.is_phases = is_phases;
            self.motors.iter_mut().for_each(PhaseMotor::switch_off);
        }
    }

    /// The words of a slice where windings are driven: of every step its pattern, and one where forcing ends between two steps. Where
    /// a path rests nothing is forced any more, as on an I/O card.
    #[inline(never)]
    pub(super) fn commute(&mut self, span: &Span, words: &mut impl Words) {
        let (stretch, until) = (&span.stretch, span.machine_until);
        let rests = !self.in_tail && self.head.rests == 1 && stretch.until == self.ticks;
        for (index, (axis, motor)) in self.axes.iter_mut().zip(&mut self.motors).enumerate() {
            while axis.cursor.left > 0 && axis.cursor.tick <= stretch.until {
                let (tick, forward) = (axis.cursor.tick, axis.cursor.forward);
                let wait = stretch.machine_tick(tick).wrapping_sub(axis.word);
                let at = axis.word.wrapping_add(if wait as i32 > 0 { wait } else { 1 });
                axis.unforce(index, motor, at.wrapping_sub(1), words);
                motor.step(forward, at);
                if rests && at == until {
                    motor.hold();
                }
                axis.show(index, motor, at, Some(forward), words);
                axis.index = axis.index.wrapping_add(if forward { 1 } else { -1 });
                axis.cursor.advance();
                if axis.cursor.left == 0 {
                    axis.next_run(&self.payload, tick);
                }
            }
            axis.hold(index, motor, (until, rests), words);
        }
    }

    /// A slice in which nothing steps.
    pub(super) fn hold(&mut self, words: &mut impl Words) {
        for (index, (axis, motor)) in self.axes.iter_mut().zip(&mut self.motors).enumerate() {
            axis.hold(index, motor, (self.machine, false), words);
        }
    }

    /// Behind all words nothing is forced any more.
    #[inline(never)]
    pub(super) fn relax(&mut self, words: &mut impl Words) {
        for (index, (axis, motor)) in self.axes.iter_mut().zip(&mut self.motors).enumerate() {
            if motor.forced_until().is_some() {
                motor.hold();
                axis.show(index, motor, axis.word.wrapping_add(1), None, words);
            }
        }
    }
}

impl Axis {
    /// The pattern of its motor at a tick of the machine behind its last word.
    fn show(
        &mut self,
        index: usize,
        motor: &PhaseMotor,
        at: u32,
        step: Option<bool>,
        words: &mut impl Words,
    ) {
        words.put(index, phase_word(at.wrapping_sub(self.word), motor.pattern(), step));
        self.word = at;
    }

    /// Ends the forcing of its motor, where that is due by a tick of the machine.
    fn unforce(&mut self, index: usize, motor: &mut PhaseMotor, by: u32, words: &mut impl Words) {
        if let Some(until) = motor.forced_until().filter(|until| by.wrapping_sub(*until) as i32 >= 0) {
            motor.hold();
            self.show(index, motor, until, None, words);
        }
    }

    /// Waits until a tick of the machine while its motor is held, or rests from then on.
    fn hold(
        &mut self,
        index: usize,
        motor: &mut PhaseMotor,
        (until, rests): (u32, bool),
        words: &mut impl Words,
    ) {
        self.unforce(index, motor, until.wrapping_sub(1), words);
        if rests || motor.forced_until() == Some(until) {
            motor.hold();
        }
        if until.wrapping_sub(self.word) as i32 > 0 {
            self.show(index, motor, until, None, words);
        }
    }
}
