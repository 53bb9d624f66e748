//! Registers as bytes of a file: I/O ports through `/dev/port`, or an ordinary file with the same layout.
//!
//! ```text
//! /dev/port   … base+0  base+1  base+2  base+3 …      seek to the register, then read or write one byte:
//!               ▲ outputs_at: the first output byte   that is one access to the port
//!               ▲ inputs_at: the first input byte
//! ```

use super::Port;
use annulus_core::machine::{Card, Machine};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom, Write};

#[derive(Debug)]
pub(super) struct Registers<F = File> {
    file: F,
    outputs: u64,
    inputs: u64,
}

impl<F> Registers<F> {
    pub(super) fn card(file: F, base: u64, card: &Card) -> Self {
        let (outputs, inputs) = (base + u64::from(card.outputs_at), base + u64::from(card.inputs_at));
        Self { file, outputs, inputs }
    }
}

pub(super) fn open(file: File, machine: &Machine) -> io::Result<Box<dyn Port>> {
    Ok(Box::new(Registers::card(file, u64::from(machine.card_address), &machine.card)))
}

pub(super) fn put(file: &mut (impl Write + Seek), at: u64, value: u8) -> io::Result<()> {
    file.seek(SeekFrom::Start(at))?;
    file.write_all(&[value])
}

pub(super) fn get(file: &mut (impl Read + Seek), at: u64) -> io::Result<u8> {
    let mut byte = [0];
    file.seek(SeekFrom::Start(at))?;
    file.read_exact(&mut byte)?;
    Ok(byte[0])
}

impl<F: Read + Write + Seek + Send> Port for Registers<F> {
    fn write(&mut self, byte: usize, value: u8) -> io::Result<()> {
        put(&mut self.file, self.outputs + byte as u64, value)
    }

    fn read(&mut self, byte: usize) -> io::Result<u8> {
        get(&mut self.file, self.inputs + byte as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn registers_use_only_the_mapped_addresses() {
        for (base, outputs_at, inputs_at) in [(0_u64, 0_u32, 0_u32), (0x2A0, 0, 4), (0x2A0, 8, 0)] {
            let bytes: Vec<u8> = (0..0x300_u32).map(|at| at as u8 ^ 0x5A).collect();
            let mut file = Cursor::new(bytes.clone());
            let card = Card { outputs_at, inputs_at, ..Card::default() };
            let mut port = Registers::card(&mut file, base, &card);
            for byte in 0..4 {
                assert_eq!(port.read(byte).unwrap(), bytes[base as usize + inputs_at as usize + byte]);
            }
            for byte in 0..4 {
                port.write(byte, 0xC0 + byte as u8).unwrap();
            }
            let at = base as usize + outputs_at as usize;
            let mut expected = bytes;
            expected[at..at + 4].copy_from_slice(&[0xC0, 0xC1, 0xC2, 0xC3]);
            assert_eq!(file.into_inner(), expected);
        }
    }

    #[test]
    fn missing_register_is_an_error() {
        let mut port = Registers::card(Cursor::new(vec![0; 3]), 0, &Card::default());
        assert!(port.read(2).is_ok());
        assert!(port.read(3).is_err());
    }
}
