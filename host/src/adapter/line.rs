//! The line to an adapter: frames to and from a cable, and the adapter's last messages.
//!
//! ```text
//! offered ─▶ Sender ─ due by the adapter's own clock ─▶ cable     a stalled line sends nothing twice
//! cable ─ bytes ─▶ frames ─▶ Welcome, Refused, Status ─▶ Sender
//! ```
//!
//! A cable that fails returns an error, and the session ends or reconnects.

use crate::executor::Time;
use annulus_link::cobs::Unstuffer;
use annulus_link::cutter::Piece;
use annulus_link::frame::{FRAME, ON_LINE, open};
use annulus_link::message::{Ask, Beat, CountTouches, Refused, Status, Tell, Touches, Welcome};
use annulus_link::sender::Sender;
use std::time::Duration;

/// Longest time between two frames that we send: outputs go off after 250 ms of silence.
const BEAT: Duration = Duration::from_millis(50);

/// How often the touch counters are requested.
const ASKS: Duration = Duration::from_secs(1);

/// Longest silence of the adapter before the line counts as lost: longer than any pause of a USB hub.
const SILENCE: Duration = Duration::from_secs(3);

/// Bytes to and from an adapter.
pub trait Cable: Send {
    fn name(&self) -> &str;

    /// Returns the bytes that arrived since the last call, or why none can arrive. A blocking cable waits a
    /// few milliseconds for them.
    fn read(&mut self) -> Result<Vec<u8>, String>;

    /// Queues bytes to be written; called with none, continues with those that wait.
    fn write(&mut self, bytes: &[u8]) -> Result<(), String>;

    /// Returns `true` if written bytes still wait for room.
    fn is_full(&self) -> bool;

    /// Releases the failed port, so that its name is free, and checks whether the adapter is back. A
    /// blocking cable waits a moment first.
    fn again(&mut self) -> bool;
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Lost {
    /// The adapter sent nothing for [`SILENCE`].
    Silent,
    Cable {
        /// The cable's own words.
        reason: String,
    },
}

pub struct AdapterLine {
    cable: Box<dyn Cable>,
    time: Time,
    sender: Sender,
    unstuffer: Unstuffer<FRAME>,
    pub(super) welcome: Option<Welcome>,
    /// Protocol versions of an adapter that does not speak ours.
    pub(super) refused: Option<Refused>,
    /// The latest status; `None` until the first one after the cable was connected.
    pub(super) status: Option<Status>,
    /// Latest count of touches shorter than their filter. Requested only if an input has a filter.
    pub(super) touches: Option<Touches>,
    pub(super) is_filtered: bool,
    asked: Duration,
    /// The adapter's clock in the last status, and its running time in this session, µs.
    clock_us: (u32, u64),
    heard: Duration,
    /// When we last sent a frame; `None` before the first.
    spoke: Option<Duration>,
    pub(super) hears_bytes: bool,
}

impl AdapterLine {
    /// A new session on `cable`. The `session` number must not have been used before.
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

    pub(super) fn now(&self) -> Duration {
        (self.time)()
    }

    /// Continues the session if the adapter is connected again. Its status must arrive again first.
    pub(super) fn again(&mut self) -> bool {
        (self.unstuffer, self.status) = (Unstuffer::new(), None);
        let is_there = self.cable.again();
        self.heard = self.now();
        is_there
    }

    pub(super) fn port(&self) -> &str {
        self.cable.name()
    }

    pub(super) fn pending(&self) -> u32 {
        self.sender.pending()
    }

    /// Queues a message. Returns its number, or `None` if too many are on their way.
    pub(super) fn offer(&mut self, ask: impl Into<Ask>) -> Option<u32> {
        self.sender.offer(&ask.into())
    }

    /// Queues a piece of path, like [`Self::offer`].
    pub(super) fn offer_piece(&mut self, piece: &Piece) -> Option<u32> {
        self.sender.offer_chunk(&piece.head, piece.slices())
    }

    /// Reads what arrived and sends what is due.
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
