//! What the receive buffer of the controller holds, counted by the characters that were sent and the lines that were answered.
//!
//! Comes in: lines sent, answers heard. Goes out: whether another line has room. Real-time characters are picked out of the stream
//! before the buffer and are not counted. Does not know what lines mean.

use std::collections::VecDeque;

/// What a GRBL board holds where it does not say.
pub const USUAL_RX_BYTES: usize = 128;

/// A line that was sent and not answered yet.
#[derive(Clone, Debug, PartialEq)]
pub struct Sent<T> {
    /// Its bytes, its end included.
    pub bytes: usize,
    /// Nothing may be sent beside it: it writes the EEPROM, or changes who listens.
    pub alone: bool,
    /// What it is for.
    pub meaning: T,
}

/// The receive buffer as it must be at most: a line stays in it until it is answered.
#[derive(Clone, Debug)]
pub struct Buffer<T> {
    size: usize,
    sent: VecDeque<Sent<T>>,
}

impl<T> Buffer<T> {
    /// An empty one of so many bytes.
    pub fn new(size: usize) -> Self {
        Self { size: size.max(16), sent: VecDeque::new() }
    }

    /// The controller told how large it is.
    pub fn resize(&mut self, size: usize) {
        self.size = size.max(16);
    }

    /// Bytes that it holds.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Bytes in it that were not answered for.
    pub fn used(&self) -> usize {
        self.sent.iter().map(|sent| sent.bytes).sum()
    }

    /// Lines in it that were not answered.
    pub fn len(&self) -> usize {
        self.sent.len()
    }

    /// Whether every line was answered.
    pub fn is_empty(&self) -> bool {
        self.sent.is_empty()
    }

    /// Whether a line of so many bytes, its end included, has room now.
    pub fn takes(&self, bytes: usize, alone: bool) -> bool {
        if self.sent.is_empty() {
            return bytes <= self.size;
        }
        !alone && !self.sent.iter().any(|sent| sent.alone) && self.used() + bytes <= self.size
    }

    /// A line was sent.
    pub fn put(&mut self, bytes: usize, alone: bool, meaning: T) {
        self.sent.push_back(Sent { bytes, alone, meaning });
    }

    /// The oldest line was answered; none where nothing was asked.
    pub fn answered(&mut self) -> Option<T> {
        self.sent.pop_front().map(|sent| sent.meaning)
    }

    /// What waits for an answer, oldest first.
    pub fn waiting(&self) -> impl Iterator<Item = &T> {
        self.sent.iter().map(|sent| &sent.meaning)
    }

    /// The controller began anew: what was in it is gone.
    pub fn clear(&mut self) {
        self.sent.clear();
    }
}

/// Whether a line writes the EEPROM, while which the controller loses what is sent to it: `$0=`, `$N0=`, `$RST=`, `$I=`, G10,
/// G28.1, G30.1; and the choice of another zero, which reads it.
pub fn stands_alone(line: &str) -> bool {
    let line: String = line.chars().filter(|c| !c.is_whitespace()).collect::<String>().to_ascii_uppercase();
    if line.starts_with('$') {
        // `$J=` and `$G` only read; homing and unlocking change who listens.
        return !(line.starts_with("$J=") || line == "$G" || line == "$I" || line == "$#" || line == "$$");
    }
    let mut rest = line.as_str();
    while let Some(at) = rest.find('G') {
        rest = &rest[at + 1..];
        let number: String = rest.chars().take_while(|c| c.is_ascii_digit() || *c == '.').collect();
        let tenths = number.parse::<f64>().map_or(0, |n| libm::round(n * 10.0) as u32);
        if matches!(tenths, 100 | 281 | 301 | 540..=590) {
            return true;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_that_write_stand_alone() {
        for (line, alone) in [
            ("$100=250", true),
            ("$H", true),
            ("$X", true),
            ("$G", false),
            ("$#", false),
            ("$J=G91X1F100", false),
            ("G10 L20 P1 X0", true),
            ("G28.1", true),
            ("G30.1", true),
            ("G28", false),
            ("G54", true),
            ("g59", true),
            ("G1X10G0", false),
            ("G5", false),
            ("G1X1Y2F100", false),
            ("", false),
        ] {
            assert_eq!(stands_alone(line), alone, "{line}");
        }
    }

    #[test]
    fn no_line_is_sent_that_has_no_room() {
        let mut chance = crate::chance::Chance::new(7);
        let mut buffer = Buffer::new(128);
        let mut real: VecDeque<usize> = VecDeque::new();
        for step in 0..10_000 {
            let bytes = 2 + chance.below(79);
            if buffer.takes(bytes, false) {
                buffer.put(bytes, false, step);
                real.push_back(bytes);
            } else {
                assert!(real.iter().sum::<usize>() + bytes > 128, "there was room");
                // The controller has read any part of the oldest; it answers when it has all.
                real.pop_front();
                assert!(buffer.answered().is_some());
            }
            assert!(real.iter().sum::<usize>() <= 128 && buffer.used() == real.iter().sum::<usize>());
        }
    }

    #[test]
    fn a_line_alone_waits_for_all_and_all_wait_for_it() {
        let mut buffer = Buffer::new(128);
        buffer.put(10, false, ());
        assert!(buffer.takes(10, false) && !buffer.takes(10, true));
        assert!(buffer.answered().is_some() && buffer.takes(10, true));
        buffer.put(10, true, ());
        assert!(!buffer.takes(2, false));
        assert!(buffer.answered().is_some() && buffer.answered().is_none());
    }
}
