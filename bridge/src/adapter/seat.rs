//! The thread that owns an adapter, as the owner of the drill sees it.
//!
//! Comes in: a machine. Goes out: a seat; reports, and at most once that the adapter is of no use any more. Nothing has to be made
//! safe for it then: an adapter that hears nothing comes to rest and turns its outputs off by itself.

use super::connect::connect;
use super::hand;
use super::play::Adapter;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::Machine;
use annulus_drill::executor::{Heard, Instruction, Seat, Shared};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Sender, channel};
use std::thread::{self, JoinHandle};

/// The owner's end.
struct Thread {
    orders: Option<Sender<Instruction>>,
    thread: Option<JoinHandle<()>>,
    gone: Arc<AtomicBool>,
}

/// Finds the adapter of `machine`, makes it ready and starts the thread that owns it. `hear` is called from that thread.
pub(crate) fn start(
    machine: &Machine,
    shared: &Arc<Shared>,
    hear: impl Fn(Heard) + Send + 'static,
) -> Result<Box<dyn Seat>, Diagnostic> {
    let mut adapter = Adapter::new(machine, connect(machine)?, Arc::clone(shared));
    let ((orders, ordered), gone) = (channel(), Arc::new(AtomicBool::new(false)));
    let over = Arc::clone(&gone);
    let body = move || {
        let ended = hand::run(&mut adapter, &ordered, &|report| hear(Heard::Report(report)));
        adapter.rest();
        over.store(true, Ordering::SeqCst);
        if let Err(why) = ended {
            tracing::error!("{}", why.message("en"));
            hear(Heard::Gone(why));
        }
    };
    let thread = thread::Builder::new().name("adapter".to_owned()).spawn(body);
    let thread = thread.map_err(|error| Diagnostic::error("control.no_thread").with("reason", error))?;
    Ok(Box::new(Thread { orders: Some(orders), thread: Some(thread), gone }))
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

    /// It does so by itself when it hears nothing.
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
