//! Variable-length numbers, bit by bit, most significant bit of a byte first.
//!
//! ```text
//! small     one 0 for each bit after the first, then the bits        1 → 1   2 → 010   3 → 011   4 → 00100
//! usual     difference of the length from the usual length (small), then the bits without the first
//! ```

#[derive(Clone, Copy, Debug)]
pub(super) struct Usual(i64);

impl Usual {
    pub(super) fn new(bits: i64) -> Self {
        Self(16 * bits)
    }

    fn bits(self) -> i64 {
        (self.0 + 8) >> 4
    }

    fn learn(&mut self, bits: i64) {
        self.0 += (16 * bits - self.0) >> 2;
    }
}

pub(super) struct Writer<'a> {
    bytes: &'a mut Vec<u8>,
    /// Bits not yet written, the latest lowest, and their number: less than 8.
    held: u64,
    count: u32,
}

impl<'a> Writer<'a> {
    pub(super) fn onto(bytes: &'a mut Vec<u8>) -> Self {
        Self { bytes, held: 0, count: 0 }
    }

    /// Writes the lowest `count` bits of a number, at most 64.
    pub(super) fn put(&mut self, number: u64, count: u32) {
        if count > 32 {
            self.put(number >> 32, count - 32);
            return self.put(number, 32);
        }
        self.held = self.held << count | number & ((1 << count) - 1);
        self.count += count;
        while self.count >= 8 {
            self.count -= 8;
            self.bytes.push((self.held >> self.count) as u8);
        }
    }

    pub(super) fn put_small(&mut self, number: u64) {
        let bits = u64::BITS - (number + 1).leading_zeros();
        self.put(0, bits - 1);
        self.put(number + 1, bits);
    }

    pub(super) fn put_usual(&mut self, number: i64, usual: &mut Usual) {
        let folded = fold(number);
        let bits = u64::BITS - folded.leading_zeros();
        self.put_small(fold(i64::from(bits) - usual.bits()));
        self.put(folded, bits.saturating_sub(1));
        usual.learn(i64::from(bits));
    }

    pub(super) fn end(mut self) {
        self.put(0, (8 - self.count) % 8);
    }
}

pub(super) struct Reader<'a> {
    bytes: &'a [u8],
    /// Bits read but not yet returned, the next one highest, and their number.
    held: u64,
    count: u32,
}

impl<'a> Reader<'a> {
    pub(super) fn of(bytes: &'a [u8]) -> Self {
        Self { bytes, held: 0, count: 0 }
    }

    pub(super) fn take(&mut self, count: u32) -> Option<u64> {
        if count > 32 {
            return Some(self.take(count - 32)? << 32 | self.take(32)?);
        }
        while self.count < count {
            let (byte, rest) = self.bytes.split_first()?;
            self.held = self.held << 8 | u64::from(*byte);
            (self.bytes, self.count) = (rest, self.count + 8);
        }
        self.count -= count;
        Some(self.held >> self.count & ((1 << count) - 1))
    }

    pub(super) fn take_small(&mut self) -> Option<u64> {
        let mut bits = 0;
        while self.take(1)? == 0 {
            bits += 1;
        }
        if bits >= u64::BITS {
            return None;
        }
        Some((1 << bits | self.take(bits)?) - 1)
    }

    pub(super) fn take_usual(&mut self, usual: &mut Usual) -> Option<i64> {
        let bits = unfold(self.take_small()?).checked_add(usual.bits())?;
        let number = match u32::try_from(bits).ok()? {
            0 => 0,
            bits @ 1..=64 => 1 << (bits - 1) | self.take(bits - 1)?,
            _ => return None,
        };
        usual.learn(bits);
        Some(unfold(number))
    }

    /// The bytes after the one with the last bit.
    pub(super) fn rest(self) -> &'a [u8] {
        self.bytes
    }
}

/// Zigzag encoding: the sign becomes the lowest bit.
fn fold(number: i64) -> u64 {
    ((number << 1) ^ (number >> 63)) as u64
}

fn unfold(number: u64) -> i64 {
    (number >> 1) as i64 ^ -((number & 1) as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_any_length_survive_a_round_trip() {
        let mut numbers = vec![0, i64::MAX, i64::MIN];
        numbers.extend((0..63).flat_map(|bits| [1_i64 << bits, -(1_i64 << bits), (1 << bits) - 1]));
        let mut bytes = vec![7];
        let (mut writer, mut usual) = (Writer::onto(&mut bytes), Usual::new(5));
        for number in &numbers {
            writer.put_usual(*number, &mut usual);
            writer.put_small(fold(*number) >> 1);
        }
        writer.end();
        for cut in [bytes.len(), bytes.len() - 1] {
            let (mut reader, mut usual) = (Reader::of(&bytes[1..cut]), Usual::new(5));
            let read: Vec<_> = numbers
                .iter()
                .map_while(|_| Some((reader.take_usual(&mut usual)?, reader.take_small()?)))
                .collect();
            let whole: Vec<_> = numbers.iter().map(|number| (*number, fold(*number) >> 1)).collect();
            assert_eq!(read, whole[..read.len()]);
            assert_eq!(read.len() == whole.len(), cut == bytes.len());
            assert!(reader.rest().is_empty());
        }
    }

    #[test]
    fn overlong_number_is_refused() {
        // 63 zeros, a one, and ones: a length of almost 2⁶⁴ bits.
        let bytes = [&[0; 7][..], &[1], &[0xFF; 24]].concat();
        let (mut reader, mut usual) = (Reader::of(&bytes), Usual::new(5));
        assert_eq!(reader.take_usual(&mut usual), None);
    }
}
