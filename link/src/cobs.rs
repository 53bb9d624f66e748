//! Bytes without zeros between two zeros (COBS): wherever one begins to listen, the next zero is the end of a frame.
//!
//! ```text
//! 11 22 00 33        ─▶  03 11 22 02 33 00
//! each group begins with its length; a zero follows every group but one of 255 and the last
//! ```
//!
//! Comes in: bytes. Goes out: bytes. Does not know what they say.

/// Most bytes that `length` bytes become, the zero at the end included.
pub const fn longest(length: usize) -> usize {
    length + length / 254 + 2
}

/// Writes a frame into a buffer.
#[derive(Debug)]
pub struct Stuffer<'a> {
    out: &'a mut [u8],
    /// Where the length of the group in the making goes, and where its next byte goes.
    group: usize,
    next: usize,
}

impl<'a> Stuffer<'a> {
    /// Into `out`, which has room for [`longest`].
    pub fn new(out: &'a mut [u8]) -> Self {
        Self { out, group: 0, next: 1 }
    }

    fn close(&mut self) {
        let length = u8::try_from(self.next - self.group).unwrap_or(u8::MAX);
        if let Some(place) = self.out.get_mut(self.group) {
            *place = length;
        }
        self.group = self.next;
        self.next += 1;
    }

    /// One byte more.
    pub fn put(&mut self, byte: u8) {
        if byte != 0 {
            if let Some(place) = self.out.get_mut(self.next) {
                *place = byte;
            }
            self.next += 1;
        }
        if byte == 0 || self.next - self.group == 255 {
            self.close();
        }
    }

    /// Ends the frame; how long it is, none where there was no room.
    pub fn end(mut self) -> Option<usize> {
        self.close();
        *self.out.get_mut(self.group)? = 0;
        Some(self.group + 1)
    }
}

/// Reads frames out of bytes that come one by one. `SIZE` is the longest frame; a longer one is dropped.
#[derive(Debug)]
pub struct Unstuffer<const SIZE: usize> {
    frame: [u8; SIZE],
    length: usize,
    /// Bytes left in the group; whether a zero stands before the next one.
    left: u8,
    zero: bool,
    /// Whether what came does not make a frame.
    broken: bool,
    /// Whether the frame was handed out: the next byte begins another.
    ended: bool,
}

impl<const SIZE: usize> Unstuffer<SIZE> {
    /// Waiting for a first byte.
    pub const fn new() -> Self {
        Self { frame: [0; SIZE], length: 0, left: 0, zero: false, broken: false, ended: false }
    }

    fn keep(&mut self, byte: u8) {
        match self.frame.get_mut(self.length) {
            Some(place) => *place = byte,
            None => self.broken = true,
        }
        self.length = (self.length + 1).min(SIZE);
    }

    /// Takes a byte; gives the frame that it ends, none where that is empty or broken.
    pub fn take(&mut self, byte: u8) -> Option<&[u8]> {
        if self.ended {
            (self.length, self.left, self.zero, self.broken, self.ended) = (0, 0, false, false, false);
        }
        if byte == 0 {
            self.ended = true;
            let good = !self.broken && self.left == 0 && self.length > 0;
            return if good { self.frame.get(..self.length) } else { None };
        }
        if self.left > 0 {
            self.left -= 1;
            self.keep(byte);
        } else {
            if self.zero {
                self.keep(0);
            }
            self.left = byte - 1;
            self.zero = byte != 255;
        }
        None
    }
}

impl<const SIZE: usize> Default for Unstuffer<SIZE> {
    fn default() -> Self {
        Self::new()
    }
}
