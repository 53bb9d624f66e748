//! Where the axes of a homed machine end, in machine coordinates: not what somebody believes of the firmware, but what agrees with the
//! place where homing left the axis. An axis that stands at none of those did not look for its switch.
//!
//! ```text
//!                        homed at its high end ($23: 0)             homed at its low end ($23: 1)
//!  most                  −travel ──────────── −off│ 0              −travel │−travel + off ──────────── 0
//!  counted from the end         the same                            0 │off ─────────────────────── travel
//!  zero where it is left  −travel ──────────── 0 │                       │ 0 ──────────────────── travel     ("Z" in `$I`)
//!                                                 │ switch; off: the pull-off `$27`
//! ```
//!
//! FluidNC has its zero anywhere: it says the ends of its axes itself, as it starts.
//!
//! Comes in: settings, the first report after homing. Goes out: ends, or nothing. mm. Does not know what moves.

use super::asks::Info;
use super::engine::Controller;
use super::settings;
use crate::control::Trust;

/// `$23`: a bit for each axis that homes to its low end.
const HOMES_LOW: u16 = 23;
/// `$27`: how far from its switch homing leaves an axis.
const PULL_OFF: u16 = 27;
/// The same of most, for those that do not say: nothing goes nearer to a switch.
const USUAL_PULL_OFF_MM: f64 = 1.0;
/// So near to where homing leaves an axis it is there.
const NEAR_MM: f64 = 0.05;
/// The same where nobody knows how far from the switch that is.
const USUALLY_NEAR_MM: f64 = 10.0;

/// The ends of an axis that was homed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AxisEnds {
    /// The lowest and the highest place.
    pub(super) ends_mm: [f64; 2],
    /// Those between which no switch speaks.
    pub(super) room_mm: [f64; 2],
}

impl Info {
    /// Whether an axis homes to its low end.
    pub(super) fn homes_low(&self, axis: usize) -> bool {
        self.values.get(&HOMES_LOW).is_some_and(|mask| *mask as u32 >> axis & 1 == 1)
    }

    /// Takes what FluidNC says of an axis as it starts: `INFO: Axis X (-200.000,0.000)`.
    pub(super) fn hear_ends(&mut self, text: &str) {
        let Some((_, said)) = text.split_once("Axis ") else { return };
        let axis = said.chars().next().and_then(|letter| "XYZ".find(letter));
        let inside = said.get(1..).and_then(|rest| rest.trim().strip_prefix('(')?.strip_suffix(')'));
        let Some((axis, (low, high))) = axis.zip(inside.and_then(|inside| inside.split_once(','))) else {
            return;
        };
        if let (Ok(low), Ok(high)) = (low.trim().parse::<f64>(), high.trim().parse::<f64>())
            && low.is_finite()
            && high.is_finite()
            && low < high
        {
            self.said_ends_mm[axis] = Some([low, high]);
        }
    }

    /// The ends of an axis as its settings have them, before homing has shown whether that is so; none where they do not say.
    pub fn likely_ends_mm(&self, axis: usize) -> Option<[f64; 2]> {
        if self.flavour() == "FluidNC" && self.said_ends_mm[axis].is_some() {
            return self.said_ends_mm[axis];
        }
        let travel = settings::axes(&self.values, 130)?[axis];
        let counts_up = self.zero_is_left() && self.homes_low(axis);
        Some(if counts_up { [0.0, travel] } else { [-travel, 0.0] })
    }

    /// Whether its zero is where homing leaves it.
    fn zero_is_left(&self) -> bool {
        self.options.letters.contains('Z')
    }

    /// What homing that left an axis at `place_mm` says of its ends: none where it cannot have looked for its switch. Of one whose travel
    /// nobody knows, nothing is known after it either.
    pub(super) fn ends_by(&self, axis: usize, place_mm: f64) -> Option<Option<AxisEnds>> {
        let pull_off = self.values.get(&PULL_OFF).copied();
        if self.flavour() == "FluidNC" {
            let Some([low, high]) = self.said_ends_mm[axis] else { return Some(None) };
            let ends =
                AxisEnds::of([low, high], [pull_off.unwrap_or(USUAL_PULL_OFF_MM).min((high - low) / 2.0); 2]);
            return (place_mm > low - NEAR_MM && place_mm < high + NEAR_MM).then_some(Some(ends));
        }
        let Some(travel) = settings::axes(&self.values, 130).map(|travel| travel[axis]) else {
            return Some(None);
        };
        let near = if pull_off.is_some() { NEAR_MM } else { USUALLY_NEAR_MM };
        let off = pull_off.unwrap_or(USUAL_PULL_OFF_MM).clamp(0.0, travel / 2.0);
        let low = self.homes_low(axis);
        // Where it is left, what its ends are then, and whether the one that it homed to is off its switch already.
        let rows = match (self.zero_is_left(), low) {
            (true, true) => vec![(0.0, [0.0, travel], true)],
            (true, false) => vec![(0.0, [-travel, 0.0], true)],
            (false, true) => vec![(off - travel, [-travel, 0.0], false), (off, [0.0, travel], false)],
            (false, false) => vec![(-off, [-travel, 0.0], false), (travel - off, [0.0, travel], false)],
        };
        let (_, ends, is_off) = rows.into_iter().find(|(left, ..)| libm::fabs(place_mm - left) <= near)?;
        let homed_off = if is_off { 0.0 } else { off };
        Some(Some(AxisEnds::of(ends, if low { [homed_off, off] } else { [off, homed_off] })))
    }
}

impl AxisEnds {
    fn of([low, high]: [f64; 2], off_mm: [f64; 2]) -> Self {
        Self { ends_mm: [low, high], room_mm: [low + off_mm[0], high - off_mm[1]] }
    }
}

impl Controller {
    /// The lowest and the highest place of an axis in machine coordinates between which no switch speaks, mm; none where that is not
    /// known: nothing was homed.
    pub fn room_mm(&self, axis: usize) -> Option<[f64; 2]> {
        self.ends_of(axis).map(|ends| ends.room_mm)
    }

    /// The same, switches and all.
    pub fn ends_mm(&self, axis: usize) -> Option<[f64; 2]> {
        self.ends_of(axis).map(|ends| ends.ends_mm)
    }

    fn ends_of(&self, axis: usize) -> Option<AxisEnds> {
        let homed = self.homes() && self.trust == Trust::Trusted;
        *self.ends.get(axis).filter(|_| homed)?
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Settings with a travel of 200 mm that are left 2 mm from their switches, X homed low.
    fn info(letters: &str) -> Info {
        let mut info = Info::default();
        info.values.extend([(HOMES_LOW, 1.0), (PULL_OFF, 2.0), (130, 200.0), (131, 200.0), (132, 200.0)]);
        info.options.letters = letters.to_owned();
        info
    }

    #[test]
    fn the_ends_agree_with_where_homing_left_the_axis() {
        let is = |ends: [f64; 2], room: [f64; 2]| Some(Some(AxisEnds { ends_mm: ends, room_mm: room }));
        for (letters, axis, place_mm, expected) in [
            ("V", 2, -2.0, is([-200.0, 0.0], [-198.0, -2.0])),
            ("V", 0, -198.0, is([-200.0, 0.0], [-198.0, -2.0])),
            ("V", 0, 2.0, is([0.0, 200.0], [2.0, 198.0])),
            ("V", 2, 198.0, is([0.0, 200.0], [2.0, 198.0])),
            ("VZ", 0, 0.0, is([0.0, 200.0], [0.0, 198.0])),
            ("VZ", 2, 0.0, is([-200.0, 0.0], [-198.0, 0.0])),
            // Where it stood when it was switched on; the other end; between.
            ("V", 2, 0.0, None),
            ("V", 2, -198.0, None),
            ("V", 0, -2.0, None),
            ("VZ", 2, -2.0, None),
            ("VZ", 0, 57.0, None),
        ] {
            assert_eq!(info(letters).ends_by(axis, place_mm), expected, "{letters} {axis} {place_mm}");
        }
        let mut unknown = info("V");
        unknown.values.remove(&PULL_OFF);
        let usual = is([-200.0, 0.0], [-199.0, -1.0]);
        assert_eq!(unknown.ends_by(2, -3.0), usual, "nobody knows how far from the switch");
        unknown.values.remove(&132);
        assert_eq!(unknown.ends_by(2, 57.0), Some(None));
    }

    #[test]
    fn fluidnc_says_its_ends_itself_and_what_is_damaged_is_none() {
        let mut info = info("");
        info.banner = "Grbl 3.7 [FluidNC v3.7.8 '$' for help]".to_owned();
        assert_eq!(info.ends_by(0, 12.0), Some(None), "nothing is known, nothing is claimed");
        for text in [
            "INFO: Axis X (2.980,1223.020)",
            "INFO: Axis Y (5.0,nan)",
            "Axis Z (4,3)",
            "Axis count 3",
            "Axis ",
        ] {
            info.hear_ends(text);
        }
        assert_eq!(info.said_ends_mm, [Some([2.98, 1_223.02]), None, None]);
        assert!(info.ends_by(0, 2.98).is_some() && info.ends_by(0, -3.0).is_none());
    }
}
