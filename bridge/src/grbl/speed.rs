//! Finds the speed of a controller's port: tries one after the other until a response is understood.
//!
//! ```text
//!  open at 115200 ─ 2.5 s: a banner? ─ ? ─ ? … a second ─▶ 57600 ─ ? ─ ? … a second ─▶ 9600 …
//! ```
//!
//! Writes nothing but status queries: they move nothing.

use crate::serial::Port;
use annulus_core::grbl::BITS_PER_S;
use annulus_core::grbl::heard::{Ear, HeardLine, hear};
use std::io;
use std::time::{Duration, Instant};

/// How long a controller may take to send its banner after its port was opened; nothing is written
/// meanwhile.
const GREETS: Duration = Duration::from_millis(2_500);
const ANSWERS: Duration = Duration::from_millis(1_200);
/// Interval between queries: one may be lost after the garbage that another speed caused.
const AGAIN: Duration = Duration::from_millis(250);

/// Tries the usual speeds; calls `silent` for each without a response. Returns `None` if none fits. The
/// port must be open at the first one.
pub(super) fn find(port: &mut Port, silent: impl Fn(u32)) -> io::Result<Option<u32>> {
    for (index, bits_per_s) in BITS_PER_S.into_iter().enumerate() {
        if index > 0 && port.set_bits_per_s(bits_per_s).is_err() {
            // This port does not support the speed.
            continue;
        }
        if is_heard(port, if index == 0 { GREETS } else { Duration::ZERO })? {
            return Ok(Some(bits_per_s));
        }
        silent(bits_per_s);
    }
    Ok(None)
}

/// Returns `true` if a line is understood, unasked during `listens` or in answer to a query.
fn is_heard(port: &mut Port, listens: Duration) -> io::Result<bool> {
    let (mut ear, mut heard) = (Ear::default(), Vec::new());
    let (since, mut asked) = (Instant::now(), None::<Instant>);
    while since.elapsed() < listens + ANSWERS {
        if since.elapsed() >= listens && asked.is_none_or(|asked| asked.elapsed() >= AGAIN) {
            port.write(b"?")?;
            asked = Some(Instant::now());
        }
        let bytes = port.read()?;
        heard.extend(&bytes);
        if ear.take(&bytes).iter().any(|line| is_understood(line)) {
            port.unread(heard);
            return Ok(true);
        }
    }
    Ok(false)
}

/// Returns `true` for lines that only a controller sends; noise does not look like them.
fn is_understood(line: &str) -> bool {
    matches!(
        hear(line),
        HeardLine::Banner(_)
            | HeardLine::Status(_)
            | HeardLine::Alarm { .. }
            | HeardLine::Error { .. }
            | HeardLine::Message(_)
            | HeardLine::Version { .. }
            | HeardLine::Options(_)
    )
}
