//! Words for pins that drive windings: patterns of the motors' tables in place of pulses.
//!
//! ```text
//! step   ──────▲───────────────▲────         the next column of the table, the windings that it switches forced
//! word   ──────┤forced ├ held ─┤forced       forcing ends with the next step, with its time, or when the path rests
//! ```

use super::{Axis, Player, Span, Words};
use crate::message::Windings;
use crate::phases::{PhaseMotor, phase_word, tables_crc};

impl Player {
    /// Takes a motor's table while stopped. Returns `false` if there is no such motor or the table is
    /// unsafe.
    pub fn wind(&mut self, table: &Windings) -> bool {
        self.motors.get_mut(usize::from(table.axis)).is_some_and(|motor| motor.take(table))
    }

    /// The checksum that identifies the tables of all motors.
    pub fn tables_crc(&self) -> u32 {
        tables_crc(&self.motors.each_ref().map(|motor| *motor.table()))
    }

    /// Selects windings or steps, while stopped. After a change nothing is on.
    pub fn drive(&mut self, is_phases: bool) {
        if self.is_phases != is_phases {
            self.is_phases = is_phases;
            self.motors.iter_mut().for_each(PhaseMotor::switch_off);
        }
    }

    /// The words of a slice for windings: a pattern for every step, and one if forcing ends between two
    /// steps. When the path rests, forcing ends, as on an I/O card.
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

    pub(super) fn hold(&mut self, words: &mut impl Words) {
        for (index, (axis, motor)) in self.axes.iter_mut().zip(&mut self.motors).enumerate() {
            axis.hold(index, motor, (self.machine, false), words);
        }
    }

    /// Ends all forcing after the last words.
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
    /// Shows its motor's pattern at a machine tick after its last word.
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

    /// Ends the forcing of its motor, if due by a machine tick.
    fn unforce(&mut self, index: usize, motor: &mut PhaseMotor, by: u32, words: &mut impl Words) {
        if let Some(until) = motor.forced_until().filter(|until| by.wrapping_sub(*until) as i32 >= 0) {
            motor.hold();
            self.show(index, motor, until, None, words);
        }
    }

    /// Waits until a machine tick while its motor is held, or rests from then on.
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
