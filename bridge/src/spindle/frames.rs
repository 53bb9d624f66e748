//! Requests to a frequency converter as bytes, and its answers.
//!
//! ```text
//! Modbus RTU   address function  …            crc crc      built and checked by `rmodbus`
//! Huanyang     address function length …      crc crc      functions 3 run, 4 read, 5 speed; the same checksum
//! ```
//!
//! `rmodbus` only builds and checks frames; the port is ours, in a thread that also keeps the deadline of
//! an answer. A client with its own runtime (`tokio-modbus`) would put a scheduler between a dead spindle
//! and the tool in the board.

use super::profile::{Frames, Profile, Write};
use annulus_core::machine::Converter;
use annulus_core::pins::SpindleTrouble;
use rmodbus::client::ModbusRequest;
use rmodbus::{ErrorKind, ModbusProto};

/// Modbus sets this bit in the function of a refusal.
const REFUSED: u8 = 0x80;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ask {
    Speed { rpm: u32 },
    Run { place: usize },
    Stop { place: usize },
    Actual,
    Fault,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Answer {
    Done,
    /// Its actual speed, rpm.
    Turns {
        rpm: u32,
    },
    /// Whether it tripped, and why.
    Tripped {
        /// The converter's own number.
        code: Option<u16>,
    },
}

/// A request, and what is needed to check its answer.
pub(super) struct Frame {
    pub(super) bytes: Vec<u8>,
    ask: Ask,
    /// `None` for Huanyang's own frames.
    modbus: Option<ModbusRequest>,
}

/// Builds `ask` for the converter of `profile`; `None` if it has no register for that.
pub(super) fn frame(ask: Ask, profile: &Profile, converter: &Converter) -> Option<Frame> {
    match profile.frames {
        Frames::Rtu => rtu(ask, profile, converter),
        Frames::Huanyang => huanyang(ask, profile, converter),
    }
}

fn rtu(ask: Ask, profile: &Profile, converter: &Converter) -> Option<Frame> {
    let mut request = ModbusRequest::new(converter.address, ModbusProto::Rtu);
    let mut bytes = Vec::new();
    let write = |request: &mut ModbusRequest, bytes: &mut Vec<u8>, write: Write| match write.function {
        5 => request.generate_set_coil(write.register, u8::from(write.value > 0), bytes),
        16 => request.generate_set_holdings_bulk(write.register, &[write.value], bytes),
        _ => request.generate_set_holding(write.register, write.value, bytes),
    };
    let read = |request: &mut ModbusRequest, bytes: &mut Vec<u8>, register: u16, function: u8| {
        if function == 4 {
            request.generate_get_inputs(register, 1, bytes)
        } else {
            request.generate_get_holdings(register, 1, bytes)
        }
    };
    let made = match ask {
        Ask::Speed { rpm } => {
            let (register, function) = (profile.speed.register, profile.speed.function);
            let value = profile.speed.number(rpm, converter);
            write(&mut request, &mut bytes, Write { register, value, function })
        }
        Ask::Run { place } => write(&mut request, &mut bytes, *profile.run.get(place)?),
        Ask::Stop { place } => write(&mut request, &mut bytes, *profile.stop.get(place)?),
        Ask::Actual => read(&mut request, &mut bytes, profile.actual.register, profile.actual.function),
        Ask::Fault => {
            let fault = profile.fault.as_ref()?;
            read(&mut request, &mut bytes, fault.register, fault.function)
        }
    };
    made.ok().map(|()| Frame { bytes, ask, modbus: Some(request) })
}

fn huanyang(ask: Ask, profile: &Profile, converter: &Converter) -> Option<Frame> {
    let run = |write: &Write| vec![3, 1, write.value as u8];
    let body = match ask {
        Ask::Speed { rpm } => {
            let [high, low] = profile.speed.number(rpm, converter).to_be_bytes();
            vec![5, 2, high, low]
        }
        Ask::Run { place } => run(profile.run.get(place)?),
        Ask::Stop { place } => run(profile.stop.get(place)?),
        Ask::Actual => vec![4, 3, profile.actual.register as u8, 0, 0],
        Ask::Fault => return None,
    };
    let mut bytes = vec![converter.address];
    bytes.extend(body);
    let sum = checksum(&bytes);
    bytes.extend(sum);
    Some(Frame { bytes, ask, modbus: None })
}

/// The Modbus checksum, in the byte order of the line.
pub(super) fn checksum(bytes: &[u8]) -> [u8; 2] {
    let shift = |crc: u16, _| if crc & 1 == 1 { (crc >> 1) ^ 0xA001 } else { crc >> 1 };
    let of = bytes.iter().fold(u16::MAX, |crc, byte| (0..8).fold(crc ^ u16::from(*byte), shift));
    of.to_le_bytes()
}

impl Frame {
    /// Length of the answer that starts with `heard`; `None` if too few bytes have arrived to decide.
    pub(super) fn answer_length(&self, heard: &[u8]) -> Option<usize> {
        let (function, count) = (*heard.get(1)?, usize::from(*heard.get(2)?));
        let counted = 3 + count + 2;
        Some(match (&self.modbus, function) {
            (None, _) => counted,
            (Some(_), function) if function & REFUSED != 0 => 5,
            (Some(_), 3 | 4) => counted,
            (Some(_), _) => 8,
        })
    }

    pub(super) fn answer(
        &self,
        heard: &[u8],
        profile: &Profile,
        converter: &Converter,
    ) -> Result<Answer, SpindleTrouble> {
        let number = match &self.modbus {
            Some(request) => self.rtu_number(request, heard)?,
            None => self.own_number(heard)?,
        };
        Ok(match (self.ask, number) {
            (Ask::Actual, Some(number)) => Answer::Turns { rpm: profile.actual.rpm(number, converter) },
            (Ask::Fault, Some(number)) => {
                Answer::Tripped { code: profile.fault.as_ref().and_then(|fault| fault.tripped(number)) }
            }
            (Ask::Actual | Ask::Fault, None) => return Err(SpindleTrouble::Garbled),
            _ => Answer::Done,
        })
    }

    fn reads(&self) -> bool {
        matches!(self.ask, Ask::Actual | Ask::Fault)
    }

    /// The number read; `None` for a written register.
    fn rtu_number(&self, request: &ModbusRequest, heard: &[u8]) -> Result<Option<u16>, SpindleTrouble> {
        let wrong = |why: ErrorKind| {
            let refused =
                why.is_modbus_error() && heard.get(1).is_some_and(|function| function & REFUSED != 0);
            let code = heard.get(2).copied().unwrap_or_default();
            if refused { SpindleTrouble::Refused { code } } else { SpindleTrouble::Garbled }
        };
        if self.reads() {
            let mut numbers: Vec<u16> = Vec::new();
            request.parse_u16(heard, &mut numbers).map_err(wrong)?;
            return Ok(numbers.first().copied());
        }
        request.parse_ok(heard).map_err(wrong)?;
        // A written register is echoed: register and value, or count.
        if heard.get(..6) == self.bytes.get(..6) { Ok(None) } else { Err(SpindleTrouble::Garbled) }
    }

    fn own_number(&self, heard: &[u8]) -> Result<Option<u16>, SpindleTrouble> {
        let garbled = Err(SpindleTrouble::Garbled);
        let Some((body, sum)) = heard.split_last_chunk::<2>() else { return garbled };
        if *sum != checksum(body) || body.get(..2) != self.bytes.get(..2) {
            return garbled;
        }
        match (self.ask, body) {
            // Address, 4, 3, index of the number, the number.
            (Ask::Actual, [_, _, _, index, high, low]) if self.bytes.get(3) == Some(index) => {
                Ok(Some(u16::from_be_bytes([*high, *low])))
            }
            (Ask::Speed { .. }, _) if body == &self.bytes[..body.len().min(self.bytes.len())] => Ok(None),
            // Its answer to run and stop is its state, not an echo.
            (Ask::Run { .. } | Ask::Stop { .. }, [_, _, 1, _]) => Ok(None),
            _ => garbled,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::profile;
    use super::*;
    use std::path::Path;

    fn of(name: &str, ask: Ask) -> (Profile, Converter, Frame) {
        let (profile, converter) =
            (profile::named(name, Path::new("/nonexistent")).unwrap(), Converter::default());
        let frame = frame(ask, &profile, &converter).unwrap();
        (profile, converter, frame)
    }

    fn summed(body: &[u8]) -> Vec<u8> {
        [body, &checksum(body)].concat()
    }

    #[test]
    fn requests_match_the_bytes_in_the_manuals() {
        let rows: [(&str, Ask, &[u8]); 9] = [
            ("huanyang", Ask::Run { place: 0 }, &[1, 3, 1, 1]),
            ("huanyang", Ask::Stop { place: 0 }, &[1, 3, 1, 8]),
            ("huanyang", Ask::Speed { rpm: 24_000 }, &[1, 5, 2, 0x9C, 0x40]),
            ("huanyang", Ask::Actual, &[1, 4, 3, 1, 0, 0]),
            ("delta", Ask::Run { place: 0 }, &[1, 6, 0x20, 0, 0, 0x12]),
            ("delta", Ask::Actual, &[1, 3, 0x21, 3, 0, 1]),
            ("h100", Ask::Run { place: 0 }, &[1, 5, 0, 0x49, 0xFF, 0]),
            ("h100", Ask::Speed { rpm: 12_000 }, &[1, 6, 2, 1, 7, 0xD0]),
            ("v20", Ask::Speed { rpm: 24_000 }, &[1, 6, 0, 100, 0x40, 0]),
        ];
        for (name, ask, body) in rows {
            let (_, _, frame) = of(name, ask);
            assert_eq!(frame.bytes, summed(body), "{name} {ask:?}: one checksum, by us and by rmodbus");
        }
        // The checksum, with a well-known example.
        assert_eq!(checksum(&[1, 3, 0, 0, 0, 10]), [0xC5, 0xCD]);
    }

    #[test]
    fn answers_are_decoded_and_flipped_bits_are_rejected() {
        let garbled = Err(SpindleTrouble::Garbled);
        let turns = |rpm| Ok(Answer::Turns { rpm });
        type Row<'a> = (&'a str, Ask, &'a [u8], Result<Answer, SpindleTrouble>);
        let rows: [Row<'_>; 12] = [
            ("delta", Ask::Actual, &[1, 3, 2, 0x9C, 0x40], turns(24_000)),
            ("delta", Ask::Actual, &[2, 3, 2, 0x9C, 0x40], garbled),
            ("delta", Ask::Actual, &[1, 0x83, 2], Err(SpindleTrouble::Refused { code: 2 })),
            ("delta", Ask::Fault, &[1, 3, 2, 0x03, 0x07], Ok(Answer::Tripped { code: Some(7) })),
            ("delta", Ask::Fault, &[1, 3, 2, 0x03, 0x00], Ok(Answer::Tripped { code: None })),
            ("delta", Ask::Run { place: 0 }, &[1, 6, 0x20, 0, 0, 0x12], Ok(Answer::Done)),
            ("delta", Ask::Run { place: 0 }, &[1, 6, 0x20, 1, 0, 0x12], garbled),
            ("delta", Ask::Run { place: 0 }, &[1, 0x86, 6], Err(SpindleTrouble::Refused { code: 6 })),
            ("huanyang", Ask::Actual, &[1, 4, 3, 1, 0x4E, 0x20], turns(12_000)),
            ("huanyang", Ask::Actual, &[1, 4, 3, 0, 0x4E, 0x20], garbled),
            ("huanyang", Ask::Run { place: 0 }, &[1, 3, 1, 0x29], Ok(Answer::Done)),
            ("huanyang", Ask::Speed { rpm: 24_000 }, &[1, 5, 2, 0x9C, 0x41], garbled),
        ];
        for (name, ask, body, wanted) in rows {
            let (profile, converter, frame) = of(name, ask);
            let heard = summed(body);
            assert_eq!(frame.answer_length(&heard), Some(heard.len()), "{name} {ask:?}");
            assert_eq!(frame.answer(&heard, &profile, &converter), wanted, "{name} {ask:?}");
            // A single flipped bit never gives a valid answer.
            for bit in 0..8 * heard.len() {
                let mut flipped = heard.clone();
                flipped[bit / 8] ^= 1 << (bit % 8);
                let found = frame.answer(&flipped, &profile, &converter);
                assert_eq!(found, Err(SpindleTrouble::Garbled), "{name} {ask:?}, bit {bit}");
            }
        }
    }
}
