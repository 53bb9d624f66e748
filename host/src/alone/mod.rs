//! A drill without threads, virtual or on a USB step adapter: owner and executor take turns whenever the
//! caller, a page's worker, calls.
//!
//! ```text
//! page ── text ──▶ line ── Message ──▶ owner ── orders ──▶ place (a coroutine) or adapter ══▶ port
//!   ◀── frames ────┘                     │ outbox: reports, records, settings, holes
//!                                        └──▶ advance: journal in two slots, drilled-board record, settings
//! ```
//!
//! Stream time of the virtual drill passes only in [`Alone::advance`]: none passes while a page is hidden
//! or a computer sleeps. An adapter keeps its own time: if the calls cease, it stops.

mod outside;
mod port;
mod slots;
#[cfg(test)]
mod tests;

use crate::adapter::{attend, greeted};
use crate::executor::{Report, Shared, Time};
use crate::files::{File, Files};
use crate::journal::{sealed, unsealed};
use crate::line::{self, Line};
use crate::owner::{Message, Owner, Parts, board};
use crate::prepare::{at_feed, prepare};
use crate::programs::{Programs, Upload};
use crate::recording::Recording;
use crate::surface::KeptSurface;
use crate::ticket::{Ticket, Tickets};
use annulus_core::chance::Chance;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::machine::{self, Machine, Output, Value};
use annulus_core::steps::TICK_HZ;
use annulus_core::virtual_drill::{DrilledBoard, Faults};
use outside::{Fresh, Letters, Plugged, Ring};
pub use port::Port;
use slots::Slots;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::AtomicU32;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::task::{Context, Waker};
use std::time::Duration;

/// Most time that one turn may grant, however long the pause before it.
const LONGEST_TURN: Duration = Duration::from_millis(50);

/// Delay until the next call while something moves.
const TURN: Duration = Duration::from_millis(8);

/// Size in bytes above which the drilled-board record is cleared when no job needs it.
const LONGEST_RECORD: usize = 1024 * 1024;

/// Most rounds of owner and executor in one call, so that the caller can hear new input.
const MOST_ROUNDS: usize = 1_000;

type Play = Pin<Box<dyn Future<Output = ()>>>;

/// A drill and the one page that controls it.
pub struct Alone<F> {
    owner: Owner,
    inbox: Receiver<Message>,
    messages: Sender<Message>,
    letters: Letters,
    shared: Arc<Shared>,
    play: Option<Play>,
    slots: Slots<F>,
    recording: Recording,
    /// Bytes of the drilled-board record that are already in its file.
    written: usize,
    programs: Programs,
    line: Line,
    speed: f64,
    time: Time,
    /// Time of the last call.
    called: Duration,
}

impl<F: Files> Alone<F> {
    /// Opens the virtual drill whose journal, settings and record are in `files`. Nothing moves. `speed` is
    /// the time scale, 1 for real time.
    pub fn open(files: F, speed: f64, seed: u64, time: Time) -> Result<Self, Diagnostic> {
        if !(speed.is_finite() && (0.01..=1e6).contains(&speed)) {
            return Err(error!("control.speed_range", speed = speed));
        }
        Self::with(files, Letters::default(), speed, seed, time)
    }

    /// Opens the machine whose adapter is at `port`, with the same files. Nothing moves; the first turns
    /// identify the adapter. Never pass the same `seed` twice: it gives the session number.
    pub fn at_port(files: F, port: Port, seed: u64, time: Time) -> Result<Self, Diagnostic> {
        let session = Arc::new(AtomicU32::new(Chance::new(seed).bits() as u32));
        let mut letters = Letters::default();
        letters.plugged = Some(Plugged { port, time, session });
        Self::with(files, letters, 1.0, seed, time)
    }

    fn with(mut files: F, letters: Letters, speed: f64, seed: u64, time: Time) -> Result<Self, Diagnostic> {
        let output = if letters.plugged.is_some() { Output::Adapter } else { Output::Virtual };
        let machine = machine_in(&mut files, output);
        let surface = surface_in(&mut files);
        let drilled = files.read(File::Drilled).unwrap_or_default();
        let mut drilled = String::from_utf8_lossy(&drilled).into_owned();
        let (mut slots, contents, program) = Slots::open(files)?;
        if contents.job.is_none() && drilled.len() > LONGEST_RECORD {
            // No interrupted job needs the earlier holes.
            drilled.clear();
            let _ = slots.files.write(File::Drilled, &[]);
        }
        let alarm = contents.damage.as_ref().map(|damage| damage.told(drilled.lines().count()));
        let job = contents.job.as_ref().map(|(job, _)| job.key.clone());
        let programs = Programs::of(job.zip(program));
        let (messages, inbox) = channel();
        let (shared, tickets) = (Arc::new(Shared::new(time)), Arc::<Tickets>::default());
        let written = drilled.len();
        letters.left().drilled = drilled;
        let owner = Owner::new(Parts {
            machine,
            speed,
            faults: Faults::default(),
            seed,
            record: record(&letters),
            contents,
            surface,
            alarm,
            tickets: Arc::clone(&tickets),
            shared: Arc::clone(&shared),
            time,
            outside: Box::new(letters.clone()),
        })?;
        let (play, recording, line) = (None, Recording::default(), Line::new(tickets));
        let called = time();
        Ok(Self {
            owner,
            inbox,
            messages,
            letters,
            shared,
            play,
            slots,
            recording,
            written,
            programs,
            line,
            speed,
            time,
            called,
        })
    }

    /// A page connected; its hello comes next.
    pub fn connect(&mut self) {
        self.line.challenge();
    }

    pub fn hear(&mut self, text: &str) {
        let now = (self.time)();
        let asked = self.line.heard(text, now);
        self.see_to(asked);
    }

    pub fn frames(&mut self) -> Vec<String> {
        self.line.frames()
    }

    /// Saves `bytes` under `key`, their SHA-256, if they are a program.
    pub fn upload(&mut self, key: &str, bytes: Vec<u8>) -> Result<(), Diagnostic> {
        // The program of a running or interrupted job must not be dropped.
        self.programs.keep(Upload::checked(key, bytes)?, self.slots.job());
        Ok(())
    }

    /// The program saved under `key`.
    pub fn job(&self, key: &str) -> Option<&[u8]> {
        self.programs.bytes(key)
    }

    /// Does everything that is due now. Returns the delay until the next call, if nothing arrives before.
    pub fn advance(&mut self) -> Duration {
        let now = (self.time)();
        let passed = now.saturating_sub(std::mem::replace(&mut self.called, now)).min(LONGEST_TURN);
        if self.letters.allowance.was_wanted() {
            let ticks = passed.as_secs_f64() * self.speed * TICK_HZ as f64;
            self.letters.allowance.grant(ticks as u64);
        }
        let asked = self.line.passed(now);
        self.see_to(asked);
        for _ in 0..MOST_ROUNDS {
            self.poll();
            let mut quiet = true;
            while let Ok(message) = self.inbox.try_recv() {
                quiet = false;
                self.owner.take(message);
                self.clear_up();
            }
            if quiet {
                break;
            }
        }
        self.owner.beat();
        self.clear_up();
        let asked = self.line.answers();
        self.see_to(asked);
        if self.owner.moves() || self.letters.plugged.is_some() { TURN } else { self.owner.idle() }
    }

    /// Runs the executor as far as the granted time allows.
    fn poll(&mut self) {
        let fresh = self.letters.left().executor.take();
        if let Some((fresh, ring)) = fresh {
            // The previous executor must finish first.
            self.play_on();
            self.play = Some(Box::pin(play(fresh, ring, self.messages.clone())));
        }
        self.play_on();
    }

    fn play_on(&mut self) {
        let mut context = Context::from_waker(Waker::noop());
        self.play.take_if(|play| play.as_mut().poll(&mut context).is_ready());
    }

    /// Passes on the page's requests, in order.
    fn see_to(&mut self, asked: Vec<line::Asked>) {
        for asked in asked {
            match asked {
                line::Asked::Message(message) => self.owner.take(message),
                line::Asked::Arm { job, from_leg, ticket } => {
                    if let Err(why) = self.arm(&job, from_leg, ticket) {
                        self.line.answer(Err(why));
                    }
                }
                line::Asked::FeedOverride { percent } => {
                    if let Err(why) = self.plan_feed_override(percent) {
                        self.line.answer(Err(why));
                    }
                }
            }
            self.clear_up();
        }
    }

    fn arm(&mut self, job: &str, from_leg: u32, ticket: Ticket) -> Result<(), Diagnostic> {
        self.line.tickets.check(ticket)?;
        let bytes = self.job(job).ok_or_else(|| error!("control.no_such_job"))?;
        let prepared = prepare(job, bytes, from_leg, &self.owner.context())?;
        let (reply, answer) = channel();
        self.line.await_answer(answer);
        self.owner.take(Message::Prepared { prepared: Box::new(prepared), reply });
        Ok(())
    }

    /// Plans the running job at a higher feed, if that is requested. The owner switches to the new plan at
    /// the next stop.
    fn plan_feed_override(&mut self, percent: u8) -> Result<(), Diagnostic> {
        let feed = percent.max(100);
        let (reply, answer) = channel();
        self.owner.take(Message::InWork(reply));
        match answer.try_recv().ok().flatten() {
            Some((job, wanted)) if wanted == feed && job.feed_percent != feed => {
                let anew = Box::new(at_feed(&job, feed)?);
                self.owner.take(Message::Anew(anew));
                Ok(())
            }
            _ => Ok(()),
        }
    }

    /// Writes everything in the owner's outbox: holes first, then the journal records that refer to them.
    fn clear_up(&mut self) {
        loop {
            self.write_drilled();
            let (tells, settings, surface, record) = {
                let mut left = self.letters.left();
                let tells = std::mem::take(&mut left.tells);
                (tells, left.settings.take(), left.surface.take(), left.records.pop_front())
            };
            if record.is_none() && settings.is_none() && surface.is_none() && tells.is_empty() {
                return;
            }
            tells.iter().for_each(|tell| self.line.tell(tell));
            if let Some(machine) = settings {
                self.keep(File::Settings, &sealed(&machine::read(&machine)));
            }
            if let Some(surface) = surface {
                self.keep(File::Surface, &sealed(&surface));
            }
            if let Some(record) = record {
                let messages = &self.messages;
                let owner = |message| drop(messages.send(message));
                self.recording.write(&mut self.slots, record, &self.shared, owner);
            }
        }
    }

    fn write_drilled(&mut self) {
        let letters = self.letters.left();
        let Some(new) = letters.drilled.get(self.written..).filter(|new| !new.is_empty()) else { return };
        let done = self.slots.files.append(File::Drilled, new.as_bytes());
        self.written = letters.drilled.len();
        if let Err(reason) = done {
            let why = error!("control.record_unwritable", reason = reason);
            let _ = self.messages.send(Message::CannotRecord(why));
        }
    }

    fn keep(&mut self, file: File, bytes: &[u8]) {
        if let Err(reason) = self.slots.files.write(file, bytes) {
            let why = error!("journal.cannot_write", reason = reason);
            let _ = self.messages.send(Message::CannotRecord(why));
        }
    }
}

/// The machine as last saved. Unreadable or unknown settings fall back to those of the virtual drill.
fn machine_in(files: &mut impl Files, output: Output) -> Machine {
    let settings = files.read(File::Settings).unwrap_or_default();
    let settings: Vec<(String, Value)> = unsealed(&settings).unwrap_or_default();
    let machine =
        machine::apply(&machine::virtual_drill(), &settings).unwrap_or_else(|_| machine::virtual_drill());
    Machine { output, ..machine }
}

/// The saved height map; `None` if it is damaged.
fn surface_in(files: &mut impl Files) -> Option<KeptSurface> {
    let bytes = files.read(File::Surface).unwrap_or_default();
    unsealed::<Option<KeptSurface>>(&bytes).ok().flatten().filter(KeptSurface::is_whole)
}

/// Plays orders until the end.
async fn play(fresh: Fresh, ring: Ring, messages: Sender<Message>) {
    let report = |report: Report| drop(messages.send(Message::Report(report)));
    let (mut line, machine, shared) = match fresh {
        Fresh::Pins(place) => return place.run(ring, report).await,
        Fresh::Adapter { line, machine, shared } => (line, machine, shared),
    };
    let ended = match greeted(&mut line, &machine).await {
        Ok(_) => attend(*line, &machine, &shared, ring.clone(), report).await,
        Err(why) => Err(why),
    };
    ring.leave();
    if let Err(why) = ended {
        let _ = messages.send(Message::ExecutorGone(why));
    }
}

fn record(letters: &Letters) -> DrilledBoard {
    let letters = letters.clone();
    Box::new(move |hole| letters.left().drilled.push_str(&board::line(hole)))
}
