//! The inputs as they were seen, and the guided check of every sensor.
//!
//! ```text
//! status ─ bits ─▶ Inputs: now, edges, last change
//!                    └─▶ Check: press this one … seen / not seen … next … report
//! ```
//!
//! Comes in: input bits with their time. Goes out: counts and a report. Does not know how bits travel; edges between two
//! statuses are not seen.

use annulus_core::job::Input;

/// How many inputs there are.
pub const INPUTS: usize = Input::ALL.len();

/// What is known of the inputs.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KnownInputs {
    /// Bits as last seen; none before the first status.
    pub bits: Option<u32>,
    /// Changes seen, by input.
    pub edges: [u32; INPUTS],
    /// When it changed last, ms since 1970.
    pub changed_ms: [Option<f64>; INPUTS],
}

impl KnownInputs {
    /// Whether `input` is on.
    pub fn on(&self, input: Input) -> bool {
        self.bits.is_some_and(|bits| bits & input.bit() != 0)
    }

    /// After a status with `bits`.
    #[must_use]
    pub fn seen(mut self, at_ms: f64, bits: u32) -> Self {
        let changed = self.bits.map_or(0, |before| before ^ bits);
        for (index, input) in Input::ALL.into_iter().enumerate() {
            if changed & input.bit() != 0 {
                self.edges[index] = self.edges[index].saturating_add(1);
                self.changed_ms[index] = Some(at_ms);
            }
        }
        self.bits = Some(bits);
        self
    }

    /// The same with the counts begun anew.
    #[must_use]
    pub fn counted_anew(self) -> Self {
        Self { bits: self.bits, ..Self::default() }
    }
}

/// What the check found of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// It turned on and off again.
    Good,
    /// It turned on and did not turn off before the person went on.
    StuckOn,
    /// It was on before it was pressed, and nothing changed.
    OnAlready,
    /// It never changed.
    Nothing,
}

/// The guided check: one sensor after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Check {
    /// The sensor to press now, as its place in [`Input::ALL`]; past the end when done.
    pub at: usize,
    found: [Option<Found>; INPUTS],
    /// It was on when its turn came.
    was_on: bool,
    /// It changed while its turn was.
    changed: bool,
}

impl Check {
    /// Begins with the first sensor, while the inputs are `bits`.
    pub fn begin(bits: u32) -> Self {
        let first = Self { at: 0, found: [None; INPUTS], was_on: false, changed: false };
        Self { was_on: first.is_on(bits), ..first }
    }

    fn is_on(&self, bits: u32) -> bool {
        Input::ALL.get(self.at).is_some_and(|input| bits & input.bit() != 0)
    }

    /// The sensor whose turn it is.
    pub fn input(&self) -> Option<Input> {
        Input::ALL.get(self.at).copied()
    }

    /// What was found of the sensor at `index`.
    pub fn found(&self, index: usize) -> Option<Found> {
        self.found.get(index).copied().flatten()
    }

    /// Whether every sensor had its turn.
    pub fn done(&self) -> bool {
        self.at >= INPUTS
    }

    /// After a status with `bits`: a sensor that went on and off again (or off and on) is good, and the next has its turn.
    #[must_use]
    pub fn seen(self, bits: u32) -> Self {
        if self.done() {
            return self;
        }
        let on = self.is_on(bits);
        if self.changed && on == self.was_on {
            return self.next(Found::Good, bits);
        }
        Self { changed: self.changed || on != self.was_on, ..self }
    }

    /// The person goes on without it.
    #[must_use]
    pub fn skipped(self, bits: u32) -> Self {
        if self.done() {
            return self;
        }
        let found = match (self.changed, self.was_on) {
            (true, _) => Found::StuckOn,
            (false, true) => Found::OnAlready,
            (false, false) => Found::Nothing,
        };
        self.next(found, bits)
    }

    fn next(mut self, found: Found, bits: u32) -> Self {
        self.found[self.at] = Some(found);
        self.at += 1;
        self.changed = false;
        self.was_on = self.is_on(bits);
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_are_counted_from_the_second_status_on() {
        let x_min = Input::XMin.bit();
        let inputs = KnownInputs::default().seen(1.0, x_min).seen(2.0, 0).seen(3.0, x_min).seen(4.0, x_min);
        assert!(inputs.on(Input::XMin) && !inputs.on(Input::XMax));
        assert_eq!((inputs.edges[0], inputs.changed_ms[0]), (2, Some(3.0)));
        assert_eq!((inputs.edges[1], inputs.changed_ms[1]), (0, None));
        let anew = inputs.counted_anew();
        assert_eq!((anew.edges[0], anew.bits), (0, Some(x_min)));
    }

    #[test]
    fn the_check_walks_through_every_sensor() {
        let [first, second, third, fourth] = [0, 1, 2, 3].map(|index| Input::ALL[index].bit());
        let mut check = Check::begin(0);
        assert_eq!(check.input(), Some(Input::ALL[0]));
        check = check.seen(0).seen(first).seen(first).seen(0); // pressed and let go
        assert_eq!((check.at, check.found(0)), (1, Some(Found::Good)));
        check = check.seen(second).skipped(second); // pressed and stuck
        assert_eq!(check.found(1), Some(Found::StuckOn));
        check = check.seen(second).skipped(second | fourth); // another one is on; this one never
        assert_eq!(check.found(2), Some(Found::Nothing));
        check = check.skipped(second | third | fourth); // it was on all the time
        assert_eq!(check.found(3), Some(Found::OnAlready));
        for _ in 4..INPUTS {
            check = check.skipped(0);
        }
        assert!(check.done() && check.input().is_none());
        assert_eq!(check.seen(first), check);
    }

    #[test]
    fn a_sensor_that_rests_on_is_good_when_it_goes_off_and_on() {
        let first = Input::ALL[0].bit();
        let check = Check::begin(first).seen(first).seen(0).seen(first);
        assert_eq!((check.at, check.found(0)), (1, Some(Found::Good)));
    }
}
