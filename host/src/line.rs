//! The connection to the one page: the frames of `wire`, which the bridge's server speaks with many pages.
//!
//! No authentication: only the page that created this drill can reach it.

use crate::owner::Message;
use crate::ticket::{Ticket, Tickets};
use annulus_core::control::lease::{Lease, LeaseEvent, LeaseOutcome, Viewer};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::wire::{Ask, Control, FRAME_LIMIT, OLDEST_PROTOCOL, PROTOCOL, Tell, understand};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::Duration;

const PAGE: Viewer = 1;

pub(crate) enum Asked {
    Message(Message),
    Arm { job: String, from_leg: u32, ticket: Ticket },
    FeedOverride { percent: u8 },
}

enum Waiting {
    /// An answer, and the feed override to plan after a success.
    Answer(Receiver<Result<Vec<Tell>, Diagnostic>>, Option<u8>),
    Greeting(Receiver<Vec<Tell>>),
}

pub(crate) struct Line {
    pub(crate) tickets: Arc<Tickets>,
    lease: Lease,
    welcome: bool,
    waiting: Vec<Waiting>,
    frames: Vec<String>,
}

impl Line {
    pub(crate) fn new(tickets: Arc<Tickets>) -> Self {
        let (lease, waiting, frames) = (Lease::default(), Vec::new(), Vec::new());
        Self { tickets, lease, welcome: false, waiting, frames }
    }

    pub(crate) fn challenge(&mut self) {
        self.welcome = false;
        let (proto, min) = (PROTOCOL, OLDEST_PROTOCOL);
        let bridge = env!("CARGO_PKG_VERSION").to_owned();
        self.say(&Tell::Challenge { proto, min, bridge, nonce: String::new() });
    }

    pub(crate) fn frames(&mut self) -> Vec<String> {
        std::mem::take(&mut self.frames)
    }

    /// Sends a message, if the page has completed its hello.
    pub(crate) fn tell(&mut self, tell: &Tell) {
        if self.welcome {
            self.say(tell);
        }
    }

    pub(crate) fn answer(&mut self, answer: Result<Vec<Tell>, Diagnostic>) {
        match answer {
            Ok(tells) => tells.iter().for_each(|tell| self.say(tell)),
            Err(why) => self.say(&Tell::Refused { why }),
        }
    }

    pub(crate) fn await_answer(&mut self, answer: Receiver<Result<Vec<Tell>, Diagnostic>>) {
        self.waiting.push(Waiting::Answer(answer, None));
    }

    fn say(&mut self, tell: &Tell) {
        self.frames.extend(serde_json::to_string(tell));
    }

    pub(crate) fn heard(&mut self, text: &str, now: Duration) -> Vec<Asked> {
        if text.len() > FRAME_LIMIT {
            self.answer(Err(error!("socket.too_large", limit = FRAME_LIMIT)));
            return Vec::new();
        }
        let mut asked = self.control(LeaseEvent::Heard(PAGE), now);
        match understand(text) {
            Ok(ask) => asked.extend(self.asked(ask, now)),
            Err(why) => self.answer(Err(why)),
        }
        asked
    }

    fn asked(&mut self, ask: Ask, now: Duration) -> Vec<Asked> {
        match ask {
            Ask::Hello { .. } if !self.welcome => return self.hello(),
            Ask::Hello { .. } => self.answer(Err(error!("socket.hello_again"))),
            _ if !self.welcome => self.answer(Err(error!("socket.first_frame"))),
            Ask::Ping { stamp } => self.say(&Tell::Pong { stamp }),
            Ask::TakeControl { force } => return self.control(LeaseEvent::Take { viewer: PAGE, force }, now),
            Ask::ReleaseControl => return self.control(LeaseEvent::Release(PAGE), now),
            Ask::Stop => {
                self.tickets.stopped();
                return vec![Asked::Message(Message::Stop)];
            }
            _ if self.lease.holder() != Some(PAGE) => {
                self.answer(Err(error!("control.needed")));
            }
            Ask::Arm { job, from_leg } => {
                return vec![Asked::Arm { job, from_leg, ticket: self.tickets.now() }];
            }
            ask => {
                let percent = if let Ask::FeedOverride { percent } = ask { Some(percent) } else { None };
                let (reply, answer) = channel();
                self.waiting.push(Waiting::Answer(answer, percent));
                return vec![Asked::Message(Message::Ask { ask, ticket: Some(self.tickets.now()), reply })];
            }
        }
        Vec::new()
    }

    fn hello(&mut self) -> Vec<Asked> {
        self.welcome = true;
        self.say(&Tell::Welcome { viewer: PAGE });
        self.say_control();
        let (reply, greeting) = channel();
        self.waiting.push(Waiting::Greeting(greeting));
        vec![Asked::Message(Message::Greeting(reply))]
    }

    fn say_control(&mut self) {
        let yours = self.lease.holder() == Some(PAGE);
        self.say(&Tell::Control(Control { yours, taken: yours, viewers: 1 }));
    }

    fn control(&mut self, event: LeaseEvent, now: Duration) -> Vec<Asked> {
        let now_ms = u64::try_from(now.as_millis()).unwrap_or(u64::MAX);
        let LeaseOutcome { changed, refused, .. } = self.lease.step(event, now_ms);
        if let Some(why) = refused {
            self.answer(Err(why));
        }
        if !changed {
            return Vec::new();
        }
        self.tickets.control_changed();
        self.say_control();
        vec![Asked::Message(Message::ControlChanged)]
    }

    /// Advances the time: a page that was silent too long loses control.
    pub(crate) fn passed(&mut self, now: Duration) -> Vec<Asked> {
        self.control(LeaseEvent::Tick, now)
    }

    /// Passes on the answers that arrived. Returns the work to do after them.
    pub(crate) fn answers(&mut self) -> Vec<Asked> {
        let mut asked = Vec::new();
        for waiting in std::mem::take(&mut self.waiting) {
            let later = match &waiting {
                Waiting::Answer(answer, percent) => match answer.try_recv() {
                    Ok(answer) => {
                        let good = answer.is_ok();
                        self.answer(answer);
                        asked.extend(percent.filter(|_| good).map(|percent| Asked::FeedOverride { percent }));
                        false
                    }
                    Err(why) => why == TryRecvError::Empty,
                },
                Waiting::Greeting(greeting) => match greeting.try_recv() {
                    Ok(tells) => {
                        self.answer(Ok(tells));
                        false
                    }
                    Err(why) => why == TryRecvError::Empty,
                },
            };
            if later {
                self.waiting.push(waiting);
            }
        }
        asked
    }
}
