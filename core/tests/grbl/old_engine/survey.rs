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

use super::asks::{EngineAction, EnginePhase, SurveyNews, SurveyStart};
use super::engine::{Controller, Meaning};
use super::lines::number;
use annulus_core::control::Trust;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::geometry::Point;
use annulus_core::level::{ProbeGrid, Survey};
use annulus_core::units::Length;

const SAME_MM: f64 = 0.02;
const NONE_MM: f64 = 0.002;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SurveyStep {
    Rise,
    Over,
    Down,
    Again,
    Back,
}

#[derive(Debug)]
pub(super) struct SurveyRun {
    start: SurveyStart,
    survey: Survey,
    last_mm: f64,
    highest_mm: f64,
    wanted_mm: [f64; 3],
    met_mm: Option<[f64; 3]>,
    pub(super) holds: bool,
    /// Time since when the tip is up and the probe input must be checked, ms.
    up_since_ms: Option<u64>,
}

impl SurveyRun {
    fn up_mm(&self) -> f64 {
        self.highest_mm.max(0.0) + self.start.clear_mm
    }
}

fn mm(place: Point) -> [f64; 2] {
    [place.x.mm(), place.y.mm()]
}

impl Controller {
    pub fn survey(&self) -> Option<&Survey> {
        self.survey.as_ref().map(|run| &run.survey)
    }

    pub(super) fn begin_survey(&mut self, start: SurveyStart) {
        if self.trust != Trust::Trusted {
            let homes = super::settings::on(&self.info.values, 22);
            return self.found(Diagnostic::error(if homes { "grbl.not_homed" } else { "grbl.no_zero" }));
        }
        let (Some(zero), Some(place)) = (self.zero_mm, self.place()) else {
            return self.found(Diagnostic::error("grbl.no_report"));
        };
        if !start.grid.is_sound() {
            return self.found(Diagnostic::error("level.no_grid").with("most", ProbeGrid::MOST));
        }
        let sound = |value: f64, most: f64| value.is_finite() && value > 0.0 && value <= most;
        let heights = sound(start.clear_mm, 20.0) && sound(start.depth_mm, 20.0);
        if !heights || !sound(start.mm_per_min, 1_000.0) || !sound(start.over_mm_per_min, 1_000.0) {
            return self.found(Diagnostic::error("level.bad_survey"));
        }
        let corners = [mm(start.grid.low), mm(start.grid.high)];
        for axis in 0..2 {
            let Some([low, high]) = self.room_mm(axis) else { continue };
            if corners[0][axis] + zero[axis] < low || corners[1][axis] + zero[axis] > high {
                let name = ["X", "Y"][axis];
                return self.found(Diagnostic::error("level.no_room").with("axis", name));
            }
        }
        let survey = Survey::new(start.grid);
        let run = SurveyRun {
            start,
            survey,
            last_mm: 0.0,
            highest_mm: 0.0,
            wanted_mm: place,
            met_mm: None,
            holds: false,
            up_since_ms: None,
        };
        self.survey = Some(run);
        self.set(EnginePhase::Surveying);
        self.survey_rises();
    }

    fn survey_rises(&mut self) {
        let Some(run) = &mut self.survey else { return };
        let up = run.up_mm().max(run.wanted_mm[2]);
        run.wanted_mm[2] = up;
        self.send("G21G17G90G94", Meaning::Survey(None));
        self.send(&format!("G90G0Z{}", number(up)), Meaning::Survey(None));
        // A dwell is answered after the move before it: the tip is up then.
        self.send("G4P0", Meaning::Survey(Some(SurveyStep::Rise)));
    }

    /// Moves to the next point or down on it; after the last point to the zero.
    fn survey_goes(&mut self) {
        let Some(run) = &mut self.survey else { return };
        if run.holds {
            return self.set(EnginePhase::Held);
        }
        let next = run.survey.next();
        let to = next.map_or([0.0; 2], mm);
        let far = libm::hypot(to[0] - run.wanted_mm[0], to[1] - run.wanted_mm[1]);
        let step = if next.is_some() { SurveyStep::Over } else { SurveyStep::Back };
        (run.wanted_mm[0], run.wanted_mm[1]) = (to[0], to[1]);
        if far > NONE_MM {
            let feed = number(run.start.over_mm_per_min);
            let text = format!("G90G38.3X{}Y{}F{feed}", number(to[0]), number(to[1]));
            return self.survey_probes(&text, step);
        }
        match next {
            Some(_) => self.survey_goes_down(),
            None => self.survey_done(),
        }
    }

    /// A report answering the query of `asked_ms`: with the tip up, a closed probe input could detect
    /// nothing.
    pub(super) fn survey_reported(&mut self, asked_ms: u64) {
        let Some(run) = self.survey.as_mut().filter(|run| run.up_since_ms.is_some_and(|up| asked_ms >= up))
        else {
            return;
        };
        run.up_since_ms = None;
        if self.contact_is_closed() {
            return self.survey_fails(Diagnostic::error("grbl.probe_closed"));
        }
        self.survey_goes();
    }

    fn survey_goes_down(&mut self) {
        let Some(run) = &mut self.survey else { return };
        let lowest = run.last_mm - run.start.depth_mm;
        run.wanted_mm[2] = lowest;
        let text = format!("G90G38.3Z{}F{}", number(lowest), number(run.start.mm_per_min));
        self.survey_probes(&text, SurveyStep::Down);
    }

    fn survey_probes(&mut self, text: &str, step: SurveyStep) {
        self.probed = None;
        self.send(text, Meaning::Survey(Some(step)));
    }

    pub(super) fn survey_answered(&mut self, step: SurveyStep) {
        if self.phase != EnginePhase::Surveying && self.phase != EnginePhase::Holding {
            return;
        }
        if step == SurveyStep::Rise {
            if let Some(run) = &mut self.survey {
                run.up_since_ms = Some(self.now_ms);
            }
            return;
        }
        let (probed, place, zero) = (self.probed.take(), self.probed_at_mm, self.zero_mm);
        let (Some(met), Some(machine), Some(zero)) = (probed, place, zero) else {
            return self.survey_fails(Diagnostic::error("level.no_answer"));
        };
        let Some(run) = &self.survey else { return };
        let at: [f64; 3] = core::array::from_fn(|axis| machine[axis] - zero[axis]);
        let wanted = run.wanted_mm;
        let off = |axis: usize| libm::fabs(at[axis] - wanted[axis]) > SAME_MM;
        let told = |code: &str| {
            let why = Diagnostic::error(code).with("x", format!("{:.3}", wanted[0]));
            why.with("y", format!("{:.3}", wanted[1]))
        };
        match (step, met) {
            (SurveyStep::Over | SurveyStep::Back, true) => self.survey_fails(told("level.in_the_way")),
            (SurveyStep::Over | SurveyStep::Back, false) if off(0) || off(1) || off(2) => {
                self.survey_fails(told("level.elsewhere"));
            }
            (SurveyStep::Down, _) if off(0) || off(1) => self.survey_fails(told("level.elsewhere")),
            (SurveyStep::Down, false) => {
                let below = format!("{:.3}", wanted[2]);
                self.survey_fails(told("level.no_board").with("mm", below));
            }
            (SurveyStep::Down, true) => {
                if let Some(run) = &mut self.survey {
                    run.met_mm = Some(machine);
                }
                self.survey_probes("$#", SurveyStep::Again);
            }
            (SurveyStep::Again, _) if !met || run.met_mm != Some(machine) => {
                self.survey_fails(Diagnostic::error("level.no_answer"));
            }
            (SurveyStep::Again, _) => self.survey_touched(at[2]),
            (SurveyStep::Over, false) => self.survey_goes_down(),
            _ => self.survey_done(),
        }
    }

    fn survey_touched(&mut self, height_mm: f64) {
        let Some(run) = &mut self.survey else { return };
        let index = run.survey.next_index().unwrap_or_default();
        let height = Length::from_mm(height_mm);
        if let Err(why) = run.survey.touch(height) {
            return self.survey_fails(why);
        }
        run.last_mm = height_mm;
        run.highest_mm = run.highest_mm.max(height_mm);
        run.wanted_mm[2] = height_mm;
        let (done, of) = run.survey.progress();
        self.out.push(EngineAction::Survey(SurveyNews::Touched { index, height, done, of }));
        self.survey_rises();
    }

    fn survey_done(&mut self) {
        let Some(run) = self.survey.take() else { return };
        // Ready after the final position is reported.
        self.set(EnginePhase::Jogging);
        self.out.push(EngineAction::Survey(SurveyNews::Over { survey: Some(Box::new(run.survey)) }));
    }

    /// The survey failed. The tip moves straight up, where nothing can be in its way.
    fn survey_fails(&mut self, why: Diagnostic) {
        let Some(run) = self.survey.take() else { return };
        self.found(why);
        self.out.push(EngineAction::Survey(SurveyNews::Over { survey: None }));
        self.lift(run.start.clear_mm);
    }

    /// An alarm, a reset or a disconnect ended the survey; `code` is a message, if no other reports the
    /// cause.
    pub(super) fn survey_is_over(&mut self, code: Option<&str>) {
        if self.survey.take().is_some() {
            self.out.extend(code.map(|code| EngineAction::Found(Diagnostic::error(code))));
            self.out.push(EngineAction::Survey(SurveyNews::Over { survey: None }));
        }
    }

    pub(super) fn survey_resumes(&mut self) {
        if let Some(run) = &mut self.survey {
            run.holds = false;
            self.set(EnginePhase::Surveying);
            self.survey_goes();
        }
    }
}
