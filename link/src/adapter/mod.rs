//! One adapter without its hardware: session, settings, motion, status.
//!
//! ```text
//! Unset ─Configure─▶ Ready ─Begin─▶ Running ─┬─ path rests ──▶ Ready
//!                      ▲                     ├─ nothing newer ▶ Starved ─┐
//!                      │                     ├─ Stop ─────────▶ Stopped ─┤
//!                      │                     └─ by force ─▶ Limit, EmergencyStop, Fault
//!                      └──────────────────────── Clear ◀─────────────────┘
//! a new session: stops as by Stop, its outputs on until then, then Unset
//! ```

mod obey;

use crate::bytes::{Plain, Writer};
use crate::chunk::Before;
use crate::cobs::Unstuffer;
use crate::frame::{FRAME, Header, ON_LINE, open, seal};
use crate::message::{Ask, Configure, Hello, Refusal, Refused, State, Status, Tell, Touches, Trust, Welcome};
use crate::phases;
use crate::player::{End, Player, Words};
use crate::receiver::Receiver;
use crate::store::{ROOM, Store};
use crate::{AXES, FULL_RATE, INPUTS, NEWEST, OLDEST};

/// After this silence of the session, in µs, motion stops on the path; outputs go off once stopped.
pub const OUTPUTS_US: u32 = 250_000;

/// After this silence, in µs, outputs go off even during motion: later than the end of the gentlest stop,
/// 1.6 s.
pub const OUTPUTS_AT_LAST_US: u32 = 2_000_000;

/// Interval of status frames, in µs.
pub const STATUS_US: u32 = 10_000;

/// Number of ended sessions to remember: their late frames must start nothing.
const ENDED: usize = 8;

pub const NO_INPUT: u8 = 255;

/// An order to the hardware. If several wait, the first in this list has priority.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    /// Apply new settings, guarded inputs and outputs.
    Settle,
    /// Arm again after a stop.
    Clear,
    /// Start moving: make words, then start the machines together.
    Begin,
}

const ORDERS: [Order; 3] = [Order::Settle, Order::Clear, Order::Begin];

/// State of the inputs, from the hardware.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Inputs {
    /// Inputs that are on, one bit each.
    pub on: u8,
    /// The emergency stop is pressed.
    pub stop: bool,
}

fn inputs_of(settings: &Configure) -> u8 {
    if settings.phases == 0 { u8::MAX } else { phases::INPUTS }
}

#[derive(Debug)]
pub struct Adapter<'a> {
    line: Unstuffer<FRAME>,
    receiver: Receiver,
    session: u32,
    ended: [u32; ENDED],
    /// Times of the session's last frame and of the last status, in µs.
    heard: u32,
    said: u32,
    settings: Configure,
    settings_crc: u32,
    limits: u8,
    filters_us: [u16; INPUTS],
    /// The touch counters were requested.
    is_asked: bool,
    outputs: u8,
    inputs: Inputs,
    state: State,
    trust: Trust,
    input: u8,
    /// Start of motion for an ended session, in µs.
    orphaned: Option<u32>,
    /// Motion is stopping because the session fell silent.
    is_deserted: bool,
    /// Outputs went off because of silence, and the host has not set them since: no path may start.
    is_off: bool,
    player: Player,
    store: &'a mut Store,
    /// Number of received chunks, their bytes, and the index at their end.
    chunk: u32,
    bytes: u32,
    accepted: [i32; AXES],
    before: [Before; AXES],
    refusal: Refusal,
    refused: u32,
    /// The next piece of the path was refused, so later ones are refused too.
    is_torn: bool,
    orders: u8,
    answer: Option<(Header, Tell)>,
    is_status_due: bool,
    welcome: Welcome,
}

impl<'a> Adapter<'a> {
    /// The state after a reset. `welcome` describes the hardware; `store` holds waiting chunks.
    pub const fn new(welcome: Welcome, store: &'a mut Store) -> Self {
        Self {
            line: Unstuffer::new(),
            receiver: Receiver::new(),
            session: 0,
            ended: [0; ENDED],
            heard: 0,
            said: 0,
            settings: Configure::NONE,
            settings_crc: 0,
            limits: 0,
            filters_us: [0; INPUTS],
            is_asked: false,
            outputs: 0,
            inputs: Inputs { on: 0, stop: false },
            state: State::Unset,
            trust: Trust::Lost,
            input: NO_INPUT,
            orphaned: None,
            is_deserted: false,
            is_off: false,
            player: Player::new(),
            store,
            chunk: 0,
            bytes: 0,
            accepted: [0; AXES],
            before: [Before { since: 0, forward: false, shown: false }; AXES],
            refusal: Refusal::None,
            refused: 0,
            is_torn: false,
            orders: 0,
            answer: None,
            is_status_due: false,
            welcome,
        }
    }

    pub fn settings(&self) -> &Configure {
        &self.settings
    }

    pub fn state(&self) -> State {
        self.state
    }

    pub fn limits(&self) -> u8 {
        self.limits
    }

    /// How long each input must be touched to count as on, in µs.
    pub fn filters_us(&self) -> &[u16; INPUTS] {
        &self.filters_us
    }

    /// Returns `true` if the hardware should report its touch counters with [`Self::touched`].
    pub fn asks_touches(&self) -> bool {
        self.is_asked && self.answer.is_none()
    }

    pub fn touched(&mut self, touches: Touches) {
        let header = Header { session: self.session, number: 0, kind: 0 };
        (self.is_asked, self.answer) = (false, Some((header, touches.into())));
    }

    pub fn outputs(&self) -> u8 {
        self.outputs
    }

    /// Description of the hardware; pin numbers change with the wiring.
    pub fn welcome_mut(&mut self) -> &mut Welcome {
        &mut self.welcome
    }

    /// Returns `true` if a session was heard recently.
    pub fn is_attended(&self, now_us: u32) -> bool {
        self.session != 0 && now_us.wrapping_sub(self.heard) < OUTPUTS_US
    }

    pub fn index(&self) -> [i32; AXES] {
        self.player.index()
    }

    /// Machine tick up to which words exist.
    pub fn machine(&self) -> u32 {
        self.player.machine()
    }

    pub fn order(&mut self) -> Option<Order> {
        let order = ORDERS.into_iter().find(|order| self.orders >> *order as u8 & 1 == 1)?;
        self.orders &= !(1 << order as u8);
        Some(order)
    }

    /// Takes a byte from the line, at `now_us`. Numbered frames wait for [`Self::obey_next`].
    pub fn hear(&mut self, byte: u8, now_us: u32) {
        let Some(frame) = self.line.take(byte) else { return };
        let mut copy = [0; FRAME];
        let length = frame.len();
        copy[..length].copy_from_slice(frame);
        let Some((header, payload)) = open(&copy[..length]) else { return };
        if header.session == 0 || self.ended.contains(&header.session) {
            return;
        }
        match Ask::take(header.kind, payload) {
            Some((Ask::Hello(hello), [])) => self.hello(header, hello, now_us),
            Some((Ask::Beat(_), [])) if header.session == self.session => self.is_status_due = true,
            Some((Ask::CountTouches(_), [])) if header.session == self.session => self.is_asked = true,
            _ if header.session == self.session && header.number != 0 => self.numbered(header, payload),
            _ => return,
        }
        if header.session == self.session {
            self.heard = now_us;
        }
    }

    fn hello(&mut self, header: Header, hello: Hello, now_us: u32) {
        let answer = Header { number: 0, kind: 0, ..header };
        if hello.oldest > NEWEST || hello.newest < OLDEST {
            self.answer = Some((answer, Refused { oldest: OLDEST, newest: NEWEST }.into()));
            return;
        }
        if header.session != self.session {
            self.begin_session(header.session, now_us);
        }
        let version = hello.newest.min(NEWEST);
        self.answer = Some((answer, Welcome { version, buffer: ROOM as u32, ..self.welcome }.into()));
        self.is_status_due = true;
    }

    fn begin_session(&mut self, session: u32, now_us: u32) {
        self.ended.rotate_right(1);
        self.ended[0] = self.session;
        self.session = session;
        self.receiver.restart();
        (self.chunk, self.bytes) = (0, 0);
        (self.refusal, self.refused, self.is_torn) = (Refusal::None, 0, false);
        (self.settings_crc, self.is_off) = (0, false);
        (self.filters_us, self.is_asked) = ([0; INPUTS], false);
        self.player.want(FULL_RATE);
        if self.state == State::Running {
            // Outputs stay on until motion stops: no tool may go through a board with the spindle off.
            self.orphaned.get_or_insert(now_us);
            self.player.stop();
        } else {
            self.outputs = 0;
            self.forget();
            if matches!(self.state, State::Ready | State::Starved | State::Stopped) {
                self.state = State::Unset;
            }
        }
        self.orders |= 1 << Order::Settle as u8;
    }

    fn forget(&mut self) {
        self.player.forget(self.store);
        self.accepted = self.player.index();
        let forward = self.player.forward();
        self.before = forward.map(Before::at_rest);
    }

    /// Loads the first chunk, after [`Order::Begin`].
    pub fn begin(&mut self) {
        if !self.player.begin(self.store, u32::from(self.settings.pulse)) {
            self.ended(End::Rested);
        }
    }

    /// Most words that a slice makes for one axis.
    pub fn most_words(&self) -> u32 {
        self.player.most_words(u32::from(self.settings.pulse))
    }

    /// Makes the words of the next slice while running. Returns how the path ended, if it did; the pins
    /// must then play out, and the caller must report with [`Self::ended`].
    #[inline(always)]
    pub fn slice(&mut self, words: &mut impl Words) -> Option<End> {
        self.player.slice(self.store, words)
    }

    /// The pins have played everything and stopped.
    pub fn ended(&mut self, end: End) {
        self.state = match end {
            End::Rested => State::Ready,
            End::Starved => State::Starved,
            End::Stopped if self.is_deserted => State::Starved,
            End::Stopped => State::Stopped,
        };
        if end != End::Rested || self.store.is_empty() {
            self.forget();
        }
        self.leave_motion();
    }

    /// The pulses were stopped by force, at `index`. The cause is an input, the emergency stop (`stop`), or
    /// neither if the pins ran dry.
    pub fn forced(&mut self, index: [i32; AXES], input: Option<u8>, stop: bool) {
        let moved = self.state == State::Running;
        self.player.cut_short(index);
        self.forget();
        (self.state, self.input) = match (stop, input) {
            (true, _) => (State::EmergencyStop, NO_INPUT),
            (false, Some(input)) => (State::Limit, input),
            (false, None) => (State::Fault, NO_INPUT),
        };
        self.outputs = 0;
        if moved {
            self.trust = match (stop, self.trust) {
                (true, _) | (_, Trust::Lost) => Trust::Lost,
                _ => Trust::Suspect,
            };
        }
        self.leave_motion();
    }

    fn leave_motion(&mut self) {
        if self.orphaned.take().is_some() {
            (self.outputs, self.is_off) = (0, false);
            if matches!(self.state, State::Ready | State::Starved | State::Stopped) {
                self.state = State::Unset;
            }
        }
        self.is_deserted = false;
        self.is_status_due = true;
    }

    /// Takes the state of the inputs. If the session is silent, motion stops first and then the outputs go
    /// off: no tool may go through a board with the spindle off. Nothing starts then until the host sets
    /// the outputs again.
    pub fn attend(&mut self, inputs: Inputs, now_us: u32) {
        self.is_status_due |= inputs != self.inputs;
        // After another stop the watcher is off, so check the emergency stop here: twice, as the watcher
        // does.
        if inputs.stop && self.inputs.stop && matches!(self.state, State::Limit | State::Fault) {
            self.forced(self.index(), None, true);
        }
        self.inputs = inputs;
        let silent_us = now_us.wrapping_sub(self.orphaned.unwrap_or(self.heard));
        let moves = self.state == State::Running;
        if moves && silent_us >= OUTPUTS_US && !self.player.is_ending() {
            self.is_deserted = true;
            self.player.stop();
        }
        let patience_us = if moves { OUTPUTS_AT_LAST_US } else { OUTPUTS_US };
        if self.outputs != 0 && silent_us >= patience_us {
            (self.outputs, self.is_off) = (0, true);
            self.is_status_due = true;
        }
    }

    pub fn status(&self, now_us: u32) -> Status {
        Status {
            next: self.receiver.next(),
            held: self.receiver.held(),
            limit: self.bytes.wrapping_add(self.store.free() as u32),
            state: self.state,
            trust: self.trust,
            input: self.input,
            index: self.player.index(),
            chunk: self.chunk,
            resident: self.player.waiting()
                + if self.state == State::Running { self.player.left() } else { 0 },
            rate: self.player.rate(),
            inputs: u16::from(self.inputs.on) | u16::from(self.inputs.stop) << 15,
            outputs: self.outputs,
            settings: self.settings_crc,
            refusal: self.refusal,
            refused: self.refused,
            micros: now_us,
        }
    }

    /// Writes the next frame due at `now_us`, if any. Returns its length.
    pub fn tell(&mut self, now_us: u32, line: &mut [u8; ON_LINE]) -> Option<usize> {
        let (header, tell) = match self.answer.take() {
            Some(answer) => answer,
            None => {
                let is_time = !self.receiver.is_here()
                    && (self.is_status_due || now_us.wrapping_sub(self.said) >= STATUS_US);
                if self.session == 0 || !is_time {
                    return None;
                }
                self.is_status_due = false;
                self.said = now_us;
                let header = Header { session: self.session, number: 0, kind: 0 };
                (header, self.status(now_us).into())
            }
        };
        let mut payload = [0; 128];
        let mut out = Writer::new(&mut payload);
        tell.put(&mut out);
        let length = out.end()?;
        seal(Header { kind: tell.kind(), ..header }, payload.get(..length)?, line)
    }
}
