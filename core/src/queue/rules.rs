//! Rules for each row in the current state of the machine, the state after the row, and the dry run of a
//! queue.
//!
//! ```text
//!         safe height ─────●── X and Y may move from here up
//!  board's surface ════════╪═════
//!                          ▼ below: only up, with the spindle turning
//! ```
//!
//! Used for the dry run, and again before every row. Moves nothing.

use super::blocks::{Queue, QueueCursor};
use super::words::{Axes, WorkCommand};
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::machine::{Machine, Steps, axis_name};
use crate::motion::cycles;
use crate::units::Length;

#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Standing {
    pub position: Steps,
    /// Work zero of X and Y in machine steps; none if it isn't set.
    pub zero: Option<[i64; 2]>,
    /// Homed axes: X, Y, Z.
    pub homed: [bool; 3],
    /// Spindle speed, rpm.
    pub rpm: u32,
    /// The presser foot is down, or may be.
    pub foot_down: bool,
}

impl Standing {
    /// State after homing, with the work zero at the rest position.
    pub fn just_homed(machine: &Machine) -> Self {
        let mut position = Steps::default();
        for axis in [0, 1].into_iter().chain(cycles::together(machine, 2)) {
            position[axis] = cycles::home_place(machine, axis);
        }
        Self { position, zero: Some([position[0], position[1]]), homed: [true; 3], rpm: 0, foot_down: false }
    }

    pub fn all_homed(&self) -> bool {
        self.homed == [true; 3]
    }
}

pub(super) fn z_steps(machine: &Machine, height: Length) -> i64 {
    machine.z.scale.steps(machine.process.surface) + machine.z.scale.steps(height)
}

/// Machine steps of Z, with level spindles, at which every tip is at least at its safe height.
fn all_safe(machine: &Machine) -> i64 {
    z_steps(machine, machine.process.safe_height) + machine.reach()
}

/// State after `command`, or why it is forbidden. `outputs` are the names that may be switched.
pub fn after(
    command: &WorkCommand,
    machine: &Machine,
    outputs: &[String],
    standing: &Standing,
) -> Result<Standing, Diagnostic> {
    let mut next = standing.clone();
    match command {
        WorkCommand::MoveBy { dx, dy } => {
            may_travel(machine, standing)?;
            let to = [standing.position[0].saturating_add(*dx), standing.position[1].saturating_add(*dy)];
            travel(machine, &mut next, to, ["dX", "dY"])?;
            next.foot_down = false;
        }
        WorkCommand::MoveTo { x, y } => {
            may_travel(machine, standing)?;
            let zero = standing.zero.ok_or_else(|| error!("queue.no_zero", ..))?;
            let to = [zero[0] + machine.x.scale.steps(*x), zero[1] + machine.y.scale.steps(*y)];
            travel(machine, &mut next, to, ["X", "Y"])?;
            next.foot_down = false;
        }
        WorkCommand::DrillDown => {
            homed(standing, &[2])?;
            if standing.rpm == 0 {
                return Err(error!("queue.spindle_off", ..));
            }
            let bottoms = machine.bottoms(bottom(machine));
            for axis in machine.spindle_axes() {
                inside(machine, 2, bottoms[axis], "")?;
                next.position[axis] = standing.position[axis].min(bottoms[axis]);
            }
            next.foot_down = machine.foot.on;
        }
        WorkCommand::DrillUp => {
            homed(standing, &[2])?;
            let safe = all_safe(machine);
            inside(machine, 2, safe, "")?;
            let above = standing.position[2].max(safe);
            machine.spindle_axes().for_each(|axis| next.position[axis] = above);
            next.foot_down = false;
        }
        WorkCommand::Home { axes } => home(machine, &mut next, *axes)?,
        WorkCommand::Park => park(machine, &mut next)?,
        WorkCommand::Output { name, on, pulse_ms } => {
            if !outputs.contains(name) {
                let known = if outputs.is_empty() { "–".to_owned() } else { outputs.join(", ") };
                let why = error!("queue.no_such_output", name = name, ..).with("field", "name");
                return Err(why.with("known", known));
            }
            if machine.foot.on && *name == machine.foot.output {
                // A pulse moves the foot, so it may be down afterwards.
                next.foot_down = *on || pulse_ms.is_some();
            }
        }
        WorkCommand::Spindle { rpm } => {
            if *rpm == 0 && tip_in_board(machine, standing) {
                return Err(error!("queue.spindle_off_in_board", ..).with("field", "rpm"));
            }
            next.rpm = *rpm;
        }
        WorkCommand::Wait { .. }
        | WorkCommand::WaitInput { .. }
        | WorkCommand::Repeat { .. }
        | WorkCommand::Sub { .. }
        | WorkCommand::Call { .. }
        | WorkCommand::End => {}
    }
    Ok(next)
}

/// Bottom of stroke of all spindles, over the board's surface.
pub(super) fn bottom(machine: &Machine) -> Length {
    let process = &machine.process;
    Length::ZERO - process.board_thickness - process.breakthrough
}

fn tip_in_board(machine: &Machine, standing: &Standing) -> bool {
    standing.homed[2] && machine.lowest(&standing.position) < z_steps(machine, Length::ZERO)
}

fn home(machine: &Machine, next: &mut Standing, axes: Axes) -> Result<(), Diagnostic> {
    for &axis in axes.in_order() {
        if axis < 2 {
            // X and Y home at full travel, so the tip must be known to be up.
            homed(next, &[2])?;
            tip_up(machine, next)?;
            next.foot_down = false;
        }
        next.homed[axis] = true;
        for axis in cycles::together(machine, axis) {
            next.position[axis] = cycles::home_place(machine, axis);
        }
    }
    Ok(())
}

/// Tips up, spindle off, then to the park position.
fn park(machine: &Machine, next: &mut Standing) -> Result<(), Diagnostic> {
    homed(next, &[0, 1, 2])?;
    let top = cycles::top(machine);
    machine.spindle_axes().for_each(|axis| next.position[axis] = next.position[axis].max(top));
    next.position[..2].copy_from_slice(&cycles::park_place(machine));
    (next.rpm, next.foot_down) = (0, false);
    Ok(())
}

fn homed(standing: &Standing, axes: &[usize]) -> Result<(), Diagnostic> {
    match axes.iter().find(|axis| !standing.homed[**axis]) {
        None => Ok(()),
        Some(axis) => Err(error!("queue.not_homed", axis = axis_name(*axis), ..)),
    }
}

fn tip_up(machine: &Machine, standing: &Standing) -> Result<(), Diagnostic> {
    let safe = z_steps(machine, machine.process.safe_height);
    let lowest = machine.lowest(&standing.position);
    if lowest >= safe {
        return Ok(());
    }
    let height = machine.z.scale.length(lowest) - machine.process.surface;
    Err(error!("queue.tip_low", height = height.mm(), safe = machine.process.safe_height.mm(), ..))
}

fn may_travel(machine: &Machine, standing: &Standing) -> Result<(), Diagnostic> {
    homed(standing, &[0, 1, 2])?;
    tip_up(machine, standing)
}

fn travel(machine: &Machine, next: &mut Standing, to: [i64; 2], fields: [&str; 2]) -> Result<(), Diagnostic> {
    for axis in [0, 1] {
        // After homing, an axis may rest on its switch, one step outside the range. That position is allowed.
        if to[axis] != next.position[axis] {
            inside(machine, axis, to[axis], fields[axis])?;
        }
        next.position[axis] = to[axis];
    }
    Ok(())
}

fn inside(machine: &Machine, axis: usize, place: i64, field: &str) -> Result<(), Diagnostic> {
    let settings = machine.axis(axis);
    let (low, high) = (settings.scale.steps(settings.min), settings.scale.steps(settings.max));
    if (low..=high).contains(&place) {
        return Ok(());
    }
    let mm = |steps: i64| settings.scale.length(steps).mm();
    let why = error!("queue.outside", axis = axis_name(axis), field = field, ..);
    Err(why.with("place", mm(place)).with("low", settings.min.mm()).with("high", settings.max.mm()))
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CheckedQueue {
    /// Rows executed; a repeated row counts each time.
    pub rows: u32,
    pub strokes: u32,
    /// Lowest position of X and Y after any row that moves them, machine steps; none if no row does.
    pub lowest: Option<[i64; 2]>,
    pub highest: Option<[i64; 2]>,
    pub end: Standing,
}

/// Checks `queue` from its first row, through every repeat and call. The first forbidden row is refused
/// before anything moves. `outputs` are the names that may be switched.
pub fn check(
    queue: &Queue,
    machine: &Machine,
    outputs: &[String],
    standing: &Standing,
) -> Result<CheckedQueue, Diagnostic> {
    let mut cursor = QueueCursor::new(queue);
    let mut done = CheckedQueue { rows: 0, strokes: 0, lowest: None, highest: None, end: standing.clone() };
    if cursor.row(queue).is_none() {
        return Err(error!("queue.empty"));
    }
    while let Some(row) = cursor.row(queue) {
        let turn = cursor.passed() + 1;
        let placed = |why: Diagnostic| {
            let line = u32::try_from(row + 1).unwrap_or(u32::MAX);
            why.with("row", line).with("turn", turn).at("", line, 1)
        };
        if let Some(command) = &queue.rows()[row].command {
            done.end = after(command, machine, outputs, &done.end).map_err(placed)?;
            match command {
                WorkCommand::MoveBy { .. }
                | WorkCommand::MoveTo { .. }
                | WorkCommand::Home { .. }
                | WorkCommand::Park => {
                    let at = [done.end.position[0], done.end.position[1]];
                    let low = done.lowest.unwrap_or(at);
                    let high = done.highest.unwrap_or(at);
                    done.lowest = Some([low[0].min(at[0]), low[1].min(at[1])]);
                    done.highest = Some([high[0].max(at[0]), high[1].max(at[1])]);
                }
                WorkCommand::DrillDown => done.strokes += 1,
                _ => {}
            }
        }
        cursor.pass(queue).map_err(placed)?;
    }
    done.rows = cursor.passed();
    Ok(done)
}
