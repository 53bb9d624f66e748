//! The bridge's end of an executor in a separate process.
//!
//! ```text
//! orders ──┐                                    ┌─ the pipe ends, or nothing arrives for 500 ms:
//! alive ───┴─▶ process ──▶ reports, positions ─▶┤  end the process, and switch its outputs off here
//! ```
//!
//! A live process stops when its pipe ends; it is killed only if it does not.

use super::Heard;
use super::frames::{self, BEAT, Down, Up};
use crate::outputs;
use crate::spindle;
use annulus_core::control::{Lateness, Timing};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{self, Machine};
use annulus_core::{code, error};
use annulus_host::executor::{Instruction, Said, Seat, Shared};
use std::io::{self, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// How long it may take to be ready: another process may have to release the port first, and the clock is
/// measured.
const READY: Duration = Duration::from_secs(30);

const END: Duration = Duration::from_secs(6);

/// Longest silence of the process. Counted in beats: time in which the bridge did not run either does not
/// count.
const SILENCE: Duration = Duration::from_millis(500);

/// How long a process may take to end after its last message.
const GRACE: Duration = Duration::from_secs(1);

pub(crate) struct Process {
    link: Arc<Link>,
    orders: Option<Sender<Down>>,
    shared: Arc<Shared>,
}

struct Link {
    machine: Machine,
    child: Mutex<Child>,
    pipe: Mutex<Option<ChildStdin>>,
    heard: AtomicU64,
    /// The process took over the outputs and was ready.
    begun: AtomicBool,
    silent: AtomicBool,
    /// The process cannot continue, or its pipe ended; its outputs are off.
    gone: AtomicBool,
    /// The process was ordered to end, so its end is not reported.
    finishing: AtomicBool,
}

fn failed(error: impl std::fmt::Display) -> Diagnostic {
    error!("output.executor_failed", reason = error)
}

/// Starts the executor of `machine` with its record at `record`. Waits until its outputs are safe and its
/// clock is measured, unless `measured` is given. `hear` is called from another thread.
pub(crate) fn start(
    machine: &Machine,
    record: &Path,
    measured: Option<Lateness>,
    shared: &Arc<Shared>,
    hear: impl Fn(Heard) + Send + 'static,
) -> Result<(Process, Timing), Diagnostic> {
    let mut child = spawn().map_err(failed)?;
    let (Some(mut stdin), Some(stdout)) = (child.stdin.take(), child.stdout.take()) else {
        return Err(failed("no pipe"));
    };
    let settings = machine::read(machine);
    // First of all, before the first keep-alive.
    frames::send(&mut stdin, &Down::Start { settings, record: record.to_owned(), measured })
        .map_err(failed)?;
    let (orders, frames_down) = channel();
    // These may have changed before the process existed; it starts with defaults.
    for said in [
        Said::Stop { upto: shared.stopped() },
        Said::Durable { legs: shared.durable() },
        Said::FeedOverride { percent: shared.feed_override() },
    ] {
        let _ = orders.send(Down::Said(said));
    }
    let link = Arc::new(Link {
        machine: machine.clone(),
        child: Mutex::new(child),
        pipe: Mutex::new(Some(stdin)),
        heard: AtomicU64::new(0),
        begun: AtomicBool::new(false),
        silent: AtomicBool::new(false),
        gone: AtomicBool::new(false),
        finishing: AtomicBool::new(false),
    });
    let shared = Arc::clone(shared);
    let mut process =
        Process { link: Arc::clone(&link), orders: Some(orders.clone()), shared: Arc::clone(&shared) };
    let (ready, answer) = channel();
    let reader = Reader { shared: Arc::clone(&shared), link: Arc::clone(&link), ready };
    let (writer, watcher) = (Arc::clone(&link), link);
    let named = |name: &str| thread::Builder::new().name(name.to_owned());
    named("orders")
        .spawn(move || writer.write_all(&frames_down))
        .and_then(|_| named("heartbeat").spawn(move || watcher.watch()))
        .and_then(|_| named("reports").spawn(move || reader.read(stdout, hear)))
        .map_err(failed)?;
    let answer = answer.recv_timeout(READY).unwrap_or_else(|_| Err(failed("it does not answer")));
    match answer {
        Ok(timing) => {
            shared.set_courier(Some(Box::new(move |said| drop(orders.send(Down::Said(said))))));
            Ok((process, timing))
        }
        Err(why) => {
            drop(orders);
            process.finish();
            Err(why)
        }
    }
}

fn spawn() -> io::Result<Child> {
    let mut command = Command::new(std::env::current_exe()?);
    command.arg("executor").stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::inherit());
    // Ctrl-C in the terminal must reach only the bridge, which ends the executor after the machine has
    // stopped.
    #[cfg(unix)]
    std::os::unix::process::CommandExt::process_group(&mut command, 0);
    command.spawn()
}

/// Returns `true` if a short frame fits into the pipe without blocking.
fn has_room(pipe: &ChildStdin) -> bool {
    #[cfg(unix)]
    {
        use rustix::event::{PollFd, PollFlags, Timespec, poll};
        let mut asked = [PollFd::new(pipe, PollFlags::OUT)];
        let at_once = Timespec { tv_sec: 0, tv_nsec: 0 };
        poll(&mut asked, Some(&at_once)).is_ok() && asked[0].revents().contains(PollFlags::OUT)
    }
    #[cfg(not(unix))]
    {
        let _ = pipe;
        true
    }
}

impl Link {
    /// Sends frames until there are no more, or the pipe breaks.
    fn write_all(&self, frames_down: &Receiver<Down>) {
        while let Ok(frame) = frames_down.recv() {
            let Ok(bytes) = frames::encode(&frame) else { break };
            let mut pipe = self.pipe.lock().unwrap_or_else(PoisonError::into_inner);
            if pipe.as_mut().is_none_or(|pipe| pipe.write_all(&bytes).is_err()) {
                break;
            }
        }
        *self.pipe.lock().unwrap_or_else(PoisonError::into_inner) = None;
    }

    /// Sends keep-alives, and checks that the process is alive. A silent process is killed: it cannot
    /// receive a stop, and must not wake up after its outputs were made safe.
    fn watch(&self) {
        let alive = frames::encode(&Down::Alive).unwrap_or_default();
        let patience = super::patience(&self.machine, SILENCE);
        let (mut before, mut silent) = (0, Duration::ZERO);
        while !self.gone.load(Ordering::SeqCst) {
            // A busy pipe carries a frame, which is as good as a keep-alive. A full pipe has no reader and
            // must not block this thread.
            if let Ok(mut pipe) = self.pipe.try_lock() {
                match pipe.as_mut() {
                    Some(pipe) if has_room(pipe) => drop(pipe.write_all(&alive)),
                    Some(_) => {}
                    None => return,
                }
            }
            thread::sleep(BEAT);
            let heard = self.heard.load(Ordering::SeqCst);
            // Before its first frame the process measures the clock, which takes longer than the patience.
            silent = if heard == 0 || heard != before { Duration::ZERO } else { silent + BEAT };
            before = heard;
            if silent >= patience {
                self.silent.store(true, Ordering::SeqCst);
                self.kill();
                return;
            }
        }
    }

    fn kill(&self) {
        let mut child = self.child.lock().unwrap_or_else(PoisonError::into_inner);
        let _ = child.kill().and_then(|()| child.wait());
    }

    /// Waits for the end; kills the process after `patience`. Returns `true` if it left the outputs safe.
    fn await_end(&self, patience: Duration) -> bool {
        let since = Instant::now();
        loop {
            let mut child = self.child.lock().unwrap_or_else(PoisonError::into_inner);
            match child.try_wait() {
                Ok(Some(status)) => return status.success(),
                Ok(None) if since.elapsed() < patience => {}
                _ => break,
            }
            // Another thread must be able to kill the process meanwhile.
            drop(child);
            thread::sleep(Duration::from_millis(2));
        }
        self.kill();
        false
    }

    /// Switches off what an ended process left on. Outputs that it never took over may belong to another
    /// one.
    fn make_safe(&self) -> Result<(), Diagnostic> {
        if !self.begun.load(Ordering::SeqCst) {
            return Ok(());
        }
        // Try both, even if the first fails.
        let pins = outputs::make_safe(&self.machine);
        let converter = spindle::make_safe(&self.machine);
        pins.and(converter).map_err(|why| {
            tracing::error!("{}", why.message("en"));
            error!("output.not_safe", reason = why.message("en"))
        })
    }
}

struct Reader {
    shared: Arc<Shared>,
    link: Arc<Link>,
    ready: Sender<Result<Timing, Diagnostic>>,
}

impl Reader {
    fn read(self, mut pipe: impl io::Read, hear: impl Fn(Heard)) {
        let mut begun = false;
        let why = loop {
            let frame = frames::receive(&mut pipe);
            self.link.heard.fetch_add(1, Ordering::SeqCst);
            match frame {
                Ok(Some(Up::Ready(timing))) => {
                    begun = true;
                    self.link.begun.store(true, Ordering::SeqCst);
                    let _ = self.ready.send(Ok(timing));
                }
                Ok(Some(Up::Report(report))) => hear(Heard::Report(report)),
                Ok(Some(Up::Glimpse(glimpse))) => self.shared.change_glimpse(|last| *last = glimpse),
                Ok(Some(Up::Alive)) => {}
                Ok(Some(Up::Refused(why))) => break why,
                Err(error) if error.kind() != io::ErrorKind::UnexpectedEof => break failed(error),
                Ok(None) | Err(_) => {
                    let silent = self.link.silent.load(Ordering::SeqCst);
                    let code =
                        if silent { code!("output.executor_silent") } else { code!("output.executor_gone") };
                    break Diagnostic::error(code);
                }
            }
        };
        let finishing = self.link.finishing.load(Ordering::SeqCst);
        let why = if finishing { why } else { self.end(why) };
        self.link.gone.store(true, Ordering::SeqCst);
        if !begun {
            let _ = self.ready.send(Err(why));
        } else if !finishing {
            hear(Heard::Gone(why));
        }
    }

    /// The process is gone, or ends: switches its outputs off at once. Returns `why`, or a worse problem if
    /// that failed.
    fn end(&self, why: Diagnostic) -> Diagnostic {
        // A writer that is blocked on a full pipe holds the lock; waiting for it could hang. Closing the pipe
        // ends the process.
        if let Ok(mut pipe) = self.link.pipe.try_lock() {
            *pipe = None;
        }
        if self.link.await_end(GRACE) {
            return why;
        }
        self.link.make_safe().err().unwrap_or(why)
    }
}

impl Seat for Process {
    fn order(&self, message: Instruction) {
        self.shared.say(Said::Order(message));
    }

    fn is_gone(&self) -> bool {
        self.link.gone.load(Ordering::SeqCst)
    }

    fn make_safe(&self) -> Result<(), Diagnostic> {
        self.link.make_safe()
    }

    fn finish(&mut self) {
        // Only once: later the courier may belong to another executor.
        let Some(orders) = self.orders.take() else { return };
        self.shared.set_courier(None);
        self.link.finishing.store(true, Ordering::SeqCst);
        let _ = orders.send(Down::Said(Said::Order(Instruction::Finish)));
        drop(orders);
        if !self.is_gone() && !self.link.await_end(END) {
            let _ = self.link.make_safe();
        }
    }
}
