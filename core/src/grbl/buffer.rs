//! Model of the controller's receive buffer: characters sent, minus lines answered.
//!
//! Real-time characters bypass the buffer and are not counted.

use std::collections::VecDeque;

/// Buffer size of GRBL controllers that don't report it.
pub const USUAL_RX_BYTES: usize = 128;

/// A line that was sent and not yet answered.
#[derive(Clone, Debug, PartialEq)]
pub struct Sent<T> {
    pub bytes: usize,
    /// Nothing else may be in flight: the line writes the EEPROM, or changes which lines the controller
    /// accepts.
    pub alone: bool,
    pub meaning: T,
}

/// Upper bound of what the receive buffer holds: a line counts until it is answered.
#[derive(Clone, Debug)]
pub struct Buffer<T> {
    size: usize,
    sent: VecDeque<Sent<T>>,
}

impl<T> Default for Buffer<T> {
    fn default() -> Self {
        Self::new(USUAL_RX_BYTES)
    }
}

impl<T> Buffer<T> {
    pub fn new(size: usize) -> Self {
        Self { size: size.max(16), sent: VecDeque::new() }
    }

    /// The controller reported its buffer size.
    pub fn resize(&mut self, size: usize) {
        self.size = size.max(16);
    }

    pub fn size(&self) -> usize {
        self.size
    }

    /// Bytes of unanswered lines.
    pub fn used(&self) -> usize {
        self.sent.iter().map(|sent| sent.bytes).sum()
    }

    pub fn len(&self) -> usize {
        self.sent.len()
    }

    pub fn is_empty(&self) -> bool {
        self.sent.is_empty()
    }

    /// True if a line of `bytes`, line ending included, can be sent now.
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

    /// The oldest line was answered; `None` if no line was open.
    pub fn answered(&mut self) -> Option<T> {
        self.sent.pop_front().map(|sent| sent.meaning)
    }

    /// Unanswered lines, oldest first.
    pub fn waiting(&self) -> impl Iterator<Item = &T> {
        self.sent.iter().map(|sent| &sent.meaning)
    }

    /// The controller restarted: its buffer is empty.
    pub fn clear(&mut self) {
        self.sent.clear();
    }
}

/// True if a line must be in flight alone. While the controller writes its EEPROM, it loses characters:
/// `$0=`, `$N0=`, `$RST=`, `$I=`, G10, G28.1, G30.1. Choosing another zero (G54 to G59) reads the EEPROM.
pub fn stands_alone(line: &str) -> bool {
    let line: String = line.chars().filter(|c| !c.is_whitespace()).collect::<String>().to_ascii_uppercase();
    if line.starts_with('$') {
        // `$J=` and `$G` only read; homing and unlocking change which lines the controller accepts.
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
    fn lines_that_write_are_sent_alone() {
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
    fn line_is_sent_only_if_the_buffer_has_room() {
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
                // The controller may have read any part of the oldest line; it answers after the whole line.
                real.pop_front();
                assert!(buffer.answered().is_some());
            }
            assert!(real.iter().sum::<usize>() <= 128 && buffer.used() == real.iter().sum::<usize>());
        }
    }

    #[test]
    fn line_sent_alone_waits_and_blocks_others() {
        let mut buffer = Buffer::new(128);
        buffer.put(10, false, ());
        assert!(buffer.takes(10, false) && !buffer.takes(10, true));
        assert!(buffer.answered().is_some() && buffer.takes(10, true));
        buffer.put(10, true, ());
        assert!(!buffer.takes(2, false));
        assert!(buffer.answered().is_some() && buffer.answered().is_none());
    }
}
