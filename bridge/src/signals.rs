//! The toolpaths a person or the system asks a command to end: Ctrl-C, `kill`, a closed terminal.
//!
//! Comes in: signals. Goes out: the exit code that each means for a server. Nothing that comes between two waits is
//! missed. Does not know what is ended.

use crate::refusal::Exit;
use std::io;

/// Listens from when it is made.
#[cfg(unix)]
pub(crate) struct Signals([tokio::signal::unix::Signal; 3]);

#[cfg(unix)]
impl Signals {
    /// To be made inside a runtime.
    pub(crate) fn new() -> io::Result<Self> {
        use tokio::signal::unix::{SignalKind, signal};
        let all = [SignalKind::interrupt(), SignalKind::terminate(), SignalKind::hangup()];
        let [interrupt, terminate, hangup] = all.map(signal);
        Ok(Self([interrupt?, terminate?, hangup?]))
    }

    /// Waits for the next one; may be dropped and called again.
    pub(crate) async fn wait(&mut self) -> Exit {
        let [interrupt, terminate, hangup] = &mut self.0;
        tokio::select! {
            _ = interrupt.recv() => Exit::Interrupted,
            _ = terminate.recv() => Exit::Done,
            _ = hangup.recv() => Exit::Done,
        }
    }
}

/// Listens from when it is made.
#[cfg(windows)]
pub(crate) struct Signals(tokio::signal::windows::CtrlC);

#[cfg(windows)]
impl Signals {
    /// To be made inside a runtime.
    pub(crate) fn new() -> io::Result<Self> {
        tokio::signal::windows::ctrl_c().map(Self)
    }

    /// Waits for the next one; may be dropped and called again.
    pub(crate) async fn wait(&mut self) -> Exit {
        self.0.recv().await;
        Exit::Interrupted
    }
}
