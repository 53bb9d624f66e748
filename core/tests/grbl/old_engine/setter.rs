//! Measures a tool on a tool setter (a pin or switch at a fixed machine position) during a tool change.
//!
//! ```text
//!  ready  G21G17G90G94 $G       modal words, before anything moves
//!  up     G90G53G0Z…            to the top, and a position check
//!  over   G90G53G0X…Y…          over the setter, and a check; ends if the probe is closed here or above
//!  near   G91G38.3Z…            down to the start height, watching the input: a touch here is too early
//!  touch  G91G38.2Z…            until the input closes; a check where the tip stopped
//!  back   G91G0Z…               1 mm off, and a check: the input must be open again
//!  again  G91G38.2Z…            slowly
//!  same   $#                    queries the touch position again
//!  lift   G90G53G0Z…            to the top, and a check
//!  zero   G21G10L2P1Z…, $#      Z zero for this tool, read back
//! ```
//!
//! A tool with a known height over the board is the reference. This tool gives the difference between the Z
//! zero and the height at which the setter meets the tool. Every other tool gets its Z zero from that
//! difference. A length offset (G43.1) is not used, because a reset clears it.
//!
//! The reference is measured once in a job, at the start and before any tool change. That is the tool used
//! for the Z zero: the first tool or a probing pin. If the height is unknown then, the tool touched off in a
//! change becomes the reference.

use super::asks::{EnginePhase, EngineStart};
use super::engine::{Controller, Meaning};
use super::hand::LIFT_MM_PER_MIN;
use super::heard::ReportedState;
use super::height::{BoardHeight, ZeroWanted};
use super::lines::number;
use annulus_core::control::Trust;
use annulus_core::diagnostic::Diagnostic;
pub use annulus_core::grbl::{SetterStep, ToolSetter};

const SAME_MM: f64 = 0.02;
const NONE_MM: f64 = 0.002;
/// A touch within this distance of the start height is not the tool: a chip, or a stuck pin.
const EARLY_MM: f64 = 0.5;
const BACK_MM: f64 = 1.0;
const AGAIN_MM: f64 = 2.0;
const TWICE_MM: f64 = 0.1;
const COAST_MM: f64 = 5.0;
const LOOKS: u32 = 2;
const CLOSED: u16 = 4;

#[derive(Debug)]
pub(super) struct SetterRun {
    setter: ToolSetter,
    top_mm: f64,
    step: SetterStep,
    pub(super) answered: bool,
    asked: bool,
    looks: u32,
    first_mm: f64,
    met_mm: [f64; 3],
    is_reference: bool,
}

impl Controller {
    pub fn measuring(&self) -> Option<SetterStep> {
        self.setter.as_ref().map(|run| run.step)
    }

    pub(super) fn setter_refused(&self, setter: &ToolSetter) -> Option<Diagnostic> {
        if !self.homes() {
            return Some(Diagnostic::error("setter.no_homing"));
        }
        if self.trust != Trust::Trusted {
            return Some(Diagnostic::error("grbl.not_homed"));
        }
        if !setter.is_sound() {
            return Some(Diagnostic::error("setter.bad"));
        }
        let ([x, y], from) = (setter.place_mm, setter.from_mm);
        let needs = [[x, x], [y, y], [from - setter.depth_mm, from]];
        let is_outside = |axis: &usize| {
            let room = self.room_mm(*axis);
            room.is_none_or(|[low, high]| needs[*axis][0] < low - NONE_MM || needs[*axis][1] > high + NONE_MM)
        };
        let axis = (0..3).find(is_outside)?;
        let [low, high] = self.room_mm(axis).unwrap_or_default();
        let mm = |value: f64| format!("{value:.3}");
        let why = Diagnostic::error("setter.no_room").with("axis", ["X", "Y", "Z"][axis]);
        let why = why.with("from", mm(needs[axis][0])).with("to", mm(needs[axis][1]));
        Some(why.with("low", mm(low)).with("high", mm(high)))
    }

    /// Problems of tool setter and tool changer that prevent a job. An unknown position is reported
    /// elsewhere.
    pub(super) fn check_setter(&self, start: &EngineStart) -> Vec<Diagnostic> {
        let setter = start.setter.filter(|_| !start.same_length);
        let why = setter.and_then(|setter| self.setter_refused(&setter));
        let why = why.filter(|_| self.trust == Trust::Trusted || !self.homes());
        why.into_iter().chain(self.check_changer(start)).collect()
    }

    pub(super) fn reference_told(&self, start: &EngineStart) -> Option<Diagnostic> {
        let setter = start.setter.filter(|_| !start.same_length && start.routine.changes_tools())?;
        let is_known = start.from > 0 && self.reference_mm.is_some();
        let [x, y] = setter.place_mm.map(|mm| format!("{mm:.3}"));
        let why = Diagnostic::warning("setter.reference").with("x", x).with("y", y);
        (self.height == BoardHeight::OfThisBit && !is_known).then_some(why)
    }

    pub(super) fn measure_tool(&mut self, setter: ToolSetter) {
        if let Some(why) = self.setter_refused(&setter) {
            return self.found(why);
        }
        let is_reference = self.height == BoardHeight::OfThisBit;
        if !is_reference && self.reference_mm.is_none() {
            return self.found(Diagnostic::error("setter.no_reference"));
        }
        let Some([_, top_mm]) = self.room_mm(2) else { return };
        self.setter = Some(SetterRun {
            setter,
            top_mm,
            step: SetterStep::Ready,
            answered: false,
            asked: false,
            looks: 0,
            first_mm: 0.0,
            met_mm: [0.0; 3],
            is_reference,
        });
        self.modes = None;
        self.set(EnginePhase::Measuring);
        // The spindle is off. Send no spindle word: a damaged character could turn it into a start.
        self.send("G21G17G90G94", Meaning::Setter(None));
        self.send("$G", Meaning::Setter(Some(SetterStep::Ready)));
    }

    /// Sends the lines of the next step; the last line is answered when the step is done.
    fn setter_goes(&mut self, step: SetterStep) {
        let Some(run) = &mut self.setter else { return };
        (run.step, run.answered, run.looks) = (step, false, 0);
        let ToolSetter { place_mm: [x, y], from_mm, depth_mm, fast_mm_per_min, slow_mm_per_min } = run.setter;
        let top_mm = run.top_mm;
        let down = |code: &str, mm: f64, feed: f64| {
            format!("G91{code}Z{}F{}", number(-libm::fabs(mm)), number(feed))
        };
        match step {
            SetterStep::Up | SetterStep::Lift => {
                self.setter_moves(&format!("G90G53G0Z{}", number(top_mm)), step);
            }
            SetterStep::Over => {
                self.setter_moves(&format!("G90G53G0X{}Y{}", number(x), number(y)), step);
            }
            // G38.3 raises no alarm if it meets nothing, which is expected here.
            SetterStep::Near => self.setter_probes(&down("G38.3", top_mm - from_mm, fast_mm_per_min), step),
            SetterStep::Touch => self.setter_probes(&down("G38.2", depth_mm, fast_mm_per_min), step),
            SetterStep::Again => self.setter_probes(&down("G38.2", AGAIN_MM, slow_mm_per_min), step),
            SetterStep::Same => self.setter_probes("$#", step),
            SetterStep::Ready | SetterStep::Back | SetterStep::Zero => {}
        }
    }

    fn setter_moves(&mut self, text: &str, step: SetterStep) {
        self.send(text, Meaning::Setter(None));
        // A dwell is answered after the move before it: the head has stopped then.
        self.send("G4P0", Meaning::Setter(Some(step)));
    }

    fn setter_probes(&mut self, text: &str, step: SetterStep) {
        self.probed = None;
        self.send(text, Meaning::Setter(Some(step)));
    }

    pub(super) fn setter_answered(&mut self, step: SetterStep) {
        let Some(run) = self.setter.as_mut().filter(|run| run.step == step) else { return };
        match step {
            SetterStep::Ready => self.setter_begins(),
            SetterStep::Up | SetterStep::Over | SetterStep::Back | SetterStep::Lift | SetterStep::Zero => {
                run.answered = true;
            }
            SetterStep::Near | SetterStep::Touch | SetterStep::Again | SetterStep::Same => {
                self.setter_probed(step);
            }
        }
    }

    fn setter_begins(&mut self) {
        let Some(modes) = &self.modes else {
            return self.setter_fails(Diagnostic::error("grbl.answer_missing"));
        };
        let wanted = [('G', 210), ('G', 170), ('G', 940), ('M', 50)];
        match wanted.into_iter().find(|(letter, tenths)| !modes.says(*letter, *tenths)) {
            None => self.setter_goes(SetterStep::Up),
            Some((letter, tenths)) => {
                let word = format!("{letter}{}", f64::from(tenths) / 10.0);
                self.setter_fails(Diagnostic::error("grbl.modes_differ").with("word", word));
            }
        }
    }

    fn setter_probed(&mut self, step: SetterStep) {
        let (probed, place) = (self.probed.take(), self.probed_at_mm);
        let (Some(met), Some(place)) = (probed, place) else {
            return self.setter_fails(Diagnostic::error("level.no_answer"));
        };
        let Some(run) = &mut self.setter else { return };
        let from_mm = run.setter.from_mm;
        let off = |axis: usize| libm::fabs(place[axis] - run.setter.place_mm[axis]) > SAME_MM;
        let aside = off(0) || off(1);
        let first_mm = run.first_mm;
        match step {
            _ if aside => self.setter_elsewhere(),
            SetterStep::Near if met => self.setter_fails(early()),
            SetterStep::Near if libm::fabs(place[2] - from_mm) > SAME_MM => self.setter_elsewhere(),
            SetterStep::Near => self.setter_goes(SetterStep::Touch),
            _ if !met => self.setter_fails(Diagnostic::error("grbl.alarm_5").with("number", 5)),
            SetterStep::Touch if place[2] > from_mm - EARLY_MM => self.setter_fails(early()),
            SetterStep::Touch => (run.first_mm, run.answered) = (place[2], true),
            SetterStep::Again if libm::fabs(place[2] - first_mm) > TWICE_MM => {
                let mm = format!("{:.3}", libm::fabs(place[2] - first_mm));
                self.setter_fails(Diagnostic::error("setter.differs").with("mm", mm));
            }
            SetterStep::Again => {
                run.met_mm = place;
                self.setter_goes(SetterStep::Same);
            }
            _ if place != run.met_mm => self.setter_fails(Diagnostic::error("level.no_answer")),
            _ => self.setter_goes(SetterStep::Lift),
        }
    }

    pub(super) fn setter_asked(&mut self) {
        let idle = self.buffer.is_empty() && self.queue.is_empty();
        if let Some(run) = &mut self.setter {
            run.asked = idle && run.answered;
        }
    }

    pub(super) fn setter_reported(&mut self, doing: ReportedState, fresh: bool) {
        let rests = fresh && doing == ReportedState::Idle;
        let at = self.status.as_ref().and_then(|status| status.machine_mm);
        let (place, is_closed) = (self.place(), self.contact_is_closed());
        let Some(run) = self.setter.as_mut().filter(|run| rests && run.answered && run.asked) else { return };
        run.asked = false;
        let Some(at) = at else { return };
        let [x, y] = run.setter.place_mm;
        let top_mm = run.top_mm;
        let is_at = |axis: usize, mm: f64| libm::fabs(at[axis] - mm) <= SAME_MM;
        let is_over = is_at(0, x) && is_at(1, y);
        let is_there = match run.step {
            SetterStep::Up => is_at(2, top_mm),
            SetterStep::Over | SetterStep::Lift => is_over && is_at(2, top_mm),
            SetterStep::Touch => {
                is_over && at[2] <= run.first_mm + SAME_MM && at[2] >= run.first_mm - COAST_MM
            }
            _ => true,
        };
        if !is_there {
            run.looks += 1;
            if run.looks >= LOOKS {
                self.setter_elsewhere();
            }
            return;
        }
        match run.step {
            // With a closed input the touch could not be detected.
            SetterStep::Up | SetterStep::Over | SetterStep::Back if is_closed => {
                self.setter_fails(Diagnostic::error("setter.closed"));
            }
            SetterStep::Up => self.setter_goes(SetterStep::Over),
            SetterStep::Back => self.setter_goes(SetterStep::Again),
            SetterStep::Over if top_mm - run.setter.from_mm > NONE_MM => self.setter_goes(SetterStep::Near),
            SetterStep::Over => self.setter_goes(SetterStep::Touch),
            SetterStep::Touch => {
                let back = number((run.first_mm - at[2]).max(0.0) + BACK_MM);
                self.setter_goes(SetterStep::Back);
                self.setter_moves(&format!("G91G0Z{back}"), SetterStep::Back);
            }
            SetterStep::Lift => self.setter_found(),
            // After a zero was written, the next report gives the position.
            SetterStep::Zero => self.setter_zeroed(place),
            _ => {}
        }
    }

    fn setter_found(&mut self) {
        let (zero, place, same_mm) = (self.zero_mm, self.place(), self.same_height_mm());
        let stored = self.info.offsets.get("G54").and_then(|places| places.get(2)).copied();
        let Some(run) = &mut self.setter else { return };
        let met_mm = run.met_mm;
        if !run.is_reference {
            let Some(reference_mm) = self.reference_mm else {
                return self.setter_fails(Diagnostic::error("setter.no_reference"));
            };
            (run.step, run.answered) = (SetterStep::Zero, false);
            let wanted = ZeroWanted { touched_mm: Some(met_mm), of_setter: true, ..ZeroWanted::default() };
            return self.write_zero([None, None, Some(met_mm[2] + reference_mm)], wanted);
        }
        let (Some(zero), Some(stored), Some(place)) = (zero, stored, place) else {
            return self.setter_fails(Diagnostic::error("grbl.no_report"));
        };
        // Reported and stored zero differ: a line was damaged, or another offset is active.
        if libm::fabs(zero[2] - stored) > same_mm {
            let mm = format!("{:.3}", zero[2] - stored);
            return self.setter_fails(Diagnostic::error("setter.offset_stands").with("mm", mm));
        }
        self.reference_mm = Some(stored - met_mm[2]);
        self.is_measured(place);
    }

    fn setter_zeroed(&mut self, place: Option<[f64; 3]>) {
        let (Some(run), Some(reference_mm)) = (&self.setter, self.reference_mm) else { return };
        let (Some(zero), Some(place)) = (self.zero_mm, place) else { return };
        let off_mm = zero[2] - run.met_mm[2] - reference_mm;
        if libm::fabs(off_mm) <= self.same_height_mm() {
            return self.is_measured(place);
        }
        self.height = BoardHeight::Unknown;
        self.setter_fails(Diagnostic::error("setter.offset_stands").with("mm", format!("{off_mm:.3}")));
    }

    pub(super) fn setter_alarm(&self, number: u16) -> Option<Diagnostic> {
        (self.setter.is_some() && number == CLOSED).then(early)
    }

    fn setter_elsewhere(&mut self) {
        self.setter_fails(Diagnostic::error("setter.elsewhere"));
    }

    /// The measurement failed; the tool must be measured again. The tip moves straight up, where nothing can
    /// be in its way.
    fn setter_fails(&mut self, why: Diagnostic) {
        let Some(run) = self.setter.take() else { return };
        self.queue.clear();
        self.found(why);
        // A jog, because STOP ends a jog.
        let text = format!("$J=G90G53G21Z{}F{}", number(run.top_mm), number(LIFT_MM_PER_MIN));
        self.send(&text, Meaning::Jog);
        self.set(EnginePhase::Jogging);
    }
}

fn early() -> Diagnostic {
    Diagnostic::error("setter.early")
}
