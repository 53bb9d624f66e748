//! The adapter's end of numbered frames: each is taken once and in order, over any bad line.
//!
//! ```text
//! number      5   6   7   8          5 was taken; 7 arrived early and is stored
//!             ✓   ·   ▪   ·          next = 6, held = 0b1: the sender sees that only 6 is missing
//! ```

use crate::frame::PAYLOAD;

/// Most frames that may be on their way.
pub const WINDOW: u32 = 8;

/// Number of the first numbered frame of a session.
pub const FIRST: u32 = 1;

#[derive(Clone, Copy, Debug)]
struct Slot {
    kind: u8,
    /// Length of the payload; `None` in an empty slot.
    length: Option<usize>,
    payload: [u8; PAYLOAD],
}

const EMPTY: Slot = Slot { kind: 0, length: None, payload: [0; PAYLOAD] };

/// Progress of a session's numbered frames.
#[derive(Debug)]
pub struct Receiver {
    next: u32,
    kept: [Slot; WINDOW as usize],
}

impl Receiver {
    pub const fn new() -> Self {
        Self { next: FIRST, kept: [EMPTY; WINDOW as usize] }
    }

    pub fn restart(&mut self) {
        self.next = FIRST;
        self.kept.iter_mut().for_each(|slot| slot.length = None);
    }

    /// The next expected number.
    pub fn next(&self) -> u32 {
        self.next
    }

    fn slot(&mut self, number: u32) -> &mut Slot {
        &mut self.kept[(number % WINDOW) as usize]
    }

    /// Frames after the next one that have arrived.
    pub fn held(&self) -> u8 {
        let here = |ahead: &u32| {
            let number = self.next.wrapping_add(ahead + 1);
            self.kept[(number % WINDOW) as usize].length.is_some()
        };
        (0..WINDOW - 1).filter(here).fold(0, |held, ahead| held | 1 << ahead)
    }

    pub fn keep(&mut self, number: u32, kind: u8, payload: &[u8]) {
        let ahead = number.wrapping_sub(self.next);
        if ahead < WINDOW && payload.len() <= PAYLOAD {
            let slot = self.slot(number);
            slot.kind = kind;
            slot.length = Some(payload.len());
            slot.payload[..payload.len()].copy_from_slice(payload);
        }
    }

    /// Returns `true` if the next frame has arrived.
    pub fn is_here(&self) -> bool {
        self.kept[(self.next % WINDOW) as usize].length.is_some()
    }

    /// Takes the next frame, if it has arrived: its kind and length, and its payload at the start of `out`.
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
