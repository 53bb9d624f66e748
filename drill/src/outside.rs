//! What the drill needs of the place where it runs: executors, a journal, a file of settings, a record, and somebody to tell.
//!
//! Comes in: records, tells, machines. Goes out: executors, what was kept. Nothing of it waits for the owner. Does not know what
//! is behind it: threads and files, or a page.

use crate::executor::{Seat, Shared};
use crate::journal::Record;
use crate::surface::KeptSurface;
use annulus_core::control::{Lateness, Timing};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::Machine;
use annulus_core::pins::Pins;
use annulus_core::wire::Tell;
use std::sync::Arc;

/// The place where a drill runs. What it hears of executors and journal it puts before the owner as messages.
pub trait Outside: Send {
    /// Tells everybody. Nobody listening is fine.
    fn tell(&self, tell: Tell);

    /// Has `record` written behind those before it; what comes of it the owner hears as a message.
    fn record(&self, record: Record);

    /// Whether what is to be written will be.
    fn records(&self) -> bool;

    /// Whether the setting `key`, which belongs into a machine's file, is changed here all the same: where there is no such file.
    fn may_rewire(&self, _key: &str) -> bool {
        false
    }

    /// Keeps the machine's settings.
    fn keep_settings(&self, machine: &Machine) -> Result<(), Diagnostic>;

    /// Keeps the height map of the board in place of the one before; or none.
    fn keep_surface(&self, surface: Option<&KeptSurface>) -> Result<(), Diagnostic>;

    /// How long the drilled-board record is, bytes.
    fn record_length(&self) -> Option<u64>;

    /// The drilled-board record from that byte on.
    fn recorded(&self, from: u64) -> Option<String>;

    /// An executor that plays on `pins`, on a computer that is so `late` with every step, in ticks, where that is to be judged.
    fn seat(
        &self,
        machine: &Machine,
        pins: Box<dyn Pins + Send>,
        late: Option<u64>,
        shared: &Arc<Shared>,
    ) -> Result<Box<dyn Seat>, Diagnostic>;

    /// An executor of a machine that is not virtual, and what its clock is worth, or was `measured` before; none where the clock
    /// of this computer times nothing.
    fn real_seat(
        &self,
        machine: &Machine,
        measured: Option<Lateness>,
        shared: &Arc<Shared>,
    ) -> Result<(Box<dyn Seat>, Option<Timing>), Diagnostic>;
}
