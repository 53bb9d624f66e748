//! CRC-32C (Castagnoli): the check of every frame and of the settings.
//!
//! Comes in: bytes. Goes out: 32 bits. Does not know frames.

const POLYNOMIAL: u32 = 0x82F6_3B78;

const TABLE: [u32; 256] = table();

const fn table() -> [u32; 256] {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < 256 {
        let mut value = byte as u32;
        let mut bit = 0;
        while bit < 8 {
            value = if value & 1 == 1 { value >> 1 ^ POLYNOMIAL } else { value >> 1 };
            bit += 1;
        }
        table[byte] = value;
        byte += 1;
    }
    table
}

/// A check in the making.
#[derive(Clone, Copy, Debug)]
pub struct Crc(u32);

impl Crc {
    /// Of no bytes yet.
    pub const fn new() -> Self {
        Self(!0)
    }

    /// With one byte more.
    #[inline]
    pub const fn with(self, byte: u8) -> Self {
        Self(TABLE[((self.0 ^ byte as u32) & 0xFF) as usize] ^ self.0 >> 8)
    }

    /// The check of all bytes so far.
    pub const fn value(self) -> u32 {
        !self.0
    }
}

impl Default for Crc {
    fn default() -> Self {
        Self::new()
    }
}

/// The check of `bytes`.
pub const fn crc32c(bytes: &[u8]) -> u32 {
    let (mut crc, mut at) = (Crc::new(), 0);
    while at < bytes.len() {
        crc = crc.with(bytes[at]);
        at += 1;
    }
    crc.value()
}
