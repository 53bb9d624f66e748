//! Manual outputs: locked, unlocked for minutes, switched one by one while nothing moves.
//!
//! ```text
//! locked ── OutputLease 1 … 5 min ──▶ unlocked ── time over, 0 min, new control, any move ──▶ locked, all off
//!                                       └─ Output: on, off, pulse
//! ```

use super::Owner;
use annulus_core::control::State;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::wire::{Outputs, Tell};
use std::time::Duration;

const LONGEST_LEASE: u8 = 5;

const LONGEST_PULSE: u32 = 10_000;

/// The first name in the list.
const SPINDLE: &str = "spindle";

/// A switch: index of the output's name, and on or off.
type Switch = (usize, bool);

/// The lock, and what was switched since it was opened.
#[derive(Debug, Default)]
pub(crate) struct ManualOutputs {
    until: Option<Duration>,
    on: u32,
    /// Running pulses: index of the name, final state, end.
    pulses: Vec<(usize, bool, Duration)>,
}

impl ManualOutputs {
    fn unlock(&mut self, minutes: u8, now: Duration) {
        self.until = Some(now + Duration::from_secs(60 * u64::from(minutes)));
    }

    fn switch(&mut self, (place, on): Switch, pulse_ms: Option<u32>, now: Duration) {
        self.pulses.retain(|(other, ..)| *other != place);
        self.note((place, on));
        if let Some(ms) = pulse_ms {
            self.pulses.push((place, !on, now + Duration::from_millis(u64::from(ms))));
        }
    }

    fn note(&mut self, (place, on): Switch) {
        let bit = 1 << place;
        self.on = if on { self.on | bit } else { self.on & !bit };
    }

    /// Locks. Returns the switches that turn everything off; `None` if it was locked already.
    fn lock(&mut self) -> Option<Vec<Switch>> {
        self.until.take()?;
        self.pulses.clear();
        let on = std::mem::take(&mut self.on);
        Some((0..32).filter(|place| on >> place & 1 == 1).map(|place| (place, false)).collect())
    }

    /// Ends pulses and the lease when they are due. Returns the switches to carry out, if any.
    fn tick(&mut self, now: Duration) -> Option<Vec<Switch>> {
        if self.until.is_some_and(|until| until <= now) {
            return self.lock();
        }
        let over: Vec<Switch> = self
            .pulses
            .iter()
            .filter(|(.., end)| *end <= now)
            .map(|(place, back, _)| (*place, *back))
            .collect();
        self.pulses.retain(|(.., end)| *end > now);
        over.iter().for_each(|switch| self.note(*switch));
        (!over.is_empty()).then_some(over)
    }

    /// Time of the next end of a pulse or the lease.
    fn due(&self) -> Option<Duration> {
        self.pulses.iter().map(|(.., end)| *end).chain(self.until).min()
    }
}

impl Owner {
    fn output_names(&self) -> Vec<String> {
        std::iter::once(SPINDLE.to_owned()).chain(self.machine.output_names()).collect()
    }

    /// Unlocks for `minutes`; 0 locks.
    pub(crate) fn lease_outputs(&mut self, minutes: u8) -> Result<(), Diagnostic> {
        if minutes > LONGEST_LEASE {
            let why = error!("control.lease_range", minutes = minutes, ..);
            return Err(why.with("most", LONGEST_LEASE));
        }
        if minutes == 0 {
            self.lock_outputs();
            return Ok(());
        }
        self.may_switch()?;
        let now = self.now();
        self.by_hand.unlock(minutes, now);
        self.tell(self.outputs_tell());
        Ok(())
    }

    fn may_switch(&self) -> Result<(), Diagnostic> {
        match self.session.state {
            State::Alarm => Err(error!("control.alarm_unread")),
            State::Ready | State::NotHomed if !self.session.moving => Ok(()),
            _ => Err(error!("control.busy")),
        }
    }

    pub(crate) fn switch_output(
        &mut self,
        name: &str,
        on: bool,
        pulse_ms: Option<u32>,
    ) -> Result<(), Diagnostic> {
        if self.by_hand.until.is_none() {
            return Err(error!("control.outputs_locked"));
        }
        self.may_switch()?;
        let names = self.output_names();
        let Some(place) = names.iter().position(|known| known == name) else {
            let why = error!("control.no_such_output", name = name, ..);
            return Err(why.with("known", names.join(", ")));
        };
        if let Some(ms) = pulse_ms.filter(|ms| !(1..=LONGEST_PULSE).contains(ms)) {
            return Err(error!("control.pulse_range", ms = ms, most = LONGEST_PULSE));
        }
        let now = self.now();
        if let Some(output) = place.checked_sub(1).and_then(|place| u8::try_from(place).ok()) {
            self.switched_by_hand(output);
        }
        self.by_hand.switch((place, on), pulse_ms, now);
        self.put_out(&[(place, on)]);
        Ok(())
    }

    fn put_out(&mut self, switches: &[Switch]) {
        for (place, on) in switches {
            match place.checked_sub(1).and_then(|place| u8::try_from(place).ok()) {
                None => self.executor.spindle(if *on { self.machine.process.usual_rpm() } else { 0 }),
                Some(place) => self.executor.output(place, *on),
            }
        }
        self.tell(self.outputs_tell());
    }

    /// Locks, turns off what was switched on, and cancels a pending opening of the clamp.
    pub(crate) fn lock_outputs(&mut self) {
        self.tools.clamp.stays();
        if let Some(switches) = self.by_hand.lock() {
            self.put_out(&switches);
        }
    }

    /// Ends pulses and the lease when they are due.
    pub(crate) fn tick_outputs(&mut self) {
        let now = self.now();
        if let Some(switches) = self.by_hand.tick(now) {
            self.put_out(&switches);
        }
    }

    /// Time until the next change here.
    pub(crate) fn outputs_due(&self) -> Option<Duration> {
        self.by_hand.due().map(|end| end.saturating_sub(self.now()))
    }

    pub(crate) fn outputs_tell(&self) -> Tell {
        let left = self.by_hand.until.map(|until| until.saturating_sub(self.now()));
        let left_s = left.map(|left| (left.as_secs_f64() * 10.0).round() / 10.0);
        Tell::Outputs(Outputs { names: self.output_names(), on: self.by_hand.on, left_s })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn manual_outputs_end_with_their_pulse_or_lease() {
        let start = Duration::ZERO;
        let at = |ms: u64| start + Duration::from_millis(ms);
        let mut bench = ManualOutputs::default();
        assert_eq!((bench.lock(), bench.due(), bench.tick(at(0))), (None, None, None), "locked as it is");
        bench.unlock(5, start);
        bench.switch((1, true), Some(200), at(10));
        bench.switch((2, false), Some(50), at(10));
        bench.switch((3, true), None, at(10));
        assert_eq!((bench.on, bench.due()), (0b1010, Some(at(60))));
        assert_eq!(bench.tick(at(59)), None);
        assert_eq!((bench.tick(at(60)), bench.on), (Some(vec![(2, true)]), 0b1110));
        // Switching an output manually cancels its pulse.
        bench.switch((1, true), None, at(100));
        assert_eq!(bench.tick(at(500)), None);
        assert_eq!(bench.due(), Some(at(300_000)));
        bench.unlock(5, at(299_000));
        assert_eq!(bench.tick(at(300_000)), None, "extended");
        let off = [1, 2, 3].map(|place| (place, false));
        assert_eq!((bench.tick(at(599_000)), bench.on), (Some(off.to_vec()), 0));
        assert_eq!((bench.lock(), bench.due()), (None, None));
    }
}
