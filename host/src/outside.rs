//! Interfaces that a drill needs from its host: executors, a journal, settings, a record, and a channel to
//! the pages. Nothing here may block.

use crate::executor::{Seat, Shared};
use crate::journal::Record;
use crate::surface::KeptSurface;
use annulus_core::control::{Lateness, Timing};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::Machine;
use annulus_core::pins::Pins;
use annulus_core::wire::Tell;
use std::sync::Arc;

/// The host of a drill. Results from executors and journal reach the owner as messages.
pub trait Outside: Send {
    /// Sends to all pages, if there are any.
    fn tell(&self, tell: Tell);

    /// Queues `record` after the earlier ones; the result reaches the owner as a message.
    fn record(&self, record: Record);

    /// Returns `true` if records can still be written.
    fn records(&self) -> bool;

    /// Returns `true` if the wiring setting `key`, normally changed only in the machine file, may be
    /// changed here because there is no such file.
    fn may_rewire(&self, _key: &str) -> bool {
        false
    }

    fn keep_settings(&self, machine: &Machine) -> Result<(), Diagnostic>;

    /// Saves the height map of the board; `None` deletes it.
    fn keep_surface(&self, surface: Option<&KeptSurface>) -> Result<(), Diagnostic>;

    fn record_length(&self) -> Option<u64>;

    fn recorded(&self, from: u64) -> Option<String>;

    /// Starts an executor on simulated `pins`. `late` simulates a host that is late by this many ticks at
    /// every step.
    fn seat(
        &self,
        machine: &Machine,
        pins: Box<dyn Pins + Send>,
        late: Option<u64>,
        shared: &Arc<Shared>,
    ) -> Result<Box<dyn Seat>, Diagnostic>;

    /// Starts an executor of a real machine. Also returns the timing quality of its clock, measured now or
    /// taken from `measured`; `None` if this computer's clock times nothing.
    fn real_seat(
        &self,
        machine: &Machine,
        measured: Option<Lateness>,
        shared: &Arc<Shared>,
    ) -> Result<(Box<dyn Seat>, Option<Timing>), Diagnostic>;
}
