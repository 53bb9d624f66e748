//! CRC-32C (Castagnoli), the checksum of every frame and of the settings.

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

/// A checksum in progress.
#[derive(Clone, Copy, Debug)]
pub struct Crc(u32);

impl Crc {
    pub const fn new() -> Self {
        Self(!0)
    }

    #[inline]
    pub const fn with(self, byte: u8) -> Self {
        Self(TABLE[((self.0 ^ byte as u32) & 0xFF) as usize] ^ self.0 >> 8)
    }

    /// The checksum of all bytes added.
    pub const fn value(self) -> u32 {
        !self.0
    }
}

impl Default for Crc {
    fn default() -> Self {
        Self::new()
    }
}

pub const fn crc32c(bytes: &[u8]) -> u32 {
    let (mut crc, mut at) = (Crc::new(), 0);
    while at < bytes.len() {
        crc = crc.with(bytes[at]);
        at += 1;
    }
    crc.value()
}
