//! Signals that end a command: Ctrl-C, `kill`, a closed terminal. Signals between two waits are not lost.

use crate::refusal::Exit;
use std::io;

/// Listens from its creation on.
#[cfg(unix)]
pub(crate) struct Signals([tokio::signal::unix::Signal; 3]);

#[cfg(unix)]
impl Signals {
    /// Call it inside a runtime.
    pub(crate) fn new() -> io::Result<Self> {
        use tokio::signal::unix::{SignalKind, signal};
        let all = [SignalKind::interrupt(), SignalKind::terminate(), SignalKind::hangup()];
        let [interrupt, terminate, hangup] = all.map(signal);
        Ok(Self([interrupt?, terminate?, hangup?]))
    }

    /// Waits for the next signal; safe to drop and call again.
    pub(crate) async fn wait(&mut self) -> Exit {
        let [interrupt, terminate, hangup] = &mut self.0;
        tokio::select! {
            _ = interrupt.recv() => Exit::Interrupted,
            _ = terminate.recv() => Exit::Done,
            _ = hangup.recv() => Exit::Done,
        }
    }
}

/// Listens from its creation on.
#[cfg(windows)]
pub(crate) struct Signals(tokio::signal::windows::CtrlC);

#[cfg(windows)]
impl Signals {
    /// Call it inside a runtime.
    pub(crate) fn new() -> io::Result<Self> {
        tokio::signal::windows::ctrl_c().map(Self)
    }

    /// Waits for the next signal; safe to drop and call again.
    pub(crate) async fn wait(&mut self) -> Exit {
        self.0.recv().await;
        Exit::Interrupted
    }
}
