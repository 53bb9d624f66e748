//! The thread that owns a port: it reads, lets the engine think, writes, and tells.
//!
//! Comes in: an open port, asks. Goes out: what the engine told, each with a glimpse. A port that is gone is told once, and the thread
//! ends. Knows time, unlike the engine.

use super::ledger::{Entry, Ledger};
use crate::serial::Port;
use annulus_core::control::{Ending, Trust};
use annulus_core::controller::{Action, Ask, Controller, Event, Info, Phase, Routine, step};
use annulus_core::diagnostic::Diagnostic;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::thread::JoinHandle;
use std::time::Instant;

/// What the engine told.
#[derive(Debug)]
pub(crate) enum Told {
    /// Who is there is known.
    Greeted(Box<Info>),
    /// The work zero is where it was asked for.
    ZeroSet,
    /// So many sections are done, and it is on the disk.
    Progress,
    /// A tool is wanted: index into the routine's tools.
    ToolWanted(u32),
    /// The job is over.
    Ended(Ending),
    /// Something to be said.
    Found(Diagnostic),
    /// How it is now; after every change.
    Now(Box<Glimpse>),
    /// The port is gone; nothing follows.
    Gone,
}

/// How the controller is.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Glimpse {
    /// What it does.
    pub(crate) phase: Phase,
    /// How well its position is known.
    pub(crate) trust: Trust,
    /// Where the tip is in work coordinates, mm.
    pub(crate) place_mm: Option<[f64; 3]>,
    /// Work zero in machine coordinates, mm.
    pub(crate) zero_mm: Option<[f64; 3]>,
    /// Lines of jobs that were sent.
    pub(crate) sent: u64,
    /// Lines of jobs that were answered.
    pub(crate) answered: u64,
}

/// A controller at a port.
pub(crate) struct Owner {
    asks: Sender<Ask>,
    told: Receiver<Told>,
    thread: Option<JoinHandle<()>>,
}

impl Owner {
    /// Takes the port. What is done of `entry` is written into `ledger`. The controller's seconds go by `speed` times as fast.
    pub(crate) fn new(port: Port, ledger: Ledger, entry: Entry, speed: f64) -> Self {
        let ((asks, asked), (tells, told)) = (channel(), channel());
        let (controller, began) = (Controller::default(), Instant::now());
        let mut work =
            Work { port, ledger, entry, tells, controller, routine: None, began, speed, before: None };
        let thread = std::thread::Builder::new().name("controller".to_owned());
        let thread = thread.spawn(move || work.run(&asked)).ok();
        Self { asks, told, thread }
    }

    /// Asks the engine; what comes of it is told.
    pub(crate) fn ask(&self, ask: Ask) {
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
    entry: Entry,
    tells: Sender<Told>,
    controller: Controller,
    routine: Option<Arc<Routine>>,
    began: Instant,
    speed: f64,
    before: Option<Glimpse>,
}

impl Work {
    fn run(&mut self, asked: &Receiver<Ask>) {
        let mut goes = self.event(Event::Opened);
        while goes {
            goes = match asked.try_recv() {
                Ok(ask) => self.event(Event::Ask(ask)),
                Err(TryRecvError::Empty) => match self.port.read() {
                    Ok(bytes) if bytes.is_empty() => self.event(Event::Tick),
                    Ok(bytes) => self.event(Event::Bytes(bytes)),
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
        self.event(Event::Closed);
        false
    }

    /// Lets the engine think and does what it says; false when the port is to be left.
    fn event(&mut self, event: Event) -> bool {
        let start = if let Event::Ask(Ask::Start(start)) = &event { Some(start.clone()) } else { None };
        let now_ms = (self.began.elapsed().as_secs_f64() * 1e3 * self.speed) as u64;
        let (controller, actions) = step(std::mem::take(&mut self.controller), now_ms, event);
        self.controller = controller;
        if let Some(start) = start.filter(|_| self.controller.phase == Phase::Running) {
            (self.entry.key, self.entry.done) = (start.routine.key.clone(), start.from);
            (self.entry.name, self.entry.ended) = (start.routine.name.clone(), false);
            (self.entry.holes, self.entry.toolpaths) = start.routine.counted(start.from);
            self.routine = Some(start.routine);
            self.keep();
        }
        // Whoever is told what happened, a tool that is wanted or an end, knows already how it is now.
        self.glimpse();
        let mut goes = true;
        for action in actions {
            goes &= self.act(action);
        }
        goes
    }

    fn act(&mut self, action: Action) -> bool {
        match action {
            Action::Write(bytes) => {
                if let Err(error) = self.port.write(&bytes) {
                    return self.gone(&error);
                }
            }
            Action::Close => return false,
            Action::Greeted => self.tell(Told::Greeted(Box::new(self.controller.info.clone()))),
            Action::ZeroSet => self.tell(Told::ZeroSet),
            Action::Progress(done) => {
                self.entry.done = done;
                if let Some(routine) = &self.routine {
                    (self.entry.holes, self.entry.toolpaths) = routine.counted(done);
                }
                self.keep();
                self.tell(Told::Progress);
            }
            Action::ToolWanted(tool) => self.tell(Told::ToolWanted(tool)),
            Action::Ended(ending) => {
                self.entry.ended = ending == Ending::Done;
                self.keep();
                self.tell(Told::Ended(ending));
            }
            Action::Found(found) => self.tell(Told::Found(found)),
        }
        true
    }

    /// Writes down what is done. Where that cannot be, nothing new may be begun.
    fn keep(&mut self) {
        if self.controller.zero_mm.is_some() {
            self.entry.zero_mm = self.controller.zero_mm;
        }
        if let Err(why) = self.ledger.write(&self.entry) {
            self.tell(Told::Found(why));
            let _ = self.port.write(b"!");
        }
    }

    fn glimpse(&mut self) {
        let controller = &self.controller;
        let now = Glimpse {
            phase: controller.phase,
            trust: controller.trust,
            place_mm: controller.place(),
            zero_mm: controller.zero_mm,
            sent: controller.sent_lines,
            answered: controller.answered_lines,
        };
        if self.before.as_ref() != Some(&now) {
            self.before = Some(now.clone());
            self.tell(Told::Now(Box::new(now)));
        }
    }
}
