//! The executor: plays tasks on pins that it owns alone. A coroutine that yields if its clock or its orders
//! do not block.

use crate::executor::{Ended, Glimpse, Instruction, Report, Shared, Task};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::Mark;
use annulus_core::machine::{Machine, Output, Steps};
use annulus_core::motion::{Timeline, cycles};
use annulus_core::pins::{
    Clock, Motors, Operator, Order, Outcome, Pins, Playhead, SpindleState, give_way, play_by_turns,
    play_on_by_turns,
};
use annulus_core::queue::{Harm, guarded};
use annulus_core::steps::{Pulse, Segment, Stage, Switching, TICK_HZ, replay, segment};
use std::sync::Arc;
use std::time::Duration;

/// How often the position is published, in ticks: 2 ms.
const GLIMPSE: u64 = TICK_HZ / 500;

/// On real hardware: how long a tool in the board waits for the task that was to follow at once. The
/// virtual drill's time stops while it waits.
const PATIENCE: Duration = Duration::from_secs(2);

pub enum Next {
    Order(Instruction),
    /// None yet: ask again.
    None,
    /// None within the patience.
    Late,
    /// No more orders will come.
    Over,
}

/// A source of orders.
pub trait Orders {
    /// Returns the next order. A blocking source waits for it, at most for `patience`, if given.
    fn next(&mut self, patience: Option<Duration>) -> Next;

    /// Something else must happen first. A blocking source waits a moment.
    fn pause(&mut self) {}
}

pub struct Place {
    machine: Machine,
    motors: Motors,
    patience: Option<Duration>,
    line: Playhead,
    pins: Box<dyn Pins + Send>,
    clock: Box<dyn Clock + Send>,
    shared: Arc<Shared>,
    rpm: u32,
    /// From the last task; `None` after anything unexpected.
    lift_to: Option<i64>,
    /// The tool is in the board, and another task should follow at once.
    follows: bool,
}

impl Place {
    /// A stopped executor without orders.
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

    /// Carries out orders until the last one; calls `report` once per task.
    pub async fn run(mut self, mut orders: impl Orders, report: impl Fn(Report)) {
        self.leave(None);
        let mut starved = false;
        loop {
            // On real hardware a tool that waits in the board must not wait forever.
            let message = match orders.next(self.patience.filter(|_| self.follows)) {
                Next::Order(message) => message,
                Next::None => {
                    give_way().await;
                    continue;
                }
                Next::Over => break,
                Next::Late => {
                    // Only once: a lifted tool may wait as long as it takes.
                    if std::mem::take(&mut self.follows) {
                        self.lift().await;
                        self.leave(None);
                        starved = true;
                    }
                    continue;
                }
            };
            match message {
                // Its first move no longer starts where the tool is: the tool was lifted.
                Instruction::Task(task) if std::mem::take(&mut starved) => {
                    report(self.report(&task, 0, Ended::Starved, self.line.tick));
                }
                Instruction::Task(task) => {
                    let done = self.task(&task, &mut orders).await;
                    // Publish first: the report's receiver must see the final position.
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
                Ok(()) => self.play(task, segment, orders).await,
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

    /// Lifts the tool if the position is trusted, even after a stop.
    async fn lift(&mut self) {
        // A tool that is already higher must not go down.
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

    /// Before the tool goes down: waits until every earlier leg is durable and the spindle is at speed. No
    /// stopped or slow tool may enter the board. A move between holes first lifts the tool, so it waits
    /// later, before it leaves for the next hole.
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
                // Retracting the tool and switching the spindle may always start.
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

    /// Plays a segment. On a toolpath it may be interrupted by a lift and continued.
    async fn play(&mut self, task: &Task, segment: &Segment, orders: &mut impl Orders) -> Ended {
        let mut made = 0;
        loop {
            match self.play_on(task, segment, made).await {
                Outcome::Left { pulses } => made = pulses,
                outcome => return ended(outcome),
            }
            if let Err(ended) = self.lifted(task, segment, orders).await {
                return ended;
            }
        }
    }

    /// Lifts the tool and stops the spindle; undoes both when the hold ends, at the same position.
    async fn lifted(
        &mut self,
        task: &Task,
        segment: &Segment,
        orders: &mut impl Orders,
    ) -> Result<(), Ended> {
        let on_path = self.line.position;
        // The tool first leaves the board: one that stops in it may break.
        if let Some(top) = task.lift_to.filter(|top| self.machine.lowest(&on_path) < *top) {
            self.way(task, cycles::retract(&self.machine, on_path, top)).await?;
        }
        let rpm = std::mem::take(&mut self.rpm);
        self.pins.spindle(self.line.tick, 0);
        self.pins.rest(self.line.tick);
        self.leave(Some(segment));
        while self.shared.is_held(task.id) {
            if self.shared.stopped() >= task.id {
                return Err(Ended::Stopped);
            }
            let held = self.shared.holds();
            self.shared.change_glimpse(|glimpse| (glimpse.held, glimpse.lifted) = (held, true));
            orders.pause();
            give_way().await;
        }
        self.shared.change_glimpse(|glimpse| (glimpse.held, glimpse.lifted) = (0, false));
        self.rpm = rpm;
        // At speed before it goes down.
        self.turn_again(task, rpm, orders).await?;
        self.way(task, cycles::back_down(&self.machine, self.line.position, on_path)).await?;
        self.leave(Some(segment));
        Ok(())
    }

    /// Starts the spindle and waits until it reaches its speed.
    async fn turn_again(&mut self, task: &Task, rpm: u32, orders: &mut impl Orders) -> Result<(), Ended> {
        if rpm == 0 {
            return Ok(());
        }
        let duration_ticks = (self.machine.process.spin_up_ms * 1e-3 * TICK_HZ as f64) as u64;
        let on = Segment {
            leg: 0,
            mark: Mark::Prepare,
            stage: Stage::Dwell,
            duration_ticks,
            runs: Vec::new(),
            effect: Switching::Spindle { rpm },
            gate: None,
            end: self.line.position,
        };
        self.step_aside(task, &on).await?;
        loop {
            match self.pins.spindle_state() {
                SpindleState::Lost { trouble } => return Err(Ended::Spindle { trouble }),
                SpindleState::Reaching { .. } if self.shared.stopped() < task.id => {}
                _ => return Ok(()),
            }
            orders.pause();
            give_way().await;
        }
    }

    /// Plays the move off the path, or back to it.
    async fn way(&mut self, task: &Task, way: Result<Timeline, Diagnostic>) -> Result<(), Ended> {
        // A move that cannot be planned is not made: it stays stopped.
        let Ok(way) = way else { return Err(Ended::Stopped) };
        for planned in &way.moves {
            let planned = segment(planned, &self.machine);
            self.step_aside(task, &planned).await?;
        }
        Ok(())
    }

    async fn step_aside(&mut self, task: &Task, segment: &Segment) -> Result<(), Ended> {
        self.leave(Some(segment));
        let mut operator = Aside { id: task.id, shared: &self.shared };
        let (pins, clock) = (&mut *self.pins, &mut *self.clock);
        let outcome = play_by_turns(segment, &self.motors, &mut self.line, pins, clock, &mut operator).await;
        self.pins.rest(self.line.tick);
        match ended(outcome) {
            Ended::Completed => Ok(()),
            other => Err(other),
        }
    }

    async fn play_on(&mut self, task: &Task, segment: &Segment, made: u64) -> Outcome {
        let hole = segment.stage == Stage::NextHole && matches!(segment.mark, Mark::Hole(_));
        let begins = if hole { next_hole_begins(segment) } else { None };
        let mut operator = Counter {
            id: task.id,
            shared: &self.shared,
            left: 0,
            now: self.line.tick,
            next_hole: begins.map(|tick| (self.line.tick + tick, task.needs_durable)),
            granted: task.granted,
            on_path: matches!(segment.mark, Mark::Toolpath(_)),
            in_board: matches!(segment.stage, Stage::Mill | Stage::Approach),
        };
        // The touch window is relative to the board's local height.
        let within = self.motors.touches_within.map(|ends| ends.map(|steps| steps + task.board_steps));
        let motors = Motors { touches_within: within, ..self.motors };
        let (pins, clock) = (&mut *self.pins, &mut *self.clock);
        play_on_by_turns(segment, made, &motors, &mut self.line, pins, clock, &mut operator).await
    }

    /// Publishes a full snapshot. During a task it is skipped while a reader holds the lock; at its end it
    /// waits, since nothing would publish the final position later.
    fn leave(&mut self, segment: Option<&Segment>) {
        let inputs = self.pins.inputs(self.line.tick);
        let latest = |glimpse: &mut Glimpse| {
            *glimpse = Glimpse {
                position: self.line.position,
                inputs,
                touches: glimpse.touches,
                other_firmware: glimpse.other_firmware,
                rpm: self.rpm,
                spindle: glimpse.spindle,
                held: 0,
                lifted: false,
                stage: segment.map(|segment| segment.stage),
                end: segment.map_or(glimpse.end, |segment| segment.end),
            };
        };
        match segment {
            Some(_) => self.shared.try_glimpse(latest),
            None => self.shared.change_glimpse(latest),
        }
    }
}

fn ended(outcome: Outcome) -> Ended {
    match outcome {
        Outcome::Completed => Ended::Completed,
        Outcome::Gated(at) => Ended::Gated(at),
        Outcome::Unmet(gate) => Ended::Unmet(gate),
        Outcome::Guarded(input) => Ended::Guarded(input),
        Outcome::Missing(input) => Ended::Missing(input),
        Outcome::Early { at } => Ended::Early { at },
        Outcome::Late { ticks } => Ended::Late { ticks },
        Outcome::Spindle { trouble } => Ended::Spindle { trouble },
        // Left for a lift and not continued: stopped.
        Outcome::Left { .. } | Outcome::Stopped => Ended::Stopped,
    }
}

/// In a move between holes, the tick at which X or Y starts to the next hole, or the tool starts down.
fn next_hole_begins(segment: &Segment) -> Option<u64> {
    const PLANE: u8 = 0b11;
    let leaves = |pulse: &Pulse| pulse.axes & PLANE != 0 || pulse.axes & !pulse.forward & !PLANE != 0;
    replay(segment).find(leaves).map(|pulse| pulse.tick)
}

/// The operator without an owner: never stops.
struct Nobody;

impl Operator for Nobody {
    fn order(&mut self) -> Order {
        Order::Go
    }

    fn passed(&mut self, _: u64, _: &Steps, _: u32) {}
}

struct Counter<'a> {
    id: u64,
    shared: &'a Shared,
    left: u64,
    /// Stream time of the last update.
    now: u64,
    /// From this tick on the move leaves for the next hole: only if this many legs are durable.
    next_hole: Option<(u64, u32)>,
    granted: bool,
    /// Follows a toolpath, on which it can be held.
    on_path: bool,
    /// The tool may be lifted here: the segment's own pulses alone decide the rest.
    in_board: bool,
}

/// The operator of a move off the path and back: only a stop ends it.
struct Aside<'a> {
    id: u64,
    shared: &'a Shared,
}

impl Operator for Aside<'_> {
    fn order(&mut self) -> Order {
        if self.shared.stopped() >= self.id { Order::Stop } else { Order::Go }
    }

    fn passed(&mut self, _: u64, position: &Steps, inputs: u32) {
        self.shared.try_glimpse(|glimpse| (glimpse.position, glimpse.inputs) = (*position, inputs));
    }
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
        if self.on_path && self.shared.is_held(self.id) {
            let leaves = self.in_board && self.shared.is_lifted(self.id);
            return if leaves { Order::Leave } else { Order::Hold };
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

    fn holds(&mut self) {
        let held = if self.on_path && self.shared.is_held(self.id) { self.shared.holds() } else { 0 };
        self.shared.try_glimpse(|glimpse| glimpse.held = held);
    }
}
