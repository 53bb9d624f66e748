//! A phase table tried on a virtual motor: there and back at the set interrupts, and what the rotor lost.
//!
//! ```text
//! Automaton ─ steps ─▶ Rotor (the virtual drill's own) ─▶ lost, first reason
//! ```
//!
//! Comes in: table, dynamics, frequency, axis. Goes out: counts. No clock runs: the time is the interrupts' own.

use annulus_core::machine::{Machine, PhaseTable};
use annulus_core::steps::TICK_HZ;
use annulus_core::steps::automaton::Automaton;
use annulus_core::virtual_drill::{Cause, Push, Rotor};

/// Steps there, and the same back.
pub const WAY: i64 = 480;

/// More interrupts than any sound table needs for the way.
const MOST_INTERRUPTS: u64 = 2_000_000;

/// What came of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrialOutcome {
    /// Interrupts a second.
    pub interrupt_hz: u32,
    /// Steps sent.
    pub sent: u64,
    /// Steps lost on the way.
    pub lost: u64,
    /// The first loss: the step, from 1, and why.
    pub first: Option<(u64, Cause)>,
    /// Where the rotor is at the end; it began at 0 and should be there again.
    pub off: i64,
}

/// Tries `table` on motor `axis` of `machine`: [`WAY`] steps forward and back, by the machine's dynamics.
pub fn run(table: &PhaseTable, machine: &Machine, axis: usize) -> TrialOutcome {
    let settings = machine.axis(axis);
    let hz_per_s = settings.max_acceleration_mm_per_s2 * settings.scale.steps_per_mm();
    let mut rotor =
        Rotor::new(table, 0, (i64::MIN / 2, i64::MAX / 2), f64::from(machine.max_step_hz), (hz_per_s, 0.0))
            .by_interrupts();
    let mut driver = Automaton::new(machine.dynamics.clone(), 0);
    let ticks = TICK_HZ / u64::from(machine.interrupt_hz.max(1));
    let mut first = None;
    let mut interrupt = 0;
    for target in [WAY, 0] {
        driver.retarget(target);
        while !driver.is_at_rest() && interrupt < MOST_INTERRUPTS {
            interrupt += 1;
            let Some(step) = driver.interrupt() else { continue };
            let lost = rotor.step(Push::free(interrupt * ticks, step.forward));
            first = first.or(lost.map(|(_, cause)| (rotor.sent, cause)));
        }
    }
    let interrupt_hz = machine.interrupt_hz;
    TrialOutcome { interrupt_hz, sent: rotor.sent, lost: rotor.lost, first, off: rotor.at }
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::machine::lab;
    use annulus_core::machine::phases::preset;

    #[test]
    fn the_papers_table_runs_clean_at_500_hz_and_slips_above_580() {
        let table = preset("boost_12").unwrap();
        let at = |interrupt_hz| run(&table, &annulus_core::machine::Machine { interrupt_hz, ..lab() }, 0);
        let clean = at(500);
        assert_eq!((clean.sent, clean.lost, clean.off, clean.first), (960, 0, 0, None));
        assert_eq!(at(580).lost, 0);
        assert!(at(590).lost > 0);
        let fast = at(700);
        assert!(fast.lost > 0 && matches!(fast.first, Some((_, Cause::TooFast))), "{fast:?}");
    }

    #[test]
    fn a_table_that_does_not_turn_the_field_loses_everything_it_is_sent() {
        let stuck = run(&PhaseTable { columns: vec![5, 10] }, &lab(), 0);
        assert!(stuck.lost > 0 && stuck.first.is_some_and(|(_, cause)| cause == Cause::NoPull), "{stuck:?}");
        assert_eq!(run(&PhaseTable { columns: Vec::new() }, &lab(), 2).sent, 960);
    }
}
