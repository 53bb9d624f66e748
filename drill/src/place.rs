//! The executor itself: plays tasks, one after the other, on the pins that it alone owns. A coroutine: it gives way where its
//! clock or its orders do not wait by themselves.
//!
//! Comes in: messages. Goes out: calls on pins, one report a task, the latest place. Does not know who gives the tasks, nor in
//! which thread or process it is.

use crate::executor::{Ended, Glimpse, Instruction, Report, Shared, Task};
use annulus_core::job::Mark;
use annulus_core::machine::{Machine, Output, Steps};
use annulus_core::motion::cycles;
use annulus_core::pins::{
    Clock, Motors, Operator, Order, Outcome, Pins, Playhead, SpindleState, give_way, play_by_turns,
};
use annulus_core::queue::{Harm, guarded};
use annulus_core::steps::{Pulse, Segment, Stage, Switching, TICK_HZ, replay, segment};
use std::sync::Arc;
use std::time::Duration;

/// How often the latest place is left, in ticks: 2 ms.
const GLIMPSE: u64 = TICK_HZ / 500;

/// How long a tip in the board waits for the task that was to follow at once, where time is real. The virtual drill keeps its
/// own time: while it waits, none passes.
const PATIENCE: Duration = Duration::from_secs(2);

/// What comes of asking for the next order.
pub enum Next {
    /// This one.
    Order(Instruction),
    /// None yet: to be asked again.
    None,
    /// None came in time.
    Late,
    /// There will be no more.
    Over,
}

/// Where orders come from.
pub trait Orders {
    /// The next order. Who waits by itself waits for it, with no more than `patience` where there is one.
    fn next(&mut self, patience: Option<Duration>) -> Next;

    /// Something else has to happen first. Who waits by itself waits a moment.
    fn pause(&mut self) {}
}

/// What an executor owns.
pub struct Place {
    machine: Machine,
    motors: Motors,
    patience: Option<Duration>,
    line: Playhead,
    pins: Box<dyn Pins + Send>,
    clock: Box<dyn Clock + Send>,
    shared: Arc<Shared>,
    rpm: u32,
    /// As the last task said, as long as nothing unforeseen happened.
    lift_to: Option<i64>,
    /// The tip is in the board and another task was to follow at once.
    follows: bool,
}

impl Place {
    /// At rest, with nothing ordered yet.
    pub fn new(
        machine: &Machine,
        pins: Box<dyn Pins + Send>,
        clock: Box<dyn Clock + Send>,
        shared: Arc<Shared>,
    ) -> Self {
        let motors = Motors::of(machine);
        let patience = (machine.output != Output::Virtual).then_some(PATIENCE);
        let (machine, line) = (machine.clone(), Playhead::default());
        let (rpm, lift_to, follows) = (0, None, false);
        Self { machine, motors, patience, line, pins, clock, shared, rpm, lift_to, follows }
    }

    /// Does what is ordered until the end; `report` is called once a task.
    pub async fn run(mut self, mut orders: impl Orders, report: impl Fn(Report)) {
        self.leave(None);
        let mut starved = false;
        loop {
            // A tip that was to go on at once does not wait for ever where time is real.
            let message = match orders.next(self.patience.filter(|_| self.follows)) {
                Next::Order(message) => message,
                Next::None => {
                    give_way().await;
                    continue;
                }
                Next::Over => break,
                Next::Late => {
                    if std::mem::take(&mut self.follows) {
                        self.lift().await;
                        self.leave(None);
                        starved = true;
                    }
                    continue;
                }
            };
            match message {
                Instruction::Task(task) if std::mem::take(&mut starved) => {
                    report(self.report(&task, 0, Ended::Starved, self.line.tick));
                }
                Instruction::Task(task) => {
                    let done = self.task(&task, &mut orders).await;
                    // Who hears the report also sees the place at which it ended.
                    self.leave(None);
                    report(done);
                }
                Instruction::Correct { axis, steps } => self.line.position[axis] += steps,
                Instruction::Spindle { rpm } => {
                    self.pins.spindle(self.line.tick, rpm);
                    self.rpm = rpm;
                }
                Instruction::Output { place, on } => self.pins.output(self.line.tick, place, on),
                Instruction::Bit(bit) => self.pins.bit(self.line.tick, &bit),
                Instruction::Stock(stock) => self.pins.stock(self.line.tick, &stock),
                Instruction::Abandon => {
                    self.lift().await;
                    break;
                }
                Instruction::Finish => break,
            }
            self.leave(None);
        }
        self.pins.safe();
    }

    async fn task(&mut self, task: &Task, orders: &mut impl Orders) -> Report {
        let start = self.line.tick;
        let (mut completed, mut ended) = (0, Ended::Completed);
        for segment in &task.segments {
            if let Switching::Spindle { rpm } = segment.effect {
                self.rpm = rpm;
            }
            self.leave(Some(segment));
            ended = match self.may_begin(task, segment, orders).await {
                Ok(()) => self.play(task, segment).await,
                Err(ended) => ended,
            };
            self.pins.rest(self.line.tick);
            if ended != Ended::Completed {
                break;
            }
            completed += 1;
        }
        let foreseen = match ended {
            Ended::Guarded(input) => guarded(input).1 == Harm::None,
            ended => !matches!(ended, Ended::Late { .. }),
        };
        self.lift_to = task.lift_to.filter(|_| foreseen);
        self.follows = task.follows && foreseen && task.is_low(&self.machine, &self.line.position);
        self.report(task, completed, ended, start)
    }

    fn report(&mut self, task: &Task, completed: usize, ended: Ended, since: u64) -> Report {
        let inputs = self.pins.inputs(self.line.tick);
        let ticks = self.line.tick - since;
        let Playhead { position, down, .. } = self.line;
        Report { id: task.id, completed, ended, position, down, inputs, ticks }
    }

    /// Lifts the tip where the position is trusted, whatever was ordered to stop.
    async fn lift(&mut self) {
        let Some(top) = self.lift_to.filter(|top| self.machine.lowest(&self.line.position) < *top) else {
            return;
        };
        let Ok(way) = cycles::retract(&self.machine, self.line.position, top) else { return };
        for planned in &way.moves {
            let segment = segment(planned, &self.machine);
            let (pins, clock) = (&mut *self.pins, &mut *self.clock);
            play_by_turns(&segment, &self.motors, &mut self.line, pins, clock, &mut Nobody).await;
            self.pins.rest(self.line.tick);
        }
    }

    /// Waits until every earlier leg is durable where the tip is about to go down, and until the spindle turns as it is to: a bit
    /// that stands, or turns too slowly, does not go into the board. A move from hole to hole lifts the tip first: it waits, if
    /// it has to, when it is about to leave for the next hole.
    async fn may_begin(
        &mut self,
        task: &Task,
        segment: &Segment,
        orders: &mut impl Orders,
    ) -> Result<(), Ended> {
        let goes_down = matches!(segment.stage, Stage::Approach | Stage::Drill);
        let stroke = goes_down && matches!(segment.mark, Mark::Hole(_));
        let switches = matches!(segment.effect, Switching::Spindle { .. });
        let cuts = goes_down || matches!(segment.stage, Stage::NextHole | Stage::Mill);
        loop {
            if self.shared.stopped() >= task.id {
                return Err(Ended::Stopped);
            }
            let turns = match self.pins.spindle_state() {
                // What lifts the bit, and what switches the spindle, may always begin.
                SpindleState::Lost { trouble } if segment.stage != Stage::Retract && !switches => {
                    return Err(Ended::Spindle { trouble });
                }
                SpindleState::Reaching { .. } => !cuts,
                _ => true,
            };
            if turns && (!stroke || self.shared.durable() >= task.needs_durable) {
                return Ok(());
            }
            orders.pause();
            give_way().await;
        }
    }

    async fn play(&mut self, task: &Task, segment: &Segment) -> Ended {
        let hole = segment.stage == Stage::NextHole && matches!(segment.mark, Mark::Hole(_));
        let begins = if hole { next_hole_begins(segment) } else { None };
        let mut operator = Counter {
            id: task.id,
            shared: &self.shared,
            left: 0,
            now: self.line.tick,
            next_hole: begins.map(|tick| (self.line.tick + tick, task.needs_durable)),
            granted: task.granted,
        };
        // Where the tip must touch is counted from the board as it lies there.
        let within = self.motors.touches_within.map(|ends| ends.map(|steps| steps + task.board_steps));
        let motors = Motors { touches_within: within, ..self.motors };
        let (pins, clock) = (&mut *self.pins, &mut *self.clock);
        let outcome = play_by_turns(segment, &motors, &mut self.line, pins, clock, &mut operator).await;
        match outcome {
            Outcome::Completed => Ended::Completed,
            Outcome::Gated(at) => Ended::Gated(at),
            Outcome::Unmet(gate) => Ended::Unmet(gate),
            Outcome::Guarded(input) => Ended::Guarded(input),
            Outcome::Missing(input) => Ended::Missing(input),
            Outcome::Early { at } => Ended::Early { at },
            Outcome::Late { ticks } => Ended::Late { ticks },
            Outcome::Spindle { trouble } => Ended::Spindle { trouble },
            Outcome::Stopped => Ended::Stopped,
        }
    }

    /// Leaves a whole glimpse if nobody is looking.
    fn leave(&mut self, segment: Option<&Segment>) {
        let inputs = self.pins.inputs(self.line.tick);
        self.shared.try_glimpse(|glimpse| {
            *glimpse = Glimpse {
                position: self.line.position,
                inputs,
                touches: glimpse.touches,
                other_firmware: glimpse.other_firmware,
                rpm: self.rpm,
                spindle: glimpse.spindle,
                stage: segment.map(|segment| segment.stage),
                end: segment.map_or(glimpse.end, |segment| segment.end),
            };
        });
    }
}

/// Tick of a move from hole to hole at which the plane leaves for the next hole, or the tip goes down to it.
fn next_hole_begins(segment: &Segment) -> Option<u64> {
    const PLANE: u8 = 0b11;
    let leaves = |pulse: &Pulse| pulse.axes & PLANE != 0 || pulse.axes & !pulse.forward & !PLANE != 0;
    replay(segment).find(leaves).map(|pulse| pulse.tick)
}

/// The operator when nobody is left.
struct Nobody;

impl Operator for Nobody {
    fn order(&mut self) -> Order {
        Order::Go
    }

    fn passed(&mut self, _: u64, _: &Steps, _: u32) {}
}

/// The operator of one task.
struct Counter<'a> {
    id: u64,
    shared: &'a Shared,
    left: u64,
    /// Stream time of the last look.
    now: u64,
    /// From this tick on it goes to the next hole: only when so many legs are durable.
    next_hole: Option<(u64, u32)>,
    /// It goes only as long as it is granted.
    granted: bool,
}

impl Operator for Counter<'_> {
    fn order(&mut self) -> Order {
        if self.shared.stopped() >= self.id {
            return Order::Stop;
        }
        let waits = |(tick, legs)| self.now >= tick && self.shared.durable() < legs;
        if self.next_hole.is_some_and(waits) {
            return Order::Hold;
        }
        let granted = if self.granted { self.shared.granted() } else { Order::Go };
        if granted != Order::Go {
            return granted;
        }
        match self.shared.feed_override() {
            100 => Order::Go,
            percent => Order::At { percent },
        }
    }

    fn passed(&mut self, tick: u64, position: &Steps, inputs: u32) {
        self.now = tick;
        if tick < self.left + GLIMPSE {
            return;
        }
        self.left = tick;
        self.shared.try_glimpse(|glimpse| {
            (glimpse.position, glimpse.inputs) = (*position, inputs);
        });
    }
}
