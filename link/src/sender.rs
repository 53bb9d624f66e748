//! The bridge's end: numbered frames, repeated until confirmed, and never more chunks than there is room
//! for.

use crate::bytes::Writer;
use crate::chunk;
use crate::frame::{Header, ON_LINE, PAYLOAD, seal};
use crate::message::{Ask, Chunk, Hello, Status};
use crate::receiver::{FIRST, WINDOW};
use crate::run::Run;
use crate::store::AROUND;
use crate::{AXES, NEWEST, OLDEST};

/// Time without a confirmation after which a frame is repeated, in µs.
pub const AGAIN_US: u64 = 25_000;

/// Least time between repetitions of a frame that is known to be missing, in µs.
const MISSING_US: u64 = 3_000;

#[derive(Clone, Copy, Debug)]
struct Slot {
    kind: u8,
    length: usize,
    payload: [u8; PAYLOAD],
    /// When it was last sent; `None` before.
    sent: Option<u64>,
    /// The adapter has it although an earlier one is missing; the adapter is known to miss it.
    held: bool,
    missing: bool,
}

const EMPTY: Slot =
    Slot { kind: 0, length: 0, payload: [0; PAYLOAD], sent: None, held: false, missing: false };

/// The bridge's side of a session.
#[derive(Debug)]
pub struct Sender {
    session: u32,
    /// First unconfirmed number, and the number of the next frame.
    first: u32,
    next: u32,
    slots: [Slot; WINDOW as usize],
    /// Bytes of all chunks sent, and the limit up to which there is room.
    bytes: u32,
    limit: u32,
}

impl Sender {
    /// Starts a session. Its number must never have been used before; 0 becomes 1.
    pub fn new(session: u32) -> Self {
        let session = session.max(1);
        Self { session, first: FIRST, next: FIRST, slots: [EMPTY; WINDOW as usize], bytes: 0, limit: 0 }
    }

    pub fn session(&self) -> u32 {
        self.session
    }

    /// Number of unconfirmed frames.
    pub fn pending(&self) -> u32 {
        self.next.wrapping_sub(self.first)
    }

    /// The frame that starts the session; may be repeated.
    pub fn hello(&self, line: &mut [u8; ON_LINE]) -> Option<usize> {
        self.unnumbered(&Hello { oldest: OLDEST, newest: NEWEST }.into(), line)
    }

    /// An unnumbered frame.
    pub fn unnumbered(&self, ask: &Ask, line: &mut [u8; ON_LINE]) -> Option<usize> {
        let mut payload = [0; PAYLOAD];
        let mut out = Writer::new(&mut payload);
        ask.put(&mut out);
        let length = out.end()?;
        let header = Header { session: self.session, number: 0, kind: ask.kind() };
        seal(header, payload.get(..length)?, line)
    }

    fn slot(&mut self, number: u32) -> &mut Slot {
        &mut self.slots[(number % WINDOW) as usize]
    }

    /// Queues a message. Returns its number; `None` while the window is full.
    pub fn offer(&mut self, ask: &Ask) -> Option<u32> {
        if self.pending() >= WINDOW {
            return None;
        }
        let (number, kind) = (self.next, ask.kind());
        let slot = self.slot(number);
        let mut out = Writer::new(&mut slot.payload);
        ask.put(&mut out);
        let length = out.end()?;
        *slot = Slot { kind, length, payload: slot.payload, ..EMPTY };
        self.next = number.wrapping_add(1);
        Some(number)
    }

    /// Queues a chunk. Returns `None` while there is no room for it, or if it is too long.
    pub fn offer_chunk(&mut self, head: &Chunk, runs: [&[Run]; AXES]) -> Option<u32> {
        if self.pending() >= WINDOW {
            return None;
        }
        let number = self.next;
        let slot = self.slot(number);
        let length = chunk::write(head, runs, &mut slot.payload)?;
        let bytes = self.bytes.wrapping_add((length + AROUND) as u32);
        if (self.limit.wrapping_sub(bytes) as i32) < 0 {
            return None;
        }
        let slot = self.slot(number);
        *slot = Slot { kind: Ask::Chunk(*head).kind(), length, payload: slot.payload, ..EMPTY };
        (self.next, self.bytes) = (number.wrapping_add(1), bytes);
        Some(number)
    }

    /// Takes the adapter's confirmation. An older status changes nothing.
    pub fn hear(&mut self, status: &Status) {
        let taken = status.next.wrapping_sub(self.first);
        if taken > self.pending() {
            return;
        }
        self.first = status.next;
        if status.limit.wrapping_sub(self.limit) as i32 > 0 {
            self.limit = status.limit;
        }
        let latest = u8::BITS - status.held.leading_zeros();
        for ahead in 0..self.pending() {
            let slot = self.slot(status.next.wrapping_add(ahead));
            slot.held |= ahead > 0 && status.held >> (ahead - 1) & 1 == 1;
            slot.missing = !slot.held && ahead < latest;
        }
    }

    /// Writes the next frame due at `now_us` to `line`. Returns its length; `None` if there is nothing to
    /// send.
    pub fn due(&mut self, now_us: u64, line: &mut [u8; ON_LINE]) -> Option<usize> {
        let session = self.session;
        for ahead in 0..self.pending() {
            let number = self.first.wrapping_add(ahead);
            let slot = self.slot(number);
            let wait = if slot.missing { MISSING_US } else { AGAIN_US };
            let is_due = slot.sent.is_none_or(|sent| now_us >= sent.saturating_add(wait));
            if slot.held || !is_due {
                continue;
            }
            slot.sent = Some(now_us);
            slot.missing = false;
            return seal(Header { session, number, kind: slot.kind }, slot.payload.get(..slot.length)?, line);
        }
        None
    }
}
