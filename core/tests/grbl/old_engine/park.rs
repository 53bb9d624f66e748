//! Parking: first up; sideways only after a report shows the top. Both are jogs, which STOP ends. The spindle
//! is already off, so no spindle word is sent that a damaged character could turn into a start.
//!
//! ```text
//! Z up ─▶ stopped, reported at the top ─▶ X and Y ─▶ stopped, reported there
//! ```

use super::asks::EnginePhase;
use super::ends::Ends;
use super::engine::{Controller, Meaning};
use super::lines::number;
use super::settings;
use annulus_core::control::Trust;
use annulus_core::diagnostic::Diagnostic;

const NEAR_MM: f64 = 0.05;
const USUAL_MM_PER_MIN: f64 = 500.0;

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ParkRun {
    place_mm: [f64; 3],
    is_up: bool,
}

impl Controller {
    pub fn parks(&self) -> bool {
        self.park.is_some()
    }

    /// Parks at this distance from the low ends of X and Y, or where homing leaves them.
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
        // Never move down, not even from where homing left Z.
        let run = ParkRun { place_mm: [along(0, x), along(1, y), z[1].max(here[2])], is_up: false };
        self.jog_to(&format!("Z{}", number(run.place_mm[2])), &[2]);
        self.set(EnginePhase::Jogging);
        self.park = Some(run);
    }

    fn jog_to(&mut self, words: &str, axes: &[usize]) {
        let rates = settings::axes(&self.info.values, 110);
        let fastest = rates.map_or(USUAL_MM_PER_MIN, |rates| {
            axes.iter().map(|axis| rates[*axis]).fold(f64::INFINITY, f64::min)
        });
        self.send(&format!("$J=G53G90G21{words}F{}", number(fastest)), Meaning::Jog);
    }

    /// The machine stopped on the way. True if parking continues: if the tip is not up, X and Y stay.
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
