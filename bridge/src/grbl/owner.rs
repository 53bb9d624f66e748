//! The thread that owns a controller's port: it reads, runs the engine, writes and reports. Unlike the
//! engine, it knows the time.
//!
//! ```text
//! turn ── 4 ms ── turn ─────── 6 s: suspended, asleep ─────── turn ─▶ hold, report; the user resumes
//! ```
//!
//! A lost port is reported once, and the thread ends.

use super::Ledger;
use super::clock::Stopwatch;
use crate::serial::Port;
use annulus_core::grbl::{EngineAsk, EngineEvent, EnginePhase};
use annulus_core::machine::ToolWear;
use annulus_core::{error, warning};
use annulus_host::grbl::{Attended, AttendedJob, Due, HELD_AFTER, Host, HostNews, JobTools, Told};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// A request of the user.
enum Asked {
    Engine(EngineAsk),
    /// The user is present and watches the machine.
    Attention,
}

/// Input for a turn of the thread.
enum Came {
    Asked(Asked),
    Read(std::io::Result<Vec<u8>>),
}

/// A controller at a port.
pub(crate) struct Owner {
    asks: Sender<Asked>,
    /// Number of requests that the engine has not handled yet.
    open: Arc<AtomicU64>,
    told: Receiver<Told>,
    thread: Option<JoinHandle<()>>,
}

impl Owner {
    /// Takes over the port. Progress of `entry`, and of its `tools` if counted, is saved in `ledger`.
    /// `speed` is the time scale of the controller.
    pub(crate) fn new(
        port: Port,
        ledger: Ledger,
        (entry, tools): (AttendedJob, Option<JobTools>),
        speed: f64,
    ) -> Self {
        let ((asks, asked), (tells, told)) = (channel(), channel());
        let (mut attended, watch, wear) = (Attended::new(entry), Stopwatch::start(), ledger.wear().to_vec());
        attended.counts(tools);
        let (now, open) = (watch.elapsed(), Arc::<AtomicU64>::default());
        let host = Host::new(now, speed);
        let (own, is_late) = (Arc::clone(&open), false);
        let mut work =
            Work { port, ledger, wear, attended, tells, watch, now, speed, host, is_late, open: own };
        let thread = std::thread::Builder::new().name("controller".to_owned());
        let thread = thread.spawn(move || work.run(&asked)).ok();
        Self { asks, open, told, thread }
    }

    /// Sends a request to the engine; results arrive as news.
    pub(crate) fn ask(&self, ask: EngineAsk) {
        self.open.fetch_add(1, Ordering::SeqCst);
        let _ = self.asks.send(Asked::Engine(ask));
    }

    /// The user is present and knows the machine's state: a hold because of absence is no longer needed.
    pub(crate) fn attend(&self) {
        self.open.fetch_add(1, Ordering::SeqCst);
        let _ = self.asks.send(Asked::Attention);
    }

    /// Returns `true` if the engine has handled every request and its results are reported.
    pub(crate) fn has_heard_all(&self) -> bool {
        self.open.load(Ordering::SeqCst) == 0
    }

    /// The next news, if any arrives within a short time.
    pub(crate) fn next(&self) -> Option<Told> {
        use std::sync::mpsc::RecvTimeoutError;
        match self.told.recv_timeout(Duration::from_millis(20)) {
            Ok(told) => Some(told),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => Some(Told::Gone),
        }
    }
}

impl Drop for Owner {
    fn drop(&mut self) {
        let (asks, _) = channel();
        drop(std::mem::replace(&mut self.asks, asks));
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

struct Work {
    port: Port,
    ledger: Ledger,
    /// Tool wear, for jobs that count none.
    wear: Vec<ToolWear>,
    attended: Attended,
    tells: Sender<Told>,
    watch: Stopwatch,
    /// The time at the start of this turn.
    now: Duration,
    speed: f64,
    host: Host,
    /// The host stalled too long: the job may not continue unasked.
    is_late: bool,
    open: Arc<AtomicU64>,
}

impl Work {
    fn run(&mut self, asked: &Receiver<Asked>) {
        let opened = if self.port.spares { EngineEvent::OpenedSparing } else { EngineEvent::Opened };
        let mut goes = self.event(opened);
        while goes {
            let came = match asked.try_recv() {
                Ok(asked) => Came::Asked(asked),
                Err(TryRecvError::Empty) => Came::Read(self.port.read()),
                Err(TryRecvError::Disconnected) => break,
            };
            // Read the clock after the wait: the input is from now.
            self.now = self.watch.elapsed();
            goes = self.looks_at_host() && self.holds_where_late() && self.takes(came);
        }
        self.tell(Told::Gone);
    }

    fn takes(&mut self, came: Came) -> bool {
        match came {
            Came::Asked(asked) => {
                let goes = self.asked(asked);
                self.open.fetch_sub(1, Ordering::SeqCst);
                goes
            }
            Came::Read(Ok(bytes)) if bytes.is_empty() => self.event(EngineEvent::Tick),
            Came::Read(Ok(bytes)) => self.event(EngineEvent::Bytes(bytes)),
            Came::Read(Err(error)) => self.gone(&error),
        }
    }

    fn asked(&mut self, asked: Asked) -> bool {
        match asked {
            Asked::Attention => {
                self.is_late = false;
                true
            }
            Asked::Engine(ask) => {
                self.is_late &= !matches!(ask, EngineAsk::Resume | EngineAsk::Stop);
                self.event(EngineEvent::Ask(ask))
            }
        }
    }

    /// After a stall the controller may have run empty: timeouts mean nothing.
    fn looks_at_host(&mut self) -> bool {
        let Some(news) = self.host.look(self.now) else { return true };
        self.is_late |= news == HostNews::TooLate;
        self.event(EngineEvent::Late)
    }

    /// After a while a user at the machine believes that it has stopped, so hold the job until the user
    /// resumes it. The position stays valid. If it cannot be held now, hold it as soon as it moves.
    fn holds_where_late(&mut self) -> bool {
        let moves = matches!(self.attended.controller().phase, EnginePhase::Running | EnginePhase::Surveying);
        if !moves || !std::mem::take(&mut self.is_late) {
            return true;
        }
        let goes = self.event(EngineEvent::Ask(EngineAsk::Hold));
        let why = warning!("grbl.command_stood", seconds = HELD_AFTER.as_secs());
        self.tell(Told::Found(why));
        goes
    }

    fn tell(&self, told: Told) {
        let _ = self.tells.send(told);
    }

    fn gone(&mut self, error: &std::io::Error) -> bool {
        let why = error!("grbl.port_lost", port = &self.port.name, ..);
        self.tell(Told::Found(why.with("reason", error)));
        self.event(EngineEvent::Closed);
        false
    }

    /// Feeds the engine and carries out the resulting work. Returns `false` if the port should be closed.
    fn event(&mut self, event: EngineEvent) -> bool {
        let passed = self.now.saturating_sub(self.host.stood());
        let now_ms = (passed.as_secs_f64() * 1e3 * self.speed) as u64;
        let (mut goes, mut is_saved) = (true, true);
        for due in self.attended.event(now_ms, event) {
            goes &= self.see_to(due, &mut is_saved);
        }
        // Without a saved progress nothing new may start. A job that has ended needs no hold.
        if !is_saved && self.attended.controller().phase == EnginePhase::Running {
            goes &= self.event(EngineEvent::Ask(EngineAsk::Hold));
        }
        goes
    }

    fn see_to(&mut self, due: Due, is_saved: &mut bool) -> bool {
        match due {
            Due::Write(bytes) => {
                if let Err(error) = self.port.write(&bytes) {
                    return self.gone(&error);
                }
            }
            Due::Close => return false,
            Due::Tell(told) => self.tell(told),
            Due::Keep(entry) => {
                let wear = self.attended.tools().map_or(self.wear.as_slice(), JobTools::wear);
                if let Err(why) = self.ledger.save(&entry, wear.to_vec()) {
                    self.tell(Told::Found(why));
                    *is_saved = false;
                }
            }
        }
        true
    }
}
