//! Input history, and a guided check of every sensor.
//!
//! ```text
//! status ─ bits ─▶ Inputs: now, edges, last change
//!                    └─▶ Check: press this one … seen / not seen … next … report
//! ```

use annulus_core::job::Input;

pub const INPUTS: usize = Input::ALL.len();

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct KnownInputs {
    /// Last reported bits; none before the first status.
    pub bits: Option<u32>,
    /// Number of changes per input.
    pub edges: [u32; INPUTS],
    /// Time of the last change, ms since 1970.
    pub changed_ms: [Option<f64>; INPUTS],
}

impl KnownInputs {
    pub fn on(&self, input: Input) -> bool {
        self.bits.is_some_and(|bits| bits & input.bit() != 0)
    }

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

    #[must_use]
    pub fn counted_anew(self) -> Self {
        Self { bits: self.bits, ..Self::default() }
    }
}

/// The result of a sensor's check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    Good,
    /// Turned on, but not off before the user continued.
    StuckOn,
    /// Was on from the start, and didn't change.
    OnAlready,
    Nothing,
}

/// The guided check: one sensor after another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Check {
    /// Index of the current sensor in [`Input::ALL`]; past the end when done.
    pub at: usize,
    found: [Option<Found>; INPUTS],
    was_on: bool,
    changed: bool,
}

impl Check {
    pub fn begin(bits: u32) -> Self {
        let first = Self { at: 0, found: [None; INPUTS], was_on: false, changed: false };
        Self { was_on: first.is_on(bits), ..first }
    }

    fn is_on(&self, bits: u32) -> bool {
        Input::ALL.get(self.at).is_some_and(|input| bits & input.bit() != 0)
    }

    pub fn input(&self) -> Option<Input> {
        Input::ALL.get(self.at).copied()
    }

    pub fn found(&self, index: usize) -> Option<Found> {
        self.found.get(index).copied().flatten()
    }

    pub fn done(&self) -> bool {
        self.at >= INPUTS
    }

    /// Takes a status with `bits`. A sensor that has changed twice (on and off, or off and on) is good; the
    /// next one follows.
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
    fn input_edges_count_from_the_second_status() {
        let x_min = Input::XMin.bit();
        let inputs = KnownInputs::default().seen(1.0, x_min).seen(2.0, 0).seen(3.0, x_min).seen(4.0, x_min);
        assert!(inputs.on(Input::XMin) && !inputs.on(Input::XMax));
        assert_eq!((inputs.edges[0], inputs.changed_ms[0]), (2, Some(3.0)));
        assert_eq!((inputs.edges[1], inputs.changed_ms[1]), (0, None));
        let anew = inputs.counted_anew();
        assert_eq!((anew.edges[0], anew.bits), (0, Some(x_min)));
    }

    #[test]
    fn sensor_check_covers_every_input() {
        let [first, second, third, fourth] = [0, 1, 2, 3].map(|index| Input::ALL[index].bit());
        let mut check = Check::begin(0);
        assert_eq!(check.input(), Some(Input::ALL[0]));
        check = check.seen(0).seen(first).seen(first).seen(0); // pressed and released
        assert_eq!((check.at, check.found(0)), (1, Some(Found::Good)));
        check = check.seen(second).skipped(second); // pressed and stuck
        assert_eq!(check.found(1), Some(Found::StuckOn));
        check = check.seen(second).skipped(second | fourth); // another one is on; this one never
        assert_eq!(check.found(2), Some(Found::Nothing));
        check = check.skipped(second | third | fourth); // on all the time
        assert_eq!(check.found(3), Some(Found::OnAlready));
        for _ in 4..INPUTS {
            check = check.skipped(0);
        }
        assert!(check.done() && check.input().is_none());
        assert_eq!(check.seen(first), check);
    }

    #[test]
    fn normally_on_sensor_passes_after_off_and_on() {
        let first = Input::ALL[0].bit();
        let check = Check::begin(first).seen(first).seen(0).seen(first);
        assert_eq!((check.at, check.found(0)), (1, Some(Found::Good)));
    }
}
