//! Frames between the bridge and an executor in another process: four bytes of length, then JSON.
//!
//! ```text
//! bridge ── Start ────────────▶ executor          the end of the pipe is a message too: the bridge is gone
//!        ◀───────────── Ready ─  (or Refused)
//!        ── Said ─────────────▶
//!        ◀── Report, Glimpse ──
//!        ── Alive ─▶ ◀─ Alive ─   at most 50 ms apart: silence is a message too
//! ```
//!
//! A frame that is too long or not understood ends the connection.

use annulus_core::control::{Lateness, Timing};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::Value;
use annulus_host::executor::{Glimpse, Report, Said};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::{self, Read, Write};
use std::path::PathBuf;
use std::time::Duration;

/// Longest frame, in bytes: a leg of a hundred thousand runs.
const LIMIT: usize = 16 * 1024 * 1024;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) enum Down {
    /// First: the machine, the path of the record, and an earlier timing measurement.
    Start {
        settings: Vec<(String, Value)>,
        record: PathBuf,
        measured: Option<Lateness>,
    },
    Said(Said),
    /// Keep-alive of the bridge.
    Alive,
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) enum Up {
    /// The outputs are safe, and the clock is measured.
    Ready(Timing),
    /// The executor cannot start or continue: no message follows.
    Refused(Diagnostic),
    Report(Report),
    Glimpse(Glimpse),
    /// Keep-alive of the executor.
    Alive,
}

/// Interval of the bridge's keep-alives.
pub(super) const BEAT: Duration = Duration::from_millis(50);

pub(super) fn encode(frame: &impl Serialize) -> io::Result<Vec<u8>> {
    let body = serde_json::to_vec(frame)?;
    let length = u32::try_from(body.len()).ok().filter(|length| *length as usize <= LIMIT);
    let length = length.ok_or(io::ErrorKind::FileTooLarge)?;
    let mut bytes = length.to_le_bytes().to_vec();
    bytes.extend(body);
    Ok(bytes)
}

pub(super) fn send(pipe: &mut impl Write, frame: &impl Serialize) -> io::Result<()> {
    pipe.write_all(&encode(frame)?)?;
    pipe.flush()
}

/// The next frame; `None` if the pipe ended between two frames.
pub(super) fn receive<T: DeserializeOwned>(pipe: &mut impl Read) -> io::Result<Option<T>> {
    Ok(match receive_bytes(pipe)? {
        Some(body) => Some(serde_json::from_slice(&body)?),
        None => None,
    })
}

/// The next frame, not yet parsed.
pub(super) fn receive_bytes(pipe: &mut impl Read) -> io::Result<Option<Vec<u8>>> {
    let mut length = [0; 4];
    match pipe.read(&mut length)? {
        0 => return Ok(None),
        4 => {}
        // A pipe may hand over only part of the length at first.
        some => pipe.read_exact(&mut length[some..])?,
    }
    let length = u32::from_le_bytes(length) as usize;
    // A damaged length must not make us allocate gigabytes.
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
    use annulus_host::executor::Instruction;

    #[test]
    fn frames_carry_a_machine_and_broken_frames_are_errors() {
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
