//! Carries out an adapter's frames one by one, or refuses them with a reason.
//!
//! ```text
//! chunk 4 ─ refused: Rate ─┐         later path frames are refused too, because chunk 4 is missing:
//! chunk 5 ─ refused: Gap   │ Rate    the reported reason stays that of chunk 4
//! Begin   ─ refused: Tail  ▼
//! Stop, Clear, Place, Configure      a new path starts: the next refusal is reported again
//! ```

use super::{Adapter, Inputs, NO_INPUT, Order, inputs_of};
use crate::INPUTS;
use crate::chunk;
use crate::crc::crc32c;
use crate::filter::LONGEST_FILTER_US;
use crate::frame::{Header, PAYLOAD};
use crate::message::{Ask, Chunk, Configure, Place, Refusal, State, Trust};
use crate::phases;
use crate::store::AROUND;

impl Adapter<'_> {
    pub(super) fn numbered(&mut self, header: Header, payload: &[u8]) {
        self.is_status_due = true;
        self.receiver.keep(header.number, header.kind, payload);
    }

    /// Carries out the next frame of the session. Returns `false` if there is none. Only one per call:
    /// checking a chunk takes time, and words must be made in between. A late lost frame releases many.
    pub fn obey_next(&mut self) -> bool {
        if !self.receiver.is_here() {
            return false;
        }
        let (number, mut payload) = (self.receiver.next(), [0; PAYLOAD]);
        let Some((kind, length)) = self.receiver.take(&mut payload) else { return false };
        self.is_status_due = true;
        self.obey(number, kind, payload.get(..length).unwrap_or_default());
        true
    }

    #[inline(never)]
    fn obey(&mut self, number: u32, kind: u8, payload: &[u8]) {
        let asked = Ask::take(kind, payload);
        let done = match asked {
            Some((Ask::Chunk(head), runs)) => {
                self.bytes = self.bytes.wrapping_add((payload.len() + AROUND) as u32);
                self.chunk(&head, runs, payload)
            }
            Some((ask, [])) => self.ask(&ask, payload),
            _ => Err(Refusal::Form),
        };
        let Err(refusal) = done else { return };
        let (is_next, is_behind) = match asked {
            Some((Ask::Chunk(head), _)) => (head.number == self.chunk, head.number != self.chunk),
            Some((Ask::Begin(_), _)) => (false, true),
            _ => (false, false),
        };
        if !(self.is_torn && is_behind) {
            (self.refusal, self.refused) = (refusal, number);
        }
        self.is_torn |= is_next;
    }

    fn ask(&mut self, ask: &Ask, payload: &[u8]) -> Result<(), Refusal> {
        let at_rest = matches!(self.state, State::Unset | State::Ready);
        match *ask {
            // A forced stop stays until it is cleared; the settings belong to the session.
            Ask::Configure(settings) if at_rest || self.is_forced() => self.configure(settings, payload)?,
            Ask::Begin(_) if self.state == State::Ready && !self.store.is_empty() && !self.is_off => {
                if self.inputs.stop || self.inputs.on & self.limits != 0 {
                    return Err(Refusal::Input);
                }
                if !self.player.is_covered(self.store) {
                    return Err(Refusal::Tail);
                }
                self.state = State::Running;
                self.player.ready();
                self.orders |= 1 << Order::Begin as u8;
            }
            Ask::Rate(rate) => self.player.want(rate.wanted),
            Ask::Stop(_) if self.state == State::Running => self.player.stop(),
            Ask::Stop(_) if at_rest => self.begin_anew(),
            Ask::Outputs(outputs) if self.settings_crc != 0 && self.state != State::EmergencyStop => {
                (self.outputs, self.is_off) = (outputs.on, false);
            }
            Ask::Clear(_) => self.clear()?,
            Ask::Place(Place { index }) if self.state == State::Ready && self.store.is_empty() => {
                self.player.place(index);
                self.trust = Trust::Trusted;
                self.begin_anew();
            }
            Ask::Windings(table) if at_rest || self.is_forced() => {
                if !self.player.wind(&table) {
                    return Err(Refusal::Settings);
                }
            }
            Ask::Guard(guard) if self.state != State::Running && self.settings_crc != 0 => {
                if guard.limits & !inputs_of(&self.settings) != 0 {
                    return Err(Refusal::Settings);
                }
                self.limits = guard.limits;
                self.orders |= 1 << Order::Settle as u8;
            }
            Ask::Filters(filters) if self.state != State::Running && self.settings_crc != 0 => {
                let there = inputs_of(&self.settings);
                let is_right = |(input, least_us): (usize, &u16)| {
                    *least_us == 0 || *least_us <= LONGEST_FILTER_US && there >> input & 1 == 1
                };
                if !filters.least_us.iter().enumerate().all(is_right) {
                    return Err(Refusal::Settings);
                }
                self.filters_us = filters.least_us;
                self.orders |= 1 << Order::Settle as u8;
            }
            _ => return Err(Refusal::State),
        }
        Ok(())
    }

    fn configure(&mut self, settings: Configure, payload: &[u8]) -> Result<(), Refusal> {
        if !(2..=33).contains(&settings.pulse) || u32::from(settings.setup) > chunk::LONGEST {
            return Err(Refusal::Settings);
        }
        let is_phases = settings.phases != 0;
        let is_other = is_phases && settings.phases != self.player.tables_crc();
        if is_other || (settings.limits | settings.low_inputs) & !inputs_of(&settings) != 0 {
            return Err(Refusal::Settings);
        }
        if is_phases != (self.settings.phases != 0) {
            // The old input states and filters belong to other pins.
            (self.inputs, self.filters_us) = (Inputs::default(), [0; INPUTS]);
        }
        self.player.drive(is_phases);
        self.settings = settings;
        self.settings_crc = crc32c(payload).max(1);
        self.limits = settings.limits;
        if !self.is_forced() {
            self.state = State::Ready;
        }
        self.orders |= 1 << Order::Settle as u8;
        self.begin_anew();
        Ok(())
    }

    /// Returns `true` after a forced stop until `Clear`: no pulse may be given, even after a new
    /// configuration.
    pub fn is_forced(&self) -> bool {
        matches!(self.state, State::Limit | State::EmergencyStop | State::Fault)
    }

    /// Drops the path that has not started, and the memory of a refusal.
    fn begin_anew(&mut self) {
        self.forget();
        self.is_torn = false;
    }

    fn clear(&mut self) -> Result<(), Refusal> {
        if self.state == State::Running || self.settings_crc == 0 {
            return Err(Refusal::State);
        }
        if self.inputs.stop || self.inputs.on & self.limits != 0 {
            return Err(Refusal::Input);
        }
        self.state = State::Ready;
        self.input = NO_INPUT;
        self.orders |= 1 << Order::Clear as u8;
        self.begin_anew();
        Ok(())
    }

    fn chunk(&mut self, head: &Chunk, runs: &[u8], payload: &[u8]) -> Result<(), Refusal> {
        if head.number.wrapping_sub(self.chunk) as i32 == -1 {
            return Ok(()); // it is here already
        }
        let is_ending = self.state == State::Running && self.player.is_ending();
        if !matches!(self.state, State::Ready | State::Running) || self.orphaned.is_some() || is_ending {
            return Err(Refusal::State);
        }
        if head.number != self.chunk {
            return Err(Refusal::Gap);
        }
        if self.settings.phases != 0 && head.runs.iter().skip(phases::MOTORS).any(|count| *count > 0) {
            return Err(Refusal::Settings); // an axis without pins
        }
        let after = chunk::check(head, runs, (&self.before, self.accepted), &self.settings)?;
        if !self.player.keep(self.store, head, payload) {
            return Err(Refusal::Room);
        }
        (self.before, self.accepted, self.is_torn) = (after.0, after.1, false);
        self.chunk = self.chunk.wrapping_add(1);
        Ok(())
    }
}
