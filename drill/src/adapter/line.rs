//! The line to an adapter: frames out of a cable and into it, and what the adapter said last.
//!
//! ```text
//! offered ─▶ Sender ─ due by the adapter's own clock ─▶ cable       a line that stands still has no time: nothing is sent twice
//! cable ─ bytes ─▶ frames ─▶ Welcome, Refused, Status ─▶ Sender     into it
//! ```
//!
//! Comes in: messages, bytes, the time. Goes out: the same. A cable that fails says so and is left. Does not know what moves.

use crate::executor::Time;
use annulus_link::cobs::Unstuffer;
use annulus_link::cutter::Piece;
use annulus_link::frame::{FRAME, ON_LINE, open};
use annulus_link::message::{Ask, Beat, CountTouches, Refused, Status, Tell, Touches, Welcome};
use annulus_link::sender::Sender;
use std::time::Duration;

/// How often something is said: outputs go off after 250 ms of silence.
const BEAT: Duration = Duration::from_millis(50);

/// How often it is asked how often inputs were touched.
const ASKS: Duration = Duration::from_secs(1);

/// So long an adapter may say nothing: a hub that stands still does not last longer.
const SILENCE: Duration = Duration::from_secs(3);

/// Bytes to an adapter and from it.
pub trait Cable: Send {
    /// What people call the port.
    fn name(&self) -> &str;

    /// What came since; why nothing comes any more. Who waits by itself waits a few milliseconds where nothing came.
    fn read(&mut self) -> Result<Vec<u8>, String>;

    /// Takes bytes to be written; with none, goes on with those that wait.
    fn write(&mut self, bytes: &[u8]) -> Result<(), String>;

    /// Whether some of what was written waits for room.
    fn is_full(&self) -> bool;

    /// Lets go of what failed, so that its name is free, and looks whether the adapter is there again. Who waits by itself waits a
    /// moment first.
    fn again(&mut self) -> bool;
}

/// Why a line is of no use now.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Lost {
    /// Nothing was heard for so long that nobody can be there.
    Silent,
    /// The cable says so.
    Cable {
        /// In its own words.
        reason: String,
    },
}

/// One session on a cable.
pub struct AdapterLine {
    cable: Box<dyn Cable>,
    time: Time,
    sender: Sender,
    unstuffer: Unstuffer<FRAME>,
    /// What the adapter is, once it said so.
    pub(super) welcome: Option<Welcome>,
    /// Versions of an adapter that does not speak ours.
    pub(super) refused: Option<Refused>,
    /// How it was last; none since the cable was plugged in.
    pub(super) status: Option<Status>,
    /// How often inputs were touched for less than their filter, as it said last; asked for where one has a filter.
    pub(super) touches: Option<Touches>,
    pub(super) is_filtered: bool,
    asked: Duration,
    /// The adapter's own clock at that, and how long it has been running in this session, in µs.
    clock_us: (u32, u64),
    heard: Duration,
    /// When something was said last; nothing was in this session at first.
    spoke: Option<Duration>,
    /// Something came that may be no adapter's.
    pub(super) hears_bytes: bool,
}

impl AdapterLine {
    /// A new session on `cable`, whose number nobody used before.
    pub fn new(cable: Box<dyn Cable>, session: u32, time: Time) -> Self {
        Self {
            cable,
            time,
            sender: Sender::new(session),
            unstuffer: Unstuffer::new(),
            welcome: None,
            refused: None,
            status: None,
            touches: None,
            is_filtered: false,
            asked: time(),
            clock_us: (0, 0),
            heard: time(),
            spoke: None,
            hears_bytes: false,
        }
    }

    /// What time it is.
    pub(super) fn now(&self) -> Duration {
        (self.time)()
    }

    /// The same session, where the adapter is there again. How it is has to be heard again.
    pub(super) fn again(&mut self) -> bool {
        (self.unstuffer, self.status) = (Unstuffer::new(), None);
        let is_there = self.cable.again();
        self.heard = self.now();
        is_there
    }

    /// The port's name.
    pub(super) fn port(&self) -> &str {
        self.cable.name()
    }

    /// How many frames the adapter has not confirmed.
    pub(super) fn pending(&self) -> u32 {
        self.sender.pending()
    }

    /// Takes a message to be sent; its number, none while too many are on their way.
    pub(super) fn offer(&mut self, ask: impl Into<Ask>) -> Option<u32> {
        self.sender.offer(&ask.into())
    }

    /// The same for a piece of path.
    pub(super) fn offer_piece(&mut self, piece: &Piece) -> Option<u32> {
        self.sender.offer_chunk(&piece.head, piece.slices())
    }

    /// Hears what came and sends what is due.
    pub(super) fn turn(&mut self) -> Result<(), Lost> {
        self.carry().map_err(|reason| Lost::Cable { reason })?;
        if self.now().saturating_sub(self.heard) >= SILENCE { Err(Lost::Silent) } else { Ok(()) }
    }

    fn carry(&mut self) -> Result<(), String> {
        self.cable.read()?.into_iter().for_each(|byte| self.hear(byte));
        self.cable.write(&[])?;
        let mut frame = [0; ON_LINE];
        while !self.cable.is_full() {
            let Some(length) = self.sender.due(self.clock_us.1, &mut frame) else { break };
            self.cable.write(frame.get(..length).unwrap_or_default())?;
            self.spoke = Some(self.now());
        }
        let is_silent = self.spoke.is_none_or(|spoke| self.now().saturating_sub(spoke) >= BEAT);
        if is_silent && !self.cable.is_full() {
            self.spoke = Some(self.now());
            let is_known = self.status.is_some() && self.welcome.is_some();
            let is_asked = self.is_filtered && self.now().saturating_sub(self.asked) >= ASKS;
            let length = if is_known && is_asked {
                self.asked = self.now();
                self.sender.unnumbered(&CountTouches {}.into(), &mut frame)
            } else if is_known {
                self.sender.unnumbered(&Beat {}.into(), &mut frame)
            } else {
                self.sender.hello(&mut frame)
            };
            self.cable.write(frame.get(..length.unwrap_or(0)).unwrap_or_default())?;
        }
        Ok(())
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
            Some((Tell::Touches(touches), [])) => self.touches = Some(touches),
            Some((Tell::Status(status), [])) => {
                let passed = status.micros.wrapping_sub(self.clock_us.0);
                let passed = if self.clock_us.1 == 0 { 1 } else { passed };
                self.clock_us = (status.micros, self.clock_us.1 + u64::from(passed));
                self.sender.hear(&status);
                self.status = Some(status);
            }
            _ => return,
        }
        self.heard = self.now();
    }
}
