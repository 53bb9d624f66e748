//! The station of a GRBL controller in a thread that owns the serial port, for the pages of the server or for
//! the command line.
//!
//! ```text
//! pages ── Input ──▶ station ── bytes ──▶ port
//!   ◀── listeners ──────┘ └─ files: progress, job, settings, height map
//!
//! port lost ─▶ the station still answers ─▶ port back: a new station ─▶ identified: takes over
//! ```
//!
//! A job continues without any page. For the command line, the thread ends with the port.

#[cfg(all(test, target_os = "linux"))]
mod tests;

use super::clock;
use super::files::DiskFiles;
use crate::hosted::{Begun, Hosted, Listeners, gone};
use crate::refusal::Refusal;
use crate::serial::{self, Listed, Port};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::grbl::{EngineAsk, ResetOnOpen};
use annulus_core::wire::{Ask, Tell};
use annulus_host::grbl::{Attended, Draft, Named, Setup, Station, Told, Written, reset_on_open};
use annulus_host::{Message, Ticket, Tickets, Upload};
use std::io;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use tokio::sync::mpsc;

/// How long the port may take no bytes before the controller counts as gone.
const FULL: Duration = Duration::from_secs(4);
/// How long [`GrblHost::open`] waits until the controller identifies itself.
const IDENTIFY_WAIT: Duration = Duration::from_secs(12);
/// Interval between attempts to open a lost port again.
const REOPEN_INTERVAL: Duration = Duration::from_secs(1);
/// Longest wait for input while no port is open.
const INPUT_WAIT: Duration = Duration::from_millis(50);
/// Age at which a page's permission to jog no longer counts.
const STALE: Duration = Duration::from_secs(1);
/// How long `shutdown` waits until the machine has stopped.
const STOP_WAIT: Duration = Duration::from_secs(5);

pub(crate) struct Site {
    pub(crate) port: String,
    /// Its baud rate; `None` to find it.
    pub(crate) baud: Option<u32>,
    pub(crate) files: DiskFiles,
    /// The machine that the user named.
    pub(crate) named: Option<Named>,
    /// Time scale of a simulated controller, 1 for real time.
    pub(crate) speed: f64,
}

impl Site {
    /// Opens the port. Returns it with its baud rate.
    pub(super) fn open(&mut self, reset: ResetOnOpen, silent: impl Fn(u32)) -> Result<(Port, u32), Refusal> {
        let opened = super::open(&self.port, self.baud, reset, silent);
        let (port, baud) = opened.map_err(Refusal::surroundings)?;
        self.baud = Some(baud);
        Ok((port, baud))
    }
}

/// The job of the command line, and whether opening the port may reset the controller.
type CommandJob = (Attended, ResetOnOpen);
/// `Ok` after the controller identified itself, or why it did not.
type Met = Result<(), Diagnostic>;

/// Handle to the thread that owns the port. Clones share the thread; `shutdown` ends it.
#[derive(Clone)]
pub(crate) struct GrblHost {
    inputs: Sender<Input>,
    listeners: Listeners,
    tickets: Arc<Tickets>,
    thread: Arc<Mutex<Option<JoinHandle<()>>>>,
}

enum Input {
    Message(Message),
    /// A request of the command line.
    Command(EngineAsk),
    /// The user of the command line is present.
    Attend,
    /// A jog, or its renewal, with the time at which the page asked for it.
    Jog(Duration, Message),
    /// Requests the program and the machine from which a job's G-code is written.
    Draft {
        job: String,
        from_leg: u32,
        ticket: Option<Ticket>,
        reply: Sender<Result<Option<Draft>, Diagnostic>>,
    },
    /// Checks a job. `written`: its new G-code; `None` if an interrupted job resumes.
    Arm {
        job: String,
        from_leg: u32,
        ticket: Option<Ticket>,
        written: Option<Box<Written>>,
        reply: Sender<Result<Vec<Tell>, Diagnostic>>,
    },
    Upload {
        upload: Upload,
        reply: Sender<()>,
    },
    Job {
        key: String,
        reply: Sender<Option<Vec<u8>>>,
    },
}

impl GrblHost {
    /// Opens the port and waits until the controller has identified itself. `silent` is called for every
    /// baud rate without a response.
    pub(crate) fn open(mut site: Site, silent: impl Fn(u32)) -> Result<Self, Refusal> {
        let reset = reset_on_open(&mut site.files);
        let (port, _) = site.open(reset, silent)?;
        let (host, met) = Self::start(site, port, None)?;
        // A controller that must not be reset identifies itself after its job.
        match met.recv_timeout(IDENTIFY_WAIT) {
            Ok(Err(why)) => {
                host.shutdown();
                Err(Refusal::surroundings(why))
            }
            Ok(Ok(())) | Err(_) => Ok(host),
        }
    }

    /// Starts the thread of an open port. `command`: the job of the command line, and where its notices go.
    pub(super) fn start(
        site: Site,
        port: Port,
        command: Option<(CommandJob, Sender<Told>)>,
    ) -> Result<(Self, Receiver<Met>), Refusal> {
        let (tickets, listeners) = (Arc::<Tickets>::default(), Listeners::default());
        let (job, command) = command.unzip();
        // Listing the ports may take a while, which the station would take for a stall.
        let usb = usb_at(&site.port, &serial::list());
        let machine = Connection::open(&site, port, &tickets, job).map_err(Refusal::surroundings)?;
        let (inputs, inbox) = channel();
        let (meets, met) = channel();
        let work = Work {
            usb,
            site,
            tickets: Arc::clone(&tickets),
            listeners: listeners.clone(),
            command,
            machine,
            next: None,
            stops: false,
            tried: Instant::now(),
        };
        let thread =
            thread::Builder::new().name("controller".to_owned()).spawn(move || work.run(&inbox, meets));
        let no_thread = |error| error!("control.no_thread", reason = error);
        let thread = thread.map_err(|error| Refusal::surroundings(no_thread(error)))?;
        Ok((Self { inputs, listeners, tickets, thread: Arc::new(Mutex::new(Some(thread))) }, met))
    }

    /// Passes a request of the command line to the engine.
    pub(super) fn command(&self, ask: EngineAsk) {
        let _ = self.inputs.send(Input::Command(ask));
    }

    /// The user of the command line is present.
    pub(super) fn attend(&self) {
        let _ = self.inputs.send(Input::Attend);
    }

    /// Writes the job's G-code in the caller's thread: the thread that owns the port must stay free to end a
    /// jog.
    fn arm(&self, job: &str, from_leg: u32, ticket: Option<Ticket>) -> Result<Vec<Tell>, Diagnostic> {
        let draft = self.send(|reply| Input::Draft { job: job.to_owned(), from_leg, ticket, reply });
        let draft = draft.unwrap_or_else(|| Err(gone()))?;
        let written = draft.map(|draft| draft.write()).transpose()?.map(Box::new);
        let armed = self.send(|reply| Input::Arm { job: job.to_owned(), from_leg, ticket, written, reply });
        armed.unwrap_or_else(|| Err(gone()))
    }

    fn send<T>(&self, input: impl FnOnce(Sender<T>) -> Input) -> Option<T> {
        let (reply, answer) = channel();
        self.inputs.send(input(reply)).ok()?;
        answer.recv().ok()
    }
}

impl Hosted for GrblHost {
    /// Reads the program here and not in the thread, where STOP would wait.
    fn upload(&self, key: &str, bytes: &[u8]) -> Result<(), Diagnostic> {
        let upload = Upload::checked(key, bytes.to_vec())?;
        self.send(|reply| Input::Upload { upload, reply }).ok_or_else(gone)
    }

    fn job(&self, key: &str) -> Option<Vec<u8>> {
        self.send(|reply| Input::Job { key: key.to_owned(), reply }).flatten()
    }

    fn begin(&self, ask: Ask, ticket: Option<Ticket>) -> Begun {
        if let Ask::Arm { job, from_leg } = ask {
            let host = self.clone();
            return Begun::new(move || host.arm(&job, from_leg, ticket));
        }
        let (reply, answer) = channel();
        let is_jog = matches!(ask, Ask::Jog { .. } | Ask::JogOn);
        let message = Message::Ask { ask, ticket, reply };
        let input = if is_jog { Input::Jog(clock::now(), message) } else { Input::Message(message) };
        let _ = self.inputs.send(input);
        Begun::awaits(answer)
    }

    fn stop(&self) {
        self.tickets.stopped();
        let _ = self.inputs.send(Input::Message(Message::Stop));
    }

    fn control_changed(&self) {
        self.tickets.control_changed();
        let _ = self.inputs.send(Input::Message(Message::ControlChanged));
    }

    fn ticket(&self) -> Ticket {
        self.tickets.now()
    }

    fn watch(&self) -> mpsc::Receiver<Tell> {
        self.listeners.add()
    }

    fn greeting(&self) -> Vec<Tell> {
        self.send(|reply| Input::Message(Message::Greeting(reply))).unwrap_or_default()
    }

    fn shutdown(&self) {
        let _ = self.inputs.send(Input::Message(Message::Shutdown));
        let thread = self.thread.lock().ok().and_then(|mut thread| thread.take());
        if let Some(thread) = thread {
            let _ = thread.join();
        }
    }
}

/// A station and its port; `port` is `None` after it was lost.
struct Connection {
    station: Station<DiskFiles>,
    port: Option<Port>,
    /// Writes that the port has not taken completely.
    waiting: u32,
    /// Since when the port takes no bytes.
    full: Option<Instant>,
    reported: Instant,
}

impl Connection {
    fn open(
        site: &Site,
        port: Port,
        tickets: &Arc<Tickets>,
        command: Option<CommandJob>,
    ) -> Result<Self, Diagnostic> {
        let (speed, tickets, named) = (site.speed, Arc::clone(tickets), site.named.clone());
        let setup = Setup { speed, time: clock::now, tickets, named, in_page: false, command };
        let station = Station::open(site.files.clone(), setup)?;
        Ok(Self { station, port: Some(port), waiting: 0, full: None, reported: Instant::now() })
    }

    fn read(&mut self) {
        let Some(port) = &mut self.port else { return };
        match port.read() {
            Ok(bytes) if bytes.is_empty() => {}
            Ok(bytes) => self.station.bytes(bytes),
            Err(error) => self.lose(&error),
        }
    }

    /// Advances the station, writes to the port, and reports when a report is due.
    fn turn(&mut self) {
        let interval = self.station.advance();
        if let Err(error) = self.write() {
            self.lose(&error);
        }
        if self.station.is_over() {
            self.port = None;
        }
        if self.reported.elapsed() >= interval {
            self.reported = Instant::now();
            self.station.report();
        }
    }

    fn write(&mut self) -> io::Result<()> {
        let bytes = self.station.written();
        let Some(port) = &mut self.port else { return Ok(()) };
        self.waiting += u32::from(!bytes.is_empty());
        if self.waiting == 0 {
            return Ok(());
        }
        port.write(&bytes)?;
        if port.is_full() {
            // A hung controller on native USB. To the station this looks like a stalled host, for which it
            // stops its clock.
            let since = *self.full.get_or_insert_with(Instant::now);
            return if since.elapsed() < FULL { Ok(()) } else { Err(io::ErrorKind::TimedOut.into()) };
        }
        self.full = None;
        (0..std::mem::take(&mut self.waiting)).for_each(|_| self.station.carried());
        Ok(())
    }

    fn lose(&mut self, error: &io::Error) {
        tracing::warn!(%error, "the port of the controller was lost");
        if let Some(port) = self.port.take() {
            let why = error!("grbl.port_lost", port = &port.name, reason = error);
            self.station.notice(Told::Found(why));
            // Closing may wait half a minute for bytes that a hung controller does not take.
            thread::spawn(move || drop(port));
        }
        self.station.unplugged();
    }
}

/// USB vendor and product ID of the port `name`, or of the target of that link.
fn usb_at(name: &str, ports: &[Listed]) -> Option<(u16, u16)> {
    ports.iter().find(|port| port.is_named(name)).and_then(|port| port.usb)
}

struct Work {
    site: Site,
    usb: Option<(u16, u16)>,
    tickets: Arc<Tickets>,
    listeners: Listeners,
    /// Where the notices for the command line go, if it is the client.
    command: Option<Sender<Told>>,
    machine: Connection,
    /// The controller at the port that was opened again, until it has identified itself.
    next: Option<Connection>,
    /// STOP was pressed, and the machine has not come to rest since.
    stops: bool,
    /// Time of the last attempt to open the port again.
    tried: Instant,
}

impl Work {
    fn run(mut self, inbox: &Receiver<Input>, meets: Sender<Met>) {
        let mut meets = Some(meets);
        while self.command.is_none() || self.machine.port.is_some() {
            let is_open =
                [Some(&self.machine), self.next.as_ref()].into_iter().flatten().any(|one| one.port.is_some());
            match inbox.recv_timeout(if is_open { Duration::ZERO } else { INPUT_WAIT }) {
                Ok(Input::Message(Message::Shutdown)) | Err(RecvTimeoutError::Disconnected) => break,
                Ok(input) => self.take(input),
                Err(RecvTimeoutError::Timeout) => self.read(),
            }
            self.turn();
            let met = self.met();
            if let Some(meets) = meets.take_if(|_| met.is_some()) {
                let _ = meets.send(met.unwrap_or(Ok(())));
            }
        }
        // What a command leaves held stays held.
        if self.command.is_none() {
            self.rest();
        }
    }

    /// `Ok` if the controller has identified itself, an error if it did not in time, `None` until then.
    fn met(&self) -> Option<Met> {
        let station = &self.machine.station;
        let silent = || station.alarm().cloned().unwrap_or_else(|| error!("grbl.no_answer"));
        match (station.greeted(), station.is_over()) {
            (true, _) => Some(Ok(())),
            (false, true) => Some(Err(silent())),
            (false, false) => None,
        }
    }

    fn take(&mut self, input: Input) {
        // STOP also reaches a controller that has not identified itself yet, or whose port is not open yet.
        if matches!(input, Input::Message(Message::Stop)) {
            self.stops = true;
            if let Some(next) = &mut self.next {
                next.station.take(Message::Stop);
            }
        }
        let station = &mut self.machine.station;
        let may = |ticket: Option<Ticket>| ticket.map_or(Ok(()), |ticket| self.tickets.check(ticket));
        match input {
            // The user has released the key long ago.
            Input::Jog(asked, Message::Ask { reply, .. }) if clock::now().saturating_sub(asked) > STALE => {
                let _ = reply.send(Err(error!("grbl.not_now")));
            }
            Input::Message(message) | Input::Jog(_, message) => station.take(message),
            Input::Command(ask) => station.command(ask),
            Input::Attend => station.attend(),
            Input::Draft { job, from_leg, ticket, reply } => {
                let _ = reply.send(may(ticket).and_then(|()| station.draft(&job, from_leg)));
            }
            Input::Arm { job, from_leg, ticket, written, reply } => {
                let written = written.map(|written| *written);
                let armed = may(ticket).and_then(|()| station.arm(&job, from_leg, written));
                let _ = reply.send(armed.map(|tell| vec![tell]));
            }
            Input::Upload { upload, reply } => {
                station.upload(upload);
                let _ = reply.send(());
            }
            Input::Job { key, reply } => drop(reply.send(station.job(&key).map(<[u8]>::to_vec))),
        }
    }

    fn read(&mut self) {
        self.machine.read();
        if let Some(next) = &mut self.next {
            next.read();
        }
    }

    fn turn(&mut self) {
        self.machine.turn();
        self.pass_on();
        if self.machine.port.is_some() {
            self.stops &= self.machine.station.moves();
        } else if self.command.is_none() {
            self.reconnect();
        }
    }

    fn pass_on(&mut self) {
        let station = &mut self.machine.station;
        station.tells().iter().for_each(|tell| self.listeners.tell(tell));
        for told in station.notices() {
            let _ = self.command.as_ref().map(|command| command.send(told));
        }
    }

    /// Opens the lost port again. A controller that identifies itself takes over.
    fn reconnect(&mut self) {
        let Some(mut next) = self.next.take() else {
            if self.tried.elapsed() >= REOPEN_INTERVAL {
                self.tried = Instant::now();
                self.next = self.open_again();
                // The controller may still run the lines that it has.
                if let Some(next) = self.next.as_mut().filter(|_| self.stops) {
                    next.station.take(Message::Stop);
                }
            }
            return;
        };
        next.turn();
        if next.station.greeted() {
            tracing::info!("the controller is back");
            let before = std::mem::replace(&mut self.machine, next);
            self.machine.station.succeed(before.station);
            self.pass_on();
        } else if next.port.is_some() {
            self.next = Some(next);
        }
    }

    fn open_again(&mut self) -> Option<Connection> {
        // Another device may have got the name of the port: it is not ours to reset.
        if usb_at(&self.site.port, &serial::list()) != self.usb {
            return None;
        }
        let reset = reset_on_open(&mut self.site.files);
        let (port, _) = self.site.open(reset, |_| {}).ok()?;
        let opened = Connection::open(&self.site, port, &self.tickets, None);
        opened.inspect_err(|why| tracing::warn!(code = why.code, "the controller was not opened")).ok()
    }

    /// Stops what moves, and waits for it. A controller that was never identified runs what others started.
    fn rest(&mut self) {
        let moves = |machine: &Connection| {
            machine.port.is_some() && machine.station.greeted() && machine.station.moves()
        };
        if moves(&self.machine) {
            self.machine.station.take(Message::Stop);
        }
        let since = Instant::now();
        loop {
            self.machine.turn();
            self.pass_on();
            if !moves(&self.machine) || since.elapsed() >= STOP_WAIT {
                return;
            }
            self.machine.read();
        }
    }
}
