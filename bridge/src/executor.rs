//! The executor: one plain thread that owns pins and clock, fed through a bounded ring.
//!
//! ```text
//! owner ── ring of orders ──▶ executor thread ──▶ pins
//!   ▲                           │        │  ▲
//!   │                           │        │  └── stop up to task n, legs durable up to n: two numbers, never a lock
//!   ├── reports: every task, once, at rest       └── latest place: lossy, never waited for
//! ```
//!
//! Comes in: tasks of segments. Goes out: calls on pins, one report a task. Does not know jobs; of the journal it knows one
//! number: how many legs are durable. The tip does not go down before every earlier leg is.

use annulus_core::job::{Gate, Input, Mark};
use annulus_core::machine::{Machine, Steps};
use annulus_core::pins::{Brakes, Clock, Desk, Line, Order, Outcome, Pins, play};
use annulus_core::steps::{Effect, Segment, Stage, TICK_HZ};
use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

/// Orders that fit into the ring.
const RING: usize = 16;

/// The clock may run ahead of life by this much, so that it sleeps rarely, in ms.
const LUMP_MS: f64 = 2.0;

/// How often the latest place is left, in ticks: 2 ms.
const GLIMPSE: u64 = TICK_HZ / 500;

/// Something to move.
pub(crate) struct Task {
    /// Grows from task to task.
    pub(crate) id: u64,
    /// Each begins and ends at rest.
    pub(crate) segments: Vec<Segment>,
    /// Legs that must be durable before the tip goes down.
    pub(crate) needs_durable: u32,
}

/// What the owner sends.
enum Message {
    Task(Task),
    /// The count of an axis is off by so much.
    Correct(usize, i64),
    Spindle(u32),
    Finish,
}

/// How a task ended, at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Report {
    /// Which.
    pub(crate) id: u64,
    /// How many segments it played to their end.
    pub(crate) completed: usize,
    /// Why no more.
    pub(crate) ended: Ended,
    /// Where it rests, machine steps.
    pub(crate) position: Steps,
    /// The inputs then.
    pub(crate) inputs: u32,
    /// Stream time it took, in ticks.
    pub(crate) ticks: u64,
}

/// Why a task ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Ended {
    /// All of it was played.
    Completed,
    /// A gate's input turned on here.
    Gated(Steps),
    /// A gate's input did not turn on.
    Unmet(Gate),
    /// A sensor that must not be reached turned on.
    Guarded(Input),
    /// As ordered.
    Stopped,
}

/// The latest place, for people to look at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Glimpse {
    /// Steps counted.
    pub(crate) position: Steps,
    /// Inputs, one bit each.
    pub(crate) inputs: u32,
    /// Spindle speed.
    pub(crate) rpm: u32,
    /// What is being done; none at rest.
    pub(crate) stage: Option<Stage>,
    /// Where it goes, in the segment's own coordinates.
    pub(crate) end: Steps,
}

/// What owner, journal and executor share without waiting for each other.
#[derive(Default)]
pub(crate) struct Shared {
    stop_upto: AtomicU64,
    durable: AtomicU32,
    glimpse: Mutex<Glimpse>,
}

impl Shared {
    /// Every task up to `id` comes to rest.
    pub(crate) fn stop(&self, id: u64) {
        self.stop_upto.fetch_max(id, Ordering::SeqCst);
    }

    /// So many legs are on the disk.
    pub(crate) fn set_durable(&self, legs: u32) {
        self.durable.store(legs, Ordering::SeqCst);
    }

    /// The latest place.
    pub(crate) fn glimpse(&self) -> Glimpse {
        self.glimpse.lock().map(|glimpse| *glimpse).unwrap_or_default()
    }
}

/// The owner's end.
pub(crate) struct Executor {
    ring: SyncSender<Message>,
    thread: Option<JoinHandle<()>>,
    pub(crate) shared: Arc<Shared>,
}

impl Executor {
    /// Starts the thread. `report` is called from it once a task.
    pub(crate) fn start(
        machine: &Machine,
        pins: Box<dyn Pins + Send>,
        speed: f64,
        shared: Arc<Shared>,
        report: impl Fn(Report) + Send + 'static,
    ) -> std::io::Result<Self> {
        let (ring, orders) = sync_channel(RING);
        let place = Place {
            brakes: Brakes::of(machine),
            line: Line::default(),
            pins,
            clock: LumpClock::new(speed),
            shared: Arc::clone(&shared),
            rpm: 0,
        };
        let builder = thread::Builder::new().name("executor".to_owned());
        let thread = builder.spawn(move || place.run(&orders, report))?;
        Ok(Self { ring, thread: Some(thread), shared })
    }

    /// Gives it something to move. The ring never fills: one task at a time is given.
    pub(crate) fn give(&self, task: Task) {
        let _ = self.ring.send(Message::Task(task));
    }

    /// The count of `axis` is off by `steps`.
    pub(crate) fn correct(&self, axis: usize, steps: i64) {
        let _ = self.ring.send(Message::Correct(axis, steps));
    }

    /// Sets the spindle's speed at rest.
    pub(crate) fn spindle(&self, rpm: u32) {
        let _ = self.ring.send(Message::Spindle(rpm));
    }
}

impl Drop for Executor {
    fn drop(&mut self) {
        let _ = self.ring.send(Message::Finish);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// What the thread owns.
struct Place {
    brakes: Brakes,
    line: Line,
    pins: Box<dyn Pins + Send>,
    clock: LumpClock,
    shared: Arc<Shared>,
    rpm: u32,
}

impl Place {
    fn run(mut self, orders: &Receiver<Message>, report: impl Fn(Report)) {
        self.leave(None);
        while let Ok(message) = orders.recv() {
            match message {
                Message::Task(task) => report(self.task(&task)),
                Message::Correct(axis, steps) => self.line.position[axis] += steps,
                Message::Spindle(rpm) => {
                    self.pins.spindle(self.line.tick, rpm);
                    self.rpm = rpm;
                }
                Message::Finish => break,
            }
            self.leave(None);
        }
        self.pins.safe();
    }

    fn task(&mut self, task: &Task) -> Report {
        let start = self.line.tick;
        let (mut completed, mut ended) = (0, Ended::Completed);
        for segment in &task.segments {
            if let Effect::Spindle(rpm) = segment.effect {
                self.rpm = rpm;
            }
            self.leave(Some(segment));
            ended = if self.may_begin(task, segment) { self.play(task.id, segment) } else { Ended::Stopped };
            if ended != Ended::Completed {
                break;
            }
            completed += 1;
        }
        let inputs = self.pins.inputs(self.line.tick);
        let ticks = self.line.tick - start;
        Report { id: task.id, completed, ended, position: self.line.position, inputs, ticks }
    }

    /// Waits until every earlier leg is durable where the tip is about to go down.
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

    fn play(&mut self, id: u64, segment: &Segment) -> Ended {
        let mut desk = Counter { id, shared: &self.shared, left: 0 };
        let outcome =
            play(segment, &self.brakes, &mut self.line, &mut *self.pins, &mut self.clock, &mut desk);
        match outcome {
            Outcome::Completed => Ended::Completed,
            Outcome::Gated(at) => Ended::Gated(at),
            Outcome::Unmet(gate) => Ended::Unmet(gate),
            Outcome::Guarded(input) => Ended::Guarded(input),
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

/// The desk of one task.
struct Counter<'a> {
    id: u64,
    shared: &'a Shared,
    left: u64,
}

impl Desk for Counter<'_> {
    fn order(&mut self) -> Order {
        if self.shared.stop_upto.load(Ordering::Relaxed) >= self.id { Order::Stop } else { Order::Go }
    }

    fn passed(&mut self, tick: u64, position: &Steps, inputs: u32) {
        if tick < self.left + GLIMPSE {
            return;
        }
        self.left = tick;
        if let Ok(mut glimpse) = self.shared.glimpse.try_lock() {
            (glimpse.position, glimpse.inputs) = (*position, inputs);
        }
    }
}

/// Real time, `speed` times as fast, up to 2 ms ahead of itself so that it sleeps rarely. It only paces: what the virtual
/// drill models goes by stream ticks.
struct LumpClock {
    start: Instant,
    ticks_per_s: f64,
    granted: u64,
}

impl LumpClock {
    fn new(speed: f64) -> Self {
        Self { start: Instant::now(), ticks_per_s: speed * TICK_HZ as f64, granted: 0 }
    }
}

impl Clock for LumpClock {
    fn now(&mut self) -> u64 {
        (self.start.elapsed().as_secs_f64() * self.ticks_per_s) as u64
    }

    fn wait_until(&mut self, tick: u64) -> u64 {
        if tick <= self.granted {
            return tick;
        }
        let now = self.now();
        if tick > now {
            thread::sleep(Duration::from_secs_f64((tick - now) as f64 / self.ticks_per_s));
        }
        let now = self.now().max(tick);
        self.granted = now + (LUMP_MS * 1e-3 * self.ticks_per_s) as u64;
        now
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_clock_keeps_its_laws_at_every_speed() {
        for speed in [1.0, 30.0, 1e6] {
            let mut clock = LumpClock::new(speed);
            let mut tick = 0;
            for _ in 0..200 {
                tick += 1 + (speed * 300.0) as u64;
                let was = clock.wait_until(tick);
                assert!(was >= tick, "no earlier than asked");
                tick = was;
            }
        }
    }
}
