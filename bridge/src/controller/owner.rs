//! The thread that owns a port: it reads, lets the engine think, writes, and tells.
//!
//! Comes in: an open port, asks. Goes out: what the engine told, each with a glimpse. A port that is gone is told once, and the thread
//! ends. Knows time, unlike the engine.

use super::ledger::Ledger;
use crate::serial::Port;
use annulus_core::controller::{EngineAsk, EngineEvent};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::ToolWear;
use annulus_drill::controller::{Attended, AttendedJob, Due, JobTools, Told};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::JoinHandle;
use std::time::Instant;

/// A controller at a port.
pub(crate) struct Owner {
    asks: Sender<EngineAsk>,
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
        let (mut attended, began, wear) = (Attended::new(entry), Instant::now(), ledger.wear());
        attended.counts(tools);
        let mut work = Work { port, ledger, wear, attended, tells, began, speed };
        let thread = std::thread::Builder::new().name("controller".to_owned());
        let thread = thread.spawn(move || work.run(&asked)).ok();
        Self { asks, told, thread }
    }

    /// Asks the engine; what comes of it is told.
    pub(crate) fn ask(&self, ask: EngineAsk) {
        let _ = self.asks.send(ask);
    }

    /// What is told next, if anything is within a short time.
    pub(crate) fn next(&self) -> Option<Told> {
        use std::sync::mpsc::RecvTimeoutError;
        match self.told.recv_timeout(std::time::Duration::from_millis(20)) {
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
    began: Instant,
    speed: f64,
}

impl Work {
    fn run(&mut self, asked: &Receiver<EngineAsk>) {
        let opened = if self.port.spares { EngineEvent::OpenedSparing } else { EngineEvent::Opened };
        let mut goes = self.event(opened);
        while goes {
            goes = match asked.try_recv() {
                Ok(ask) => self.event(EngineEvent::Ask(ask)),
                Err(TryRecvError::Empty) => match self.port.read() {
                    Ok(bytes) if bytes.is_empty() => self.event(EngineEvent::Tick),
                    Ok(bytes) => self.event(EngineEvent::Bytes(bytes)),
                    Err(error) => self.gone(&error),
                },
                Err(TryRecvError::Disconnected) => return,
            };
        }
        self.tell(Told::Gone);
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
        let now_ms = (self.began.elapsed().as_secs_f64() * 1e3 * self.speed) as u64;
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
