//! Consistent overhead byte stuffing (COBS): no zeros inside a frame, so a listener that joins anywhere
//! finds the next frame at the next zero.
//!
//! ```text
//! 11 22 00 33        ─▶  03 11 22 02 33 00
//! each group begins with its length; a zero follows every group except one of 255 and the last
//! ```

/// Most bytes that `length` bytes become, including the final zero.
pub const fn longest(length: usize) -> usize {
    length + length / 254 + 2
}

/// Writes a frame into a buffer.
#[derive(Debug)]
pub struct Stuffer<'a> {
    out: &'a mut [u8],
    /// Position of the current group's length byte, and of the next byte.
    group: usize,
    next: usize,
}

impl<'a> Stuffer<'a> {
    /// `out` must have room for [`longest`].
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

    /// Ends the frame. Returns its length, `None` if there was no room.
    pub fn end(mut self) -> Option<usize> {
        self.close();
        *self.out.get_mut(self.group)? = 0;
        Some(self.group + 1)
    }
}

/// Reads frames from single bytes. `SIZE` is the longest frame; longer ones are dropped.
#[derive(Debug)]
pub struct Unstuffer<const SIZE: usize> {
    frame: [u8; SIZE],
    length: usize,
    /// Bytes left in the group; whether a zero comes before the next group.
    left: u8,
    zero: bool,
    /// The received bytes are no valid frame.
    broken: bool,
    /// The frame was returned: the next byte starts another.
    ended: bool,
}

impl<const SIZE: usize> Unstuffer<SIZE> {
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

    /// Takes a byte. Returns the frame that it completes; `None` for an empty or broken one.
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
