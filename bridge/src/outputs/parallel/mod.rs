//! The PC parallel port as bytes of outputs and inputs.
//!
//! ```text
//! output byte 0   D0 … D7              pins 2 … 9
//! output byte 1   bits 0 … 3           pins 1, 14, 16, 17    (control; the port inverts 1, 14 and 17)
//! input byte 0    bits 0 … 4           pins 15, 13, 12, 10, 11 (status; the port inverts 11)
//! ```
//!
//! Here a 1 is always a high pin: the port's inversions are undone.

#[cfg(target_os = "linux")]
mod ppdev;

#[cfg(target_os = "linux")]
pub(super) use ppdev::MAJOR;

use super::Port;
use super::registers::{get, put};
use annulus_core::machine::Machine;
use std::fs::File;
use std::io::{self, Read, Seek, Write};

/// Control bits that the port inverts: strobe, autofeed, select.
const TURNED_OUT: u8 = 0b1011;

/// The status bit that the port inverts: busy.
const TURNED_IN: u8 = 0x80;

trait Lines: Send {
    fn data(&mut self, value: u8) -> io::Result<()>;
    fn control(&mut self, value: u8) -> io::Result<()>;
    fn status(&mut self) -> io::Result<u8>;
}

/// A parallel port on any kind of lines.
struct Parallel<L>(L);

impl<L: Lines> Port for Parallel<L> {
    fn write(&mut self, byte: usize, value: u8) -> io::Result<()> {
        match byte {
            0 => self.0.data(value),
            1 => self.0.control((value & 0x0F) ^ TURNED_OUT),
            // No more outputs; the machine's wiring was checked against that.
            _ => Ok(()),
        }
    }

    fn read(&mut self, byte: usize) -> io::Result<u8> {
        if byte > 0 {
            return Ok(0);
        }
        Ok((self.0.status()? ^ TURNED_IN) >> 3)
    }
}

/// The registers at an address: data, status, control.
struct Addressed<F> {
    file: F,
    base: u64,
}

impl<F: Read + Write + Seek + Send> Lines for Addressed<F> {
    fn data(&mut self, value: u8) -> io::Result<()> {
        put(&mut self.file, self.base, value)
    }

    fn control(&mut self, value: u8) -> io::Result<()> {
        put(&mut self.file, self.base + 2, value)
    }

    fn status(&mut self) -> io::Result<u8> {
        get(&mut self.file, self.base + 1)
    }
}

/// The port behind `file`: the kernel driver, or registers at the machine's address.
pub(super) fn open(file: File, machine: &Machine) -> io::Result<Box<dyn Port>> {
    #[cfg(target_os = "linux")]
    if ppdev::is_driver(&file)? {
        return Ok(Box::new(Parallel(ppdev::Driver::claim(file)?)));
    }
    Ok(Box::new(Parallel(Addressed { file, base: u64::from(machine.parallel.address) })))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    #[test]
    fn set_bit_is_a_high_pin_for_inputs_and_outputs() {
        // (register, pin levels): control 0b1011 in the register holds pins 1, 14 and 17 low and 16 low.
        let rows = [(0b0000, 0b1011), (0b1111, 0b0100), (0b0100, 0b1111), (0b1000, 0b0011)];
        for (pins, register) in rows {
            let mut file = Cursor::new(vec![0; 0x37B]);
            let mut port = Parallel(Addressed { file: &mut file, base: 0x378 });
            port.write(0, 0xA7).unwrap();
            port.write(1, pins).unwrap();
            port.write(2, 0xFF).unwrap();
            assert_eq!(file.into_inner()[0x378..], [0xA7, 0, register]);
        }
        // Status bits 3 … 7 are pins 15, 13, 12, 10 and, inverted, 11.
        for (status, pins) in [(0x00, 0b10000), (0x80, 0), (0xF8, 0b01111), (0x08, 0b10001), (0x47, 0b11000)]
        {
            let mut port = Parallel(Addressed { file: Cursor::new(vec![0, status, 0]), base: 0 });
            assert_eq!(port.read(0).unwrap(), pins, "{status:02x}");
        }
    }
}
