//! The drill of this computer: the owner of `annulus-drill` in a thread of its own, its journal in another.
//!
//! ```text
//! server, `run` ── ask ──▶ owner thread ── tasks ──▶ executor ── steps ──▶ pins (virtual drill, or card)
//!       ▲                  │  ▲   control: (session, event) → (session, actions)     │
//!       └──── watch ───────┘  └── report: done, gated, stopped, alarm ◀──────────────┘
//!                          └── legs begun and done ──▶ journal thread ── durable ──▶ lets the next stroke start
//! ```
//!
//! Comes in: asks and uploaded programs. Goes out: tells. Does not know sockets, sessions or leases.

mod outside;
mod recorder;
mod store;
#[cfg(test)]
mod tests;

use crate::executor::clock;
use crate::journal::{self, Journal};
use crate::own;
use crate::refusal::Refusal;
use annulus_core::control::Timing;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::level::HeightMap;
use annulus_core::machine::{Machine, Output};
use annulus_core::virtual_drill::{DrilledBoard, Faults};
use annulus_core::wire::{Ask, Tell};
pub(crate) use annulus_drill::Ticket;
use annulus_drill::executor::Shared;
use annulus_drill::journal::Contents;
use annulus_drill::{KeptSurface, Message, Owner, Parts, Tickets, line, prepare};
use outside::Here;
use recorder::Recorder;
use std::fs::{self, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use tokio::sync::broadcast;

/// Name of the drilled-board record in the drill's folder: one line a hole, written by the virtual drill itself.
pub(crate) const RECORD: &str = "drilled.txt";

/// Name of the journal in the drill's folder.
pub(crate) const JOURNAL: &str = "journal.redb";

/// Tells that a slow listener may be behind before it misses some.
const BACKLOG: usize = 256;

/// How long `shutdown` waits for the machine to come to rest.
const LAST_REST: Duration = Duration::from_secs(5);

/// How often it is looked whether it rests.
const LOOK: Duration = Duration::from_millis(100);

/// A handle on the drill. Clones speak to the same drill; it shuts down with [`Drill::shutdown`].
#[derive(Clone)]
pub(crate) struct Drill {
    folder: PathBuf,
    messages: Sender<Message>,
    tells: broadcast::Sender<Tell>,
    owner: Arc<Mutex<Option<JoinHandle<()>>>>,
    timing: Option<Timing>,
    tickets: Arc<Tickets>,
    /// One plan is made at a time.
    planner: Arc<Mutex<()>>,
    /// Where changed settings go.
    settings: Arc<Mutex<PathBuf>>,
}

impl Drill {
    /// Opens the drill whose jobs, journal and drilled-board record live in `folder`. Nothing moves. `speed` is
    /// how many times faster than life the virtual drill runs.
    #[cfg(test)]
    pub(crate) fn open(folder: &Path, machine: Machine, speed: f64) -> Result<Self, Refusal> {
        Self::open_with(folder, machine, speed, Faults::default())
    }

    /// The same with a virtual drill that has faults.
    pub(crate) fn open_with(
        folder: &Path,
        machine: Machine,
        speed: f64,
        faults: Faults,
    ) -> Result<Self, Refusal> {
        Self::open_on(folder, machine, speed, faults, store::load_surface(folder))
    }

    /// The same with jobs that follow no height map, whatever is kept.
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
            let why = Diagnostic::error("control.speed_range").with("speed", speed);
            return Err(Refusal::usage(why));
        }
        if machine.output != Output::Virtual && speed != 1.0 {
            return Err(Refusal::usage(Diagnostic::error("control.speed_is_real")));
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
        let (tells, _) = broadcast::channel(BACKLOG);
        let tickets = Arc::<Tickets>::default();
        let settings = Arc::new(Mutex::new(folder.join("machines").join("virtual.toml")));
        let shared = Arc::new(Shared::new(clock::time));
        let no_thread =
            |error| Refusal::surroundings(Diagnostic::error("control.no_thread").with("reason", error));
        let recorder = Recorder::start(journal, Arc::clone(&shared), messages.clone()).map_err(no_thread)?;
        let here = Here {
            folder: folder.to_owned(),
            speed,
            settings: Arc::clone(&settings),
            recorder,
            messages: messages.clone(),
            tells: tells.clone(),
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
        Ok(Self { folder, messages, tells, owner, timing, tickets, planner, settings })
    }

    /// What was found out about this computer's clock when the drill was opened; none where the drill is virtual.
    pub(crate) fn timing(&self) -> Option<&Timing> {
        self.timing.as_ref()
    }

    /// Changed settings go to this machine file from now on.
    pub(crate) fn keep_settings_in(&self, path: PathBuf) {
        *self.settings.lock().unwrap_or_else(PoisonError::into_inner) = path;
    }

    /// Keeps the program `bytes` under `key`, its SHA-256, if they are a program.
    pub(crate) fn upload(&self, key: &str, bytes: &[u8]) -> Result<(), Diagnostic> {
        store::keep(&self.folder, key, bytes)
    }

    /// The bytes kept under `key`.
    pub(crate) fn job(&self, key: &str) -> Option<Vec<u8>> {
        store::load(&self.folder, key)
    }

    /// Does what is asked, or says why not. The answers are for the asker alone; changes that everybody should
    /// see come through [`Drill::watch`]. `Arm` and `Feed override` take as long as planning does: call them where waiting is allowed.
    /// Who may ask is the caller's business.
    pub(crate) fn ask(&self, ask: Ask) -> Result<Vec<Tell>, Diagnostic> {
        self.begin(ask, None).finish()
    }

    /// Puts what a page asks with `ticket` before the owner, and never waits; what is left to do is in the answer. Everything
    /// begun is worked on in the order in which it was begun; only what has to be planned waits for its plan.
    pub(crate) fn begin(&self, ask: Ask, ticket: Option<Ticket>) -> Begun {
        let (drill, (reply, answer)) = (self.clone(), channel());
        let percent = if let Ask::FeedOverride { percent } = ask { Some(percent) } else { None };
        match ask {
            Ask::Arm { job, from_leg } => Begun::Arm { drill, job, from_leg, ticket },
            ask => match self.messages.send(Message::Ask { ask, ticket, reply }) {
                Ok(()) => Begun::Asked { drill, percent, answer },
                Err(_) => Begun::Gone,
            },
        }
    }

    /// Stops, now. Never waits.
    pub(crate) fn stop(&self) {
        self.tickets.stopped();
        let _ = self.messages.send(Message::Stop);
    }

    /// Control changed hands: tickets from before are no good, what moved by hand comes to rest, outputs lock. Never waits.
    pub(crate) fn control_changed(&self) {
        self.tickets.control_changed();
        let _ = self.messages.send(Message::ControlChanged);
    }

    /// A ticket for what is asked now.
    pub(crate) fn ticket(&self) -> Ticket {
        self.tickets.now()
    }

    /// The plan for a feed override that was ordered: feeds other than those in force are planned here, and the owner takes the new
    /// plan over at the next rest.
    fn plan_feed_override(&self, percent: u8) -> Result<(), Diagnostic> {
        let feed = percent.max(100);
        let _planning = self.planner.lock();
        match self.send(Message::InWork).flatten() {
            // Of several that were ordered meanwhile only the last is planned.
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
        let bytes = self.job(job).ok_or_else(|| Diagnostic::error("control.no_such_job"))?;
        let context = self.send(Message::Context).ok_or_else(gone)?;
        let prepared = prepare::prepare(job, &bytes, from_leg, &context)?;
        self.send(|reply| Message::Prepared { prepared: Box::new(prepared), reply })
            .unwrap_or_else(|| Err(gone()))
    }

    /// The height map that is kept.
    pub(crate) fn map(&self) -> Option<HeightMap> {
        store::load_surface(&self.folder).map(|surface| surface.map)
    }

    /// Everything that happens: `Status` 10 times a second and after every change, `Armed`, `Ended`,
    /// `Interrupted`, `Machine`. A slow listener misses the oldest.
    pub(crate) fn watch(&self) -> broadcast::Receiver<Tell> {
        self.tells.subscribe()
    }

    /// What a newcomer must know: `Machine`, `Status`, and `Armed` and `Interrupted` where there are.
    pub(crate) fn greeting(&self) -> Vec<Tell> {
        self.send(Message::Greeting).unwrap_or_default()
    }

    /// Comes to rest in a controlled way, makes the journal durable and ends the threads.
    pub(crate) fn shutdown(&self) {
        let _ = self.messages.send(Message::Shutdown);
        let thread = self.owner.lock().ok().and_then(|mut owner| owner.take());
        if let Some(thread) = thread {
            let _ = thread.join();
        }
    }

    fn send<T>(&self, message: impl FnOnce(Sender<T>) -> Message) -> Option<T> {
        let (reply, answer) = channel();
        self.messages.send(message(reply)).ok()?;
        answer.recv().ok()
    }
}

/// Something that was put before the owner, or is still to be planned.
pub(crate) enum Begun {
    /// The owner has it; for a feed override, what is to be planned afterwards.
    Asked { drill: Drill, percent: Option<u8>, answer: Receiver<Result<Vec<Tell>, Diagnostic>> },
    /// A job to be planned and checked first.
    Arm { drill: Drill, job: String, from_leg: u32, ticket: Option<Ticket> },
    /// There is no owner any more.
    Gone,
}

impl Begun {
    /// Waits for the answer, as long as planning takes: for threads that may.
    pub(crate) fn finish(self) -> Result<Vec<Tell>, Diagnostic> {
        match self {
            Self::Arm { drill, job, from_leg, ticket } => drill.arm(&job, from_leg, ticket),
            Self::Gone => Err(gone()),
            Self::Asked { drill, percent, answer } => {
                let told = answer.recv().unwrap_or_else(|_| Err(gone()))?;
                percent.map_or(Ok(()), |percent| drill.plan_feed_override(percent))?;
                Ok(told)
            }
        }
    }
}

/// The owner's thread: hands messages to it until it is to end, then waits until it rests.
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

fn gone() -> Diagnostic {
    Diagnostic::error("control.shut_down")
}

fn unwritable(folder: &Path, error: &std::io::Error) -> Refusal {
    let why = Diagnostic::error("control.folder_unwritable").with("folder", folder.display());
    Refusal::surroundings(why.with("reason", error))
}

/// The drilled-board record: a plain append a hole, the moment it is made. It knows nothing of the journal. What cannot be
/// written stops the job: a record with a hole left out is worse than none.
fn drilled_record(path: &Path, owner: Sender<Message>) -> std::io::Result<DrilledBoard> {
    let mut file = own::open(path, OpenOptions::new().create(true).append(true))?;
    Ok(Box::new(move |hole| {
        let before = file.metadata().map(|file| file.len());
        if let Err(error) = file.write_all(line(hole).as_bytes()) {
            // No half line stays.
            let _ = before.and_then(|before| file.set_len(before));
            let why = Diagnostic::error("control.record_unwritable").with("reason", error);
            let _ = owner.send(Message::CannotRecord(why));
        }
    }))
}
