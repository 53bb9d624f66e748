//! The line to an adapter: frames out of a port and into it, and what the adapter said last.
//!
//! ```text
//! offered ─▶ Sender ─ due by the adapter's own clock ─▶ port        a line that stands still has no time: nothing is sent twice
//! port ─ bytes ─▶ frames ─▶ Welcome, Refused, Status ─▶ Sender      into it
//! ```
//!
//! Comes in: messages, bytes. Goes out: the same. A port that fails says so and is left. Does not know what moves.

use crate::serial::Port;
use annulus_link::cobs::Unstuffer;
use annulus_link::cutter::Piece;
use annulus_link::frame::{FRAME, ON_LINE, open};
use annulus_link::message::{Ask, Beat, Refused, Status, Tell, Welcome};
use annulus_link::sender::Sender;
use std::io::{self, ErrorKind};
use std::time::{Duration, Instant};

/// How often something is said: outputs go off after 250 ms of silence.
const BEAT: Duration = Duration::from_millis(50);

/// So long an adapter may say nothing: a hub that stands still does not last longer.
const SILENCE: Duration = Duration::from_secs(3);

/// One session on a port.
pub(super) struct Line {
    /// None while it is unplugged.
    port: Option<Port>,
    name: String,
    sender: Sender,
    unstuffer: Unstuffer<FRAME>,
    /// What the adapter is, once it said so.
    pub(super) welcome: Option<Welcome>,
    /// Versions of an adapter that does not speak ours.
    pub(super) refused: Option<Refused>,
    /// How it was last; none since the port was opened.
    pub(super) status: Option<Status>,
    /// The adapter's own clock at that, and how long it has been running in this session, in µs.
    clock_us: (u32, u64),
    heard: Instant,
    spoke: Instant,
    /// Something came that may be no adapter's.
    pub(super) hears_bytes: bool,
}

impl Line {
    /// A new session on `port`, whose number nobody used before.
    pub(super) fn new(port: Port, session: u32) -> Self {
        let now = Instant::now();
        Self {
            name: port.name.clone(),
            port: Some(port),
            sender: Sender::new(session),
            unstuffer: Unstuffer::new(),
            welcome: None,
            refused: None,
            status: None,
            clock_us: (0, 0),
            heard: now,
            spoke: now.checked_sub(BEAT).unwrap_or(now),
            hears_bytes: false,
        }
    }

    /// The same session on a port that was opened anew. How the adapter is has to be heard again.
    pub(super) fn move_to(&mut self, port: Port) {
        self.name.clone_from(&port.name);
        (self.port, self.heard) = (Some(port), Instant::now());
    }

    /// Lets go of a port that failed, so that its name is free.
    pub(super) fn leave(&mut self) {
        (self.port, self.unstuffer, self.status) = (None, Unstuffer::new(), None);
    }

    /// The port's name.
    pub(super) fn port(&self) -> &str {
        &self.name
    }

    /// How many frames the adapter has not confirmed.
    pub(super) fn pending(&self) -> u32 {
        self.sender.pending()
    }

    /// Takes a message to be sent; its number, none while too many are on their way.
    pub(super) fn offer(&mut self, ask: impl Into<Ask>) -> Option<u32> {
        self.sender.offer(&ask.into())
    }

    /// The same for a piece of path; whether there was room.
    pub(super) fn offer_piece(&mut self, piece: &Piece) -> bool {
        let (runs, tail) = piece.slices();
        self.sender.offer_chunk(&piece.head, runs, tail).is_some()
    }

    /// Hears what came and sends what is due; waits a few milliseconds where nothing comes.
    pub(super) fn turn(&mut self) -> io::Result<()> {
        let bytes = self.port.as_mut().ok_or(ErrorKind::NotConnected)?.read()?;
        bytes.into_iter().for_each(|byte| self.hear(byte));
        let Some(port) = &mut self.port else { return Ok(()) };
        port.write(&[])?;
        let mut frame = [0; ON_LINE];
        while !port.is_full() {
            let Some(length) = self.sender.due(self.clock_us.1, &mut frame) else { break };
            port.write(frame.get(..length).unwrap_or_default())?;
            self.spoke = Instant::now();
        }
        if self.spoke.elapsed() >= BEAT && !port.is_full() {
            self.spoke = Instant::now();
            let is_known = self.status.is_some() && self.welcome.is_some();
            let length = if is_known {
                self.sender.unnumbered(&Beat {}.into(), &mut frame)
            } else {
                self.sender.hello(&mut frame)
            };
            port.write(frame.get(..length.unwrap_or(0)).unwrap_or_default())?;
        }
        if self.heard.elapsed() >= SILENCE { Err(ErrorKind::TimedOut.into()) } else { Ok(()) }
    }

    fn hear(&mut self, byte: u8) {
        self.hears_bytes = true;
        let Some((header, payload)) = self.unstuffer.take(byte).and_then(open) else { return };
        if header.session != self.sender.session() {
            return;
        }
        match Tell::take(header.kind, payload) {
            Some((Tell::Welcome(welcome), [])) => self.welcome = Some(welcome),
            Some((Tell::Refused(refused), [])) => self.refused = Some(refused),
            Some((Tell::Status(status), [])) => {
                let passed = status.micros.wrapping_sub(self.clock_us.0);
                let passed = if self.clock_us.1 == 0 { 1 } else { passed };
                self.clock_us = (status.micros, self.clock_us.1 + u64::from(passed));
                self.sender.hear(&status);
                self.status = Some(status);
            }
            _ => return,
        }
        self.heard = Instant::now();
    }
}
