//! The command line as the client of the thread that owns a controller's port.

use super::hosted::{GrblHost, Site};
use crate::hosted::Hosted;
use crate::refusal::Refusal;
use annulus_core::grbl::{EngineAsk, ResetOnOpen};
use annulus_host::grbl::{Attended, AttendedJob, JobTools, Told};
use std::cell::Cell;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::Duration;

/// A controller at a port, for one command. Dropping it closes the port and stops nothing.
pub(crate) struct Client {
    host: GrblHost,
    told: Receiver<Told>,
    /// Number of requests that the engine has not handled yet.
    open: Cell<u64>,
    pub(crate) bits_per_s: u32,
}

impl Client {
    /// Opens the port of `site`. Progress of `entry`, and of its `tools` if counted, is saved there. `silent`
    /// is called for every baud rate without a response.
    pub(crate) fn open(
        mut site: Site,
        reset: ResetOnOpen,
        (entry, tools): (AttendedJob, Option<JobTools>),
        silent: impl Fn(u32),
    ) -> Result<Self, Refusal> {
        let (port, bits_per_s) = site.open(reset, silent)?;
        let mut attended = Attended::new(entry);
        attended.counts(tools);
        let (tells, told) = channel();
        let (host, _) = GrblHost::start(site, port, Some(((attended, reset), tells)))?;
        Ok(Self { host, told, open: Cell::default(), bits_per_s })
    }

    /// Sends a request to the engine; results arrive as news.
    pub(crate) fn ask(&self, ask: EngineAsk) {
        self.open.update(|open| open + 1);
        self.host.command(ask);
    }

    /// The user is present and knows the machine's state: a hold because of absence is no longer needed.
    pub(crate) fn attend(&self) {
        self.host.attend();
    }

    /// Returns `true` if the engine has handled every request and its results are reported.
    pub(crate) fn has_heard_all(&self) -> bool {
        self.open.get() == 0
    }

    /// The next news, if any arrives within a short time.
    pub(crate) fn next(&self) -> Option<Told> {
        match self.told.recv_timeout(Duration::from_millis(20)) {
            Ok(Told::Handled) => {
                self.open.update(|open| open.saturating_sub(1));
                None
            }
            Ok(told) => Some(told),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => Some(Told::Gone),
        }
    }
}

impl Drop for Client {
    fn drop(&mut self) {
        self.host.shutdown();
    }
}
