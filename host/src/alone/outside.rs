//! The host of a drill without threads: it collects the owner's output in one box, which [`super::Alone`]
//! empties. Nothing here blocks.

use super::port::Port;
use crate::adapter::AdapterLine;
use crate::executor::{Instruction as Order, Seat, Shared, Time};
use crate::journal::Record;
use crate::outside::Outside;
use crate::place::{Next, Orders, Place};
use crate::surface::KeptSurface;
use annulus_core::control::{Lateness, Timing};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::machine::{Machine, Output, is_adapter_wiring};
use annulus_core::pins::{Clock, Pins};
use annulus_core::wire::Tell;
use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Output of the owner since the last turn.
#[derive(Default)]
pub(super) struct Left {
    pub(super) tells: Vec<Tell>,
    pub(super) records: VecDeque<Record>,
    pub(super) settings: Option<Machine>,
    /// A changed height map; `Some(None)` if it was forgotten.
    pub(super) surface: Option<Option<KeptSurface>>,
    pub(super) drilled: String,
    /// A new executor that has not started yet.
    pub(super) executor: Option<(Fresh, Ring)>,
}

pub(super) enum Fresh {
    Pins(Box<Place>),
    /// An adapter that is not identified yet.
    Adapter {
        line: Box<AdapterLine>,
        machine: Box<Machine>,
        shared: Arc<Shared>,
    },
}

#[derive(Clone)]
pub(super) struct Plugged {
    pub(super) port: Port,
    pub(super) time: Time,
    pub(super) session: Arc<AtomicU32>,
}

/// The owner's outbox, and the time that the executor may use.
#[derive(Clone, Default)]
pub(super) struct Letters {
    left: Arc<Mutex<Left>>,
    pub(super) allowance: Arc<Allowance>,
    /// The port of a real machine; `None` for the virtual drill.
    pub(super) plugged: Option<Plugged>,
}

impl Letters {
    pub(super) fn left(&self) -> MutexGuard<'_, Left> {
        self.left.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// How far stream time may pass, and whether the executor waits for more.
#[derive(Default)]
pub(super) struct Allowance {
    granted: AtomicU64,
    wanted: AtomicBool,
}

impl Allowance {
    /// Returns `true` if the executor waited for more time since the last call.
    pub(super) fn was_wanted(&self) -> bool {
        self.wanted.swap(false, Ordering::Relaxed)
    }

    pub(super) fn grant(&self, ticks: u64) {
        self.granted.fetch_add(ticks, Ordering::Relaxed);
    }
}

/// A clock that is set by its caller. The clock is never late: without calls no time passes.
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

#[derive(Clone, Default)]
pub(super) struct Ring {
    orders: Arc<Mutex<VecDeque<Order>>>,
    gone: Arc<AtomicBool>,
}

impl Ring {
    pub(super) fn leave(&self) {
        self.gone.store(true, Ordering::Relaxed);
    }
}

impl Orders for Ring {
    fn next(&mut self, _: Option<Duration>) -> Next {
        let mut orders = self.orders.lock().unwrap_or_else(PoisonError::into_inner);
        orders.pop_front().map_or(Next::None, Next::Order)
    }
}

impl Seat for Ring {
    fn order(&self, message: Order) {
        self.orders.lock().unwrap_or_else(PoisonError::into_inner).push_back(message);
    }

    fn is_gone(&self) -> bool {
        self.gone.load(Ordering::Relaxed)
    }

    /// Simulated pins switch nothing, and an adapter that hears nothing turns its outputs off.
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

    fn may_rewire(&self, key: &str) -> bool {
        self.plugged.is_some() && is_adapter_wiring(key)
    }

    fn keep_settings(&self, machine: &Machine) -> Result<(), Diagnostic> {
        self.left().settings = Some(machine.clone());
        Ok(())
    }

    fn keep_surface(&self, surface: Option<&KeptSurface>) -> Result<(), Diagnostic> {
        self.left().surface = Some(surface.cloned());
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
        self.left().executor = Some((Fresh::Pins(Box::new(place)), ring.clone()));
        Ok(Box::new(ring))
    }

    /// The only real outputs here are those of an adapter at a port.
    fn real_seat(
        &self,
        machine: &Machine,
        _: Option<Lateness>,
        shared: &Arc<Shared>,
    ) -> Result<(Box<dyn Seat>, Option<Timing>), Diagnostic> {
        let Some(plugged) = self.plugged.as_ref().filter(|_| machine.output == Output::Adapter) else {
            return Err(error!("control.in_file_only", key = "machine.output"));
        };
        let session = plugged.session.fetch_add(1, Ordering::Relaxed);
        let line = AdapterLine::new(Box::new(plugged.port.clone()), session, plugged.time);
        let fresh = Fresh::Adapter {
            line: Box::new(line),
            machine: Box::new(machine.clone()),
            shared: Arc::clone(shared),
        };
        let ring = Ring::default();
        self.left().executor = Some((fresh, ring.clone()));
        Ok((Box::new(ring), None))
    }
}
