//! Parking: first up; sideways only after a report shows the top. Both are jogs, which STOP ends. The spindle
//! is already off, so no spindle word is sent that a damaged character could turn into a start.
//!
//! ```text
//! Z up ─▶ stopped, reported at the top ─▶ X and Y ─▶ stopped, reported there
//! ```

use super::context::Context;
use super::line::Meaning;
use super::lines::number;
use super::settings;
use crate::diagnostic::Diagnostic;
use crate::{code, error};

const NEAR_MM: f64 = 0.05;
const USUAL_MM_PER_MIN: f64 = 500.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Park {
    /// Park position, machine coordinates: X, Y, and Z fully up.
    place_mm: [f64; 3],
    is_up: bool,
}

impl Park {
    /// Parks at this distance from the low ends of X and Y, or where homing leaves them.
    pub(super) fn start(cx: &mut Context, from_low_mm: Option<[f64; 2]>) -> Result<Self, Diagnostic> {
        let known = &cx.known;
        let rooms: [_; 3] = core::array::from_fn(|axis| known.room_mm(axis));
        let [Some(x), Some(y), Some(z)] = rooms else {
            let code = if known.is_homed() {
                code!("grbl.no_travel")
            } else if known.homes() {
                code!("grbl.not_homed")
            } else {
                code!("grbl.cannot_home")
            };
            return Err(Diagnostic::error(code));
        };
        let here = known.machine_mm().ok_or_else(|| error!("grbl.no_report"))?;
        let along = |axis: usize, [low, high]: [f64; 2]| match from_low_mm {
            Some(from_low) => {
                let lowest = known.ends_mm(axis).map_or(low, |ends| ends[0]);
                (lowest + from_low[axis]).clamp(low, high)
            }
            None if known.info.homes_low(axis) => low,
            None => high,
        };
        // Never move down, not even from where homing left Z.
        let park = Self { place_mm: [along(0, x), along(1, y), z[1].max(here[2])], is_up: false };
        jog_to(cx, &format!("Z{}", number(park.place_mm[2])), &[2]);
        Ok(park)
    }

    /// The machine stopped on the way: the rest of the way, if any. If the tip is not up, X and Y stay.
    pub(super) fn next(self, cx: &mut Context, is_to_end: bool) -> Option<Self> {
        if is_to_end {
            return None;
        }
        let place_mm = cx.known.machine_mm();
        let is_near = |axis: usize| {
            place_mm.is_some_and(|place| libm::fabs(place[axis] - self.place_mm[axis]) <= NEAR_MM)
        };
        let is_there = is_near(2) && (!self.is_up || is_near(0) && is_near(1));
        if !is_there {
            cx.error(code!("grbl.not_parked"));
        }
        if !is_there || self.is_up {
            return None;
        }
        let [x, y, _] = self.place_mm;
        jog_to(cx, &format!("X{}Y{}", number(x), number(y)), &[0, 1]);
        Some(Self { is_up: true, ..self })
    }
}

/// Moves to machine coordinates at the feed of the slowest of `axes`.
fn jog_to(cx: &mut Context, words: &str, axes: &[usize]) {
    let rates = settings::axes(&cx.known.info.values, 110);
    let fastest = rates
        .map_or(USUAL_MM_PER_MIN, |rates| axes.iter().map(|axis| rates[*axis]).fold(f64::INFINITY, f64::min));
    cx.send(&format!("$J=G53G90G21{words}F{}", number(fastest)), Meaning::Jog);
}
