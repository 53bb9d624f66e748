//! At which speed a controller speaks, where nobody says: one after the other is tried until something is understood.
//!
//! ```text
//!  open at 115200 ─ 2.5 s: does it greet? ─ ? ─ ? … a second ─▶ 57600 ─ ? ─ ? … a second ─▶ 9600 …
//! ```
//!
//! Comes in: a port that was just opened. Goes out: the speed; what was heard stays to be read. Nothing is written but questions for a
//! report: they move nothing. Does not know what is said.

use crate::serial::Port;
use annulus_core::controller::BITS_PER_S;
use annulus_core::controller::heard::{Ear, HeardLine, hear};
use std::io;
use std::time::{Duration, Instant};

/// How long a board takes to greet after its port was opened: nothing is written meanwhile.
const GREETS: Duration = Duration::from_millis(2_500);
/// How long it may take to answer a question.
const ANSWERS: Duration = Duration::from_millis(1_200);
/// A question is asked again after so long: one may come to nothing behind what another speed made of those before.
const AGAIN: Duration = Duration::from_millis(250);

/// Tries the usual speeds; `silent` hears of each at which nobody answers. None where that is so at all of them. The port is open at the
/// first one.
pub(super) fn find(port: &mut Port, silent: impl Fn(u32)) -> io::Result<Option<u32>> {
    for (index, bits_per_s) in BITS_PER_S.into_iter().enumerate() {
        if index > 0 && port.set_bits_per_s(bits_per_s).is_err() {
            // This port does not have it.
            continue;
        }
        if is_heard(port, if index == 0 { GREETS } else { Duration::ZERO })? {
            return Ok(Some(bits_per_s));
        }
        silent(bits_per_s);
    }
    Ok(None)
}

/// Whether something is understood, by itself for so long or in answer to questions.
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

/// Whether only a controller says such a line, and no noise.
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
