//! What an executor is to its owner: tasks, one report each, and the few numbers that both share without waiting.
//!
//! ```text
//! owner ── orders, in their order ──▶ executor ──▶ pins
//!   ▲  └── stop up to task n, legs durable up to n, feed override: numbers, seen between two steps
//!   └───── reports: every task, once, at rest; the latest place: lossy, never waited for
//! ```
//!
//! Comes in: tasks of segments. Goes out: reports. Does not know where the executor sits; of the journal it knows one number: how
//! many legs are durable. The tip does not go down before every earlier leg is.

use crate::grant::Grant;
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

/// How long it is since some moment, by a clock that only goes forward.
pub type Time = fn() -> Duration;

/// Something to move.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Task {
    /// Grows from task to task.
    pub id: u64,
    /// Each begins and ends at rest.
    pub segments: Vec<Segment>,
    /// It ends with the tip in the board, and another task follows at once.
    pub follows: bool,
    /// Machine steps of Z below which the tip is in the board.
    pub surface_steps: i64,
    /// So many steps of Z higher than flat the board lies at the hole of this task, as its height map has it.
    pub board_steps: i64,
    /// Legs that must be durable before the tip goes down.
    pub needs_durable: u32,
    /// Machine steps of Z to which the tip may be lifted when nobody is left to say so; none where the position is not
    /// trusted.
    pub lift_to: Option<i64>,
    /// It goes only as long as it is granted again and again ([`Shared::grant`]).
    pub granted: bool,
}

impl Task {
    /// Whether a tip is in the board where the axes of `machine` are at `place`, machine steps.
    pub(crate) fn is_low(&self, machine: &Machine, place: &Steps) -> bool {
        machine.lowest(place) < self.surface_steps
    }
}

/// How a task ended, at rest.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Which.
    pub id: u64,
    /// How many segments it played to their end.
    pub completed: usize,
    /// Why no more.
    pub ended: Ended,
    /// Where it rests, machine steps.
    pub position: Steps,
    /// Axes that came there from above.
    pub down: AxisSet,
    /// The inputs then.
    pub inputs: u32,
    /// Stream time it took, in ticks.
    pub ticks: u64,
}

/// Why a task ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Ended {
    /// All of it was played.
    Completed,
    /// A gate's input turned on here.
    Gated(Steps),
    /// A gate's input did not turn on.
    Unmet(Gate),
    /// A sensor that must not be reached turned on.
    Guarded(Input),
    /// A sensor that must be on is off.
    Missing(Input),
    /// The tip touched something on its way down to a hole, higher than the board can be.
    Early {
        /// Where it touched, machine steps.
        at: Steps,
    },
    /// A step came so many ticks too late for its motor.
    Late {
        /// How late.
        ticks: u64,
    },
    /// The spindle was to turn, and does not any more, or never reached its speed.
    Spindle {
        /// Why.
        trouble: SpindleTrouble,
    },
    /// Not begun: the tip was down in the board, this task did not come in time, and the tip was lifted.
    Starved,
    /// The path did not come in time, or the way to the pins was cut: it came to rest on the path, every step counted.
    RanDry,
    /// As ordered.
    Stopped,
}

impl Ended {
    /// Whether what is being touched sees to it. The contact ends a way beside the board: nothing was pushed, every step is counted.
    pub(crate) fn is_of_touch(self) -> bool {
        let own = matches!(self, Self::Completed | Self::Gated(_) | Self::Unmet(_));
        own || self == Self::Guarded(Input::Contact)
    }
}

/// The latest place, for people to look at.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Glimpse {
    /// Steps counted.
    pub position: Steps,
    /// Inputs, one bit each.
    pub inputs: u32,
    /// Touches of each of [`Input::OF_AXES`] that were shorter than its filter, where somebody counts them.
    #[serde(default)]
    pub touches: Option<[ShortTouches; Input::OF_AXES.len()]>,
    /// Firmware of an adapter that is not the one of this program.
    #[serde(default)]
    pub other_firmware: Option<OtherFirmware>,
    /// Spindle speed that is wanted.
    pub rpm: u32,
    /// What the spindle tells of itself.
    #[serde(default)]
    pub spindle: SpindleState,
    /// What is being done; none at rest.
    pub stage: Option<Stage>,
    /// Where it goes, in the segment's own coordinates.
    pub end: Steps,
}

/// What an executor tells its owner.
#[derive(Clone, Debug)]
pub enum Heard {
    /// A task ended, at rest.
    Report(Report),
    /// The executor is no more; what it was doing was not reported.
    Gone(Diagnostic),
}

/// What owner, journal and executor share without waiting for each other.
pub struct Shared {
    time: Time,
    stop_upto: AtomicU64,
    durable: AtomicU32,
    /// Percent that the feed is below the planned one.
    slower: AtomicU8,
    glimpse: Mutex<Glimpse>,
    /// Until when a move by hand may go.
    grant: Grant,
    /// The way to an executor that is elsewhere.
    courier: Mutex<Option<Courier>>,
}

/// What tells an executor elsewhere. Never waits.
pub type Courier = Box<dyn Fn(Said) + Send>;

/// What an executor elsewhere has to be told.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Said {
    /// To be done after what was ordered before.
    Order(Instruction),
    /// Every task up to this one comes to rest, at once.
    Stop {
        /// Number of the last task that is meant.
        upto: u64,
    },
    /// So many legs are durable.
    Durable {
        /// How many.
        legs: u32,
    },
    /// Everything at so many percent of the planned feed.
    FeedOverride {
        /// Of the planned feed.
        percent: u8,
    },
    /// A move by hand may go for a moment.
    Grant,
    /// It may not any more.
    Revoke,
}

/// What is ordered, one after the other.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Instruction {
    /// Something to move.
    Task(Task),
    /// The count of an axis is off by so much.
    Correct {
        /// Which.
        axis: usize,
        /// So many steps more than were counted.
        steps: i64,
    },
    /// The spindle's speed at rest.
    Spindle {
        /// Its speed; 0 is off.
        rpm: u32,
    },
    /// An output by its place among the machine's names.
    Output {
        /// Its place among the machine's outputs.
        place: u8,
        /// On, else off.
        on: bool,
    },
    /// A new bit is in the spindles.
    Bit(Bit),
    /// A person says what lies in the magazine and the spindle.
    Stock(Box<ToolStock>),
    /// It ends, and there is nobody who could still make the machine safe.
    Abandon,
    /// It ends.
    Finish,
}

impl Shared {
    /// For an executor that does not move yet, with a clock that only goes forward.
    pub fn new(time: Time) -> Self {
        Self {
            time,
            stop_upto: AtomicU64::default(),
            durable: AtomicU32::default(),
            slower: AtomicU8::default(),
            glimpse: Mutex::default(),
            grant: Grant::default(),
            courier: Mutex::default(),
        }
    }

    /// Every task up to `id` comes to rest.
    pub fn stop(&self, id: u64) {
        self.stop_upto.fetch_max(id, Ordering::SeqCst);
        self.say(Said::Stop { upto: id });
    }

    /// Up to which task everything is to rest.
    pub fn stopped(&self) -> u64 {
        self.stop_upto.load(Ordering::SeqCst)
    }

    /// So many legs are on the disk.
    pub fn set_durable(&self, legs: u32) {
        self.durable.store(legs, Ordering::SeqCst);
        self.say(Said::Durable { legs });
    }

    /// How many legs are on the disk.
    pub fn durable(&self) -> u32 {
        self.durable.load(Ordering::SeqCst)
    }

    /// Everything goes at so many percent of the planned feed.
    pub fn set_feed_override(&self, percent: u8) {
        self.slower.store(100 - percent.min(100), Ordering::SeqCst);
        self.say(Said::FeedOverride { percent });
    }

    /// Percent of the planned feed.
    pub fn feed_override(&self) -> u8 {
        100 - self.slower.load(Ordering::Relaxed)
    }

    /// A move by hand may go for a moment from now on.
    pub fn grant(&self) {
        self.grant.give((self.time)());
        self.say(Said::Grant);
    }

    /// Nobody watches what moves by hand any more.
    pub fn revoke(&self) {
        self.grant.revoke();
        self.say(Said::Revoke);
    }

    /// What a move by hand is to do now.
    pub fn granted(&self) -> pins::Order {
        self.grant.order((self.time)())
    }

    /// The latest place.
    pub fn glimpse(&self) -> Glimpse {
        self.glimpse.lock().map(|glimpse| *glimpse).unwrap_or_default()
    }

    /// Leaves the latest place.
    pub fn set_glimpse(&self, latest: Glimpse) {
        if let Ok(mut glimpse) = self.glimpse.lock() {
            *glimpse = latest;
        }
    }

    /// Leaves what the spindle tells of itself.
    pub fn set_spindle(&self, spindle: SpindleState) {
        if let Ok(mut glimpse) = self.glimpse.lock() {
            glimpse.spindle = spindle;
        }
    }

    /// Changes the latest place, if nobody is looking.
    pub(crate) fn try_glimpse(&self, change: impl FnOnce(&mut Glimpse)) {
        if let Ok(mut glimpse) = self.glimpse.try_lock() {
            change(&mut glimpse);
        }
    }

    /// Whether every stop, and so on, is also told elsewhere.
    pub fn set_courier(&self, courier: Option<Courier>) {
        if let Ok(mut place) = self.courier.lock() {
            *place = courier;
        }
    }

    /// Tells an executor elsewhere, if there is one. Never waits.
    pub fn say(&self, said: Said) {
        if let Ok(courier) = self.courier.lock()
            && let Some(courier) = &*courier
        {
            courier(said);
        }
    }
}

/// Where an executor sits: in a thread, in another process, or taken by turns with everything else.
pub trait Seat: Send {
    /// Orders something. Never waits for it.
    fn order(&self, message: Instruction);

    /// Whether it died: nothing that is ordered will be reported.
    fn is_gone(&self) -> bool;

    /// Switches everything off in the place of an executor that is gone.
    fn make_safe(&self) -> Result<(), Diagnostic>;

    /// Comes to rest, makes the outputs safe and lets go of them. A second time, nothing.
    fn finish(&mut self);
}

/// The owner's end.
pub(crate) struct Executor {
    seat: Box<dyn Seat>,
    pub(crate) shared: Arc<Shared>,
}

impl Executor {
    pub(crate) fn new(seat: Box<dyn Seat>, shared: Arc<Shared>) -> Self {
        Self { seat, shared }
    }

    /// Gives it something to move. One task at a time is given.
    pub(crate) fn give(&self, task: Task) {
        self.seat.order(Instruction::Task(task));
    }

    /// The count of `axis` is off by `steps`.
    pub(crate) fn correct(&self, axis: usize, steps: i64) {
        self.seat.order(Instruction::Correct { axis, steps });
    }

    /// Sets the spindle's speed at rest.
    pub(crate) fn spindle(&self, rpm: u32) {
        self.seat.order(Instruction::Spindle { rpm });
    }

    /// Spindle off at rest. Where nobody is left to do it, everything off at once.
    pub(crate) fn spindle_off(&self) -> Result<(), Diagnostic> {
        if self.seat.is_gone() {
            return self.seat.make_safe();
        }
        self.spindle(0);
        Ok(())
    }

    /// Switches an output, by its place among the machine's names, at rest.
    pub(crate) fn output(&self, place: u8, on: bool) {
        self.seat.order(Instruction::Output { place, on });
    }

    /// A new bit of this kind is in the spindles.
    pub(crate) fn bit(&self, bit: Bit) {
        self.seat.order(Instruction::Bit(bit));
    }

    /// What lies in the magazine and the spindle, as a person says.
    pub(crate) fn stock(&self, stock: ToolStock) {
        self.seat.order(Instruction::Stock(Box::new(stock)));
    }

    /// Whether it died: nothing that is given will be reported.
    pub(crate) fn is_gone(&self) -> bool {
        self.seat.is_gone()
    }

    /// Comes to rest, makes the outputs safe and lets go of them.
    pub(crate) fn finish(&mut self) {
        self.seat.finish();
    }
}

impl Drop for Executor {
    fn drop(&mut self) {
        self.finish();
    }
}
