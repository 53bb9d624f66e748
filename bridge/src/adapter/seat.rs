//! The thread that owns an adapter, as the drill's owner sees it. Nothing has to be made safe for a dead
//! thread: an adapter that hears nothing stops and turns its outputs off.

use super::port::Plug;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::machine::Machine;
use annulus_core::pins::through;
use annulus_host::adapter::{AdapterLine, attend, greeted, other_firmware};
use annulus_host::executor::{Heard, Instruction, Seat, Shared, Time};
use annulus_host::{Next, Orders};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

struct Thread {
    orders: Option<Sender<Instruction>>,
    thread: Option<JoinHandle<()>>,
    gone: Arc<AtomicBool>,
}

/// Finds the adapter of `machine`, makes it ready, and starts its thread. `hear` is called from that
/// thread.
pub(crate) fn start(
    machine: &Machine,
    time: Time,
    shared: &Arc<Shared>,
    hear: impl Fn(Heard) + Send + 'static,
) -> Result<Box<dyn Seat>, Diagnostic> {
    let session = getrandom::u32().unwrap_or(std::process::id());
    let mut line = AdapterLine::new(Box::new(Plug::open(&machine.adapter.port)?), session, time);
    let welcome = through(greeted(&mut line, machine))?;
    tracing::info!(
        "USB step adapter: firmware {:08x}, version {} of the link",
        welcome.firmware,
        welcome.version
    );
    if let Some(other) = other_firmware(welcome) {
        let why = other.warning();
        tracing::warn!("{} {}", why.message("en"), why.advice("en"));
    }
    let (machine, shared) = (machine.clone(), Arc::clone(shared));
    let ((orders, ordered), gone) = (channel(), Arc::new(AtomicBool::new(false)));
    let over = Arc::clone(&gone);
    let body = move || {
        let report = |report| hear(Heard::Report(report));
        let ended = through(attend(line, &machine, &shared, Ordered(ordered), report));
        over.store(true, Ordering::SeqCst);
        if let Err(why) = ended {
            tracing::error!("{}", why.message("en"));
            hear(Heard::Gone(why));
        }
    };
    let thread = thread::Builder::new().name("adapter".to_owned()).spawn(body);
    let thread = thread.map_err(|error| error!("control.no_thread", reason = error))?;
    Ok(Box::new(Thread { orders: Some(orders), thread: Some(thread), gone }))
}

/// The thread's receiver of orders: it never blocks, because the thread waits at the port.
struct Ordered(Receiver<Instruction>);

impl Orders for Ordered {
    fn next(&mut self, _: Option<Duration>) -> Next {
        match self.0.try_recv() {
            Ok(message) => Next::Order(message),
            Err(TryRecvError::Empty) => Next::None,
            Err(TryRecvError::Disconnected) => Next::Over,
        }
    }
}

impl Seat for Thread {
    fn order(&self, message: Instruction) {
        if let Some(orders) = &self.orders {
            let _ = orders.send(message);
        }
    }

    fn is_gone(&self) -> bool {
        self.gone.load(Ordering::SeqCst)
    }

    fn make_safe(&self) -> Result<(), Diagnostic> {
        Ok(())
    }

    fn finish(&mut self) {
        self.order(Instruction::Finish);
        self.orders = None;
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
