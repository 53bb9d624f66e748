//! Measures a tool on the tool setter during a tool change.
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

use super::activity::Activity;
use super::changing::Changing;
use super::context::{Context, Report};
use super::job::{Job, JobTool};
use super::jogging::Jogging;
use super::known::Known;
use super::line::{Meaning, ZeroWanted};
use super::lines::number;
use super::probing::LIFT_MM_PER_MIN;
use super::running::Running;
use super::setter::{SetterStep, ToolSetter};
use crate::control::{BoardHeight, Trust};
use crate::diagnostic::Diagnostic;
use crate::{code, error};

const SAME_MM: f64 = 0.02;
/// Shorter moves are skipped: a controller refuses to probe where it already is.
const NONE_MM: f64 = 0.002;
/// A touch within this distance of the start height is not the tool: a chip, or a stuck pin.
const EARLY_MM: f64 = 0.5;
/// Retreat before the second touch, and the longest travel of that touch.
const BACK_MM: f64 = 1.0;
const AGAIN_MM: f64 = 2.0;
const TWICE_MM: f64 = 0.1;
const COAST_MM: f64 = 5.0;
/// Failed checks that count as proof: a single report may be damaged.
const LOOKS: u32 = 2;
/// Alarm of a probe input that was closed before the move.
const CLOSED: u16 = 4;

impl Known {
    pub(super) fn setter_refused(&self, setter: &ToolSetter) -> Option<Diagnostic> {
        // The setter is at a machine position, which only homing restores after a restart.
        if !self.homes() {
            return Some(error!("setter.no_homing"));
        }
        if self.trust != Trust::Trusted {
            return Some(error!("grbl.not_homed"));
        }
        if !setter.is_sound() {
            return Some(error!("setter.bad"));
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
        let why = error!("setter.no_room", axis = ["X", "Y", "Z"][axis], ..);
        let why = why.with("from", mm(needs[axis][0])).with("to", mm(needs[axis][1]));
        Some(why.with("low", mm(low)).with("high", mm(high)))
    }
}

#[derive(Debug)]
pub(super) struct Measuring {
    pub(super) job: Box<Job>,
    setter: ToolSetter,
    top_mm: f64,
    step: SetterStep,
    /// The step is fully answered: a report must show its end position.
    pub(super) is_answered: bool,
    is_asked: bool,
    looks: u32,
    first_mm: f64,
    met_mm: [f64; 3],
    /// The board height is known for this tool: it becomes the reference.
    is_reference: bool,
}

impl Measuring {
    /// Starts measuring the tool in the spindle; `Err` if that is impossible, which is reported.
    pub(super) fn start(cx: &mut Context, job: Box<Job>, setter: ToolSetter) -> Result<Activity, Box<Job>> {
        if let Some(why) = cx.known.setter_refused(&setter) {
            cx.found(why);
            return Err(job);
        }
        let is_reference = cx.known.height == BoardHeight::OfThisBit;
        if !is_reference && cx.known.reference_mm.is_none() {
            cx.error(code!("setter.no_reference"));
            return Err(job);
        }
        let Some([_, top_mm]) = cx.known.room_mm(2) else { return Err(job) };
        // Forget the modal words, so that a lost `$G` answer is noticed.
        cx.known.modes = None;
        // The spindle is off. Send no spindle word: a damaged character could turn it into a start.
        cx.send("G21G17G90G94", Meaning::Setter(None));
        cx.send("$G", Meaning::Setter(Some(SetterStep::Ready)));
        Ok(Activity::Measuring(Self {
            job,
            setter,
            top_mm,
            step: SetterStep::Ready,
            is_answered: false,
            is_asked: false,
            looks: 0,
            first_mm: 0.0,
            met_mm: [0.0; 3],
            is_reference,
        }))
    }

    pub(super) fn step(&self) -> SetterStep {
        self.step
    }

    /// Sends the lines of the next step; the last line is answered when the step is done.
    fn go(mut self, cx: &mut Context, step: SetterStep) -> Activity {
        (self.step, self.is_answered, self.looks) = (step, false, 0);
        let ToolSetter { place_mm: [x, y], from_mm, depth_mm, fast_mm_per_min, slow_mm_per_min } =
            self.setter;
        let top_mm = self.top_mm;
        let down = |code: &str, mm: f64, feed: f64| {
            format!("G91{code}Z{}F{}", number(-libm::fabs(mm)), number(feed))
        };
        match step {
            SetterStep::Up | SetterStep::Lift => {
                move_to(cx, &format!("G90G53G0Z{}", number(top_mm)), step);
            }
            SetterStep::Over => move_to(cx, &format!("G90G53G0X{}Y{}", number(x), number(y)), step),
            // G38.3 raises no alarm if it meets nothing, which is expected here.
            SetterStep::Near => probe(cx, &down("G38.3", top_mm - from_mm, fast_mm_per_min), step),
            // The setter must be met: G38.2 raises an alarm if it isn't.
            SetterStep::Touch => probe(cx, &down("G38.2", depth_mm, fast_mm_per_min), step),
            SetterStep::Again => probe(cx, &down("G38.2", AGAIN_MM, slow_mm_per_min), step),
            SetterStep::Same => probe(cx, "$#", step),
            SetterStep::Ready | SetterStep::Back | SetterStep::Zero => {}
        }
        Activity::Measuring(self)
    }

    pub(super) fn on_answer(mut self, cx: &mut Context, step: SetterStep) -> Activity {
        match step {
            _ if self.step != step => {}
            SetterStep::Ready => return self.begin(cx),
            SetterStep::Up | SetterStep::Over | SetterStep::Back | SetterStep::Lift | SetterStep::Zero => {
                self.is_answered = true;
            }
            SetterStep::Near | SetterStep::Touch | SetterStep::Again | SetterStep::Same => {
                return self.on_probe(cx, step);
            }
        }
        Activity::Measuring(self)
    }

    /// Nothing moves before millimetres are in force and the spindle is off.
    fn begin(self, cx: &mut Context) -> Activity {
        match cx.known.other_word(&[('G', 210), ('G', 170), ('G', 940), ('M', 50)]) {
            None => self.go(cx, SetterStep::Up),
            Some(why) => self.fail(cx, why),
        }
    }

    /// A probing move ended, or its position was queried again.
    fn on_probe(mut self, cx: &mut Context, step: SetterStep) -> Activity {
        let (Some(met), Some(place)) = (cx.known.probed.take(), cx.known.probed_at_mm) else {
            return self.fail(cx, error!("level.no_answer"));
        };
        let (from_mm, first_mm, [x, y]) = (self.setter.from_mm, self.first_mm, self.setter.place_mm);
        // A damaged line may have moved X or Y.
        let aside = libm::fabs(place[0] - x) > SAME_MM || libm::fabs(place[1] - y) > SAME_MM;
        match step {
            _ if aside => self.fail(cx, elsewhere()),
            SetterStep::Near if met => self.fail(cx, early()),
            SetterStep::Near if libm::fabs(place[2] - from_mm) > SAME_MM => self.fail(cx, elsewhere()),
            SetterStep::Near => self.go(cx, SetterStep::Touch),
            _ if !met => self.fail(cx, error!("grbl.alarm_5", number = 5)),
            SetterStep::Touch if place[2] > from_mm - EARLY_MM => self.fail(cx, early()),
            SetterStep::Touch => {
                (self.first_mm, self.is_answered) = (place[2], true);
                Activity::Measuring(self)
            }
            SetterStep::Again if libm::fabs(place[2] - first_mm) > TWICE_MM => {
                let mm = format!("{:.3}", libm::fabs(place[2] - first_mm));
                self.fail(cx, error!("setter.differs", mm = mm))
            }
            SetterStep::Again => {
                self.met_mm = place;
                self.go(cx, SetterStep::Same)
            }
            // The line has no checksum: the position must arrive twice.
            _ if place != self.met_mm => self.fail(cx, error!("level.no_answer")),
            _ => self.go(cx, SetterStep::Lift),
        }
    }

    /// A status query is sent: it will show the end of the step, if `is_empty`, the line.
    pub(super) fn on_query(&mut self, is_empty: bool) {
        self.is_asked = is_empty && self.is_answered;
    }

    pub(super) fn on_report(mut self, cx: &mut Context, report: Report) -> Activity {
        if !(report.is_idle() && self.is_answered && self.is_asked) {
            return Activity::Measuring(self);
        }
        self.is_asked = false;
        let Some(at) = cx.known.machine_mm() else { return Activity::Measuring(self) };
        if !self.is_there(at) {
            self.looks += 1;
            let is_proof = self.looks >= LOOKS;
            return if is_proof { self.fail(cx, elsewhere()) } else { Activity::Measuring(self) };
        }
        let is_closed = cx.known.contact_is_closed();
        match self.step {
            // With a closed input the touch could not be detected.
            SetterStep::Up | SetterStep::Over | SetterStep::Back if is_closed => {
                self.fail(cx, error!("setter.closed"))
            }
            SetterStep::Up => self.go(cx, SetterStep::Over),
            SetterStep::Back => self.go(cx, SetterStep::Again),
            SetterStep::Over if self.top_mm - self.setter.from_mm > NONE_MM => self.go(cx, SetterStep::Near),
            SetterStep::Over => self.go(cx, SetterStep::Touch),
            SetterStep::Touch => {
                // The axis brakes after the touch, so the tip rests below it.
                let back = number((self.first_mm - at[2]).max(0.0) + BACK_MM);
                move_to(cx, &format!("G91G0Z{back}"), SetterStep::Back);
                self.go(cx, SetterStep::Back)
            }
            SetterStep::Lift => self.on_found(cx),
            // After a zero was written, the next report gives the position.
            SetterStep::Zero => self.on_zero(cx),
            _ => Activity::Measuring(self),
        }
    }

    /// True if this is where the step ends, in machine coordinates.
    fn is_there(&self, at: [f64; 3]) -> bool {
        let [x, y] = self.setter.place_mm;
        let is_at = |axis: usize, mm: f64| libm::fabs(at[axis] - mm) <= SAME_MM;
        let is_over = is_at(0, x) && is_at(1, y);
        match self.step {
            SetterStep::Up => is_at(2, self.top_mm),
            SetterStep::Over | SetterStep::Lift => is_over && is_at(2, self.top_mm),
            SetterStep::Touch => {
                is_over && at[2] <= self.first_mm + SAME_MM && at[2] >= self.first_mm - COAST_MM
            }
            _ => true,
        }
    }

    fn on_found(mut self, cx: &mut Context) -> Activity {
        let met_mm = self.met_mm;
        if !self.is_reference {
            let Some(reference_mm) = cx.known.reference_mm else {
                return self.fail(cx, error!("setter.no_reference"));
            };
            (self.step, self.is_answered) = (SetterStep::Zero, false);
            let wanted = ZeroWanted { touched_mm: Some(met_mm), of_setter: true, ..ZeroWanted::default() };
            cx.write_zero([None, None, Some(met_mm[2] + reference_mm)], wanted);
            return Activity::Measuring(self);
        }
        let stored = cx.known.info.offsets.get("G54").and_then(|places| places.get(2)).copied();
        let (Some(zero), Some(stored), Some(place)) = (cx.known.zero_mm, stored, cx.known.place()) else {
            return self.fail(cx, error!("grbl.no_report"));
        };
        // Reported and stored zero differ: a line was damaged, or another offset is active.
        if libm::fabs(zero[2] - stored) > cx.known.same_height_mm() {
            let mm = format!("{:.3}", zero[2] - stored);
            return self.fail(cx, error!("setter.offset_stands", mm = mm));
        }
        cx.known.reference_mm = Some(stored - met_mm[2]);
        self.on_measured(cx, place)
    }

    /// The Z zero was written and read back: positions must refer to it.
    fn on_zero(self, cx: &mut Context) -> Activity {
        let known = &cx.known;
        let (Some(reference_mm), Some(zero), Some(place)) =
            (known.reference_mm, known.zero_mm, known.place())
        else {
            return Activity::Measuring(self);
        };
        let off_mm = zero[2] - self.met_mm[2] - reference_mm;
        if libm::fabs(off_mm) <= known.same_height_mm() {
            return self.on_measured(cx, place);
        }
        cx.known.height = BoardHeight::Unknown;
        self.fail(cx, error!("setter.offset_stands", mm = format!("{off_mm:.3}")))
    }

    /// The tool was measured: continue, or start the change that waited for this measurement.
    fn on_measured(self, cx: &mut Context, place_mm: [f64; 3]) -> Activity {
        match self.job.tool {
            JobTool::Wanted(tool) if self.job.changes().is_some() => Changing::start(cx, self.job, tool),
            _ => Running::continue_with_tool(cx, self.job, place_mm),
        }
    }

    /// An alarm with a special meaning during a measurement.
    pub(super) fn alarm(&self, number: u16) -> Option<Diagnostic> {
        (number == CLOSED).then(early)
    }

    /// The measurement failed; the tool must be measured again. The tip moves straight up, where nothing can
    /// be in its way.
    fn fail(self, cx: &mut Context, why: Diagnostic) -> Activity {
        // Lines of this step must not run after the failure.
        cx.line.queue.clear();
        cx.found(why);
        // A jog, because STOP ends a jog.
        let text = format!("$J=G90G53G21Z{}F{}", number(self.top_mm), number(LIFT_MM_PER_MIN));
        cx.send(&text, Meaning::Jog);
        Jogging::sent(Some(self.job))
    }
}

fn move_to(cx: &mut Context, text: &str, step: SetterStep) {
    cx.send(text, Meaning::Setter(None));
    // A dwell is answered after the move before it: the head has stopped then.
    cx.send("G4P0", Meaning::Setter(Some(step)));
}

fn probe(cx: &mut Context, text: &str, step: SetterStep) {
    cx.known.probed = None;
    cx.send(text, Meaning::Setter(Some(step)));
}

fn early() -> Diagnostic {
    error!("setter.early")
}

fn elsewhere() -> Diagnostic {
    error!("setter.elsewhere")
}
