//! Checks a job against the status reports: the machine must be on the path sent. At each position check
//! (*look*) it must be at the planned position.

use super::asks::{EnginePhase, signs};
use super::engine::{Controller, Meaning};
use super::heard::{Modes, ReportedState};
use super::lines::{WordsInForce, distance};
use super::routine::Spindle;
use super::settings;
use annulus_core::diagnostic::Diagnostic;

const OFF_PATH_MM: f64 = 0.02;
/// Tolerance at a position check, mm, plus 0.75 step and the last digit of a report.
const OFF_PLACE_MM: f64 = 0.0015;
const USUAL_STEPS: f64 = 80.0;
const REPORTS: u32 = 2;
const FEED_SLACK: (f64, f64) = (1.05, 10.0);
/// The reported speed leads the reported position by this time, s: it belongs to the motion prepared next.
const LEAD_S: f64 = 0.06;
/// Tolerance of the feed in force: this share of its last digit and of 1 mm/min, plus 1 %.
const FEED_ROUNDED_SHARE: f64 = 0.5;
/// Factor and offset, s: a batch faster than factor × planned time − offset did not run as planned.
const QUICKEST: (f64, f64) = (0.75, 0.15);
const HOLD_REPORTS: u32 = 3;
/// After a resume, a report of a hold within this time is an old one.
const OLD_REPORT_MS: u64 = 500;
const FAR: usize = 4_096;

impl Controller {
    pub(super) fn watch(&mut self, doing: ReportedState, fresh: bool) {
        let overridden = self
            .status
            .as_ref()
            .and_then(|status| status.overrides)
            .is_some_and(|all| all[..2] != [100, 100]);
        if let Some(run) = &mut self.run {
            run.batch.disturbed |= overridden || self.phase != EnginePhase::Running;
            run.is_to_go_on &= matches!(doing, ReportedState::Hold { .. });
        }
        match (self.phase, doing) {
            // The resume may arrive as late as the queries sent after it, if the line or the page stalled. Of
            // three successive queries, the last one certainly shows the effect of the resume.
            (EnginePhase::Running, ReportedState::Hold { .. })
                if self.now_ms < self.since_ms + OLD_REPORT_MS || self.stand_reports < HOLD_REPORTS => {}
            (EnginePhase::Running, ReportedState::Hold { .. }) => self.is_held_still(),
            (EnginePhase::Running | EnginePhase::Holding, ReportedState::Door { .. }) => {
                self.found(Diagnostic::warning("grbl.door"));
                self.set(EnginePhase::Held);
            }
            (
                EnginePhase::Running,
                ReportedState::Check | ReportedState::Tool | ReportedState::Home | ReportedState::Jog,
            ) => {
                self.trouble(Diagnostic::error("grbl.held_by_itself"));
            }
            (EnginePhase::Running, _) => {
                self.follow(fresh);
                // Fixed here: it looked on, and could send a line, after this report had ended the job.
                if self.phase == EnginePhase::Running {
                    self.look(doing, fresh);
                }
            }
            (EnginePhase::Holding, ReportedState::Hold { rests: true }) => self.set(EnginePhase::Held),
            (EnginePhase::Holding, ReportedState::Run | ReportedState::Idle)
                if self.now_ms >= self.since_ms + OLD_REPORT_MS =>
            {
                // The hold was lost on the way.
                self.since_ms = self.now_ms;
                self.write(signs::HOLD);
            }
            (EnginePhase::Held, ReportedState::Run) if self.now_ms >= self.since_ms + OLD_REPORT_MS => {
                self.set(EnginePhase::Running);
            }
            _ => {}
        }
    }

    pub(super) fn goes_on(&mut self) {
        self.write(signs::RESUME);
        if let Some(run) = &mut self.run {
            run.is_to_go_on = true;
        }
        self.set(EnginePhase::Running);
    }

    /// The controller is held. If it never moved since the resume, this is our own hold: some controllers
    /// drop a resume that arrives together with another hold. Ask the user to resume again: the user doesn't
    /// expect a delayed start of motion.
    fn is_held_still(&mut self) {
        if !self.run.as_ref().is_some_and(|run| run.is_to_go_on) {
            return self.trouble(Diagnostic::error("grbl.held_by_itself"));
        }
        self.found(Diagnostic::warning("grbl.still_held"));
        self.set(EnginePhase::Held);
    }

    pub(super) fn step_mm(&self) -> f64 {
        let scale = settings::axes(&self.info.values, 100).unwrap_or([USUAL_STEPS; 3]);
        scale.into_iter().fold(0.0_f64, |most, steps| most.max(1.0 / steps))
    }

    /// Finds the reported position on the path and drops the path before it. If several reports arrive at
    /// once, as after a stalled hub, only the report that answers a query counts.
    fn follow(&mut self, fresh: bool) {
        let tolerance = OFF_PATH_MM + 1.5 * self.step_mm();
        let Some(place) = self.place() else { return };
        let feed = self.status.as_ref().and_then(|status| status.feed_mm_per_min);
        let override_part = self
            .status
            .as_ref()
            .and_then(|status| status.overrides)
            .map_or(1.0, |all| f64::from(all[0]) / 100.0);
        let Some(run) = &mut self.run else { return };
        if run.window.is_empty() {
            return;
        }
        let near = run.window.iter().take(FAR).position(|(piece, _)| piece.distance(place) <= tolerance);
        let Some(near) = near else {
            run.off += u32::from(fresh);
            let off = run.window.iter().map(|(piece, _)| piece.distance(place)).fold(f64::INFINITY, f64::min);
            if run.off >= REPORTS {
                let why = Diagnostic::error("grbl.off_path").with("off", libm::round(off * 1e3) / 1e3);
                self.trouble(why);
            }
            return;
        };
        run.off = 0;
        run.window.drain(..near);
        // Checks for a speed above the feed. Pieces that may be on a rapid, such as the retract from a hole,
        // are not judged. One fast report may show the speed of the next piece; a second counts only after
        // the head has moved further than that lead.
        let here = run.window.iter().take(FAR).filter(|(piece, _)| piece.distance(place) <= tolerance);
        let most = here.map(|(piece, _)| piece.feed_mm_per_min).reduce(|a, b| Some(a?.max(b?))).flatten();
        let over =
            |most: f64| feed.is_some_and(|feed| feed > most * override_part * FEED_SLACK.0 + FEED_SLACK.1);
        let is_over = most.is_some_and(over);
        let first = run.fast_at_mm.filter(|_| is_over).or_else(|| (is_over && fresh).then_some(place));
        run.fast_at_mm = first;
        let lead_mm = feed.unwrap_or(0.0) / 60.0 * LEAD_S;
        if fresh && first.is_some_and(|first| distance(first, place) >= lead_mm) {
            let why = Diagnostic::error("grbl.too_fast").with("feed", feed.unwrap_or(0.0));
            self.trouble(why.with("most", most.unwrap_or(0.0)));
        }
    }

    /// Compares the position and modal words at the end of a batch with the plan.
    fn look(&mut self, doing: ReportedState, fresh: bool) {
        let (now_ms, step) = (self.now_ms, self.step_mm());
        let values = &self.info.values;
        let place_digit_mm = settings::place_digit_mm(values);
        let feed_slack = FEED_ROUNDED_SHARE * (1.0 + settings::feed_digit_mm_per_min(values));
        let place = self.place();
        let may = self.may_look() && fresh && doing == ReportedState::Idle;
        let Some(run) = self.run.as_mut().filter(|run| may && run.batch.asked) else { return };
        run.batch.asked = false;
        let Some(place) = place else { return };
        let Some(modes) = &self.modes else {
            // The answer was damaged: query again.
            run.batch.looks += 1;
            if run.batch.looks > REPORTS {
                return self.trouble(Diagnostic::error("grbl.answer_missing"));
            }
            self.send("$G", Meaning::Job { text: "$G".to_owned(), wait_s: 0.0 });
            return;
        };
        let expected = run.pen.at();
        let tolerance = OFF_PLACE_MM + place_digit_mm + 0.75 * step;
        let off = (0..3).map(|axis| libm::fabs(place[axis] - expected[axis])).fold(0.0_f64, f64::max);
        if off > tolerance {
            run.batch.looks += 1;
            if run.batch.looks >= REPORTS {
                let words = |place: [f64; 3]| place.map(|value| format!("{value:.3}")).join(", ");
                let why = Diagnostic::error("grbl.place_differs").with("found", words(place));
                self.trouble(why.with("expected", words(expected)));
            }
            return;
        }
        if let Some(word) = other_mode(modes, &run.pen, feed_slack) {
            return self.trouble(Diagnostic::error("grbl.modes_differ").with("word", word));
        }
        let spent_s = run.batch.began_ms.map_or(0.0, |began| (now_ms - began) as f64 / 1e3);
        let quickest = run.batch.expected_s.map_or(0.0, |expected| expected * QUICKEST.0 - QUICKEST.1);
        if spent_s < quickest && !run.batch.disturbed {
            let why = Diagnostic::error("grbl.too_quick").with("seconds", format!("{spent_s:.1}"));
            let expected = run.batch.expected_s.unwrap_or(0.0);
            return self.trouble(why.with("expected", format!("{expected:.1}")));
        }
        self.passed();
    }
}

fn other_mode(modes: &Modes, pen: &WordsInForce, feed_slack: f64) -> Option<String> {
    let spindle = match pen.spindle {
        Spindle::Off => ('M', 50),
        Spindle::On(_) => ('M', 30),
        Spindle::Back(_) => ('M', 40),
    };
    for (letter, tenths) in [spindle, ('G', 170), ('G', 210), ('G', 940), ('G', 540)] {
        if !modes.says(letter, tenths) {
            return Some(format!("{letter}{}", f64::from(tenths) / 10.0));
        }
    }
    if let Spindle::On(speed) | Spindle::Back(speed) = pen.spindle
        && libm::fabs(modes.speed_rpm - speed) > 1.0
    {
        return Some(format!("S{}", modes.speed_rpm));
    }
    let is_other = |feed: &f64| libm::fabs(modes.feed_mm_per_min - feed) > feed_slack + 0.01 * feed;
    let feed = pen.feed_mm_per_min.filter(is_other);
    feed.map(|_| format!("F{}", modes.feed_mm_per_min))
}
