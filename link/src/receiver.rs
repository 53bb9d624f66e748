//! The adapter's end of the numbered frames: each is taken once and in order, whatever the line does to it.
//!
//! ```text
//! number      5   6   7   8          5 was taken; 7 came early and is kept
//!             ✓   ·   ▪   ·          next = 6, held = 0b1: whoever sends knows that 6 alone is missing
//! ```
//!
//! Comes in: frames. Goes out: the next one in order. Does not know sessions.

use crate::frame::PAYLOAD;

/// Frames that may be on their way at once.
pub const WINDOW: u32 = 8;

/// Number of the first numbered frame of a session.
pub const FIRST: u32 = 1;

#[derive(Clone, Copy, Debug)]
struct Slot {
    kind: u8,
    /// Length of the payload, none in an empty slot.
    length: Option<usize>,
    payload: [u8; PAYLOAD],
}

const EMPTY: Slot = Slot { kind: 0, length: None, payload: [0; PAYLOAD] };

/// Where a session is in its numbered frames.
#[derive(Debug)]
pub struct Receiver {
    next: u32,
    kept: [Slot; WINDOW as usize],
}

impl Receiver {
    /// Nothing came yet.
    pub const fn new() -> Self {
        Self { next: FIRST, kept: [EMPTY; WINDOW as usize] }
    }

    /// A session begins.
    pub fn restart(&mut self) {
        self.next = FIRST;
        self.kept.iter_mut().for_each(|slot| slot.length = None);
    }

    /// The number that is waited for.
    pub fn next(&self) -> u32 {
        self.next
    }

    fn slot(&mut self, number: u32) -> &mut Slot {
        &mut self.kept[(number % WINDOW) as usize]
    }

    /// Which frames behind the next one are here.
    pub fn held(&self) -> u8 {
        let here = |ahead: &u32| {
            let number = self.next.wrapping_add(ahead + 1);
            self.kept[(number % WINDOW) as usize].length.is_some()
        };
        (0..WINDOW - 1).filter(here).fold(0, |held, ahead| held | 1 << ahead)
    }

    /// Keeps a frame until its turn comes.
    pub fn keep(&mut self, number: u32, kind: u8, payload: &[u8]) {
        let ahead = number.wrapping_sub(self.next);
        if ahead < WINDOW && payload.len() <= PAYLOAD {
            let slot = self.slot(number);
            slot.kind = kind;
            slot.length = Some(payload.len());
            slot.payload[..payload.len()].copy_from_slice(payload);
        }
    }

    /// Whether the next frame is here.
    pub fn is_here(&self) -> bool {
        self.kept[(self.next % WINDOW) as usize].length.is_some()
    }

    /// Takes the next frame where it is here: its kind and length, the payload at the start of `out`.
    pub fn take(&mut self, out: &mut [u8; PAYLOAD]) -> Option<(u8, usize)> {
        let slot = self.slot(self.next);
        let length = slot.length.take()?;
        out[..length].copy_from_slice(&slot.payload[..length]);
        let kind = slot.kind;
        self.next = self.next.wrapping_add(1);
        Some((kind, length))
    }
}

impl Default for Receiver {
    fn default() -> Self {
        Self::new()
    }
}
