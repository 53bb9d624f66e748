//! The thread that owns a port: it reads, lets the engine think, writes, and tells.
//!
//! ```text
//! turn ── 4 ms ── turn ─────── 6 s: suspended, asleep ─────── turn ─▶ held, told; on when a person wants that
//! ```
//!
//! Comes in: an open port, asks. Goes out: what the engine told, each with a glimpse. A port that is gone is told once, and the thread
//! ends. Knows time, unlike the engine.

use super::clock::Stopwatch;
use super::ledger::Ledger;
use crate::serial::Port;
use annulus_core::controller::{EngineAsk, EngineEvent, EnginePhase};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::ToolWear;
use annulus_drill::controller::{Attended, AttendedJob, Due, HELD_AFTER, Host, HostNews, JobTools, Told};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// What comes from the person.
enum Asked {
    Engine(EngineAsk),
    /// Somebody is there, and looks at the machine.
    Attention,
}

/// What a turn of the thread is for.
enum Came {
    Asked(Asked),
    Read(std::io::Result<Vec<u8>>),
}

/// A controller at a port.
pub(crate) struct Owner {
    asks: Sender<Asked>,
    /// Asks that the engine did not think about yet.
    open: Arc<AtomicU64>,
    told: Receiver<Told>,
    thread: Option<JoinHandle<()>>,
}

impl Owner {
    /// Takes the port. What is done of `entry`, and of its `tools` where they are counted, is written into `ledger`. The controller's
    /// seconds go by `speed` times as fast.
    pub(crate) fn new(
        port: Port,
        ledger: Ledger,
        (entry, tools): (AttendedJob, Option<JobTools>),
        speed: f64,
    ) -> Self {
        let ((asks, asked), (tells, told)) = (channel(), channel());
        let (mut attended, watch, wear) = (Attended::new(entry), Stopwatch::start(), ledger.wear());
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

    /// Asks the engine; what comes of it is told.
    pub(crate) fn ask(&self, ask: EngineAsk) {
        self.open.fetch_add(1, Ordering::SeqCst);
        let _ = self.asks.send(Asked::Engine(ask));
    }

    /// A person is there and knows how the machine stands: what was to be held because nobody was there goes on.
    pub(crate) fn attend(&self) {
        self.open.fetch_add(1, Ordering::SeqCst);
        let _ = self.asks.send(Asked::Attention);
    }

    /// Whether the engine has thought about everything that it was asked, and what came of it is told.
    pub(crate) fn has_heard_all(&self) -> bool {
        self.open.load(Ordering::SeqCst) == 0
    }

    /// What is told next, if anything is within a short time.
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
    /// What tools have done where the job counts none.
    wear: Vec<ToolWear>,
    attended: Attended,
    tells: Sender<Told>,
    watch: Stopwatch,
    /// What it showed in this turn.
    now: Duration,
    speed: f64,
    host: Host,
    /// The computer, or this process, stood still for so long that nothing goes on unasked.
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
            // That was now, however long it was waited for.
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

    /// Where it stood still, the board has run what it had: how long that took says nothing.
    fn looks_at_host(&mut self) -> bool {
        let Some(news) = self.host.look(self.now) else { return true };
        self.is_late |= news == HostNews::TooLate;
        self.event(EngineEvent::Late)
    }

    /// Whoever stands at the machine takes it for held after a while: a job goes on when a person wants that, and its place is known as
    /// before. Where it cannot be held, it is as soon as it is on its path.
    fn holds_where_late(&mut self) -> bool {
        let moves = matches!(self.attended.controller().phase, EnginePhase::Running | EnginePhase::Surveying);
        if !moves || !std::mem::take(&mut self.is_late) {
            return true;
        }
        let goes = self.event(EngineEvent::Ask(EngineAsk::Hold));
        let why = Diagnostic::warning("grbl.command_stood").with("seconds", HELD_AFTER.as_secs());
        self.tell(Told::Found(why));
        goes
    }

    fn tell(&self, told: Told) {
        let _ = self.tells.send(told);
    }

    fn gone(&mut self, error: &std::io::Error) -> bool {
        let why = Diagnostic::error("grbl.port_lost").with("port", &self.port.name);
        self.tell(Told::Found(why.with("reason", error)));
        self.event(EngineEvent::Closed);
        false
    }

    /// Lets the engine think and does what it says; false when the port is to be left.
    fn event(&mut self, event: EngineEvent) -> bool {
        let passed = self.now.saturating_sub(self.host.stood());
        let now_ms = (passed.as_secs_f64() * 1e3 * self.speed) as u64;
        let mut goes = true;
        for due in self.attended.event(now_ms, event) {
            goes &= self.see_to(due);
        }
        goes
    }

    fn see_to(&mut self, due: Due) -> bool {
        match due {
            Due::Write(bytes) => {
                if let Err(error) = self.port.write(&bytes) {
                    return self.gone(&error);
                }
            }
            Due::Close => return false,
            Due::Tell(told) => self.tell(told),
            // Where it cannot be written down, nothing new may be begun.
            Due::Keep(entry) => {
                let wear = self.attended.tools().map_or(self.wear.as_slice(), JobTools::wear);
                if let Err(why) = self.ledger.write(&entry, wear) {
                    self.tell(Told::Found(why));
                    let _ = self.port.write(b"!");
                }
            }
        }
        true
    }
}
