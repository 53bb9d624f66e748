//! The place where a drill without threads runs: everything is left in one box, and whoever has the drill sees to it.
//!
//! Comes in: what the owner wants done. Goes out: the same, for [`super::Alone`]. Does nothing itself, and waits for nothing.

use crate::executor::{Instruction as Order, Seat, Shared};
use crate::journal::Record;
use crate::outside::Outside;
use crate::place::{Next, Orders, Place};
use annulus_core::control::{Lateness, Timing};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::Machine;
use annulus_core::pins::{Clock, Pins};
use annulus_core::wire::Tell;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// What the owner left.
#[derive(Default)]
pub(super) struct Left {
    pub(super) tells: Vec<Tell>,
    pub(super) records: VecDeque<Record>,
    /// Changed settings.
    pub(super) settings: Option<Machine>,
    /// The drilled-board record, as long as it is known.
    pub(super) drilled: String,
    /// An executor that nobody plays yet.
    pub(super) executor: Option<(Place, Ring)>,
}

/// The box, and how far the executor's clock may go.
#[derive(Clone, Default)]
pub(super) struct Letters {
    left: Arc<Mutex<Left>>,
    pub(super) allowance: Arc<Allowance>,
}

impl Letters {
    pub(super) fn left(&self) -> MutexGuard<'_, Left> {
        self.left.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// How far stream time may pass, and whether somebody waits for more.
#[derive(Default)]
pub(super) struct Allowance {
    granted: AtomicU64,
    wanted: AtomicBool,
}

impl Allowance {
    /// Whether somebody waited for more since this was asked last.
    pub(super) fn was_wanted(&self) -> bool {
        self.wanted.swap(false, Ordering::Relaxed)
    }

    /// So many ticks more.
    pub(super) fn grant(&self, ticks: u64) {
        self.granted.fetch_add(ticks, Ordering::Relaxed);
    }
}

/// A clock that is told the time. It is never late: while nobody is there to tell it, none passes.
struct Told {
    allowance: Arc<Allowance>,
    tick: u64,
}

impl Clock for Told {
    fn now(&mut self) -> u64 {
        self.tick
    }

    fn grants(&mut self, tick: u64) -> bool {
        let granted = tick <= self.allowance.granted.load(Ordering::Relaxed);
        if !granted {
            self.allowance.wanted.store(true, Ordering::Relaxed);
        }
        granted
    }

    fn wait_until(&mut self, tick: u64) -> u64 {
        self.tick = self.tick.max(tick);
        tick
    }
}

/// Orders on their way to an executor that is played by turns.
#[derive(Clone, Default)]
pub(super) struct Ring(Arc<Mutex<VecDeque<Order>>>);

impl Orders for Ring {
    fn next(&mut self, _: Option<Duration>) -> Next {
        let mut orders = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        orders.pop_front().map_or(Next::None, Next::Order)
    }
}

impl Seat for Ring {
    fn order(&self, message: Order) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push_back(message);
    }

    fn is_gone(&self) -> bool {
        false
    }

    fn make_safe(&self) -> Result<(), Diagnostic> {
        Ok(())
    }

    fn finish(&mut self) {
        self.order(Order::Finish);
    }
}

impl Outside for Letters {
    fn tell(&self, tell: Tell) {
        self.left().tells.push(tell);
    }

    fn record(&self, record: Record) {
        self.left().records.push_back(record);
    }

    fn records(&self) -> bool {
        true
    }

    fn keep_settings(&self, machine: &Machine) -> Result<(), Diagnostic> {
        self.left().settings = Some(machine.clone());
        Ok(())
    }

    fn record_length(&self) -> Option<u64> {
        u64::try_from(self.left().drilled.len()).ok()
    }

    fn recorded(&self, from: u64) -> Option<String> {
        let from = usize::try_from(from).ok()?;
        self.left().drilled.get(from..).map(str::to_owned)
    }

    fn seat(
        &self,
        machine: &Machine,
        pins: Box<dyn Pins + Send>,
        _: Option<u64>,
        shared: &Arc<Shared>,
    ) -> Result<Box<dyn Seat>, Diagnostic> {
        let clock = Told { allowance: Arc::clone(&self.allowance), tick: 0 };
        self.allowance.granted.store(0, Ordering::Relaxed);
        let place = Place::new(machine, pins, Box::new(clock), Arc::clone(shared));
        let ring = Ring::default();
        self.left().executor = Some((place, ring.clone()));
        Ok(Box::new(ring))
    }

    /// There are no wires here.
    fn real_seat(
        &self,
        _: &Machine,
        _: Option<Lateness>,
        _: &Arc<Shared>,
    ) -> Result<(Box<dyn Seat>, Option<Timing>), Diagnostic> {
        Err(Diagnostic::error("control.in_file_only").with("key", "machine.output"))
    }
}
