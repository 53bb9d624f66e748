//! Frames between the bridge and an executor in another process: four bytes of length, then JSON.
//!
//! ```text
//! bridge ── Start ────────────▶ executor          the pipe's end is a message too: the bridge is no more
//!        ◀───────────── Ready ─  (or Refused)
//!        ── Said ─────────────▶
//!        ◀── Report, Glimpse ──
//!        ── Alive ─▶ ◀─ Alive ─   50 ms apart at most: silence is a message too
//! ```
//!
//! Comes in and goes out: messages over a pipe between two processes of the same program and version. A frame that is too
//! long or not understood ends the conversation. Does not know what is moved.

use annulus_core::control::{Lateness, Timing};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::Value;
use annulus_drill::executor::{Glimpse, Report, Said};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::{self, Read, Write};
use std::path::PathBuf;
use std::time::Duration;

/// Longest frame, in bytes: a leg of a hundred thousand runs.
const LIMIT: usize = 16 * 1024 * 1024;

/// Bridge to executor.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) enum Down {
    /// First: the machine, where to keep the record, and what was measured before.
    Start { settings: Vec<(String, Value)>, record: PathBuf, measured: Option<Lateness> },
    /// What its owner has to say.
    Said(Said),
    /// The bridge lives. Nothing is to be done.
    Alive,
}

/// Executor to bridge.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) enum Up {
    /// The outputs are safe, the clock is measured.
    Ready(Timing),
    /// It cannot begin, or cannot go on: nothing more will be said.
    Refused(Diagnostic),
    /// A task ended.
    Report(Report),
    /// The latest place.
    Glimpse(Glimpse),
    /// The executor lives, and nothing is new.
    Alive,
}

/// How often the bridge says that it lives.
pub(super) const BEAT: Duration = Duration::from_millis(50);

/// A frame as it goes over the pipe.
pub(super) fn encode(frame: &impl Serialize) -> io::Result<Vec<u8>> {
    let body = serde_json::to_vec(frame)?;
    let length = u32::try_from(body.len()).ok().filter(|length| *length as usize <= LIMIT);
    let length = length.ok_or(io::ErrorKind::FileTooLarge)?;
    let mut bytes = length.to_le_bytes().to_vec();
    bytes.extend(body);
    Ok(bytes)
}

/// Sends one frame.
pub(super) fn send(pipe: &mut impl Write, frame: &impl Serialize) -> io::Result<()> {
    pipe.write_all(&encode(frame)?)?;
    pipe.flush()
}

/// The next frame; none where the pipe ended between two frames.
pub(super) fn receive<T: DeserializeOwned>(pipe: &mut impl Read) -> io::Result<Option<T>> {
    Ok(match receive_bytes(pipe)? {
        Some(body) => Some(serde_json::from_slice(&body)?),
        None => None,
    })
}

/// The same before anybody understands it.
pub(super) fn receive_bytes(pipe: &mut impl Read) -> io::Result<Option<Vec<u8>>> {
    let mut length = [0; 4];
    match pipe.read(&mut length)? {
        0 => return Ok(None),
        4 => {}
        some => pipe.read_exact(&mut length[some..])?,
    }
    let length = u32::from_le_bytes(length) as usize;
    if length > LIMIT {
        return Err(io::ErrorKind::InvalidData.into());
    }
    let mut body = vec![0; length];
    pipe.read_exact(&mut body)?;
    Ok(Some(body))
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::machine;
    use annulus_drill::executor::Instruction;

    #[test]
    fn a_machine_survives_the_way_and_broken_frames_end_it() {
        let settings = machine::read(&machine::lab());
        let frames = [
            Down::Start { settings, record: "executor.log".into(), measured: None },
            Down::Said(Said::Stop { upto: u64::MAX }),
            Down::Said(Said::Order(Instruction::Spindle { rpm: 3 })),
        ];
        let mut bytes = Vec::new();
        frames.iter().for_each(|frame| send(&mut bytes, frame).unwrap());
        let mut pipe = bytes.as_slice();
        let Some(Down::Start { settings, .. }) = receive(&mut pipe).unwrap() else { panic!("no start") };
        assert_eq!(machine::apply(&machine::virtual_drill(), &settings).unwrap(), machine::lab());
        assert!(matches!(receive(&mut pipe).unwrap(), Some(Down::Said(Said::Stop { upto: u64::MAX }))));
        assert!(matches!(
            receive(&mut pipe).unwrap(),
            Some(Down::Said(Said::Order(Instruction::Spindle { rpm: 3 })))
        ));
        assert!(receive::<Down>(&mut pipe).unwrap().is_none(), "the end");
        for cut in 1..bytes.len() {
            let mut pipe = &bytes[..cut];
            while let Ok(Some(_)) = receive::<Down>(&mut pipe) {}
            assert!(pipe.is_empty() || pipe.len() < 5, "{cut}");
        }
        for broken in [&b"\xff\xff\xff\xff"[..], b"\x02\0\0\0{}", b"\x01\0\0\0x"] {
            assert!(receive::<Down>(&mut &broken[..]).is_err(), "{broken:?}");
        }
    }
}
