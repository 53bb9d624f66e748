//! The executor's thread: plays tasks, one after the other, on the pins that it alone owns.
//!
//! Comes in: messages through a bounded ring. Goes out: calls on pins, one report a task, the latest place. Does not know
//! who gives the tasks, nor in which process it is.

use super::{Ended, Glimpse, Report, Shared, Task};
use annulus_core::job::{Bit, Mark};
use annulus_core::machine::{Machine, Output, Steps};
use annulus_core::motion::cycles;
use annulus_core::pins::{Clock, Line, Motors, Operator, Order, Outcome, Pins, play};
use annulus_core::steps::{Effect, Pulse, Segment, Stage, TICK_HZ, replay, segment};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Orders that fit into the ring.
const RING: usize = 16;

/// How often the latest place is left, in ticks: 2 ms.
const GLIMPSE: u64 = TICK_HZ / 500;

/// How long a tip in the board waits for the task that was to follow at once, where time is real. The virtual drill keeps its
/// own time: while it waits, none passes.
const PATIENCE: Duration = Duration::from_secs(2);

/// What the owner sends.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) enum Message {
    Task(Task),
    /// The count of an axis is off by so much.
    Correct(usize, i64),
    Spindle(u32),
    /// An output by its place among the machine's names.
    Output(u8, bool),
    /// A new bit is in the spindles.
    Bit(Bit),
    /// It ends, and there is nobody who could still make the machine safe.
    Abandon,
    Finish,
}

/// Starts the thread. `first` is done in it before anything else; `report` is called from it once a task.
pub(super) fn start(
    machine: &Machine,
    pins: Box<dyn Pins + Send>,
    clock: Box<dyn Clock + Send>,
    shared: Arc<Shared>,
    first: impl FnOnce() + Send + 'static,
    report: impl Fn(Report) + Send + 'static,
) -> std::io::Result<(SyncSender<Message>, JoinHandle<()>)> {
    let (ring, orders) = sync_channel(RING);
    let motors = Motors::of(machine);
    let patience = (machine.output != Output::Virtual).then_some(PATIENCE);
    let (machine, line) = (machine.clone(), Line::default());
    let (rpm, lift_to, follows) = (0, None, false);
    let place = Place { machine, motors, patience, line, pins, clock, shared, rpm, lift_to, follows };
    let builder = thread::Builder::new().name("executor".to_owned());
    let thread = builder.spawn(move || {
        first();
        place.run(&orders, report);
    })?;
    Ok((ring, thread))
}

/// What the thread owns.
struct Place {
    machine: Machine,
    motors: Motors,
    patience: Option<Duration>,
    line: Line,
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
    fn run(mut self, orders: &Receiver<Message>, report: impl Fn(Report)) {
        self.leave(None);
        let mut starved = false;
        loop {
            let message = match self.next(orders) {
                Ok(message) => message,
                Err(RecvTimeoutError::Disconnected) => break,
                Err(RecvTimeoutError::Timeout) => {
                    if std::mem::take(&mut self.follows) {
                        self.lift();
                        self.leave(None);
                        starved = true;
                    }
                    continue;
                }
            };
            match message {
                Message::Task(task) if std::mem::take(&mut starved) => {
                    report(self.report(&task, 0, Ended::Starved, self.line.tick));
                }
                Message::Task(task) => {
                    let done = self.task(&task);
                    // Who hears the report also sees the place at which it ended.
                    self.leave(None);
                    report(done);
                }
                Message::Correct(axis, steps) => self.line.position[axis] += steps,
                Message::Spindle(rpm) => {
                    self.pins.spindle(self.line.tick, rpm);
                    self.rpm = rpm;
                }
                Message::Output(place, on) => self.pins.output(self.line.tick, place, on),
                Message::Bit(bit) => self.pins.bit(self.line.tick, &bit),
                Message::Abandon => {
                    self.lift();
                    break;
                }
                Message::Finish => break,
            }
            self.leave(None);
        }
        self.pins.safe();
    }

    /// The next message. A tip that was to go on at once does not wait for ever where time is real.
    fn next(&self, orders: &Receiver<Message>) -> Result<Message, RecvTimeoutError> {
        match self.patience.filter(|_| self.follows) {
            Some(patience) => orders.recv_timeout(patience),
            None => orders.recv().map_err(|_| RecvTimeoutError::Disconnected),
        }
    }

    fn task(&mut self, task: &Task) -> Report {
        let start = self.line.tick;
        let (mut completed, mut ended) = (0, Ended::Completed);
        for segment in &task.segments {
            if let Effect::Spindle(rpm) = segment.effect {
                self.rpm = rpm;
            }
            self.leave(Some(segment));
            ended = if self.may_begin(task, segment) { self.play(task, segment) } else { Ended::Stopped };
            self.pins.rest(self.line.tick);
            if ended != Ended::Completed {
                break;
            }
            completed += 1;
        }
        let foreseen = !matches!(ended, Ended::Guarded(_) | Ended::Late(_));
        self.lift_to = task.lift_to.filter(|_| foreseen);
        let surface = self.machine.z.scale.steps(self.machine.process.surface);
        let is_low = self.line.position.iter().skip(2).any(|z| *z < surface);
        self.follows = task.follows && foreseen && is_low;
        self.report(task, completed, ended, start)
    }

    fn report(&mut self, task: &Task, completed: usize, ended: Ended, since: u64) -> Report {
        let inputs = self.pins.inputs(self.line.tick);
        let ticks = self.line.tick - since;
        let Line { position, down, .. } = self.line;
        Report { id: task.id, completed, ended, position, down, inputs, ticks }
    }

    /// Lifts the tip where the position is trusted, whatever was ordered to stop.
    fn lift(&mut self) {
        let Some(top) = self.lift_to.filter(|top| self.line.position[2] < *top) else { return };
        let Ok(way) = cycles::retract(&self.machine, self.line.position, top) else { return };
        for planned in &way.moves {
            let segment = segment(planned, &self.machine);
            let operator = &mut Nobody;
            play(&segment, &self.motors, &mut self.line, &mut *self.pins, &mut *self.clock, operator);
            self.pins.rest(self.line.tick);
        }
    }

    /// Waits until every earlier leg is durable where the tip is about to go down. A move from hole to hole lifts the tip first: it waits, if
    /// it has to, when it is about to leave for the next hole.
    fn may_begin(&self, task: &Task, segment: &Segment) -> bool {
        let goes_down = matches!(segment.stage, Stage::Approach | Stage::Drill);
        let stroke = goes_down && matches!(segment.mark, Mark::Hole(_));
        loop {
            if self.shared.stop_upto.load(Ordering::SeqCst) >= task.id {
                return false;
            }
            if !stroke || self.shared.durable.load(Ordering::SeqCst) >= task.needs_durable {
                return true;
            }
            thread::sleep(Duration::from_micros(100));
        }
    }

    fn play(&mut self, task: &Task, segment: &Segment) -> Ended {
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
        let outcome =
            play(segment, &self.motors, &mut self.line, &mut *self.pins, &mut *self.clock, &mut operator);
        match outcome {
            Outcome::Completed => Ended::Completed,
            Outcome::Gated(at) => Ended::Gated(at),
            Outcome::Unmet(gate) => Ended::Unmet(gate),
            Outcome::Guarded(input) => Ended::Guarded(input),
            Outcome::Late(ticks) => Ended::Late(ticks),
            Outcome::Stopped => Ended::Stopped,
        }
    }

    /// Leaves a whole glimpse if nobody is looking.
    fn leave(&mut self, segment: Option<&Segment>) {
        let inputs = self.pins.inputs(self.line.tick);
        if let Ok(mut glimpse) = self.shared.glimpse.try_lock() {
            *glimpse = Glimpse {
                position: self.line.position,
                inputs,
                rpm: self.rpm,
                stage: segment.map(|segment| segment.stage),
                end: segment.map_or(glimpse.end, |segment| segment.end),
            };
        }
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
        if self.shared.stop_upto.load(Ordering::Relaxed) >= self.id {
            return Order::Stop;
        }
        let waits = |(tick, legs)| self.now >= tick && self.shared.durable.load(Ordering::SeqCst) < legs;
        if self.next_hole.is_some_and(waits) {
            return Order::Hold;
        }
        let granted = if self.granted { self.shared.grant.order(Instant::now()) } else { Order::Go };
        if granted != Order::Go {
            return granted;
        }
        match self.shared.feed_override() {
            100 => Order::Go,
            percent => Order::At(percent),
        }
    }

    fn passed(&mut self, tick: u64, position: &Steps, inputs: u32) {
        self.now = tick;
        if tick < self.left + GLIMPSE {
            return;
        }
        self.left = tick;
        if let Ok(mut glimpse) = self.shared.glimpse.try_lock() {
            (glimpse.position, glimpse.inputs) = (*position, inputs);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::machine::virtual_drill;
    use annulus_core::pins::Recorder;
    use std::sync::mpsc::channel;

    /// A clock that is never late.
    struct Punctual(u64);

    impl Clock for Punctual {
        fn now(&mut self) -> u64 {
            self.0
        }
        fn wait_until(&mut self, tick: u64) -> u64 {
            self.0 = self.0.max(tick);
            tick
        }
    }

    fn way(machine: &Machine, from: Steps, z: i64) -> Vec<Segment> {
        let way = cycles::retract(machine, from, z).unwrap();
        way.moves.iter().map(|planned| segment(planned, machine)).collect()
    }

    /// How two tasks end: one that leaves the tip `depth` steps below the board's surface, and after a pause one that should
    /// have followed; and where the tip rests after each of them, from the surface.
    fn two_tasks(output: Output, follows: bool, depth: i64, pause: Duration) -> [(Ended, i64); 2] {
        let machine = Machine { output, ..virtual_drill() };
        let surface = machine.z.scale.steps(machine.process.surface);
        let (reports, heard) = channel();
        let report = move |report| {
            let _ = reports.send(report);
        };
        let pins = Box::<Recorder>::default();
        let (ring, thread) =
            start(&machine, pins, Box::new(Punctual(0)), Arc::default(), || {}, report).unwrap();
        let task = |id, segments, follows| {
            Message::Task(Task { id, segments, follows, needs_durable: 0, lift_to: Some(0), granted: false })
        };
        let mut low = Steps::default();
        low[2] = surface - depth;
        ring.send(task(1, way(&machine, Steps::default(), low[2]), follows)).unwrap();
        let first: Report = heard.recv().unwrap();
        thread::sleep(pause);
        ring.send(task(2, way(&machine, low, surface + 1_000), false)).unwrap();
        let second = heard.recv().unwrap();
        ring.send(Message::Finish).unwrap();
        thread.join().unwrap();
        [first, second].map(|report| (report.ended, report.position[2] - surface))
    }

    #[test]
    fn a_tip_in_the_board_is_lifted_when_the_next_move_does_not_come() {
        const LONG: Duration = Duration::from_millis(2_400);
        let top = -virtual_drill().z.scale.steps(virtual_drill().process.surface);
        let [down, starved] = two_tasks(Output::Card, true, 100, LONG);
        assert_eq!((down, starved), ((Ended::Completed, -100), (Ended::Starved, top)));
        // In time; on the virtual drill, which keeps its own time; with the tip out of the board; and of a row of a queue, which
        // may leave the tip down as long as a person likes.
        let rows = [
            (Output::Card, true, 100, Duration::ZERO),
            (Output::Virtual, true, 100, LONG),
            (Output::Card, true, -100, LONG),
            (Output::Card, false, 100, LONG),
        ];
        let rows = rows.map(|(output, follows, depth, pause)| {
            thread::spawn(move || (depth, two_tasks(output, follows, depth, pause)))
        });
        for row in rows {
            let (depth, ended) = row.join().unwrap();
            assert_eq!(ended, [(Ended::Completed, -depth), (Ended::Completed, 1_000)]);
        }
    }
}
