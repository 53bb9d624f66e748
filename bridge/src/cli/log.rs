//! Writes the log of `annulus serve` to standard error without blocking.
//!
//! If the terminal is paused or the pipe is full, lines are dropped, because STOP must not wait for a
//! terminal.

use super::verbosity;
use std::io::{self, Write};
use std::sync::OnceLock;
use std::sync::mpsc::{SyncSender, sync_channel};
use std::thread;

/// Maximum number of queued lines.
const WAITING: usize = 1024;

static LINES: OnceLock<SyncSender<Vec<u8>>> = OnceLock::new();

/// A writer that queues one line.
struct Line;

impl Write for Line {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        match LINES.get() {
            Some(lines) => drop(lines.try_send(line.to_vec())),
            None => io::stderr().write_all(line)?,
        }
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Starts the log with the filter in `ANNULUS_LOG`, or else as detailed as the user asked for. `is_brief`
/// leaves out what is no warning.
pub(super) fn begin(is_brief: bool) {
    let filter = tracing_subscriber::EnvFilter::try_from_env("ANNULUS_LOG");
    let usual = match (verbosity::is_verbose(), is_brief || verbosity::is_quiet()) {
        (true, _) => "info,annulus=debug",
        (false, true) => "warn",
        (false, false) => "info",
    };
    let filter = filter.unwrap_or_else(|_| tracing_subscriber::EnvFilter::new(usual));
    let (lines, written) = sync_channel::<Vec<u8>>(WAITING);
    let write = move || {
        while let Ok(line) = written.recv() {
            let _ = io::stderr().write_all(&line);
        }
    };
    if thread::Builder::new().name("log".to_owned()).spawn(write).is_ok() {
        let _ = LINES.set(lines);
    }
    let _ = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_ansi(verbosity::has_color())
        .with_writer(|| Line)
        .try_init();
}
