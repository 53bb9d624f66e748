//! Touching a board place by place with the probe of a controller, for a height map.
//!
//! ```text
//!  rise   G90G0Z…          straight up, and a look: the contact has to be open before anything goes aside or down
//!  over   G90G38.3X…Y…     to the next place, with an eye on the probe: what stands in the way stops it
//!  down   G90G38.3Z…       until the probe meets the board
//!  again  $#               where that was, said a second time
//! ```
//!
//! Every move but the one straight up is a probing one, and each is answered with the place where it ended. That is compared with the
//! place where it should: a character that was changed on the line, or a lead that does not let go, ends the survey.
//!
//! Comes in: asks and answers, from the engine. Goes out: lines, touches, at last the survey. mm in flight, work coordinates. Does not
//! know what the map is for.

use super::asks::{EngineAction, EnginePhase, SurveyNews, SurveyStart};
use super::engine::{Controller, Meaning};
use super::lines::number;
use crate::control::Trust;
use crate::diagnostic::Diagnostic;
use crate::geometry::Point;
use crate::level::{ProbeGrid, Survey};
use crate::units::Length;

/// A probing move that ends further from its place than this did not go where it was sent, mm.
const SAME_MM: f64 = 0.02;
/// Moves shorter than this are none: a controller refuses to probe where it stands.
const NONE_MM: f64 = 0.002;

/// What a line of a survey is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SurveyStep {
    /// Words, and a move straight up.
    Rise,
    /// On the way to the next place.
    Over,
    /// Down to the board.
    Down,
    /// Where it was met, said once more: the line has no checksum.
    Again,
    /// Back over the work zero.
    Back,
}

/// A survey in work.
#[derive(Debug)]
pub(super) struct SurveyRun {
    start: SurveyStart,
    survey: Survey,
    /// The height of the board where it was touched last, and the highest so far, mm.
    last_mm: f64,
    highest_mm: f64,
    /// Where the last line should have led, work coordinates.
    wanted_mm: [f64; 3],
    /// Where the probe met the board as it was said first, machine coordinates.
    met_mm: Option<[f64; 3]>,
    /// It waits once the tip is up.
    pub(super) holds: bool,
    /// Since when the tip is up and its contact is to be looked at, ms.
    up_since_ms: Option<u64>,
}

impl SurveyRun {
    /// How high the tip goes from place to place, mm.
    fn up_mm(&self) -> f64 {
        self.highest_mm.max(0.0) + self.start.clear_mm
    }
}

fn mm(place: Point) -> [f64; 2] {
    [place.x.mm(), place.y.mm()]
}

impl Controller {
    /// The survey that goes on, if one does.
    pub fn survey(&self) -> Option<&Survey> {
        self.survey.as_ref().map(|run| &run.survey)
    }

    /// Begins.
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

    /// Straight up, where the tip is not up already.
    fn survey_rises(&mut self) {
        let Some(run) = &mut self.survey else { return };
        let up = run.up_mm().max(run.wanted_mm[2]);
        run.wanted_mm[2] = up;
        self.send("G21G17G90G94", Meaning::Survey(None));
        self.send(&format!("G90G0Z{}", number(up)), Meaning::Survey(None));
        // It is answered once the tip is up.
        self.send("G4P0", Meaning::Survey(Some(SurveyStep::Rise)));
    }

    /// To the place that is next, to the zero when none is, or down where it stands over it.
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

    /// A report, to a question of `asked_ms`: with the tip up, a contact that is closed tells nothing.
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

    /// A line of it was answered.
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
                let below = format!("{:.3}", -wanted[2]);
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
        // Ready once it has reported where that is.
        self.set(EnginePhase::Jogging);
        self.out.push(EngineAction::Survey(SurveyNews::Over { survey: Some(Box::new(run.survey)) }));
    }

    /// It ends here. The tip goes straight up, where nothing can be in its way.
    fn survey_fails(&mut self, why: Diagnostic) {
        let Some(run) = self.survey.take() else { return };
        self.found(why);
        self.out.push(EngineAction::Survey(SurveyNews::Over { survey: None }));
        self.lift(run.start.clear_mm);
    }

    /// Something else ended it: an alarm, a reset, a cable; `code` is what there is to say of that, where nobody else does.
    pub(super) fn survey_is_over(&mut self, code: Option<&str>) {
        if self.survey.take().is_some() {
            self.out.extend(code.map(|code| EngineAction::Found(Diagnostic::error(code))));
            self.out.push(EngineAction::Survey(SurveyNews::Over { survey: None }));
        }
    }

    /// Goes on after it was held.
    pub(super) fn survey_resumes(&mut self) {
        if let Some(run) = &mut self.survey {
            run.holds = false;
            self.set(EnginePhase::Surveying);
            self.survey_goes();
        }
    }
}
