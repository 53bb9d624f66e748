//! Runs a queue on pins without an executor: the page steps it on a virtual drill, without hardware or
//! bridge.
//!
//! ```text
//! Run ── Play ──▶ pins::play ──▶ Pins (VirtualDrill)         time passes as fast as it is computed
//!  ▲                  │
//!  └──── report ◀─────┘
//! ```

use super::rules::Standing;
use super::run::{Mode, QueueAction, QueueRun, Rest};
use super::text::read;
use super::work::QueueReport;
use crate::diagnostic::Diagnostic;
use crate::error;
use crate::machine::{Machine, Steps};
use crate::motion::cycles;
use crate::pins::{Clock, Motors, Operator, Order, Outcome, Pins, Playhead, play};
use crate::steps::Segment;

/// State of a drill between two queues.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rig {
    /// State of its executor.
    pub line: Playhead,
    /// State that the queue rules know.
    pub standing: Standing,
}

impl Rig {
    /// A drill that was just homed, with the work zero at its rest position.
    pub fn homed(machine: &Machine, pins: &mut dyn Pins) -> Result<Self, Diagnostic> {
        let home = read("", "HOME ALL").map_err(|whys| whys.into_iter().next());
        let home = home.map_err(|why| why.unwrap_or_else(|| error!("queue.empty")))?;
        let mut rehearsal = Rehearsal::new(home, Vec::new(), Self::default());
        match rehearsal.go(machine, Mode::ToEnd, pins, usize::MAX) {
            Some(Rest::Failed { why, .. }) => Err(why),
            _ => {
                let mut bench = rehearsal.bench();
                bench.standing.zero = Some([bench.standing.position[0], bench.standing.position[1]]);
                Ok(bench)
            }
        }
    }
}

/// A queue that runs on pins.
#[derive(Clone, Debug)]
pub struct Rehearsal {
    run: QueueRun,
    line: Playhead,
    next: Option<Vec<Segment>>,
    trail: Vec<(usize, Steps)>,
}

impl Rehearsal {
    /// `queue` before its first row, on a drill in the state `bench`.
    pub fn new(queue: super::Queue, outputs: Vec<String>, bench: Rig) -> Self {
        let run = QueueRun::new(queue, outputs, bench.standing);
        Self { run, line: bench.line, next: None, trail: Vec::new() }
    }

    pub fn run(&self) -> &QueueRun {
        &self.run
    }

    /// Row and machine steps at the end of every segment, in order.
    pub fn trail(&self) -> &[(usize, Steps)] {
        &self.trail
    }

    /// Current state of the drill.
    pub fn bench(&self) -> Rig {
        Rig { line: self.line, standing: self.run.standing().clone() }
    }

    /// Runs as far as `mode` allows, for at most `pieces` segments. None if more remains: then call again.
    pub fn go(&mut self, machine: &Machine, mode: Mode, pins: &mut dyn Pins, pieces: usize) -> Option<Rest> {
        let mut actions = match self.next.take() {
            Some(segments) => vec![QueueAction::Play(segments)],
            None => self.run.go(machine, mode),
        };
        let mut left = pieces;
        loop {
            let mut segments = None;
            for action in actions {
                match action {
                    QueueAction::Output { place, on } => pins.output(self.line.tick, place, on),
                    QueueAction::Correct { axis, steps } => {
                        for axis in cycles::together(machine, axis) {
                            self.line.position[axis] += steps;
                        }
                    }
                    QueueAction::Play(wanted) => segments = Some(wanted),
                    QueueAction::Rest(rest) => return Some(rest),
                }
            }
            let segments = segments?;
            if left == 0 {
                self.next = Some(segments);
                return None;
            }
            left -= 1;
            let report = self.play(machine, &segments, pins);
            if let Some(row) =
                self.run.row().filter(|_| segments.iter().any(|segment| !segment.runs.is_empty()))
            {
                self.trail.push((row, report.position));
            }
            actions = self.run.reported(machine, &report);
        }
    }

    fn play(&mut self, machine: &Machine, segments: &[Segment], pins: &mut dyn Pins) -> QueueReport {
        let motors = Motors::of(machine);
        let start = self.line.tick;
        let mut outcome = Outcome::Completed;
        for segment in segments {
            outcome = play(segment, &motors, &mut self.line, pins, &mut AtOnce, &mut Nobody);
            if outcome != Outcome::Completed {
                break;
            }
        }
        let inputs = pins.inputs(self.line.tick);
        QueueReport { outcome, position: self.line.position, inputs, ticks: self.line.tick - start }
    }
}

/// A clock that is never late: time passes as fast as it is computed.
struct AtOnce;

impl Clock for AtOnce {
    fn now(&mut self) -> u64 {
        0
    }
    fn wait_until(&mut self, tick: u64) -> u64 {
        tick
    }
}

struct Nobody;

impl Operator for Nobody {
    fn order(&mut self) -> Order {
        Order::Go
    }
    fn passed(&mut self, _tick: u64, _position: &Steps, _inputs: u32) {}
}
