//! Inputs without glitches: a reading that differs from the previous one counts only if repeated readings
//! confirm it.
//!
//! ```text
//! readings   0 0 0 1 0 0 0 0 0 1 1 1 1 1 1 1         a single flip is read again and rejected
//! believed   0 0 0 0 0 0 0 0 0 0 0 0 0 1 1 1         five in a row at one moment are believed
//! ```
//!
//! Contact chatter stays visible: its first touch counts, because that is the edge.

use super::Pins;
use crate::pass_pins_on;

/// Readings taken before a change is believed. With 1 % of the readings flipped, one change in 10¹⁰ is wrong.
const AGREE: u32 = 5;

/// Pins that reject single wrong readings.
#[derive(Clone, Debug)]
pub struct Steady<P> {
    pins: P,
    believed: Option<u32>,
}

impl<P: Pins> Steady<P> {
    pub fn new(pins: P) -> Self {
        Self { pins, believed: None }
    }

    pub fn inner(&self) -> &P {
        &self.pins
    }
}

impl<P: Pins> Pins for Steady<P> {
    pass_pins_on!(step, spindle, spindle_state, output, rest, due, bit, stock, ahead, attend, safe);

    fn inputs(&mut self, at_tick: u64) -> u32 {
        let pins = &mut self.pins;
        let mut read = || pins.inputs(at_tick);
        // Without an earlier value, the majority decides.
        let believed = *self.believed.get_or_insert_with(|| majority(&std::array::from_fn(|_| read())));
        let mut changed = read() ^ believed;
        for _ in 1..AGREE {
            if changed != 0 {
                changed &= read() ^ believed;
            }
        }
        self.believed = Some(believed ^ changed);
        believed ^ changed
    }
}

fn majority(readings: &[u32; AGREE as usize]) -> u32 {
    let most = |bit: &u32| readings.iter().filter(|word| *word & bit != 0).count() * 2 > readings.len();
    (0..u32::BITS).map(|bit| 1 << bit).filter(most).fold(0, |word, bit| word | bit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pins::AxisSet;

    struct Script(Vec<u32>, usize);

    impl Pins for Script {
        fn step(&mut self, _: u64, _: AxisSet, _: AxisSet) {}
        fn spindle(&mut self, _: u64, _: u32) {}
        fn inputs(&mut self, _: u64) -> u32 {
            self.1 += 1;
            self.0[(self.1 - 1).min(self.0.len() - 1)]
        }
        fn safe(&mut self) {}
    }

    #[test]
    fn single_flips_are_ignored_and_changes_are_accepted() {
        // (readings after the first five, which are 0b01; what is believed in the end)
        let rows: [(&[u32], u32); 5] = [
            (&[0b11, 0b01], 0b01),
            (&[0b00, 0b01], 0b01),
            (&[0b11, 0b10, 0b11, 0b11, 0b11], 0b11),
            (&[0b11, 0b11, 0b11, 0b11, 0b01], 0b01),
            (&[0b10, 0b10, 0b10, 0b10, 0b10], 0b10),
        ];
        for (readings, believed) in rows {
            let mut script = vec![0b01, 0b11, 0b01, 0b00, 0b01];
            script.extend(readings);
            let mut pins = Steady::new(Script(script, 0));
            assert_eq!(pins.inputs(0), believed, "{readings:?}");
        }
    }
}
