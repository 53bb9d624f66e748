//! Plays the owner's tasks and orders on an adapter, one after the other.

use super::greet;
use super::line::AdapterLine;
use super::path::guard;
use super::play::{Adapter, NO_TASK};
use crate::executor::{Ended, Instruction, Report, Shared, Task};
use crate::place::{Next, Orders};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::{Input, Mark};
use annulus_core::machine::Machine;
use annulus_core::motion::cycles;
use annulus_core::steps::{Segment, Stage, Switching, segment};
use annulus_link::message::Welcome;
use std::sync::Arc;
use std::time::Duration;

/// How long a tool in the board waits for the task that was announced to follow at once.
const PATIENCE: Duration = Duration::from_secs(2);

#[derive(Default)]
struct Memory {
    /// Height to which the tool may be lifted, from the last task; `None` after anything unexpected.
    lift_to: Option<i64>,
    /// Since when the tool waits in the board for an announced task.
    follows: Option<Duration>,
    /// The announced task did not arrive, and the tool was lifted.
    starved: bool,
}

pub async fn greeted(line: &mut AdapterLine, machine: &Machine) -> Result<Welcome, Diagnostic> {
    greet::ready(line, machine).await
}

/// Carries out orders until the last one, on the adapter of `machine` on `line`, which [`greeted`] made
/// ready. Calls `report` once per task. After an error the caller has nothing to make safe: an adapter that
/// hears nothing stops and turns its outputs off. Never blocks on `orders`; only the line is awaited.
pub async fn attend(
    line: AdapterLine,
    machine: &Machine,
    shared: &Arc<Shared>,
    mut orders: impl Orders,
    report: impl Fn(Report),
) -> Result<(), Diagnostic> {
    let mut adapter = Adapter::new(machine, line, Arc::clone(shared));
    let ended = run(&mut adapter, &mut orders, &report).await;
    adapter.rest();
    ended
}

async fn run(
    adapter: &mut Adapter,
    orders: &mut impl Orders,
    report: &impl Fn(Report),
) -> Result<(), Diagnostic> {
    let mut memory = Memory::default();
    adapter.leave(None);
    loop {
        adapter.task = NO_TASK;
        let message = match orders.next(None) {
            Next::Order(message) => message,
            Next::Over => break,
            Next::None | Next::Late => {
                adapter.turn().await?;
                let now = adapter.line.now();
                if memory.follows.is_some_and(|since| now.saturating_sub(since) >= PATIENCE) {
                    memory.follows = None;
                    lift(adapter, memory.lift_to).await?;
                    memory.starved = true;
                }
                adapter.leave(None);
                continue;
            }
        };
        match message {
            Instruction::Task(given) if std::mem::take(&mut memory.starved) => {
                report(report_of(adapter, &given, 0, Ended::Starved));
            }
            Instruction::Task(given) => {
                let done = task(adapter, &given, &mut memory).await?;
                adapter.leave(None);
                report(done);
            }
            Instruction::Correct { axis, steps } => {
                if let Some(place) = adapter.position.get_mut(axis) {
                    *place += steps;
                }
            }
            Instruction::Spindle { rpm } => adapter.spindle(rpm).await?,
            Instruction::Output { on, .. } => adapter.output(on).await?,
            Instruction::Bit(_) | Instruction::Stock(_) => {}
            Instruction::Abandon => {
                lift(adapter, memory.lift_to).await?;
                break;
            }
            Instruction::Finish => break,
        }
    }
    // Send "outputs off" in case the adapter still listens; without a line it turns them off itself.
    let _ = adapter.safe().await;
    Ok(())
}

fn report_of(adapter: &Adapter, task: &Task, completed: usize, ended: Ended) -> Report {
    let (position, down, inputs, ticks) = (adapter.position, adapter.down, adapter.inputs(), adapter.ticks);
    Report { id: task.id, completed, ended, position, down, inputs, ticks }
}

async fn task(adapter: &mut Adapter, task: &Task, memory: &mut Memory) -> Result<Report, Diagnostic> {
    (adapter.task, adapter.ticks, memory.follows) = (task.id, 0, None);
    let (mut completed, mut ended) = (0, Ended::Completed);
    while let Some(segment) = task.segments.get(completed) {
        if let Switching::Spindle { rpm } = segment.effect {
            adapter.spindle(rpm).await?;
        }
        if !may_begin(adapter, task, segment).await? {
            ended = Ended::Stopped;
            break;
        }
        let later = task.segments.get(completed..).unwrap_or_default();
        let together = together(adapter, task, later);
        ended = adapter.play(later.get(..together).unwrap_or_default(), task.granted).await?;
        if ended != Ended::Completed {
            break;
        }
        completed += together;
    }
    let foreseen = !matches!(ended, Ended::Guarded(_) | Ended::RanDry);
    memory.lift_to = task.lift_to.filter(|_| foreseen);
    let follows = task.follows && foreseen && task.is_low(&adapter.machine, &adapter.position);
    memory.follows = follows.then(|| adapter.line.now());
    Ok(report_of(adapter, task, completed, ended))
}

/// Returns `true` if the tool is about to go down to a hole.
fn is_stroke(segment: &Segment) -> bool {
    matches!(segment.stage, Stage::Approach | Stage::Drill | Stage::NextHole)
        && matches!(segment.mark, Mark::Hole(_))
}

/// Before the tool goes down, waits until every earlier leg is durable. Returns `false` if the task was
/// stopped.
async fn may_begin(adapter: &mut Adapter, task: &Task, segment: &Segment) -> Result<bool, Diagnostic> {
    loop {
        if adapter.shared.stopped() >= task.id {
            return Ok(false);
        }
        if !is_stroke(segment) || adapter.shared.durable() >= task.needs_durable {
            return Ok(true);
        }
        adapter.turn().await?;
    }
}

/// How many segments the adapter may play without a stop. The series ends before a segment that switches an
/// output, has a gate or must wait for the journal. The series also ends if a guarded sensor is already on,
/// or if only one of two segments may touch the board.
fn together(adapter: &Adapter, task: &Task, segments: &[Segment]) -> usize {
    let (inputs, is_durable) = (adapter.inputs(), adapter.shared.durable() >= task.needs_durable);
    let wiring = &adapter.machine.adapter;
    let shuns_board = |segment: &Segment| wiring.wired(guard(segment) & Input::Contact.bit());
    let joins = |first: &Segment, segment: &Segment| {
        let waits = is_stroke(segment) && !is_durable;
        let is_free = guard(segment) & inputs == 0 && shuns_board(segment) == shuns_board(first);
        segment.gate.is_none() && segment.effect == Switching::None && is_free && !waits
    };
    match segments.split_first() {
        Some((first, later)) if first.gate.is_none() => {
            1 + later.iter().take_while(|segment| joins(first, segment)).count()
        }
        Some(_) => 1,
        None => 0,
    }
}

/// Lifts the tool if the position is trusted, even after a stop.
async fn lift(adapter: &mut Adapter, to: Option<i64>) -> Result<(), Diagnostic> {
    let Some(top) = to.filter(|top| adapter.position[2] < *top) else { return Ok(()) };
    let Ok(way) = cycles::retract(&adapter.machine, adapter.position, top) else { return Ok(()) };
    let machine = adapter.machine.clone();
    let segments: Vec<Segment> = way.moves.iter().map(|planned| segment(planned, &machine)).collect();
    adapter.task = NO_TASK;
    adapter.play(&segments, false).await.map(drop)
}
