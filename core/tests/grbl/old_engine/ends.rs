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
use super::engine::Controller;
use super::settings;
use annulus_core::control::Trust;

const HOMES_LOW: u16 = 23;
const PULL_OFF: u16 = 27;
const USUAL_PULL_OFF_MM: f64 = 1.0;
const NEAR_MM: f64 = 0.05;
const USUALLY_NEAR_MM: f64 = 10.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct AxisEnds {
    pub(super) ends_mm: [f64; 2],
    pub(super) room_mm: [f64; 2],
}

pub(super) trait Ends {
    fn homes_low(&self, axis: usize) -> bool;
    fn hear_ends(&mut self, text: &str);
    fn zero_is_left(&self) -> bool;
    fn ends_by(&self, axis: usize, place_mm: f64) -> Option<Option<AxisEnds>>;
}

impl Ends for Info {
    fn homes_low(&self, axis: usize) -> bool {
        self.values.get(&HOMES_LOW).is_some_and(|mask| *mask as u32 >> axis & 1 == 1)
    }

    fn hear_ends(&mut self, text: &str) {
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

    fn zero_is_left(&self) -> bool {
        self.options.letters.contains('Z')
    }

    /// Ends of an axis that homing left at `place_mm`. `None`: the axis can't have looked for its limit
    /// switch. `Some(None)`: the travel is unknown.
    fn ends_by(&self, axis: usize, place_mm: f64) -> Option<Option<AxisEnds>> {
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

impl Controller {
    /// Range of an axis without limit switches, machine coordinates, mm; `None` if the axis wasn't homed.
    pub fn room_mm(&self, axis: usize) -> Option<[f64; 2]> {
        self.ends_of(axis).map(|ends| ends.room_mm)
    }

    pub fn ends_mm(&self, axis: usize) -> Option<[f64; 2]> {
        self.ends_of(axis).map(|ends| ends.ends_mm)
    }

    fn ends_of(&self, axis: usize) -> Option<AxisEnds> {
        let homed = self.homes() && self.trust == Trust::Trusted;
        *self.ends.get(axis).filter(|_| homed)?
    }
}
