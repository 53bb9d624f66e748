//! A queue in work, as a pure machine: (what was done, what is reported) → what to do next.
//!
//! ```text
//! Go ─▶ row: rules once more ─▶ Play ─▶ report ─▶ result of the row ─▶ next row … ─▶ Rest
//!                                │                                                  held: step done, breakpoint
//!                                └─ stopped, sensor, time over ─▶ Rest              done · stopped here · failed
//! ```
//!
//! Comes in: orders and reports. Goes out: [`QueueAction`]s, at most one of them a [`QueueAction::Play`] or [`QueueAction::Rest`], always
//! the last. Every row begins and ends at rest. Does not know who plays the segments.

use super::blocks::{Queue, QueueCursor};
use super::homing::{Homing, HomingNext};
use super::rules::{Standing, after};
use super::text::refuse;
use super::words::{INPUTS, STATES, WorkCommand};
use super::work;
use crate::diagnostic::Diagnostic;
use crate::job::{Input, Otherwise};
use crate::machine::{Machine, Steps};
use crate::pins::Outcome;
use crate::steps::{Segment, TICK_HZ};
use serde::{Deserialize, Serialize};

/// How long one look at an input lasts while it is waited for, in ms.
const LOOK_MS: u32 = 5;

/// Ticks of a millisecond.
const TICKS_OF_MS: u64 = TICK_HZ / 1_000;

/// How far to go.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// One row.
    Step,
    /// Up to the next breakpoint, or to the end.
    ToBreakpoint,
    /// To the end, over every breakpoint.
    ToEnd,
}

/// What came of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RowState {
    /// Not yet done.
    #[default]
    Waiting,
    /// Being done.
    Working,
    /// Done, the last time it came.
    Done,
    /// Not begun, or ended by an alarm: the reason says why.
    Refused,
    /// STOP came while it was done.
    StoppedHere,
}

/// The result of a row.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RowResult {
    /// What came of it.
    pub state: RowState,
    /// How often it was begun.
    pub turns: u32,
    /// How long it took the last time, in ms of machine time.
    pub ms: f64,
    /// Why it was refused.
    pub why: Option<Diagnostic>,
}

/// What the player says after a [`QueueAction::Play`], at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QueueReport {
    /// How the last segment played ended.
    pub outcome: Outcome,
    /// Steps counted.
    pub position: Steps,
    /// The inputs then, one bit each.
    pub inputs: u32,
    /// Machine time it took, in ticks.
    pub ticks: u64,
}

/// What to do.
#[derive(Clone, Debug, PartialEq)]
pub enum QueueAction {
    /// Switch this output: its place among the machine's outputs.
    Output {
        /// Its place among the machine's outputs.
        place: u8,
        /// On, else off.
        on: bool,
    },
    /// The count of an axis, and of all that move together with it, is off.
    Correct {
        /// Which axis.
        axis: usize,
        /// By so many.
        steps: i64,
    },
    /// Play these, then report.
    Play(Vec<Segment>),
    /// Nothing to do.
    Rest(Rest),
}

/// Why nothing is done.
#[derive(Clone, Debug, PartialEq)]
pub enum Rest {
    /// Between two rows: after a step, before a breakpoint, or as asked.
    Held,
    /// The last row is done.
    Done,
    /// STOP.
    Stopped,
    /// A row was refused or failed, and what is left of the trust in the position.
    Failed {
        /// Why.
        why: Diagnostic,
        /// What is left of the trust.
        harm: Harm,
    },
}

/// What a failure leaves of the trust in the position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Harm {
    /// As much as before.
    None,
    /// Probably right.
    Suspect,
    /// Nothing.
    Lost,
}

/// What the player has in hand.
#[derive(Clone, Debug, PartialEq)]
enum Doing {
    Nothing,
    /// Segments; how the drill will stand.
    Moves(Standing),
    /// A pulse on this output; what it goes back to.
    Pulse(u8, bool),
    /// Looking at an input that is to be so; ms left.
    Look(Input, bool, u32),
    Homing(Homing),
}

/// A queue in work.
#[derive(Clone, Debug)]
pub struct QueueRun {
    queue: Queue,
    outputs: Vec<String>,
    standing: Standing,
    cursor: QueueCursor,
    mode: Mode,
    doing: Doing,
    results: Vec<RowResult>,
    /// Stands between two rows of a run that has begun.
    held: bool,
    ended: bool,
    on: u32,
}

impl QueueRun {
    /// `queue` before its first row. `outputs` are the names that may be switched, in the order of their places.
    pub fn new(queue: Queue, outputs: Vec<String>, standing: Standing) -> Self {
        let cursor = QueueCursor::new(&queue);
        let results = vec![RowResult::default(); queue.rows().len()];
        let (mode, doing) = (Mode::Step, Doing::Nothing);
        Self { queue, outputs, standing, cursor, mode, doing, results, held: false, ended: false, on: 0 }
    }

    /// Its rows.
    pub fn queue(&self) -> &Queue {
        &self.queue
    }

    /// The row in work or next; none at the end.
    pub fn row(&self) -> Option<usize> {
        self.cursor.row(&self.queue)
    }

    /// Results, one a row.
    pub fn results(&self) -> &[RowResult] {
        &self.results
    }

    /// How the drill stands, as far as was reported.
    pub fn standing(&self) -> &Standing {
        &self.standing
    }

    /// Whether it came to an end, good or bad.
    pub fn ended(&self) -> bool {
        self.ended
    }

    /// Rows passed, each as often as it was done.
    pub fn passed(&self) -> u32 {
        self.cursor.passed()
    }

    /// Whether an axis is being homed.
    pub fn homes(&self) -> bool {
        matches!(self.doing, Doing::Homing(_))
    }

    /// Whether a stroke into the board is being done.
    pub fn drills(&self) -> bool {
        let command = self.row().and_then(|row| self.queue.rows().get(row)?.command.as_ref());
        matches!((&self.doing, command), (Doing::Moves(_), Some(WorkCommand::DrillDown)))
    }

    /// Goes on after [`QueueRun::hold`] that has not held yet, as far as `mode` says.
    pub fn proceed(&mut self, mode: Mode) {
        self.mode = mode;
    }

    /// Holds after the row in work.
    pub fn hold(&mut self) {
        self.mode = Mode::Step;
    }

    /// Goes on, or begins.
    pub fn go(&mut self, machine: &Machine, mode: Mode) -> Vec<QueueAction> {
        if self.doing != Doing::Nothing || self.ended {
            return Vec::new();
        }
        self.mode = mode;
        let at_once = self.held || mode == Mode::Step;
        self.held = false;
        self.rows(machine, at_once)
    }

    /// Rows one after the other, until something is to be played or it rests. The first is done even if a breakpoint
    /// stands before it, where `at_once`.
    fn rows(&mut self, machine: &Machine, mut at_once: bool) -> Vec<QueueAction> {
        let mut actions = Vec::new();
        while let Some(row) = self.row() {
            let stops = match self.mode {
                Mode::Step => true,
                Mode::ToBreakpoint => self.queue.rows()[row].breakpoint,
                Mode::ToEnd => false,
            };
            if stops && !at_once {
                self.held = true;
                actions.push(QueueAction::Rest(Rest::Held));
                return actions;
            }
            at_once = false;
            let result = &mut self.results[row];
            *result = RowResult { state: RowState::Working, turns: result.turns + 1, ..RowResult::default() };
            if let Err(why) = self.begin(machine, row, &mut actions) {
                actions.extend(self.fail(why, Harm::None));
                return actions;
            }
            if self.doing != Doing::Nothing {
                return actions;
            }
            if let Err(why) = self.row_done() {
                actions.extend(self.fail(why, Harm::None));
                return actions;
            }
        }
        actions.extend(self.end(Rest::Done));
        actions
    }

    /// The end, good or bad: outputs that the queue turned on are turned off.
    fn end(&mut self, rest: Rest) -> Vec<QueueAction> {
        (self.doing, self.ended) = (Doing::Nothing, true);
        let on = std::mem::take(&mut self.on);
        let off =
            (0..32).filter(|bit| on >> bit & 1 == 1).map(|bit| QueueAction::Output { place: bit, on: false });
        off.chain([QueueAction::Rest(rest)]).collect()
    }

    /// Begins a row. Where there is something to play, it is the last action.
    fn begin(
        &mut self,
        machine: &Machine,
        row: usize,
        actions: &mut Vec<QueueAction>,
    ) -> Result<(), Diagnostic> {
        let Some(command) = self.queue.rows()[row].command.clone() else { return Ok(()) };
        let next = after(&command, machine, &self.outputs, &self.standing)?;
        let from = self.standing.position;
        let segments = match &command {
            WorkCommand::MoveBy { .. } | WorkCommand::MoveTo { .. } => {
                let mut pieces = self.foot_up(machine);
                pieces.extend(work::travel(machine, from, next.position)?);
                pieces
            }
            WorkCommand::DrillDown => work::down(machine, from)?,
            WorkCommand::DrillUp => work::up(machine, from, next.position[2])?,
            WorkCommand::Park => work::park(machine, from)?,
            WorkCommand::Spindle { rpm } if next.rpm != self.standing.rpm => {
                work::spindle(machine, from, *rpm)
            }
            WorkCommand::Wait { ms } => work::wait(from, u64::from(*ms) * TICKS_OF_MS),
            WorkCommand::WaitInput { input, on, timeout_ms } => {
                self.doing = Doing::Look(*input, *on, *timeout_ms);
                actions.push(QueueAction::Play(work::wait(from, 1)));
                return Ok(());
            }
            WorkCommand::Output { name, on, pulse_ms } => {
                let bit = self.outputs.iter().position(|output| output == name).unwrap_or(0) as u8;
                actions.push(self.switch(bit, *on));
                self.standing.foot_down = next.foot_down;
                let Some(ms) = pulse_ms else { return Ok(()) };
                self.doing = Doing::Pulse(bit, !on);
                actions.push(QueueAction::Play(work::wait(from, u64::from(*ms) * TICKS_OF_MS)));
                return Ok(());
            }
            WorkCommand::Home { axes } => {
                let mut homing = Homing::new(axes.in_order(), self.standing.homed);
                let first = homing.begin(machine)?;
                actions.extend(self.homing_goes_on(machine, homing, first));
                return Ok(());
            }
            _ => Vec::new(),
        };
        if segments.is_empty() {
            self.standing = next;
        } else {
            self.doing = Doing::Moves(next);
            actions.push(QueueAction::Play(segments));
        }
        Ok(())
    }

    fn switch(&mut self, bit: u8, on: bool) -> QueueAction {
        let mask = 1_u32.checked_shl(u32::from(bit)).unwrap_or(0);
        self.on = if on { self.on | mask } else { self.on & !mask };
        QueueAction::Output { place: bit, on }
    }

    /// The presser foot up where it may be down, before X or Y moves.
    fn foot_up(&mut self, machine: &Machine) -> Vec<Segment> {
        let is_down = std::mem::take(&mut self.standing.foot_down);
        if is_down { work::foot(machine, self.standing.position, false) } else { Vec::new() }
    }

    fn homing_goes_on(&mut self, machine: &Machine, homing: Homing, next: HomingNext) -> Vec<QueueAction> {
        match next {
            HomingNext::Homed => Vec::new(),
            HomingNext::Play { segment, correction_steps: correction } => {
                let axis = homing.axis();
                if let Some(homed) = self.standing.homed.get_mut(axis) {
                    *homed = false;
                }
                self.doing = Doing::Homing(homing);
                let mut actions = Vec::new();
                if correction != 0 {
                    actions.push(QueueAction::Correct { axis, steps: correction });
                }
                let mut pieces = if axis < 2 { self.foot_up(machine) } else { Vec::new() };
                pieces.push(segment);
                actions.push(QueueAction::Play(pieces));
                actions
            }
        }
    }

    /// What follows from a report.
    pub fn reported(&mut self, machine: &Machine, report: &QueueReport) -> Vec<QueueAction> {
        let doing = std::mem::replace(&mut self.doing, Doing::Nothing);
        self.standing.position = report.position;
        if let Some(result) = self.row().and_then(|row| self.results.get_mut(row)) {
            result.ms += report.ticks as f64 / TICKS_OF_MS as f64;
        }
        if report.outcome == Outcome::Stopped {
            return self.stopped();
        }
        let mut actions = Vec::new();
        match doing {
            Doing::Nothing => return Vec::new(),
            Doing::Moves(next) => {
                if let Some((why, harm)) = failure(machine, &report.outcome) {
                    return self.fail(why, harm);
                }
                self.standing = Standing { position: report.position, ..next };
            }
            Doing::Pulse(bit, back) => actions.push(self.switch(bit, back)),
            Doing::Look(input, on, left_ms) => {
                if (report.inputs & input.bit() != 0) != on {
                    return self.look_again(input, on, left_ms);
                }
            }
            Doing::Homing(mut homing) => {
                let axis = homing.axis();
                match homing.reported(machine, report, &mut self.standing.position) {
                    Err((why, harm)) => {
                        // A count that was wrong is found out at the end of the homing: it is right again.
                        if let Some(homed) = self.standing.homed.get_mut(axis) {
                            *homed = harm == Harm::None;
                        }
                        return self.fail(why, harm);
                    }
                    Ok(next) => {
                        let more = self.homed_so_far(machine, (axis, homing), next);
                        if !more.is_empty() {
                            return more;
                        }
                    }
                }
            }
        }
        if let Err(why) = self.row_done() {
            actions.extend(self.fail(why, Harm::None));
            return actions;
        }
        actions.extend(self.rows(machine, false));
        actions
    }

    /// `axis` was being homed; it is homed where another one is begun or all are done.
    fn homed_so_far(
        &mut self,
        machine: &Machine,
        (axis, homing): (usize, Homing),
        next: HomingNext,
    ) -> Vec<QueueAction> {
        let over = matches!(next, HomingNext::Homed) || homing.axis() != axis;
        if let Some(homed) = self.standing.homed.get_mut(axis).filter(|_| over) {
            *homed = true;
        }
        self.homing_goes_on(machine, homing, next)
    }

    fn look_again(&mut self, input: Input, on: bool, left_ms: u32) -> Vec<QueueAction> {
        if left_ms == 0 {
            let timeout = self.row().and_then(|row| self.queue.rows()[row].command.clone());
            let ms =
                if let Some(WorkCommand::WaitInput { timeout_ms, .. }) = timeout { timeout_ms } else { 0 };
            let why = refuse("queue.input_timeout").with("input", INPUTS[input as usize]);
            let why = why.with("state", STATES[usize::from(on)]).with("ms", ms);
            return self.fail(why, Harm::None);
        }
        let ms = left_ms.min(LOOK_MS);
        self.doing = Doing::Look(input, on, left_ms - ms);
        vec![QueueAction::Play(work::wait(self.standing.position, u64::from(ms) * TICKS_OF_MS))]
    }

    /// The row is done; on to the next.
    fn row_done(&mut self) -> Result<(), Diagnostic> {
        if let Some(result) = self.row().and_then(|row| self.results.get_mut(row)) {
            result.state = RowState::Done;
        }
        self.cursor.pass(&self.queue)
    }

    /// Ends the run because of STOP, wherever it is.
    pub fn stopped(&mut self) -> Vec<QueueAction> {
        if let Some(result) = self.row().and_then(|row| self.results.get_mut(row)) {
            result.state = RowState::StoppedHere;
        }
        self.end(Rest::Stopped)
    }

    fn fail(&mut self, why: Diagnostic, harm: Harm) -> Vec<QueueAction> {
        let row = self.row();
        let line = row.map_or(0, |row| u32::try_from(row + 1).unwrap_or(u32::MAX));
        let turn = self.cursor.passed() + 1;
        let why = why.with("row", line).with("turn", turn).at("", line, 1);
        if let Some(result) = row.and_then(|row| self.results.get_mut(row)) {
            (result.state, result.why) = (RowState::Refused, Some(why.clone()));
        }
        self.end(Rest::Failed { why, harm })
    }
}

/// A step came so many ticks later than its motor could wait for.
pub fn late(ticks: u64) -> Diagnostic {
    refuse("control.executor_late").with("ms", libm::ceil(ticks as f64 / TICKS_OF_MS as f64))
}

/// What a sensor means that turned on where it must not, and what it leaves of the trust: every step is counted, unless an axis met
/// its end.
pub fn guarded(input: Input) -> (Diagnostic, Harm) {
    match input {
        Input::CoverOpen => (refuse("control.cover_open"), Harm::None),
        Input::FootDown => (refuse("control.foot_down"), Harm::None),
        _ => (refuse("control.end_sensor").with("sensor", format!("{input:?}")), Harm::Suspect),
    }
}

/// What a sensor means that is off where it must be on: no board under the tip, or no presser foot on it.
pub fn missing(input: Input) -> Diagnostic {
    refuse(if input == Input::Contact { "control.no_contact" } else { "control.foot_gone" })
}

/// What it means that the tip of `machine` touched something `at` which is higher than the board can be, whose surface lies there
/// `board_steps` of Z over the flat one. Every step is counted, and the height of the tip is looked at again over the next hole.
pub fn early(machine: &Machine, at: &Steps, board_steps: i64) -> Diagnostic {
    let above = machine.z.scale.length(machine.lowest(at) - board_steps) - machine.process.surface;
    refuse("control.early_contact").with("mm", format!("{:.2}", above.mm()))
}

/// What an outcome means that is not the end of a row.
fn failure(machine: &Machine, outcome: &Outcome) -> Option<(Diagnostic, Harm)> {
    match outcome {
        Outcome::Guarded(input) => Some(guarded(*input)),
        Outcome::Missing(input) => Some((missing(*input), Harm::None)),
        Outcome::Early { at } => Some((early(machine, at, 0), Harm::None)),
        Outcome::Late { ticks } => Some((late(*ticks), Harm::Suspect)),
        Outcome::Spindle { trouble } => Some((trouble.diagnostic(), Harm::None)),
        Outcome::Unmet(gate) if gate.otherwise == Otherwise::Alarm => {
            let why = refuse("control.drilling_too_long").with("sensor", format!("{:?}", gate.input));
            Some((why.with("seconds", f64::from(gate.deadline_us) / 1e6), Harm::None))
        }
        _ => None,
    }
}
