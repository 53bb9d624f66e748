//! One frame: header and payload under one checksum, byte-stuffed.
//!
//! ```text
//! COBS( session u32 │ number u32 │ kind u8 │ payload, at most 1024 bytes │ CRC-32C of all before it u32 ) 00
//! ```

use crate::bytes::{Plain, Reader};
use crate::cobs::{Stuffer, longest};
use crate::crc::{Crc, crc32c};

/// Longest payload, in bytes.
pub const PAYLOAD: usize = 1024;

/// Bytes of header and checksum.
pub const AROUND: usize = 13;

pub const FRAME: usize = PAYLOAD + AROUND;

/// Longest frame on the line.
pub const ON_LINE: usize = longest(FRAME);

/// Precedes every payload.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Header {
    /// The session: a random number that the bridge chooses when it connects, never 0.
    pub session: u32,
    /// Number within the session; 0 for unnumbered frames.
    pub number: u32,
    pub kind: u8,
}

/// Writes a frame to `line`, which must have room for [`ON_LINE`]. Returns its length; `None` if the
/// payload is too long.
pub fn seal(header: Header, payload: &[u8], line: &mut [u8]) -> Option<usize> {
    if payload.len() > PAYLOAD {
        return None;
    }
    let (mut out, mut crc) = (Stuffer::new(line), Crc::new());
    let head =
        header.session.to_le_bytes().into_iter().chain(header.number.to_le_bytes()).chain([header.kind]);
    for byte in head.chain(payload.iter().copied()) {
        crc = crc.with(byte);
        out.put(byte);
    }
    crc.value().to_le_bytes().into_iter().for_each(|byte| out.put(byte));
    out.end()
}

/// Splits an unstuffed frame into header and payload; `None` if the checksum is wrong.
pub fn open(frame: &[u8]) -> Option<(Header, &[u8])> {
    let (bytes, check) = frame.split_last_chunk::<4>()?;
    if crc32c(bytes) != u32::from_le_bytes(*check) {
        return None;
    }
    let mut from = Reader::new(bytes);
    let header =
        Header { session: u32::take(&mut from)?, number: u32::take(&mut from)?, kind: u8::take(&mut from)? };
    Some((header, from.rest()))
}
