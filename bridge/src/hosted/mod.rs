//! The machine behind the server: Annulus' own drill, or a GRBL controller at a serial port.

mod listeners;

use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::wire::{Ask, Tell};
use annulus_host::Ticket;
pub(crate) use listeners::Listeners;
use std::sync::mpsc::Receiver;
use tokio::sync::mpsc;

/// A machine that several pages share. The caller checks which page may send requests.
pub(crate) trait Hosted: Send + Sync {
    /// Saves `bytes` under `key`, their SHA-256, if they are a program.
    fn upload(&self, key: &str, bytes: &[u8]) -> Result<(), Diagnostic>;

    fn job(&self, key: &str) -> Option<Vec<u8>>;

    /// Passes on a page's request with its `ticket`, without blocking. Requests are handled in order;
    /// planning, or writing a job's G-code, is left for [`Begun::finish`].
    fn begin(&self, ask: Ask, ticket: Option<Ticket>) -> Begun;

    /// Stops now. Never blocks.
    fn stop(&self);

    /// Control changed: earlier tickets become invalid, jogs end, outputs lock. Never blocks.
    fn control_changed(&self);

    fn ticket(&self) -> Ticket;

    /// All reports: `Status` 10 times per second and after every change, `Armed`, `Ended`, `Interrupted`,
    /// `Machine`. A slow listener misses statuses.
    fn watch(&self) -> mpsc::Receiver<Tell>;

    /// Messages for a new listener: `Machine`, `Status`, and `Armed` and `Interrupted` if they apply.
    fn greeting(&self) -> Vec<Tell>;

    /// Stops in a controlled way and ends the threads.
    fn shutdown(&self);
}

type Answer = Result<Vec<Tell>, Diagnostic>;

/// A request in progress: the rest of its work, or the wait for its answer.
pub(crate) struct Begun(Box<dyn FnOnce() -> Answer + Send>);

impl Begun {
    pub(crate) fn new(rest: impl FnOnce() -> Answer + Send + 'static) -> Self {
        Self(Box::new(rest))
    }

    pub(crate) fn awaits(answer: Receiver<Answer>) -> Self {
        Self::new(move || answer.recv().unwrap_or_else(|_| Err(gone())))
    }

    /// Does the rest and waits for the answer; blocks.
    pub(crate) fn finish(self) -> Answer {
        (self.0)()
    }
}

/// Error for a request after the machine's thread has ended.
pub(crate) fn gone() -> Diagnostic {
    error!("control.shut_down")
}
