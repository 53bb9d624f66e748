//! Numbers as bytes, lowest byte first, and back.
//!
//! ```text
//! short numbers: seven bits per byte, the highest bit marks that more follow        5 → 05    300 → AC 02
//! ```

/// Writes into a buffer; [`Writer::end`] reports an overflow.
#[derive(Debug)]
pub struct Writer<'a> {
    out: &'a mut [u8],
    length: usize,
}

impl<'a> Writer<'a> {
    pub fn new(out: &'a mut [u8]) -> Self {
        Self { out, length: 0 }
    }

    pub fn bytes(&mut self, bytes: &[u8]) {
        if let Some(place) = self.out.get_mut(self.length..self.length + bytes.len()) {
            place.copy_from_slice(bytes);
        }
        self.length += bytes.len();
    }

    /// A number that is usually small.
    pub fn short(&mut self, mut number: u32) {
        while number > 0x7F {
            self.bytes(&[number as u8 | 0x80]);
            number >>= 7;
        }
        self.bytes(&[number as u8]);
    }

    /// A number that is usually near 0 and may exceed 32 bits.
    pub fn long_signed(&mut self, number: i64) {
        let mut folded = (number << 1 ^ number >> 63) as u64;
        while folded > 0x7F {
            self.bytes(&[folded as u8 | 0x80]);
            folded >>= 7;
        }
        self.bytes(&[folded as u8]);
    }

    /// Number of bytes written; `None` if they did not fit.
    pub fn end(self) -> Option<usize> {
        (self.length <= self.out.len()).then_some(self.length)
    }
}

#[derive(Clone, Copy, Debug)]
pub struct Reader<'a> {
    bytes: &'a [u8],
}

impl<'a> Reader<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes }
    }

    pub fn bytes(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.bytes.split_at_checked(count)?;
        self.bytes = rest;
        Some(taken)
    }

    pub fn short(&mut self) -> Option<u32> {
        let mut number = 0_u32;
        for shift in [0, 7, 14, 21, 28] {
            let (byte, rest) = self.bytes.split_first()?;
            self.bytes = rest;
            if shift == 28 && *byte > 0x0F {
                return None;
            }
            number |= u32::from(byte & 0x7F) << shift;
            if byte & 0x80 == 0 {
                return Some(number);
            }
        }
        None
    }

    /// A number that is usually near 0, of up to 48 bits.
    pub fn long_signed(&mut self) -> Option<i64> {
        let low = self.bytes.first().copied()?;
        if low & 0x80 == 0 {
            // Most numbers take one byte.
            self.bytes = &self.bytes[1..];
            return Some(i64::from(i32::from(low >> 1) ^ -i32::from(low & 1)));
        }
        let mut folded = 0_u64;
        for shift in [0, 7, 14, 21, 28, 35, 42] {
            let (byte, rest) = self.bytes.split_first()?;
            self.bytes = rest;
            folded |= u64::from(byte & 0x7F) << shift;
            if byte & 0x80 == 0 {
                return Some((folded >> 1) as i64 ^ -((folded & 1) as i64));
            }
        }
        None
    }

    /// Skips a number of [`Self::short`] or [`Self::long_signed`].
    pub fn skip(&mut self) -> Option<()> {
        let last = self.bytes.iter().position(|byte| byte & 0x80 == 0)?;
        self.bytes = self.bytes.get(last + 1..)?;
        Some(())
    }

    pub fn rest(self) -> &'a [u8] {
        self.bytes
    }
}

pub trait Plain: Sized {
    /// All zeros.
    const NONE: Self;
    fn put(&self, out: &mut Writer<'_>);
    fn take(from: &mut Reader<'_>) -> Option<Self>;
}

macro_rules! plain {
    ($($number:ty),*) => {$(
        impl Plain for $number {
            const NONE: Self = 0;
            fn put(&self, out: &mut Writer<'_>) {
                out.bytes(&self.to_le_bytes());
            }
            fn take(from: &mut Reader<'_>) -> Option<Self> {
                Some(Self::from_le_bytes(from.bytes(size_of::<Self>())?.try_into().ok()?))
            }
        }
    )*};
}

plain!(u8, u16, u32, i32);

impl<T: Plain + Copy, const COUNT: usize> Plain for [T; COUNT] {
    const NONE: Self = [T::NONE; COUNT];

    fn put(&self, out: &mut Writer<'_>) {
        self.iter().for_each(|one| one.put(out));
    }

    fn take(from: &mut Reader<'_>) -> Option<Self> {
        let mut all = Self::NONE;
        for one in &mut all {
            *one = T::take(from)?;
        }
        Some(all)
    }
}
