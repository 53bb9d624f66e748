//! Executes the user's commands; rejects those that the current phase does not allow.

use super::asks::{EngineAction, EngineAsk, EnginePhase, EngineStart, signs};
use super::engine::{Controller, Meaning};
use super::fits::{self, MachineRange};
use super::height::{BoardHeight, ZeroWanted};
use super::jog::JogEnd;
use super::lines::number;
use super::settings;
use annulus_core::control::{Ending, Trust, is_same_press};
use annulus_core::diagnostic::{Diagnostic, Severity};

/// Most that a work zero may differ from the zero of the interrupted job, mm.
pub(super) const SAME_ZERO_MM: f64 = 0.01;
pub(super) const LIFT_MM_PER_MIN: f64 = 500.0;
const AXES: [char; 3] = ['X', 'Y', 'Z'];

impl Controller {
    pub(super) fn ask(&mut self, ask: EngineAsk) {
        use EngineAsk::{Edge, Probe, SetZero, ZeroAt};
        let is_of_place = matches!(ask, SetZero { .. } | ZeroAt { .. } | Probe { .. } | Edge { .. });
        if is_of_place && self.is_to_be_homed() && self.at_rest() {
            return self.found(Diagnostic::error("grbl.not_homed"));
        }
        if let Some(code) = self.contact_forbids(&ask).filter(|_| self.at_rest()) {
            return self.found(Diagnostic::error(code));
        }
        if let Some(why) = self.depth_forbids(&ask).filter(|_| self.at_rest()) {
            return self.found(why);
        }
        if let Some(why) = self.offset_forbids(&ask).filter(|_| self.at_rest()) {
            return self.found(why);
        }
        self.act(ask);
    }

    /// A closed probe input forbids this move: another touch could not be detected, and sideways the tip
    /// breaks.
    fn contact_forbids(&self, ask: &EngineAsk) -> Option<&'static str> {
        let code = match ask {
            // A survey lifts the tip first and then checks the input.
            EngineAsk::Probe { .. } | EngineAsk::Edge { .. } => "grbl.probe_closed",
            EngineAsk::Jog { axis: 0 | 1, .. } => "grbl.tip_touches",
            _ => return None,
        };
        self.contact_is_closed().then_some(code)
    }

    fn depth_forbids(&self, ask: &EngineAsk) -> Option<Diagnostic> {
        let EngineAsk::Jog { axis: 0 | 1, anyway: false, .. } = ask else { return None };
        let lift_mm = self.lift_first_mm()?;
        Some(Diagnostic::error("control.tip_low").with("mm", format!("{lift_mm:.2}")))
    }

    pub(super) fn contact_is_closed(&self) -> bool {
        self.status.as_ref().is_some_and(|status| status.pins.contains('P'))
    }

    fn act(&mut self, ask: EngineAsk) {
        match ask {
            EngineAsk::Stop => self.ask_stop(),
            EngineAsk::Hold if self.phase == EnginePhase::Running => {
                self.write(signs::HOLD);
                self.set(EnginePhase::Holding);
            }
            EngineAsk::Hold if self.phase == EnginePhase::Surveying => {
                if let Some(run) = &mut self.survey {
                    run.holds = true;
                }
                self.set(EnginePhase::Holding);
            }
            EngineAsk::Resume if self.phase == EnginePhase::Held && self.survey.is_some() => {
                self.survey_resumes();
            }
            EngineAsk::Survey(start) if self.is_free() => self.begin_survey(start),
            EngineAsk::Resume if self.phase == EnginePhase::Held => {
                self.goes_on();
            }
            EngineAsk::Resume if self.stands() => self.resume_there(),
            EngineAsk::StopAfter => self.ask_stop_after(),
            EngineAsk::Override { of, percent } => self.ask_override(of, percent),
            EngineAsk::Check { routine, written } if self.is_free() => self.begin_check(routine, written),
            EngineAsk::JogCancel if self.phase == EnginePhase::Jogging => self.end_jog(),
            EngineAsk::Home if matches!(self.phase, EnginePhase::Ready | EnginePhase::Locked) => self.home(),
            EngineAsk::Unlock if self.phase == EnginePhase::Locked => self.unlock(),
            EngineAsk::Jog { axis, um, mm_per_min, .. } if self.at_rest() => self.jog(axis, um, mm_per_min),
            EngineAsk::Park { from_low_mm } if self.is_free() => self.begin_park(from_low_mm),
            EngineAsk::SetZero { axes, height_mm } if self.at_rest() && self.may_set_zero(axes) => {
                self.set_zero(axes, height_mm);
            }
            EngineAsk::ZeroAt { place_mm } if self.is_free() => {
                self.drops_offsets();
                self.write_zero(place_mm, ZeroWanted::default());
            }
            EngineAsk::Probe { depth_mm, mm_per_min, plate_mm, up_mm } if self.at_rest() => {
                let down = format!("G91G38.2Z-{}F{}", number(depth_mm.abs()), number(mm_per_min));
                self.probe(&down, Meaning::Probe { plate_mm, up_mm });
            }
            EngineAsk::Edge { axis, reach_mm, mm_per_min, radius_mm, back_mm }
                if axis < 2 && self.phase == EnginePhase::Ready && self.idle() =>
            {
                let axis = usize::from(axis);
                // Sign of the retreat: opposite to the probing direction.
                let side = if reach_mm < 0.0 { 1.0 } else { -1.0 };
                self.probed = None;
                self.drops_offsets();
                let text = format!("G91G38.2{}{}F{}", AXES[axis], number(reach_mm), number(mm_per_min));
                self.send("G21G94", Meaning::Jog);
                let (radius_mm, back_mm) = (side * radius_mm, side * back_mm);
                self.send(&text, Meaning::Edge { axis, radius_mm, back_mm });
                self.set(EnginePhase::Probing);
            }
            EngineAsk::Start(start) if self.phase == EnginePhase::Ready => self.begin(&start),
            EngineAsk::ToolBefore { section } => self.tool_before(section),
            EngineAsk::ToolReady if self.phase == EnginePhase::ToolChange => {
                self.ready_asked_ms = Some(self.now_ms);
            }
            EngineAsk::NewBit => self.bit_is_another(),
            EngineAsk::Set { number, value } if self.phase == EnginePhase::Ready && self.idle() => {
                self.send(&format!("${number}={}", super::lines::number(value)), Meaning::Written);
                self.send("$$", Meaning::Written);
            }
            _ => self.found(Diagnostic::error("grbl.not_now")),
        }
    }

    fn probe(&mut self, down: &str, meaning: Meaning) {
        (self.probed, self.height) = (None, BoardHeight::Unknown);
        self.drops_offsets();
        self.send("G21G94", Meaning::Jog);
        self.send(down, meaning);
        self.set(EnginePhase::Probing);
    }

    pub(super) fn idle(&self) -> bool {
        self.buffer.is_empty() && self.queue.is_empty() && self.reset_at.is_none()
    }

    fn is_free(&self) -> bool {
        self.phase == EnginePhase::Ready && self.idle()
    }

    /// True if the machine can home and has not: a zero set now would be elsewhere after homing.
    fn is_to_be_homed(&self) -> bool {
        self.homes() && self.trust != Trust::Trusted
    }

    fn at_rest(&self) -> bool {
        matches!(self.phase, EnginePhase::Ready | EnginePhase::ToolChange) && self.idle()
    }

    fn may_set_zero(&self, [x, y, _]: [bool; 3]) -> bool {
        self.run.is_none() || !(x || y)
    }

    fn ask_stop(&mut self) {
        // STOP cancels the `$X` or `$H` that was to follow a reset.
        self.after_reset = None;
        let before_ms = self.stopped_ms.replace(self.now_ms);
        let is_before = is_same_press(before_ms, self.now_ms);
        match self.phase {
            // A double click is one press: only a deliberate second STOP may cost the position.
            EnginePhase::Stopping if is_before => self.stopped_ms = before_ms,
            EnginePhase::Jogging if is_before && self.jog_end == JogEnd::Stopped => {
                self.stopped_ms = before_ms;
            }
            // A controller that has not sent its banner may be moving.
            EnginePhase::Greeting if self.info.banner.is_empty() => self.write(signs::HOLD),
            EnginePhase::Closed | EnginePhase::Greeting => {}
            // Second STOP: reset at once, even if the position is lost.
            EnginePhase::Stopping | EnginePhase::Homing => {
                self.lose_place();
                self.reset();
            }
            EnginePhase::Jogging if self.jog_end == JogEnd::Stopped => {
                self.lose_place();
                self.reset();
            }
            EnginePhase::Jogging if self.run.is_none() => {
                self.end_jog();
                self.jog_end = JogEnd::Stopped;
            }
            // STOP in a tool change ends the job, not only the jog.
            EnginePhase::Jogging => {
                self.end_jog();
                self.stop(Ending::Stopped);
            }
            EnginePhase::Locked => self.reset(),
            EnginePhase::Checking => self.leave_check(Some(Diagnostic::note("grbl.check_stopped"))),
            _ => self.stop(Ending::Stopped),
        }
    }

    /// Ends a job that waits for a tool, or that is held, at once; the section that was held is not done.
    fn ask_stop_after(&mut self) {
        match (self.phase, &mut self.run) {
            (EnginePhase::Running | EnginePhase::Holding, Some(run)) => run.stops_after = true,
            (EnginePhase::ToolChange, Some(_)) => self.stop(Ending::StoppedAfterHole),
            (EnginePhase::Held, Some(_)) => self.stop(Ending::Stopped),
            _ => self.found(Diagnostic::error("grbl.not_now")),
        }
    }

    fn tool_before(&mut self, section: usize) {
        if let Some(run) = &mut self.run {
            run.tool_before = Some(section);
        }
    }

    fn unlock(&mut self) {
        if self.needs_reset {
            self.after_reset = Some(Meaning::Unlock);
            return self.reset();
        }
        self.send("$X", Meaning::Unlock);
    }

    /// Lifts by a jog, because STOP ends a jog.
    pub(super) fn lift(&mut self, up_mm: f64) {
        let text = format!("$J=G91G21Z{}F{}", number(up_mm), number(LIFT_MM_PER_MIN));
        // Probing may have left G91 active, and `$J=` doesn't change modes.
        self.send("G90", Meaning::Jog);
        self.send(&text, Meaning::Jog);
        self.set(EnginePhase::Jogging);
    }

    fn end_jog(&mut self) {
        self.queue.retain(|next| !next.text.starts_with("$J="));
        (self.jog, self.jog_end) = (None, JogEnd::Asked);
        self.write(signs::JOG_CANCEL);
    }

    /// Another program may have left another zero, or the last job an offset. Clear them, because a new zero
    /// must count alone.
    fn drops_offsets(&mut self) {
        if self.zero_off_mm().is_some() {
            self.send("G54", Meaning::Jog);
        }
        if self.offset_in_force().is_some() {
            self.send("G92.1", Meaning::Written);
            self.send("G49", Meaning::Written);
        }
    }

    fn offset_forbids(&self, ask: &EngineAsk) -> Option<Diagnostic> {
        use EngineAsk::{Edge, Probe, SetZero, ZeroAt};
        let sets_zero = matches!(ask, SetZero { .. } | ZeroAt { .. } | Probe { .. } | Edge { .. });
        let off_mm = self.offset_in_force().filter(|_| sets_zero && self.run.is_some())?;
        Some(Diagnostic::error("grbl.offset_in_force").with("mm", format!("{off_mm:.3}")))
    }

    /// Sets zero at the current position. The controller computes the position (L20), so a damaged report
    /// can't become a zero.
    fn set_zero(&mut self, axes: [bool; 3], height_mm: f64) {
        let Some(machine) = self.status.as_ref().and_then(|status| status.machine_mm) else {
            return self.found(Diagnostic::error("grbl.no_report"));
        };
        let heights = [0.0, 0.0, height_mm];
        let words = AXES.into_iter().zip(heights).zip(axes).filter(|(_, wanted)| *wanted);
        let words = words.map(|((letter, height_mm), _)| format!("{letter}{}", number(height_mm)));
        self.drops_offsets();
        self.send(&format!("G21G10L20P1{}", words.collect::<String>()), Meaning::Written);
        let place_mm = core::array::from_fn(|axis| axes[axis].then_some(machine[axis] - heights[axis]));
        // Without limit switches the user's word is the only position reference; trusted once the controller
        // has stored the zero.
        let trusts = axes[0] && axes[1] && !self.homes() && self.phase == EnginePhase::Ready;
        self.read_zero(place_mm, ZeroWanted { trusts, ..ZeroWanted::default() });
    }

    /// Makes this machine position the zero of its axes. The position is absolute (L2): after a probing the
    /// head may have moved on while it stopped.
    pub(super) fn write_zero(&mut self, place_mm: [Option<f64>; 3], wanted: ZeroWanted) {
        let words = AXES.into_iter().zip(place_mm);
        let words = words.filter_map(|(letter, mm)| Some(format!("{letter}{}", number(mm?))));
        self.send(&format!("G21G10L2P1{}", words.collect::<String>()), Meaning::Written);
        self.read_zero(place_mm, wanted);
    }

    pub(super) fn go_on_after_reset(&mut self) {
        match self.after_reset.take() {
            Some(Meaning::Home) => self.send_home(),
            Some(_) => self.send("$X", Meaning::Unlock),
            None => {}
        }
    }

    pub(super) fn done_by_hand(&mut self, meaning: &Meaning) {
        match *meaning {
            // Older reports refer to another position or zero.
            Meaning::Written => self.zero_mm = None,
            Meaning::Home => self.homed(),
            Meaning::Unlock => self.set(EnginePhase::Ready),
            Meaning::Jog => self.jog_answered(),
            // Stopping: the probing was cancelled.
            Meaning::Probe { .. } | Meaning::Edge { .. } if self.phase != EnginePhase::Probing => {}
            Meaning::Edge { axis, radius_mm, back_mm } => self.met_edge(axis, radius_mm, back_mm),
            Meaning::Probe { plate_mm, up_mm } => {
                if self.probed != Some(true) {
                    self.found(Diagnostic::error("grbl.alarm_5").with("number", 5));
                    return self.rest();
                }
                let touched_mm = self.probed_at_mm;
                let height_mm = touched_mm.map(|place| place[2] - plate_mm);
                self.write_zero([None, None, height_mm], ZeroWanted { touched_mm, ..ZeroWanted::default() });
                self.lift(up_mm.abs());
            }
            Meaning::Echo => self.compare_zero(),
            Meaning::Survey(Some(step)) => self.survey_answered(step),
            Meaning::Setter(Some(step)) => self.setter_answered(step),
            _ => {}
        }
    }

    /// The probe met an edge, or not. The tool's axis is `radius_mm` from the edge, signed, and then
    /// retreats.
    fn met_edge(&mut self, axis: usize, radius_mm: f64, back_mm: f64) {
        let (true, Some(place)) = (self.probed == Some(true), self.probed_at_mm) else {
            self.found(Diagnostic::error("grbl.alarm_5").with("number", 5));
            return self.rest();
        };
        let edge_mm = place[axis] - radius_mm;
        let place_mm = core::array::from_fn(|own| (own == axis).then_some(edge_mm));
        self.write_zero(place_mm, ZeroWanted { touched_mm: Some(place), ..ZeroWanted::default() });
        let text = format!("$J=G91G21{}{}F{}", AXES[axis], number(back_mm), number(LIFT_MM_PER_MIN));
        self.send("G90", Meaning::Jog);
        self.send(&text, Meaning::Jog);
        self.set(EnginePhase::Jogging);
    }

    /// Queries the stored offsets to verify the zero, including the axes that must not change: a flipped
    /// letter would write another axis.
    fn read_zero(&mut self, place_mm: [Option<f64>; 3], wanted: ZeroWanted) {
        let of_plane = place_mm[0].is_some() && place_mm[1].is_some();
        let of_height = place_mm[2].is_some();
        if of_height {
            self.height_is_asked(&wanted);
        }
        let before = self.info.offsets.remove("G54").unwrap_or_default();
        let place_mm = core::array::from_fn(|axis| place_mm[axis].or(before.get(axis).copied()));
        self.zero_wanted = Some(ZeroWanted { place_mm, of_plane, of_height, ..wanted });
        self.send("$#", Meaning::Echo);
    }

    fn compare_zero(&mut self) {
        let Some(wanted) = self.zero_wanted.take() else { return };
        // Include every active offset: positions refer to the sum.
        let found = self.listed_zero_mm();
        let same = |axis: usize| {
            let is_there =
                |wanted: f64| found.is_some_and(|found| libm::fabs(found[axis] - wanted) <= SAME_ZERO_MM);
            wanted.place_mm[axis].is_none_or(is_there)
        };
        // The probed position is queried again: a damaged number would give a wrong zero.
        let touched = wanted.touched_mm.is_none() || wanted.touched_mm == self.probed_at_mm;
        let plane = same(0) && same(1) && (touched || wanted.of_height);
        if plane && same(2) && touched {
            return self.zero_is_taken(&wanted);
        }
        self.zero_is_not_taken(!plane);
    }

    fn begin(&mut self, start: &EngineStart) {
        let found = self.check(start);
        let refused = found.iter().any(|diagnostic| diagnostic.is_unacknowledged(&start.accepted));
        let place = self.place();
        self.out.extend(found.into_iter().map(EngineAction::Found));
        if let (false, Some(place)) = (refused, place) {
            self.start(start, place);
        }
    }

    pub fn check(&self, start: &EngineStart) -> Vec<Diagnostic> {
        let mut found = Vec::new();
        if self.trust != Trust::Trusted {
            found.push(Diagnostic::error(if self.homes() { "grbl.not_homed" } else { "grbl.no_zero" }));
        }
        let (Some(zero), Some(_)) = (self.zero_mm, self.place()) else {
            found.push(Diagnostic::error("grbl.no_report"));
            return found;
        };
        found.extend(self.check_listed());
        found.extend(self.zero_refused.then(|| Diagnostic::error("grbl.zero_not_taken")));
        found.extend(self.check_zero(start));
        found.extend(self.overrides_that_stand());
        found.extend(self.check_setter(start));
        found.extend(self.reference_told(start));
        found.extend(settings::motors_let_go(&self.info.values));
        let homed = self.homes() && self.trust == Trust::Trusted;
        let ends_mm = core::array::from_fn(|axis| self.reach_mm(axis));
        let small = self.info.flavour() == "GRBL";
        let machine = MachineRange { values: &self.info.values, zero_mm: zero, homed, ends_mm, small };
        let (routine, lower) = self.fitted(&start.routine);
        found.extend(lower);
        found.extend(fits::compare(&routine, &machine));
        found.sort_by_key(|diagnostic| std::cmp::Reverse(severity(diagnostic)));
        found
    }
}

fn severity(diagnostic: &Diagnostic) -> Severity {
    diagnostic.severity
}
