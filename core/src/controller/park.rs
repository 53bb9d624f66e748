//! Parking: up first, and away in the plane only once it is reported up there. Both are moves by hand, which STOP ends. At rest the
//! spindle is off already: nothing is said of it that could become its start on the way.
//!
//! ```text
//! Z up ─▶ rest, reported at the top ─▶ X and Y ─▶ rest, reported there
//! ```
//!
//! Comes in: an ask, reports of rest. Goes out: `$J` lines in machine coordinates. mm and mm/min. Does not know who wants it.

use super::asks::EnginePhase;
use super::engine::{Controller, Meaning};
use super::lines::number;
use super::settings;
use crate::control::Trust;
use crate::diagnostic::Diagnostic;

/// So near to where it was to come to rest it is there.
const NEAR_MM: f64 = 0.05;
/// How fast it goes where nobody knows how fast it may.
const USUAL_MM_PER_MIN: f64 = 500.0;

/// A way to where it is parked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ParkRun {
    /// Where it is parked, machine coordinates: X, Y, and Z all the way up.
    place_mm: [f64; 3],
    /// It is up, and goes away in the plane.
    is_up: bool,
}

impl Controller {
    /// Whether it is on its way to where it is parked.
    pub fn parks(&self) -> bool {
        self.park.is_some()
    }

    /// Goes there: to so far from the lowest ends of X and Y, or to where homing leaves it.
    pub(super) fn begin_park(&mut self, from_low_mm: Option<[f64; 2]>) {
        let rooms: [_; 3] = core::array::from_fn(|axis| self.room_mm(axis));
        let [Some(x), Some(y), Some(z)] = rooms else {
            let code = if self.homes() && self.trust == Trust::Trusted {
                "grbl.no_travel"
            } else if self.homes() {
                "grbl.not_homed"
            } else {
                "grbl.cannot_home"
            };
            return self.found(Diagnostic::error(code));
        };
        let here = self.status.as_ref().and_then(|status| status.machine_mm);
        let Some(here) = here else { return self.found(Diagnostic::error("grbl.no_report")) };
        let along = |axis: usize, [low, high]: [f64; 2]| match from_low_mm {
            Some(from_low) => {
                let lowest = self.ends_mm(axis).map_or(low, |ends| ends[0]);
                (lowest + from_low[axis]).clamp(low, high)
            }
            None if self.info.homes_low(axis) => low,
            None => high,
        };
        // Never down: not from where homing left it either.
        let run = ParkRun { place_mm: [along(0, x), along(1, y), z[1].max(here[2])], is_up: false };
        self.jog_to(&format!("Z{}", number(run.place_mm[2])), &[2]);
        self.set(EnginePhase::Jogging);
        self.park = Some(run);
    }

    /// To these words in machine coordinates, as fast as the slowest of `axes` goes.
    fn jog_to(&mut self, words: &str, axes: &[usize]) {
        let rates = settings::axes(&self.info.values, 110);
        let fastest = rates.map_or(USUAL_MM_PER_MIN, |rates| {
            axes.iter().map(|axis| rates[*axis]).fold(f64::INFINITY, f64::min)
        });
        self.send(&format!("$J=G53G90G21{words}F{}", number(fastest)), Meaning::Jog);
    }

    /// It rests on its way. Gives whether it goes on: where it is not up, X and Y stay where they are.
    pub(super) fn park_goes_on(&mut self) -> bool {
        let Some(run) = self.park.take() else { return false };
        if self.jog_is_to_end() {
            return false;
        }
        let place_mm = self.status.as_ref().and_then(|status| status.machine_mm);
        let is_near = |axis: usize| {
            place_mm.is_some_and(|place| libm::fabs(place[axis] - run.place_mm[axis]) <= NEAR_MM)
        };
        let is_there = is_near(2) && (!run.is_up || is_near(0) && is_near(1));
        if !is_there {
            self.found(Diagnostic::error("grbl.not_parked"));
        }
        if !is_there || run.is_up {
            return false;
        }
        let [x, y, _] = run.place_mm;
        self.jog_to(&format!("X{}Y{}", number(x), number(y)), &[0, 1]);
        self.park = Some(ParkRun { is_up: true, ..run });
        true
    }
}
