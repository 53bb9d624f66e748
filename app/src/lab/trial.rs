//! Tries a phase table on a virtual motor: there and back at the set interrupt frequency, counting lost
//! steps.
//!
//! ```text
//! Automaton ─ steps ─▶ Rotor (of the virtual drill) ─▶ lost steps, first cause
//! ```
//!
//! Uses simulated time, counted in interrupts.

use annulus_core::machine::{Machine, PhaseTable};
use annulus_core::steps::TICK_HZ;
use annulus_core::steps::automaton::Automaton;
use annulus_core::virtual_drill::{Cause, Push, Rotor};

/// Steps in each direction.
pub const WAY: i64 = 480;

/// Limit for a table that never finishes; a valid table needs far fewer interrupts.
const MOST_INTERRUPTS: u64 = 2_000_000;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrialOutcome {
    pub interrupt_hz: u32,
    pub sent: u64,
    pub lost: u64,
    /// The first loss: number of the step, from 1, and cause.
    pub first: Option<(u64, Cause)>,
    /// Final position of the rotor; 0 if no step was lost.
    pub off: i64,
}

/// Runs `table` on motor `axis` of `machine`: [`WAY`] steps forward and back, with the machine's dynamics.
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
    fn papers_phase_table_slips_above_580_hz() {
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
    fn phase_table_without_rotation_loses_steps() {
        let stuck = run(&PhaseTable { columns: vec![5, 10] }, &lab(), 0);
        assert!(stuck.lost > 0 && stuck.first.is_some_and(|(_, cause)| cause == Cause::NoPull), "{stuck:?}");
        assert_eq!(run(&PhaseTable { columns: Vec::new() }, &lab(), 2).sent, 960);
    }
}
