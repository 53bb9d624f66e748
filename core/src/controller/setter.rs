//! How long a tool is, by a tool setter: a pin or a switch that stands at a place of the machine, in the middle of a tool change.
//!
//! ```text
//!  ready  G21G17G90G94 $G       the words in force, before anything moves
//!  up     G90G53G0Z…            to the top, and a look
//!  over   G90G53G0X…Y…          over the setter, and a look; a contact that is closed at one of these looks ends it
//!  near   G91G38.3Z…            down to where it is looked for, with an eye on the contact: too early
//!  touch  G91G38.2Z…            until the contact closes; a look where the tip came to rest
//!  back   G91G0Z…               a millimetre off it, and a look: the contact has to be open again
//!  again  G91G38.2Z…            slowly
//!  same   $#                    where that was, said a second time
//!  lift   G90G53G0Z…            to the top, and a look
//!  zero   G21G10L2P1Z…, $#      zero of Z for this tool, read again
//! ```
//!
//! A tool whose height over the board is known is the reference: by it is known how much higher zero of Z is than the place where the
//! setter meets that tool. For every other tool it is as much higher than where the setter meets that one. No length offset (G43.1) is
//! left standing that a reset would take away.
//!
//! The reference is measured once in a job, at its start and before any tool is asked for: what is in then is what zero of Z was set with,
//! the first bit or a probing pin. Where that is not known, the tool that is touched off in a change is the reference.
//!
//! Comes in: a tool that is in, answers and reports, from the engine. Goes out: lines, at last the zero. mm, machine coordinates. Does not
//! know which tool it is.

use super::asks::{EnginePhase, EngineStart};
use super::engine::{Controller, Meaning};
use super::hand::LIFT_MM_PER_MIN;
use super::heard::ReportedState;
use super::height::{BoardHeight, ZeroWanted};
use super::lines::number;
use crate::control::Trust;
use crate::diagnostic::Diagnostic;
use serde::{Deserialize, Serialize};

/// Under this key the settings of a controller say how the length of a tool is found: `board` or `setter`.
pub const LENGTH_KEY: &str = "controller.length";
/// Under this key they have the six numbers of the tool setter ([`ToolSetter::numbers`]).
pub const SETTER_KEY: &str = "controller.setter";

/// A move that ends further from its place than this did not go where it was sent, mm.
const SAME_MM: f64 = 0.02;
/// Moves shorter than this are none: a controller refuses to probe where it stands.
const NONE_MM: f64 = 0.002;
/// A contact so near below the place where it was first looked for is none of the tool: a chip, or a pin that hangs.
const EARLY_MM: f64 = 0.5;
/// How far the tip goes off the setter before it meets it again, and how far down it may go then.
const BACK_MM: f64 = 1.0;
const AGAIN_MM: f64 = 2.0;
/// How far the second contact may be from the first one.
const TWICE_MM: f64 = 0.1;
/// The furthest that a tip comes to rest below a contact.
const COAST_MM: f64 = 5.0;
/// Looks that did not find what they should, before that is believed: a report may be damaged too.
const LOOKS: u32 = 2;
/// The alarm of a probe that was closed before it went down.
const CLOSED: u16 = 4;

/// A tool setter: mm in machine coordinates, mm/min.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ToolSetter {
    /// Where it stands: X and Y.
    pub place_mm: [f64; 2],
    /// The height of Z from which it is looked for: no tool meets it as high as that.
    pub from_mm: f64,
    /// How far down at most.
    pub depth_mm: f64,
    /// How fast the first time.
    pub fast_mm_per_min: f64,
    /// How fast the second time.
    pub slow_mm_per_min: f64,
}

impl ToolSetter {
    /// One at this place, looked for from there as fast as it is usual.
    pub fn usual(place_mm: [f64; 2], from_mm: f64) -> Self {
        Self { place_mm, from_mm, depth_mm: 40.0, fast_mm_per_min: 150.0, slow_mm_per_min: 25.0 }
    }

    /// X, Y, the height from which, how far down, the fast and the slow feed.
    pub fn numbers(&self) -> [f64; 6] {
        let [x, y] = self.place_mm;
        [x, y, self.from_mm, self.depth_mm, self.fast_mm_per_min, self.slow_mm_per_min]
    }

    /// One of such numbers, where they make one.
    pub fn of_numbers(parts: &[f64]) -> Option<Self> {
        let &[x, y, from_mm, depth_mm, fast_mm_per_min, slow_mm_per_min] = parts else { return None };
        let setter = Self { place_mm: [x, y], from_mm, depth_mm, fast_mm_per_min, slow_mm_per_min };
        setter.is_sound().then_some(setter)
    }

    /// Whether it is one at all, whatever the machine's travel.
    pub fn is_sound(&self) -> bool {
        let [x, y] = self.place_mm;
        let places = [x, y, self.from_mm].iter().all(|mm| mm.is_finite() && libm::fabs(*mm) <= 5_000.0);
        let feeds = [self.fast_mm_per_min, self.slow_mm_per_min];
        places
            && (1.0..=500.0).contains(&self.depth_mm)
            && feeds.iter().all(|feed| (1.0..=1_000.0).contains(feed))
    }
}

/// How the length of a tool is found at a machine, as its owner chose it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ToolLengths {
    /// On a tool setter; else each is touched off against the board.
    pub on_setter: bool,
    /// The tool setter, once somebody said where it stands.
    pub setter: Option<ToolSetter>,
}

impl ToolLengths {
    /// The tool setter that tools are measured on.
    pub fn in_force(&self) -> Option<ToolSetter> {
        self.setter.filter(|_| self.on_setter)
    }
}

/// What is done of a measurement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SetterStep {
    /// The words that everything goes by are put in force.
    Ready,
    /// Straight up to the top.
    Up,
    /// Over the setter.
    Over,
    /// Down to where it is looked for.
    Near,
    /// Down until the contact closes.
    Touch,
    /// A little up again.
    Back,
    /// Down once more, slowly.
    Again,
    /// Where that was is asked for a second time.
    Same,
    /// Up to the top again.
    Lift,
    /// Zero of Z is written, and read again.
    Zero,
}

/// A measurement in work.
#[derive(Debug)]
pub(super) struct SetterRun {
    setter: ToolSetter,
    top_mm: f64,
    step: SetterStep,
    /// All of the step is answered: a report shows where it led.
    pub(super) answered: bool,
    /// The question for that report was asked.
    asked: bool,
    looks: u32,
    /// Z where the contact closed the first time.
    first_mm: f64,
    /// Where it closed the second time.
    met_mm: [f64; 3],
    /// The height of the board is known for the tool that is in: the others go by it.
    is_reference: bool,
}

impl Controller {
    /// What is done just now of the measurement of a tool.
    pub fn measuring(&self) -> Option<SetterStep> {
        self.setter.as_ref().map(|run| run.step)
    }

    /// Why no tool can be measured there, if that is so.
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

    /// What of tool setter and tool changer keeps a job from being started; that the place is not known is said by itself.
    pub(super) fn check_setter(&self, start: &EngineStart) -> Vec<Diagnostic> {
        let setter = start.setter.filter(|_| !start.same_length);
        let why = setter.and_then(|setter| self.setter_refused(&setter));
        let why = why.filter(|_| self.trust == Trust::Trusted || !self.homes());
        why.into_iter().chain(self.check_changer(start)).collect()
    }

    /// That the tool which is in is measured before the job asks for one, where it is.
    pub(super) fn reference_told(&self, start: &EngineStart) -> Option<Diagnostic> {
        let setter = start.setter.filter(|_| !start.same_length && start.routine.changes_tools())?;
        let is_known = start.from > 0 && self.reference_mm.is_some();
        let [x, y] = setter.place_mm.map(|mm| format!("{mm:.3}"));
        let why = Diagnostic::warning("setter.reference").with("x", x).with("y", y);
        (self.height == BoardHeight::OfThisBit && !is_known).then_some(why)
    }

    /// Begins to measure the tool that is in.
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
        // The spindle is off: nothing is said of it that could become its start on the way.
        self.send("G21G17G90G94", Meaning::Setter(None));
        self.send("$G", Meaning::Setter(Some(SetterStep::Ready)));
    }

    /// The step that follows: its lines, the last of which is answered when it is done.
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
            SetterStep::Near => self.setter_probes(&down("G38.3", top_mm - from_mm, fast_mm_per_min), step),
            SetterStep::Touch => self.setter_probes(&down("G38.2", depth_mm, fast_mm_per_min), step),
            SetterStep::Again => self.setter_probes(&down("G38.2", AGAIN_MM, slow_mm_per_min), step),
            SetterStep::Same => self.setter_probes("$#", step),
            SetterStep::Ready | SetterStep::Back | SetterStep::Zero => {}
        }
    }

    fn setter_moves(&mut self, text: &str, step: SetterStep) {
        self.send(text, Meaning::Setter(None));
        // It is answered once the head stands still.
        self.send("G4P0", Meaning::Setter(Some(step)));
    }

    fn setter_probes(&mut self, text: &str, step: SetterStep) {
        self.probed = None;
        self.send(text, Meaning::Setter(Some(step)));
    }

    /// A line of it was answered.
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

    /// Nothing moves before the unit is that of these numbers, and the spindle off.
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

    /// A probing move ended, or was said once more where it did.
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

    /// The question that was asked now shows where the step led.
    pub(super) fn setter_asked(&mut self) {
        let idle = self.buffer.is_empty() && self.queue.is_empty();
        if let Some(run) = &mut self.setter {
            run.asked = idle && run.answered;
        }
    }

    /// A report meanwhile.
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
            // Nothing would tell where the tool meets it.
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
            // Behind a zero that was written the place is known with the next report of it.
            SetterStep::Zero => self.setter_zeroed(place),
            _ => {}
        }
    }

    /// The tip is up again, and where the setter met it is known.
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
        // What is reported and what is stored are said apart: where they differ a line was damaged, or another offset stands.
        if libm::fabs(zero[2] - stored) > same_mm {
            let mm = format!("{:.3}", zero[2] - stored);
            return self.setter_fails(Diagnostic::error("setter.offset_stands").with("mm", mm));
        }
        self.reference_mm = Some(stored - met_mm[2]);
        self.is_measured(place);
    }

    /// Zero of Z was written and read again: it has to be what places go by.
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

    /// What an alarm means while a tool is measured, where it means something else.
    pub(super) fn setter_alarm(&self, number: u16) -> Option<Diagnostic> {
        (self.setter.is_some() && number == CLOSED).then(early)
    }

    fn setter_elsewhere(&mut self) {
        self.setter_fails(Diagnostic::error("setter.elsewhere"));
    }

    /// It ends here, and the tool waits to be measured again. The tip goes straight up, where nothing can be in its way.
    fn setter_fails(&mut self, why: Diagnostic) {
        let Some(run) = self.setter.take() else { return };
        self.queue.clear();
        self.found(why);
        // As a move by hand: that one ends at STOP.
        let text = format!("$J=G90G53G21Z{}F{}", number(run.top_mm), number(LIFT_MM_PER_MIN));
        self.send(&text, Meaning::Jog);
        self.set(EnginePhase::Jogging);
    }
}

fn early() -> Diagnostic {
    Diagnostic::error("setter.early")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_that_make_no_setter_are_none() {
        let setter = ToolSetter::usual([-180.0, -5.0], -1.0);
        assert_eq!(ToolSetter::of_numbers(&setter.numbers()), Some(setter));
        let rows: [&[f64]; 7] = [
            &[],
            &[-180.0, -5.0, -1.0, 40.0, 150.0],
            &[f64::NAN, -5.0, -1.0, 40.0, 150.0, 25.0],
            &[-180.0, 9_000.0, -1.0, 40.0, 150.0, 25.0],
            &[-180.0, -5.0, -1.0, 0.0, 150.0, 25.0],
            &[-180.0, -5.0, -1.0, 40.0, 0.0, 25.0],
            &[-180.0, -5.0, -1.0, 40.0, 150.0, f64::INFINITY],
        ];
        for numbers in rows {
            assert_eq!(ToolSetter::of_numbers(numbers), None, "{numbers:?}");
        }
    }

    #[test]
    fn a_setter_that_nobody_chose_is_not_in_force() {
        let setter = Some(ToolSetter::usual([-180.0, -5.0], -1.0));
        assert_eq!(ToolLengths { on_setter: false, setter }.in_force(), None);
        assert_eq!(ToolLengths { on_setter: true, setter }.in_force(), setter);
    }
}
