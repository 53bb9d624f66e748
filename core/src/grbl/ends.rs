//! Ends of the axes of a homed machine, in machine coordinates. The firmware's convention is derived from
//! where homing left the axis. An axis that is at none of the possible positions did not look for its limit
//! switch.
//!
//! ```text
//!                        homed at its high end ($23: 0)             homed at its low end ($23: 1)
//!  most                   −travel ──────────── −off│ 0              −travel │−travel + off ──────────── 0
//!  counted from the end          same                               0 │off ─────────────────────── travel
//!  zero where it is left  −travel ──────────── 0 │                        │ 0 ──────────────────── travel
//!                                                │ switch; off: the pull-off `$27`; last row: "Z" in `$I`
//! ```
//!
//! FluidNC may have its zero anywhere: it reports the ends of its axes at startup.

use super::asks::Info;
use super::settings;

/// `$23`: one bit for each axis that homes to its low end.
const HOMES_LOW: u16 = 23;
/// `$27`: distance from the limit switch after homing.
const PULL_OFF: u16 = 27;
/// Pull-off of firmwares that don't report it: keep this far from a limit switch.
const USUAL_PULL_OFF_MM: f64 = 1.0;
/// Tolerance for "where homing leaves the axis".
const NEAR_MM: f64 = 0.05;
/// Tolerance if the pull-off is unknown.
const USUALLY_NEAR_MM: f64 = 10.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AxisEnds {
    pub(super) ends_mm: [f64; 2],
    /// Range in which no limit switch triggers.
    pub(super) room_mm: [f64; 2],
}

impl Info {
    pub(super) fn homes_low(&self, axis: usize) -> bool {
        self.values.get(&HOMES_LOW).is_some_and(|mask| *mask as u32 >> axis & 1 == 1)
    }

    /// Reads FluidNC's axis range at startup: `INFO: Axis X (-200.000,0.000)`.
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

    /// Ends of an axis according to its settings, not confirmed by homing; `None` if the settings don't say.
    pub fn likely_ends_mm(&self, axis: usize) -> Option<[f64; 2]> {
        if self.flavour() == "FluidNC" && self.said_ends_mm[axis].is_some() {
            return self.said_ends_mm[axis];
        }
        let travel = settings::axes(&self.values, 130)?[axis];
        let counts_up = self.zero_is_left() && self.homes_low(axis);
        Some(if counts_up { [0.0, travel] } else { [-travel, 0.0] })
    }

    /// True if zero is where homing leaves the axis.
    fn zero_is_left(&self) -> bool {
        // Option letter Z: homing sets the machine position to zero.
        self.options.letters.contains('Z')
    }

    /// Ends of an axis that homing left at `place_mm`. `None`: the axis can't have looked for its limit
    /// switch. `Some(None)`: the travel is unknown.
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
        // Position after homing, the ends that follow, and whether the homed end already excludes the switch.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Travel 200 mm, pull-off 2 mm, X homes low.
    fn info(letters: &str) -> Info {
        let mut info = Info::default();
        info.values.extend([(HOMES_LOW, 1.0), (PULL_OFF, 2.0), (130, 200.0), (131, 200.0), (132, 200.0)]);
        info.options.letters = letters.to_owned();
        info
    }

    #[test]
    fn axis_ends_follow_the_position_after_homing() {
        let is = |ends: [f64; 2], room: [f64; 2]| Some(Some(AxisEnds { ends_mm: ends, room_mm: room }));
        for (letters, axis, place_mm, expected) in [
            ("V", 2, -2.0, is([-200.0, 0.0], [-198.0, -2.0])),
            ("V", 0, -198.0, is([-200.0, 0.0], [-198.0, -2.0])),
            ("V", 0, 2.0, is([0.0, 200.0], [2.0, 198.0])),
            ("V", 2, 198.0, is([0.0, 200.0], [2.0, 198.0])),
            ("VZ", 0, 0.0, is([0.0, 200.0], [0.0, 198.0])),
            ("VZ", 2, 0.0, is([-200.0, 0.0], [-198.0, 0.0])),
            // Position at power-on; the other end; between.
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
    fn fluidnc_reports_axis_ends_and_damaged_reports_are_ignored() {
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
