//! A program as bytes, and back. Uploads, hashes and `plan -o FILE` use this form.
//!
//! ```text
//! "ANNULUS PROGRAM\n"  version u8  postcard(Program)
//! ```

use super::{PROGRAM_LIMIT, auth};
use crate::code;
use crate::diagnostic::Diagnostic;
use crate::job::Program;

const MAGIC: &[u8] = b"ANNULUS PROGRAM\n";
const VERSION: u8 = 4;

/// Encodes the program. Equal programs give equal bytes.
pub fn encode(program: &Program) -> Vec<u8> {
    let mut bytes = MAGIC.to_vec();
    bytes.push(VERSION);
    if let Ok(body) = postcard::to_allocvec(program) {
        bytes.extend(body);
    }
    bytes
}

/// Decodes `bytes`, or explains why that fails.
pub fn decode(bytes: &[u8]) -> Result<Program, Diagnostic> {
    let refuse = |code: &str| Err(Diagnostic::error(code));
    if bytes.len() > PROGRAM_LIMIT {
        return refuse(code!("program.too_large"));
    }
    let Some(rest) = bytes.strip_prefix(MAGIC) else { return refuse(code!("program.not_one")) };
    match rest.split_first() {
        Some((&VERSION, body)) => match postcard::take_from_bytes(body) {
            Ok((program, [])) => Ok(program),
            _ => refuse(code!("program.damaged")),
        },
        Some(_) => refuse(code!("program.other_version")),
        None => refuse(code!("program.damaged")),
    }
}

/// True if `bytes` start like a program.
pub fn looks_like_one(bytes: &[u8]) -> bool {
    bytes.starts_with(MAGIC)
}

/// Key of a program: SHA-256 of its bytes, hexadecimal.
pub fn key(bytes: &[u8]) -> String {
    auth::sha256(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point;
    use crate::job::{Bit, Command, Cutter, Leg, Mark};
    use crate::units::Length;

    fn example() -> Program {
        Program {
            name: "one hole".into(),
            machine: "00".into(),
            origin: Point::default(),
            bits: vec![Bit {
                diameter: Length::from_um(800),
                name: "0.8 mm".into(),
                cutter: Cutter::Drill,
                handling: Default::default(),
            }],
            spindles: u8::MAX,
            safe_height: Length::from_um(2000),
            legs: vec![Leg {
                mark: Mark::Hole(0),
                commands: vec![Command::Rapid { to: Point::from_mm(1.0, 2.0) }],
            }],
            accepted: vec![],
        }
    }

    #[test]
    fn program_survives_encoding() {
        assert_eq!(decode(&encode(&example())), Ok(example()));
    }

    #[test]
    fn damaged_program_decodes_or_is_an_error() {
        let bytes = encode(&example());
        for end in 0..bytes.len() {
            assert!(decode(&bytes[..end]).is_err(), "cut at {end}");
        }
        for at in 0..bytes.len() {
            for flip in 0..8 {
                let mut damaged = bytes.clone();
                damaged[at] ^= 1 << flip;
                let _ = decode(&damaged);
            }
        }
    }
}
