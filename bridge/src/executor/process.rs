//! The bridge's end of an executor in a process of its own.
//!
//! Comes in: orders, stops, the durable count. Goes out: frames to the process; from it reports, the latest place, and once
//! what its clock is worth. The process is never killed: it comes to rest by itself when its pipe ends. Does not know pins.

use super::frames::{self, Down, Up};
use super::thread::Message;
use super::{Heard, Shared};
use annulus_core::control::{Lateness, Timing};
use annulus_core::machine::{self, Machine};
use annulus_core::remark::{Remark, Weight};
use std::io;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

/// How long it may take to be ready: another process may have to let go first, and the clock is measured.
const READY: Duration = Duration::from_secs(30);

/// How long it may take to come to rest and end.
const END: Duration = Duration::from_secs(6);

/// An executor process.
pub(crate) struct Process {
    child: Child,
    orders: Option<Sender<Down>>,
    /// It said that it cannot go on, or its pipe ended.
    gone: Arc<AtomicBool>,
    /// It was told to end: that it does is no news.
    finishing: Arc<AtomicBool>,
}

fn failed(error: impl std::fmt::Display) -> Remark {
    Remark::new(Weight::Loss, "output.executor_failed").with("reason", error)
}

/// Starts the executor of `machine`, whose record is `record`, and waits until its outputs are safe and its clock is
/// measured, or was `measured` before. `hear` is called from another thread.
pub(crate) fn start(
    machine: &Machine,
    record: &Path,
    measured: Option<Lateness>,
    shared: &Arc<Shared>,
    hear: impl Fn(Heard) + Send + 'static,
) -> Result<(Process, Timing), Remark> {
    let mut child = spawn().map_err(failed)?;
    let (Some(stdin), Some(stdout)) = (child.stdin.take(), child.stdout.take()) else {
        return Err(failed("no pipe"));
    };
    let (orders, frames_down) = channel();
    let settings = machine::read(machine);
    let (stopped, durable) = (&shared.stop_upto, &shared.durable);
    for frame in [
        Down::Start { settings, record: record.to_owned(), measured },
        Down::Stop(stopped.load(Ordering::SeqCst)),
        Down::Durable(durable.load(Ordering::SeqCst)),
        Down::Pace(shared.pace()),
    ] {
        let _ = orders.send(frame);
    }
    let (gone, finishing) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
    let (ready, answer) = channel();
    let reader = Reader {
        shared: Arc::clone(shared),
        gone: Arc::clone(&gone),
        finishing: Arc::clone(&finishing),
        ready,
    };
    thread::Builder::new()
        .name("orders".to_owned())
        .spawn(move || write(stdin, &frames_down))
        .and_then(|_| {
            let read = move || reader.read(stdout, hear);
            thread::Builder::new().name("reports".to_owned()).spawn(read)
        })
        .map_err(failed)?;
    let mut process = Process { child, orders: Some(orders.clone()), gone, finishing };
    match answer.recv_timeout(READY) {
        Ok(Ok(timing)) => {
            shared.set_courier(Some(orders));
            Ok((process, timing))
        }
        Ok(Err(why)) => {
            drop(orders);
            process.finish();
            Err(why)
        }
        Err(_) => {
            drop(orders);
            process.finish();
            Err(failed("it does not answer"))
        }
    }
}

fn spawn() -> io::Result<Child> {
    let mut command = Command::new(std::env::current_exe()?);
    command.arg("executor").stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::inherit());
    // Ctrl-C in the terminal is for the bridge: it ends the executor when the machine rests.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command.spawn()
}

fn write(mut pipe: impl io::Write, frames_down: &Receiver<Down>) {
    while let Ok(frame) = frames_down.recv() {
        if frames::send(&mut pipe, &frame).is_err() {
            return;
        }
    }
}

/// What hears the process.
struct Reader {
    shared: Arc<Shared>,
    gone: Arc<AtomicBool>,
    finishing: Arc<AtomicBool>,
    ready: Sender<Result<Timing, Remark>>,
}

impl Reader {
    fn read(self, mut pipe: impl io::Read, hear: impl Fn(Heard)) {
        let mut begun = false;
        let why = loop {
            match frames::receive(&mut pipe) {
                Ok(Some(Up::Ready(timing))) => {
                    begun = true;
                    let _ = self.ready.send(Ok(timing));
                }
                Ok(Some(Up::Report(report))) => hear(Heard::Report(report)),
                Ok(Some(Up::Glimpse(glimpse))) => self.shared.set_glimpse(glimpse),
                Ok(Some(Up::Refused(why))) => break why,
                Ok(None) => break Remark::new(Weight::Loss, "output.executor_gone"),
                Err(error) => break failed(error),
            }
        };
        self.gone.store(true, Ordering::SeqCst);
        if !begun {
            let _ = self.ready.send(Err(why));
        } else if !self.finishing.load(Ordering::SeqCst) {
            hear(Heard::Gone(why));
        }
    }
}

impl Process {
    /// Whether it died or gave up.
    pub(crate) fn is_gone(&self) -> bool {
        self.gone.load(Ordering::SeqCst)
    }

    /// Whether it was not told to end yet.
    pub(super) fn is_open(&self) -> bool {
        self.orders.is_some()
    }

    /// Lets it come to rest and end.
    pub(super) fn finish(&mut self) {
        self.finishing.store(true, Ordering::SeqCst);
        if let Some(orders) = self.orders.take() {
            let _ = orders.send(Down::Order(Message::Finish));
        }
        let since = Instant::now();
        while matches!(self.child.try_wait(), Ok(None)) && since.elapsed() < END {
            thread::sleep(Duration::from_millis(2));
        }
    }
}
