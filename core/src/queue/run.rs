//! A running queue, as a pure state machine: (state, report) → next action.
//!
//! ```text
//! Go ─▶ row: check rules ─▶ Play ─▶ report ─▶ result of the row ─▶ next row … ─▶ Rest
//!                              │                                           held: step done, breakpoint
//!                              └─ stopped, sensor, timeout ─▶ Rest         done · stopped here · failed
//! ```
//!
//! Every row starts and ends at rest.

use super::blocks::{Queue, QueueCursor};
use super::homing::{Homing, HomingNext};
use super::rules::{Standing, after};
use super::words::{INPUTS, STATES, WorkCommand};
use super::work::{self, Harm, QueueReport, failure};
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::job::Input;
use crate::machine::Machine;
use crate::pins::Outcome;
use crate::steps::{Segment, TICK_HZ};
use serde::{Deserialize, Serialize};

const LOOK_MS: u32 = 5;

const TICKS_OF_MS: u64 = TICK_HZ / 1_000;

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    Step,
    ToBreakpoint,
    ToEnd,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RowState {
    #[default]
    Waiting,
    Working,
    /// Completed, in its latest execution.
    Done,
    /// Not started, or ended by an alarm: see the reason.
    Refused,
    StoppedHere,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RowResult {
    pub state: RowState,
    /// Number of executions started.
    pub turns: u32,
    /// Duration of the latest execution, in ms of machine time.
    pub ms: f64,
    pub why: Option<Diagnostic>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum QueueAction {
    Output {
        /// Index among the machine's outputs.
        place: u8,
        on: bool,
    },
    /// The count of an axis, and of all axes that move with it, is wrong by this.
    Correct {
        axis: usize,
        steps: i64,
    },
    /// Play these, then report.
    Play(Vec<Segment>),
    Rest(Rest),
}

#[derive(Clone, Debug, PartialEq)]
pub enum Rest {
    /// Between two rows: after a step, before a breakpoint, or on request.
    Held,
    Done,
    Stopped,
    Failed {
        why: Diagnostic,
        harm: Harm,
    },
}

#[derive(Clone, Debug, PartialEq)]
enum Doing {
    Nothing,
    /// Segments, and the state after them.
    Moves(Standing),
    /// A pulse on this output, and the level after it.
    Pulse(u8, bool),
    /// Waiting for an input to reach a level; ms left.
    Look(Input, bool, u32),
    Homing(Homing),
}

#[derive(Clone, Debug)]
pub struct QueueRun {
    queue: Queue,
    outputs: Vec<String>,
    standing: Standing,
    cursor: QueueCursor,
    mode: Mode,
    doing: Doing,
    results: Vec<RowResult>,
    /// Paused between two rows.
    held: bool,
    ended: bool,
    on: u32,
}

impl QueueRun {
    /// `queue` before its first row. `outputs` are the names that may be switched, in index order.
    pub fn new(queue: Queue, outputs: Vec<String>, standing: Standing) -> Self {
        let cursor = QueueCursor::new(&queue);
        let results = vec![RowResult::default(); queue.rows().len()];
        let (mode, doing) = (Mode::Step, Doing::Nothing);
        Self { queue, outputs, standing, cursor, mode, doing, results, held: false, ended: false, on: 0 }
    }

    pub fn queue(&self) -> &Queue {
        &self.queue
    }

    /// Current or next row; none at the end.
    pub fn row(&self) -> Option<usize> {
        self.cursor.row(&self.queue)
    }

    /// One result per row.
    pub fn results(&self) -> &[RowResult] {
        &self.results
    }

    /// State of the drill, as reported.
    pub fn standing(&self) -> &Standing {
        &self.standing
    }

    /// True after completion, failure or stop.
    pub fn ended(&self) -> bool {
        self.ended
    }

    /// Rows executed; a repeated row counts each time.
    pub fn passed(&self) -> u32 {
        self.cursor.passed()
    }

    pub fn homes(&self) -> bool {
        matches!(self.doing, Doing::Homing(_))
    }

    pub fn drills(&self) -> bool {
        let command = self.row().and_then(|row| self.queue.rows().get(row)?.command.as_ref());
        matches!((&self.doing, command), (Doing::Moves(_), Some(WorkCommand::DrillDown)))
    }

    /// Cancels a pending [`QueueRun::hold`], and continues as far as `mode` allows.
    pub fn proceed(&mut self, mode: Mode) {
        self.mode = mode;
    }

    /// Holds after the current row.
    pub fn hold(&mut self) {
        self.mode = Mode::Step;
    }

    /// Starts or continues.
    pub fn go(&mut self, machine: &Machine, mode: Mode) -> Vec<QueueAction> {
        if self.doing != Doing::Nothing || self.ended {
            return Vec::new();
        }
        self.mode = mode;
        // A run that was held at a breakpoint must get past it.
        let at_once = self.held || mode == Mode::Step;
        self.held = false;
        self.rows(machine, at_once)
    }

    /// Executes rows until there is something to play, or a reason to rest. With `at_once`, the first row
    /// runs even at a breakpoint.
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

    fn end(&mut self, rest: Rest) -> Vec<QueueAction> {
        (self.doing, self.ended) = (Doing::Nothing, true);
        let on = std::mem::take(&mut self.on);
        let off =
            (0..32).filter(|bit| on >> bit & 1 == 1).map(|bit| QueueAction::Output { place: bit, on: false });
        off.chain([QueueAction::Rest(rest)]).collect()
    }

    /// Starts a row. If there is something to play, it is the last action.
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
                // A rest of one tick, to read the inputs.
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

    /// Raises the presser foot if it may be down, before X or Y moves.
    fn foot_up(&mut self, machine: &Machine) -> Vec<Segment> {
        let is_down = std::mem::take(&mut self.standing.foot_down);
        if is_down { work::foot(machine, self.standing.position, false) } else { Vec::new() }
    }

    fn homing_goes_on(&mut self, machine: &Machine, homing: Homing, next: HomingNext) -> Vec<QueueAction> {
        match next {
            HomingNext::Homed => Vec::new(),
            HomingNext::Play { segment, correction_steps: correction } => {
                let axis = homing.axis();
                // Until this axis is homed again, its position is unknown.
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

    /// Next actions after a report.
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
                        // A wrong count is found at the end of homing, and is correct from there on.
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

    /// `axis` is homed as soon as another axis starts homing, or all are done.
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
            let why = error!("queue.input_timeout", input = INPUTS[input as usize], ..);
            let why = why.with("state", STATES[usize::from(on)]).with("ms", ms);
            return self.fail(why, Harm::None);
        }
        let ms = left_ms.min(LOOK_MS);
        self.doing = Doing::Look(input, on, left_ms - ms);
        vec![QueueAction::Play(work::wait(self.standing.position, u64::from(ms) * TICKS_OF_MS))]
    }

    fn row_done(&mut self) -> Result<(), Diagnostic> {
        if let Some(result) = self.row().and_then(|row| self.results.get_mut(row)) {
            result.state = RowState::Done;
        }
        self.cursor.pass(&self.queue)
    }

    /// Ends the run because of STOP.
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
