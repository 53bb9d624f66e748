//! A station in the worker of the one page that uses it.

use super::station::{Setup, Station};
use crate::executor::Time;
use crate::files::Files;
use crate::line::{Asked, Line};
use crate::programs::Upload;
use crate::ticket::Tickets;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::wire::Tell;
use std::sync::Arc;
use std::time::Duration;

/// A controller and its page. Its port is open from the start; the worker ends with the port.
pub struct PageStation<F> {
    station: Station<F>,
    line: Line,
    time: Time,
}

impl<F: Files> PageStation<F> {
    /// Opens the station whose ledger is in `files`. `speed` is the time scale of a simulated controller, 1
    /// for real time.
    pub fn open(files: F, speed: f64, time: Time) -> Result<Self, Diagnostic> {
        let tickets = Arc::<Tickets>::default();
        let (named, command, in_page) = (None, None, true);
        let setup = Setup { speed, time, tickets: Arc::clone(&tickets), named, in_page, command };
        Ok(Self { station: Station::open(files, setup)?, line: Line::new(tickets), time })
    }

    /// A page connected; its hello comes next.
    pub fn connect(&mut self) {
        self.line.challenge();
    }

    pub fn hear(&mut self, text: &str) {
        let asked = self.line.heard(text, (self.time)());
        self.see_to(asked);
    }

    pub fn bytes(&mut self, bytes: Vec<u8>) {
        self.station.bytes(bytes);
        self.pass_on();
    }

    /// The port is closed.
    pub fn unplugged(&mut self) {
        self.station.unplugged();
        self.station.say_farewell();
        self.station.report();
        self.pass_on();
    }

    /// Takes the bytes for the port, in order. The caller confirms each batch with [`Self::carried`].
    pub fn written(&mut self) -> Vec<u8> {
        self.station.written()
    }

    /// The port accepted the oldest written batch.
    pub fn carried(&mut self) {
        self.station.carried();
        self.pass_on();
    }

    /// Takes the frames for the page, in order.
    pub fn frames(&mut self) -> Vec<String> {
        self.line.frames()
    }

    /// Returns `true` if the session ended and the port should be closed.
    pub fn is_over(&self) -> bool {
        self.station.is_over()
    }

    /// Returns `true` if the controller identified itself since the port was opened.
    pub fn greeted(&self) -> bool {
        self.station.greeted()
    }

    /// Saves `bytes` under `key`, their SHA-256, if they are a program.
    pub fn upload(&mut self, key: &str, bytes: Vec<u8>) -> Result<(), Diagnostic> {
        self.station.upload(Upload::checked(key, bytes)?);
        Ok(())
    }

    pub fn job(&self, key: &str) -> Option<&[u8]> {
        self.station.job(key)
    }

    /// Does everything that is due now. Returns the delay until the next call.
    pub fn advance(&mut self) -> Duration {
        let asked = self.line.passed((self.time)());
        self.see_to(asked);
        let delay = self.station.advance();
        if self.station.is_over() && self.station.greeted() {
            self.station.say_farewell();
        }
        self.station.report();
        self.pass_on();
        let asked = self.line.answers();
        self.see_to(asked);
        delay
    }

    fn see_to(&mut self, asked: Vec<Asked>) {
        for asked in asked {
            match asked {
                Asked::Message(message) => self.station.take(message),
                Asked::Arm { job, from_leg, ticket } => {
                    let armed = self.line.tickets.check(ticket).and_then(|()| self.arm(&job, from_leg));
                    self.line.answer(armed.map(|tell| vec![tell]));
                }
                // The controller applies overrides itself: nothing to plan.
                Asked::FeedOverride { .. } => {}
            }
            self.pass_on();
        }
    }

    fn arm(&mut self, job: &str, from_leg: u32) -> Result<Tell, Diagnostic> {
        let draft = self.station.draft(job, from_leg)?;
        let written = draft.map(|draft| draft.write()).transpose()?;
        self.station.arm(job, from_leg, written)
    }

    fn pass_on(&mut self) {
        for tell in self.station.tells() {
            self.line.tell(&tell);
        }
    }
}
