//! The interface between owner and executor: tasks, one report for each, and a few numbers shared without
//! blocking.
//!
//! ```text
//! owner ── orders, in sequence ──▶ executor ──▶ pins
//!   ▲  └── stop up to task n, legs durable up to n, feed override: numbers, read between two steps
//!   └───── reports: every task, once, when stopped; the latest position: lossy, never waited for
//! ```
//!
//! The tool does not go down to a hole before every earlier leg is durable.

use crate::ticket::Grant;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::job::{Bit, Gate, Input};
use annulus_core::machine::{Machine, Steps};
use annulus_core::magazine::ToolStock;
use annulus_core::pins::{self, AxisSet, ShortTouches, SpindleState, SpindleTrouble};
use annulus_core::steps::{Segment, Stage};
use annulus_core::wire::OtherFirmware;
use serde::{Deserialize, Serialize};
use std::sync::atomic::{AtomicU8, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A monotonic clock: the time since a fixed moment.
pub type Time = fn() -> Duration;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Task {
    /// Increases from task to task.
    pub id: u64,
    pub segments: Vec<Segment>,
    /// The task ends with the tool in the board, and another task follows at once.
    pub follows: bool,
    /// Machine steps of Z below which the tool is in the board.
    pub surface_steps: i64,
    /// Height of the board at this task's hole above flat, in steps of Z, from the height map.
    pub board_steps: i64,
    /// Legs that must be durable before the tool goes down.
    pub needs_durable: u32,
    /// Machine steps of Z to which the executor may lift the tool on its own; `None` if the position is not
    /// trusted.
    pub lift_to: Option<i64>,
    /// The task moves only while [`Shared::grant`] is renewed.
    pub granted: bool,
}

impl Task {
    pub(crate) fn is_low(&self, machine: &Machine, place: &Steps) -> bool {
        machine.lowest(place) < self.surface_steps
    }
}

/// How a task ended; the axes are stopped.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    pub id: u64,
    pub completed: usize,
    pub ended: Ended,
    /// Final position, machine steps.
    pub position: Steps,
    /// Axes whose last step counted down.
    pub down: AxisSet,
    pub inputs: u32,
    pub ticks: u64,
}

/// Why a task ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Ended {
    Completed,
    /// A gate's input turned on here.
    Gated(Steps),
    /// A gate's input did not turn on.
    Unmet(Gate),
    /// A sensor turned on that had to stay off.
    Guarded(Input),
    /// A sensor is off that had to be on.
    Missing(Input),
    /// On its way down to a hole, the tool touched something higher than the board can be.
    Early {
        at: Steps,
    },
    /// A step came too late for its motor, by this many ticks.
    Late {
        ticks: u64,
    },
    /// The spindle stopped, or never reached its speed.
    Spindle {
        trouble: SpindleTrouble,
    },
    /// Not started: the tool was in the board, the task did not arrive in time, and the tool was lifted.
    Starved,
    /// The path did not arrive in time, or the line to the pins was cut. Motion stopped on the path; every
    /// step is counted.
    RanDry,
    Stopped,
}

impl Ended {
    /// Returns `true` if the probing code handles this end. A contact that ends a move is no collision:
    /// nothing was pushed and every step is counted.
    pub(crate) fn is_of_touch(self) -> bool {
        let own = matches!(self, Self::Completed | Self::Gated(_) | Self::Unmet(_));
        own || self == Self::Guarded(Input::Contact)
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Glimpse {
    pub position: Steps,
    /// Inputs, one bit each.
    pub inputs: u32,
    /// Touches of each of [`Input::OF_AXES`] shorter than its filter; `None` if they are not counted.
    #[serde(default)]
    pub touches: Option<[ShortTouches; Input::OF_AXES.len()]>,
    /// Firmware of the adapter, if it differs from the one of this program.
    #[serde(default)]
    pub other_firmware: Option<OtherFirmware>,
    pub rpm: u32,
    /// The spindle's own report.
    #[serde(default)]
    pub spindle: SpindleState,
    /// Number of the hold that stopped it on its path; 0 if none.
    #[serde(default)]
    pub held: u64,
    /// The tool was lifted off the path, and the spindle is off.
    #[serde(default)]
    pub lifted: bool,
    /// The current stage; `None` when stopped.
    pub stage: Option<Stage>,
    /// End of the current segment, in its own coordinates.
    pub end: Steps,
}

#[derive(Clone, Debug)]
pub enum Heard {
    Report(Report),
    /// The executor ended; its current task will not be reported.
    Gone(Diagnostic),
}

/// State that owner, journal and executor share without blocking.
pub struct Shared {
    time: Time,
    stop_upto: AtomicU64,
    durable: AtomicU32,
    /// Percent below the planned feed.
    slower: AtomicU8,
    /// The task to hold on its path, and the task whose tool to lift there; 0 for none.
    hold: AtomicU64,
    lift: AtomicU64,
    holds: AtomicU64,
    glimpse: Mutex<Glimpse>,
    grant: Grant,
    /// Forwards changes to an executor in another process.
    courier: Mutex<Option<Courier>>,
}

/// Sends to an executor in another process. Never blocks.
pub type Courier = Box<dyn Fn(Said) + Send>;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Said {
    /// Carried out after all earlier orders.
    Order(Instruction),
    Stop {
        /// Number of the last task to stop.
        upto: u64,
    },
    /// This many legs are durable.
    Durable {
        legs: u32,
    },
    FeedOverride {
        percent: u8,
    },
    Grant,
    /// Withdraws it.
    Revoke,
    Hold {
        id: u64,
        number: u64,
    },
    /// Lift this task's tool off its path, and switch the spindle off.
    Lift {
        id: u64,
    },
    Go,
}

/// An order; orders are carried out in sequence.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Instruction {
    Task(Task),
    Correct {
        axis: usize,
        steps: i64,
    },
    Spindle {
        /// In rpm; 0 is off.
        rpm: u32,
    },
    Output {
        /// Index among the machine's named outputs.
        place: u8,
        on: bool,
    },
    Bit(Bit),
    /// The user states what is in the magazine and the spindle.
    Stock(Box<ToolStock>),
    /// End, and lift the tool first: the owner is gone and cannot make the machine safe.
    Abandon,
    Finish,
}

impl Shared {
    /// For an executor that does not move yet.
    pub fn new(time: Time) -> Self {
        Self {
            time,
            stop_upto: AtomicU64::default(),
            durable: AtomicU32::default(),
            slower: AtomicU8::default(),
            hold: AtomicU64::default(),
            lift: AtomicU64::default(),
            holds: AtomicU64::default(),
            glimpse: Mutex::default(),
            grant: Grant::default(),
            courier: Mutex::default(),
        }
    }

    /// Stops every task up to `id`.
    pub fn stop(&self, id: u64) {
        self.stop_upto.fetch_max(id, Ordering::SeqCst);
        self.say(Said::Stop { upto: id });
    }

    /// Number of the last task to stop.
    pub fn stopped(&self) -> u64 {
        self.stop_upto.load(Ordering::SeqCst)
    }

    /// Sets the number of durable legs.
    pub fn set_durable(&self, legs: u32) {
        self.durable.store(legs, Ordering::SeqCst);
        self.say(Said::Durable { legs });
    }

    pub fn durable(&self) -> u32 {
        self.durable.load(Ordering::SeqCst)
    }

    /// Holds task `id` if it follows a toolpath. Returns the number of this hold.
    pub fn hold(&self, id: u64) -> u64 {
        let number = self.holds.load(Ordering::SeqCst) + 1;
        self.hold_as(id, number);
        number
    }

    /// Holds task `id` under a number that the owner's process chose.
    pub fn hold_as(&self, id: u64, number: u64) {
        self.holds.store(number, Ordering::SeqCst);
        self.hold.store(id, Ordering::SeqCst);
        self.say(Said::Hold { id, number });
    }

    /// Lifts the tool of the held task `id` off its path, and switches the spindle off.
    pub fn lift(&self, id: u64) {
        self.lift.store(id, Ordering::SeqCst);
        self.say(Said::Lift { id });
    }

    /// Continues after a hold; a lifted tool goes down to its path first.
    pub fn go(&self) {
        self.hold.store(0, Ordering::SeqCst);
        self.lift.store(0, Ordering::SeqCst);
        self.say(Said::Go);
    }

    /// Returns `true` if task `id` should hold on its path.
    pub fn is_held(&self, id: u64) -> bool {
        self.hold.load(Ordering::SeqCst) == id
    }

    /// Returns `true` if the tool of task `id` should be lifted off its path.
    pub fn is_lifted(&self, id: u64) -> bool {
        self.is_held(id) && self.lift.load(Ordering::SeqCst) == id
    }

    pub fn holds(&self) -> u64 {
        self.holds.load(Ordering::SeqCst)
    }

    pub fn set_feed_override(&self, percent: u8) {
        self.slower.store(100 - percent.min(100), Ordering::SeqCst);
        self.say(Said::FeedOverride { percent });
    }

    /// Percent of the planned feed.
    pub fn feed_override(&self) -> u8 {
        100 - self.slower.load(Ordering::Relaxed)
    }

    pub fn grant(&self) {
        self.grant.give((self.time)());
        self.say(Said::Grant);
    }

    pub fn revoke(&self) {
        self.grant.revoke();
        self.say(Said::Revoke);
    }

    pub fn granted(&self) -> pins::Order {
        self.grant.order((self.time)())
    }

    pub fn glimpse(&self) -> Glimpse {
        self.glimpse.lock().map(|glimpse| *glimpse).unwrap_or_default()
    }

    /// Changes the snapshot; waits for a reader.
    pub fn change_glimpse(&self, change: impl FnOnce(&mut Glimpse)) {
        if let Ok(mut glimpse) = self.glimpse.lock() {
            change(&mut glimpse);
        }
    }

    /// Changes the snapshot, for an executor in motion: skipped while a reader holds the lock.
    pub(crate) fn try_glimpse(&self, change: impl FnOnce(&mut Glimpse)) {
        if let Ok(mut glimpse) = self.glimpse.try_lock() {
            change(&mut glimpse);
        }
    }

    /// Forwards every later change to `courier`, or stops doing so.
    pub fn set_courier(&self, courier: Option<Courier>) {
        if let Ok(mut place) = self.courier.lock() {
            *place = courier;
        }
    }

    /// Sends to an executor in another process, if there is one. Never blocks.
    pub fn say(&self, said: Said) {
        if let Ok(courier) = self.courier.lock()
            && let Some(courier) = &*courier
        {
            courier(said);
        }
    }
}

/// Where an executor runs: in a thread, in another process, or in turns with its owner.
pub trait Seat: Send {
    /// Sends an order. Never blocks.
    fn order(&self, message: Instruction);

    /// Returns `true` if the executor died: later orders will not be reported.
    fn is_gone(&self) -> bool;

    /// Switches everything off in place of a dead executor.
    fn make_safe(&self) -> Result<(), Diagnostic>;

    /// Stops, makes the outputs safe and releases them. Calling it twice is harmless.
    fn finish(&mut self);
}

pub(crate) struct Executor {
    seat: Box<dyn Seat>,
    pub(crate) shared: Arc<Shared>,
}

impl Executor {
    pub(crate) fn new(seat: Box<dyn Seat>, shared: Arc<Shared>) -> Self {
        Self { seat, shared }
    }

    /// Gives a task. Only one may be pending.
    pub(crate) fn give(&self, task: Task) {
        self.seat.order(Instruction::Task(task));
    }

    pub(crate) fn correct(&self, axis: usize, steps: i64) {
        self.seat.order(Instruction::Correct { axis, steps });
    }

    pub(crate) fn spindle(&self, rpm: u32) {
        self.seat.order(Instruction::Spindle { rpm });
    }

    /// Switches the spindle off while stopped. If the executor is dead, switches everything off.
    pub(crate) fn spindle_off(&self) -> Result<(), Diagnostic> {
        if self.seat.is_gone() {
            return self.seat.make_safe();
        }
        self.spindle(0);
        Ok(())
    }

    /// Switches an output, by its index among the machine's names, while stopped.
    pub(crate) fn output(&self, place: u8, on: bool) {
        self.seat.order(Instruction::Output { place, on });
    }

    pub(crate) fn bit(&self, bit: Bit) {
        self.seat.order(Instruction::Bit(bit));
    }

    /// The magazine's and spindle's contents, as the user states them.
    pub(crate) fn stock(&self, stock: ToolStock) {
        self.seat.order(Instruction::Stock(Box::new(stock)));
    }

    /// Returns `true` if the executor died: later orders will not be reported.
    pub(crate) fn is_gone(&self) -> bool {
        self.seat.is_gone()
    }

    /// Stops, makes the outputs safe and releases them.
    pub(crate) fn finish(&mut self) {
        self.seat.finish();
    }
}

impl Drop for Executor {
    fn drop(&mut self) {
        self.finish();
    }
}
