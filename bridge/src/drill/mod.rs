//! The drill of this computer: the owner of `annulus-host` in one thread, its journal in another.
//!
//! ```text
//! server, `run` ── ask ──▶ owner thread ── tasks ──▶ executor ── steps ──▶ pins (virtual drill, or card)
//!       ▲                  │  ▲   control: (session, event) → (session, actions)     │
//!       └──── watch ───────┘  └── report: done, gated, stopped, alarm ◀──────────────┘
//!                          └── legs started and done ──▶ journal thread ── durable ──▶ allows the next hole
//! ```

mod outside;
mod recorder;
mod store;
#[cfg(test)]
mod tests;

use crate::executor::clock;
use crate::hosted::{Begun, Hosted, Listeners, gone};
use crate::journal::{self, Journal};
use crate::own;
use crate::refusal::Refusal;
use annulus_core::control::Timing;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::level::HeightMap;
use annulus_core::machine::{Machine, Output, Value};
use annulus_core::virtual_drill::{DrilledBoard, Faults};
use annulus_core::wire::{Ask, Tell};
use annulus_host::executor::Shared;
use annulus_host::journal::Contents;
use annulus_host::{KeptSurface, Message, Owner, Parts, Ticket, Tickets, line, prepare};
use outside::{Here, KeptSettings};
use recorder::Recorder;
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use tokio::sync::mpsc;

/// Name of the drilled-board record in the drill's folder: one line per hole, written by the virtual drill.
pub(crate) const RECORD: &str = "drilled.txt";

pub(crate) const JOURNAL: &str = "journal.redb";

/// How long `shutdown` waits for the machine to stop.
const LAST_REST: Duration = Duration::from_secs(5);

const LOOK: Duration = Duration::from_millis(100);

/// A handle of the drill. Clones share the drill; [`Drill::shutdown`] ends it.
#[derive(Clone)]
pub(crate) struct Drill {
    folder: PathBuf,
    messages: Sender<Message>,
    listeners: Listeners,
    owner: Arc<Mutex<Option<JoinHandle<()>>>>,
    timing: Option<Timing>,
    tickets: Arc<Tickets>,
    planner: Arc<Mutex<()>>,
    settings: Arc<Mutex<KeptSettings>>,
}

impl Drill {
    /// Opens the drill whose jobs, journal and drilled-board record are in `folder`. Nothing moves. `speed`
    /// is the time scale of the virtual drill, 1 for real time.
    #[cfg(test)]
    pub(crate) fn open(folder: &Path, machine: Machine, speed: f64) -> Result<Self, Refusal> {
        Self::open_with(folder, machine, speed, Faults::default())
    }

    pub(crate) fn open_with(
        folder: &Path,
        machine: Machine,
        speed: f64,
        faults: Faults,
    ) -> Result<Self, Refusal> {
        Self::open_on(folder, machine, speed, faults, store::load_surface(folder))
    }

    /// The same without a height map: jobs ignore the saved one.
    pub(crate) fn open_flat(
        folder: &Path,
        machine: Machine,
        speed: f64,
        faults: Faults,
    ) -> Result<Self, Refusal> {
        Self::open_on(folder, machine, speed, faults, None)
    }

    fn open_on(
        folder: &Path,
        machine: Machine,
        speed: f64,
        faults: Faults,
        surface: Option<KeptSurface>,
    ) -> Result<Self, Refusal> {
        if !(speed.is_finite() && (0.01..=1e6).contains(&speed)) {
            let why = error!("control.speed_range", speed = speed);
            return Err(Refusal::usage(why));
        }
        if machine.output != Output::Virtual && speed != 1.0 {
            return Err(Refusal::usage(error!("control.speed_is_real")));
        }
        let unwritable = |error: std::io::Error| unwritable(folder, &error);
        own::root(folder).and_then(|()| own::mend(&folder.join(JOURNAL))).map_err(unwritable)?;
        let holes = fs::read(folder.join(RECORD)).unwrap_or_default();
        let holes = holes.iter().filter(|byte| **byte == b'\n').count();
        let used = holes > 0 || store::has_any(folder);
        let (journal, contents) =
            journal::open(&folder.join(JOURNAL), used).map_err(Refusal::surroundings)?;
        own::mend(&folder.join(JOURNAL)).map_err(unwritable)?;
        let damaged = contents.damage.as_ref().map(|damage| damage.told(holes));
        Self::assemble(folder, machine, speed, faults, (journal, contents, surface, damaged))
    }

    fn assemble(
        folder: &Path,
        machine: Machine,
        speed: f64,
        faults: Faults,
        (journal, contents, surface, alarm): (Journal, Contents, Option<KeptSurface>, Option<Diagnostic>),
    ) -> Result<Self, Refusal> {
        let (messages, inbox) = channel();
        let record = drilled_record(&folder.join(RECORD), messages.clone())
            .map_err(|error| unwritable(folder, &error))?;
        if let Some((job, _)) =
            contents.job.as_ref().filter(|(job, _)| store::load(folder, &job.key).is_none())
            && let Some(program) = journal.program()
        {
            let _ = store::keep(folder, &job.key, &program);
        }
        let listeners = Listeners::default();
        let tickets = Arc::<Tickets>::default();
        let path = folder.join("machines").join("virtual.toml");
        let settings = Arc::new(Mutex::new(KeptSettings { path, unchanged: Vec::new() }));
        let shared = Arc::new(Shared::new(clock::time));
        let no_thread = |error| Refusal::surroundings(error!("control.no_thread", reason = error));
        let recorder = Recorder::start(journal, Arc::clone(&shared), messages.clone()).map_err(no_thread)?;
        let here = Here {
            folder: folder.to_owned(),
            speed,
            settings: Arc::clone(&settings),
            recorder,
            messages: messages.clone(),
            listeners: listeners.clone(),
        };
        let owner = Owner::new(Parts {
            machine,
            speed,
            faults,
            seed: u64::from(std::process::id()),
            record,
            contents,
            surface,
            alarm,
            tickets: Arc::clone(&tickets),
            shared,
            time: clock::time,
            outside: Box::new(here),
        })
        .map_err(Refusal::surroundings)?;
        let timing = owner.timing.clone();
        let thread = thread::Builder::new()
            .name("drill".to_owned())
            .spawn(move || run(owner, &inbox))
            .map_err(|error| unwritable(folder, &error))?;
        let owner = Arc::new(Mutex::new(Some(thread)));
        let (folder, planner) = (folder.to_owned(), Arc::default());
        Ok(Self { folder, messages, listeners, owner, timing, tickets, planner, settings })
    }

    /// Timing quality of this computer, measured when the drill was opened; `None` for a virtual drill.
    pub(crate) fn timing(&self) -> Option<&Timing> {
        self.timing.as_ref()
    }

    pub(crate) fn keep_settings_in(&self, path: PathBuf) {
        self.keep_settings_but(path, Vec::new());
    }

    /// As [`Drill::keep_settings_in`], for a run with overrides: the file keeps the values in `unchanged`.
    pub(crate) fn keep_settings_but(&self, path: PathBuf, unchanged: Vec<(String, Value)>) {
        *self.settings.lock().unwrap_or_else(PoisonError::into_inner) = KeptSettings { path, unchanged };
    }

    /// Carries out a request, or returns why not. The answers are for the requester; other changes arrive
    /// through [`Drill::watch`]. `Arm` and `FeedOverride` block while planning. The caller must check who
    /// may ask.
    pub(crate) fn ask(&self, ask: Ask) -> Result<Vec<Tell>, Diagnostic> {
        self.begin(ask, None).finish()
    }

    /// Plans the requested feed override, if it differs from the current plan. The owner switches to it at
    /// the next stop.
    fn plan_feed_override(&self, percent: u8) -> Result<(), Diagnostic> {
        let feed = percent.max(100);
        let _planning = self.planner.lock();
        match self.send(Message::InWork).flatten() {
            // If several were requested meanwhile, only the last is planned.
            Some((job, wanted)) if wanted == feed && job.feed_percent != feed => {
                let anew = Box::new(prepare::at_feed(&job, feed)?);
                self.messages.send(Message::Anew(anew)).map_err(|_| gone())?;
            }
            _ => {}
        }
        Ok(())
    }

    fn arm(&self, job: &str, from_leg: u32, ticket: Option<Ticket>) -> Result<Vec<Tell>, Diagnostic> {
        ticket.map_or(Ok(()), |ticket| self.tickets.check(ticket))?;
        let _planning = self.planner.lock();
        let bytes = self.job(job).ok_or_else(|| error!("control.no_such_job"))?;
        let context = self.send(Message::Context).ok_or_else(gone)?;
        let prepared = prepare::prepare(job, &bytes, from_leg, &context)?;
        self.send(|reply| Message::Prepared { prepared: Box::new(prepared), reply })
            .unwrap_or_else(|| Err(gone()))
    }

    pub(crate) fn map(&self) -> Option<HeightMap> {
        store::load_surface(&self.folder).map(|surface| surface.map)
    }

    fn send<T>(&self, message: impl FnOnce(Sender<T>) -> Message) -> Option<T> {
        let (reply, answer) = channel();
        self.messages.send(message(reply)).ok()?;
        answer.recv().ok()
    }
}

impl Hosted for Drill {
    fn upload(&self, key: &str, bytes: &[u8]) -> Result<(), Diagnostic> {
        store::keep(&self.folder, key, bytes)
    }

    fn job(&self, key: &str) -> Option<Vec<u8>> {
        store::load(&self.folder, key)
    }

    fn begin(&self, ask: Ask, ticket: Option<Ticket>) -> Begun {
        let (drill, (reply, answer)) = (self.clone(), channel());
        let percent = if let Ask::FeedOverride { percent } = ask { Some(percent) } else { None };
        if let Ask::Arm { job, from_leg } = ask {
            return Begun::new(move || drill.arm(&job, from_leg, ticket));
        }
        let _ = self.messages.send(Message::Ask { ask, ticket, reply });
        let Some(percent) = percent else { return Begun::awaits(answer) };
        Begun::new(move || {
            let told = Begun::awaits(answer).finish()?;
            drill.plan_feed_override(percent)?;
            Ok(told)
        })
    }

    fn stop(&self) {
        self.tickets.stopped();
        let _ = self.messages.send(Message::Stop);
    }

    fn control_changed(&self) {
        self.tickets.control_changed();
        let _ = self.messages.send(Message::ControlChanged);
    }

    fn ticket(&self) -> Ticket {
        self.tickets.now()
    }

    fn watch(&self) -> mpsc::Receiver<Tell> {
        self.listeners.add()
    }

    fn greeting(&self) -> Vec<Tell> {
        self.send(Message::Greeting).unwrap_or_default()
    }

    /// Also makes the journal durable.
    fn shutdown(&self) {
        let _ = self.messages.send(Message::Shutdown);
        let thread = self.owner.lock().ok().and_then(|mut owner| owner.take());
        if let Some(thread) = thread {
            let _ = thread.join();
        }
    }
}

/// The owner's thread: passes messages until the shutdown, then waits until the machine has stopped.
fn run(mut owner: Owner, inbox: &Receiver<Message>) {
    loop {
        match inbox.recv_timeout(owner.idle()) {
            Ok(Message::Shutdown) | Err(RecvTimeoutError::Disconnected) => break,
            Ok(message) => owner.take(message),
            Err(RecvTimeoutError::Timeout) => {}
        }
        owner.beat();
    }
    owner.take(Message::Shutdown);
    let since = Instant::now();
    while owner.moves() && since.elapsed() < LAST_REST {
        match inbox.recv_timeout(LOOK) {
            Ok(message @ (Message::Report(_) | Message::ExecutorGone(_) | Message::CannotRecord(_))) => {
                owner.take(message);
            }
            Err(RecvTimeoutError::Disconnected) => break,
            Ok(_) | Err(RecvTimeoutError::Timeout) => {}
        }
    }
    owner.over();
}

fn unwritable(folder: &Path, error: &std::io::Error) -> Refusal {
    let why = error!("control.folder_unwritable", folder = folder.display(), ..);
    Refusal::surroundings(why.with("reason", error))
}

/// The drilled-board record: one append per hole, at the moment it is drilled, independent of the journal.
/// A failed write stops the job: a record with a missing hole is worse than none.
fn drilled_record(path: &Path, owner: Sender<Message>) -> std::io::Result<DrilledBoard> {
    let mut file = own::open(path, OpenOptions::new().create(true).append(true))?;
    Ok(Box::new(move |hole| {
        let before = file.metadata().map(|file| file.len());
        if let Err(error) = file.write_all(line(hole).as_bytes()) {
            // Remove a partial line.
            let _ = before.and_then(|before| file.set_len(before));
            let why = error!("control.record_unwritable", reason = error);
            let _ = owner.send(Message::CannotRecord(why));
        }
    }))
}
