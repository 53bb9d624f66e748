//! Waiting chunks: consecutive payloads in a ring of bytes.

use crate::frame::PAYLOAD;

/// Room for chunks, in bytes: about a second of the densest path.
pub const ROOM: usize = 64 * 1024;

/// Extra bytes per payload.
pub const AROUND: usize = 2;

#[derive(Debug)]
pub struct Store {
    ring: [u8; ROOM],
    from: usize,
    length: usize,
}

impl Store {
    pub const fn new() -> Self {
        Self { ring: [0; ROOM], from: 0, length: 0 }
    }

    pub fn has_room(&self, length: usize) -> bool {
        self.length + length + AROUND <= ROOM
    }

    /// Free bytes.
    pub fn free(&self) -> usize {
        ROOM - self.length
    }

    pub fn is_empty(&self) -> bool {
        self.length == 0
    }

    pub fn clear(&mut self) {
        (self.from, self.length) = (0, 0);
    }

    fn write(&mut self, bytes: &[u8]) {
        let at = (self.from + self.length) % ROOM;
        let (head, tail) = bytes.split_at(bytes.len().min(ROOM - at));
        self.ring[at..at + head.len()].copy_from_slice(head);
        self.ring[..tail.len()].copy_from_slice(tail);
        self.length += bytes.len();
    }

    fn read(&mut self, out: &mut [u8]) {
        let (head, tail) = out.split_at_mut(out.len().min(ROOM - self.from));
        head.copy_from_slice(&self.ring[self.from..self.from + head.len()]);
        tail.copy_from_slice(&self.ring[..tail.len()]);
        let length = head.len() + tail.len();
        self.from = (self.from + length) % ROOM;
        self.length -= length;
    }

    /// Stores a payload. Returns `false` if there is no room.
    pub fn push(&mut self, payload: &[u8]) -> bool {
        let (true, Ok(length)) = (self.has_room(payload.len()), u16::try_from(payload.len())) else {
            return false;
        };
        self.write(&length.to_le_bytes());
        self.write(payload);
        true
    }

    /// Copies the first bytes of the oldest payload, which stays; `None` if there is none.
    pub fn look(&self, out: &mut [u8]) -> Option<()> {
        let payload = self.length.checked_sub(AROUND)?;
        for (place, byte) in out.iter_mut().enumerate() {
            *byte = self.ring[(self.from + AROUND + place) % ROOM];
        }
        (out.len() <= payload).then_some(())
    }

    /// Moves the oldest payload to the start of `out`. Returns its length.
    pub fn pop(&mut self, out: &mut [u8; PAYLOAD]) -> Option<usize> {
        if self.is_empty() {
            return None;
        }
        let mut length = [0; AROUND];
        self.read(&mut length);
        let length = usize::from(u16::from_le_bytes(length));
        self.read(out.get_mut(..length)?);
        Some(length)
    }
}

impl Default for Store {
    fn default() -> Self {
        Self::new()
    }
}
