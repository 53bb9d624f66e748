//! Probes the board point by point for a height map.
//!
//! ```text
//!  rise   G90G0Z…          straight up, and a check: the probe input must be open before any other move
//!  over   G90G38.3X…Y…     to the next point, watching the probe: an obstacle stops the move
//!  down   G90G38.3Z…       until the probe meets the board
//!  again  $#               queries the touch position again
//! ```
//!
//! Every move except the one straight up is a probing move, and each is answered with its end position. An
//! end position that differs from the plan, by a corrupted character or a stuck probe lead, ends the survey.

use super::activity::Activity;
use super::asks::{EngineAction, EnginePhase, SurveyNews, SurveyStart};
use super::context::{Context, Report};
use super::jogging::Jogging;
use super::line::{Meaning, SurveyStep};
use super::lines::number;
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::level::{ProbeGrid, Survey};
use crate::units::Length;
use crate::{code, error};

const SAME_MM: f64 = 0.02;
/// Shorter moves are skipped: a controller refuses to probe where it already is.
const NONE_MM: f64 = 0.002;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Hold {
    No,
    Asked,
    Held,
}

#[derive(Debug)]
pub(super) struct Surveying {
    start: SurveyStart,
    survey: Survey,
    last_mm: f64,
    highest_mm: f64,
    /// Planned end of the last line, work coordinates.
    wanted_mm: [f64; 3],
    /// Touch position as first reported, machine coordinates.
    met_mm: Option<[f64; 3]>,
    hold: Hold,
    /// Time since when the tip is up and the probe input must be checked, ms.
    up_since_ms: Option<u64>,
}

fn mm(place: Point) -> [f64; 2] {
    [place.x.mm(), place.y.mm()]
}

impl Surveying {
    /// Starts a survey; `Err` if it can't start.
    pub(super) fn start(cx: &mut Context, start: SurveyStart) -> Result<Box<Self>, Diagnostic> {
        let known = &cx.known;
        if let Some(why) = known.untrusted() {
            return Err(why);
        }
        let (Some(zero), Some(place)) = (known.zero_mm, known.place()) else {
            return Err(error!("grbl.no_report"));
        };
        if !start.grid.is_sound() {
            return Err(error!("level.no_grid", most = ProbeGrid::MOST));
        }
        let sound = |value: f64, most: f64| value.is_finite() && value > 0.0 && value <= most;
        let heights = sound(start.clear_mm, 20.0) && sound(start.depth_mm, 20.0);
        if !heights || !sound(start.mm_per_min, 1_000.0) || !sound(start.over_mm_per_min, 1_000.0) {
            return Err(error!("level.bad_survey"));
        }
        let corners = [mm(start.grid.low), mm(start.grid.high)];
        for axis in 0..2 {
            let Some([low, high]) = known.room_mm(axis) else { continue };
            if corners[0][axis] + zero[axis] < low || corners[1][axis] + zero[axis] > high {
                return Err(error!("level.no_room", axis = ["X", "Y"][axis]));
            }
        }
        let mut surveying = Box::new(Self {
            start,
            survey: Survey::new(start.grid),
            last_mm: 0.0,
            highest_mm: 0.0,
            wanted_mm: place,
            met_mm: None,
            hold: Hold::No,
            up_since_ms: None,
        });
        surveying.rise(cx);
        Ok(surveying)
    }

    pub(super) fn survey(&self) -> &Survey {
        &self.survey
    }

    pub(super) fn phase(&self) -> EnginePhase {
        match self.hold {
            Hold::No => EnginePhase::Surveying,
            Hold::Asked => EnginePhase::Holding,
            Hold::Held => EnginePhase::Held,
        }
    }

    fn up_mm(&self) -> f64 {
        self.highest_mm.max(0.0) + self.start.clear_mm
    }

    /// Straight up, unless the tip is already up.
    fn rise(&mut self, cx: &mut Context) {
        // Never down: the tip may already be higher.
        let up = self.up_mm().max(self.wanted_mm[2]);
        self.wanted_mm[2] = up;
        cx.send("G21G17G90G94", Meaning::Survey(None));
        cx.send(&format!("G90G0Z{}", number(up)), Meaning::Survey(None));
        // A dwell is answered after the move before it: the tip is up then.
        cx.send("G4P0", Meaning::Survey(Some(SurveyStep::Rise)));
    }

    /// Moves to the next point or down on it; after the last point to the zero.
    fn next(mut self: Box<Self>, cx: &mut Context) -> Activity {
        if self.hold == Hold::Asked {
            self.hold = Hold::Held;
            return Activity::Surveying(self);
        }
        let next = self.survey.next();
        let to = next.map_or([0.0; 2], mm);
        let far = libm::hypot(to[0] - self.wanted_mm[0], to[1] - self.wanted_mm[1]);
        let step = if next.is_some() { SurveyStep::Over } else { SurveyStep::Back };
        (self.wanted_mm[0], self.wanted_mm[1]) = (to[0], to[1]);
        if far > NONE_MM {
            let feed = number(self.start.over_mm_per_min);
            // A probing move sideways: if the tip meets something, it stops there.
            let text = format!("G90G38.3X{}Y{}F{feed}", number(to[0]), number(to[1]));
            probe(cx, &text, step);
            return Activity::Surveying(self);
        }
        if next.is_some() { self.descend(cx) } else { self.finish(cx) }
    }

    /// A report. With the tip up, a closed probe input could detect nothing.
    pub(super) fn on_report(mut self: Box<Self>, cx: &mut Context, report: Report) -> Activity {
        let asked_ms = cx.line.last_ask_ms;
        // A query from before the lift may show the contact still closed.
        let shows_up = report.fresh && self.up_since_ms.is_some_and(|up| asked_ms >= up);
        if !shows_up || self.hold == Hold::Held {
            return Activity::Surveying(self);
        }
        self.up_since_ms = None;
        if cx.known.contact_is_closed() {
            return self.fail(cx, error!("grbl.probe_closed"));
        }
        self.next(cx)
    }

    fn descend(mut self: Box<Self>, cx: &mut Context) -> Activity {
        let lowest = self.last_mm - self.start.depth_mm;
        self.wanted_mm[2] = lowest;
        let text = format!("G90G38.3Z{}F{}", number(lowest), number(self.start.mm_per_min));
        probe(cx, &text, SurveyStep::Down);
        Activity::Surveying(self)
    }

    pub(super) fn on_answer(mut self: Box<Self>, cx: &mut Context, step: SurveyStep) -> Activity {
        if self.hold == Hold::Held {
            return Activity::Surveying(self);
        }
        if step == SurveyStep::Rise {
            self.up_since_ms = Some(cx.now_ms);
            return Activity::Surveying(self);
        }
        let (probed, place, zero) = (cx.known.probed.take(), cx.known.probed_at_mm, cx.known.zero_mm);
        let (Some(met), Some(machine), Some(zero)) = (probed, place, zero) else {
            return self.fail(cx, error!("level.no_answer"));
        };
        let at: [f64; 3] = core::array::from_fn(|axis| machine[axis] - zero[axis]);
        let wanted = self.wanted_mm;
        let off = |axis: usize| libm::fabs(at[axis] - wanted[axis]) > SAME_MM;
        let told = |code: &str| {
            let why = Diagnostic::error(code).with("x", format!("{:.3}", wanted[0]));
            why.with("y", format!("{:.3}", wanted[1]))
        };
        match (step, met) {
            (SurveyStep::Over | SurveyStep::Back, true) => self.fail(cx, told(code!("level.in_the_way"))),
            (SurveyStep::Over | SurveyStep::Back, false) if off(0) || off(1) || off(2) => {
                self.fail(cx, told(code!("level.elsewhere")))
            }
            (SurveyStep::Down, _) if off(0) || off(1) => self.fail(cx, told(code!("level.elsewhere"))),
            (SurveyStep::Down, false) => {
                self.fail(cx, told(code!("level.no_board")).with("mm", format!("{:.3}", wanted[2])))
            }
            (SurveyStep::Down, true) => {
                self.met_mm = Some(machine);
                probe(cx, "$#", SurveyStep::Again);
                Activity::Surveying(self)
            }
            (SurveyStep::Again, _) if !met || self.met_mm != Some(machine) => {
                self.fail(cx, error!("level.no_answer"))
            }
            (SurveyStep::Again, _) => self.on_touch(cx, at[2]),
            (SurveyStep::Over, false) => self.descend(cx),
            _ => self.finish(cx),
        }
    }

    fn on_touch(mut self: Box<Self>, cx: &mut Context, height_mm: f64) -> Activity {
        let index = self.survey.next_index().unwrap_or_default();
        let height = Length::from_mm(height_mm);
        if let Err(why) = self.survey.touch(height) {
            return self.fail(cx, why);
        }
        self.last_mm = height_mm;
        // Later moves must clear every point touched so far.
        self.highest_mm = self.highest_mm.max(height_mm);
        self.wanted_mm[2] = height_mm;
        let (done, of) = self.survey.progress();
        cx.out.push(EngineAction::Survey(SurveyNews::Touched { index, height, done, of }));
        self.rise(cx);
        Activity::Surveying(self)
    }

    /// Ready after the final position is reported.
    fn finish(self: Box<Self>, cx: &mut Context) -> Activity {
        cx.out.push(EngineAction::Survey(SurveyNews::Over { survey: Some(Box::new(self.survey)) }));
        // Waits for standstill as after a jog.
        Jogging::sent(None)
    }

    /// The survey failed. The tip moves straight up, where nothing can be in its way.
    fn fail(self: Box<Self>, cx: &mut Context, why: Diagnostic) -> Activity {
        cx.found(why);
        cx.survey_failed();
        cx.lift(self.start.clear_mm);
        Jogging::sent(None)
    }

    pub(super) fn may_hold(&self) -> bool {
        self.hold == Hold::No
    }

    pub(super) fn hold(&mut self) {
        self.hold = Hold::Asked;
    }

    pub(super) fn is_held(&self) -> bool {
        self.hold == Hold::Held
    }

    pub(super) fn resume(mut self: Box<Self>, cx: &mut Context) -> Activity {
        self.hold = Hold::No;
        self.next(cx)
    }
}

fn probe(cx: &mut Context, text: &str, step: SurveyStep) {
    cx.known.probed = None;
    cx.send(text, Meaning::Survey(Some(step)));
}

impl Context {
    /// A survey ended without a result.
    pub(super) fn survey_failed(&mut self) {
        self.out.push(EngineAction::Survey(SurveyNews::Over { survey: None }));
    }
}
