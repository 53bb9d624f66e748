//! The kernel's parallel port driver, `/dev/parport0`: four requests of Linux' `ppdev.h`.
//!
//! Cannot be tested without a parallel port; the layer above is tested on a file.
#![expect(unsafe_code, reason = "a request number and the type behind it can only be vouched for by hand")]

use super::Lines;
use rustix::fs::{FileType, fstat, major};
use rustix::ioctl::{Getter, NoArg, Setter, ioctl, opcode};
use std::fs::File;
use std::io;

/// Major number of the driver's devices.
pub(in crate::outputs) const MAJOR: u32 = 99;

/// `PPCLAIM`, `_IO('p', 0x8b)`.
const CLAIM: rustix::ioctl::Opcode = opcode::none(b'p', 0x8b);
/// `PPEXCL`, `_IO('p', 0x8f)`.
const EXCLUSIVE: rustix::ioctl::Opcode = opcode::none(b'p', 0x8f);
/// `PPRSTATUS`, `_IOR('p', 0x81, unsigned char)`.
const STATUS: rustix::ioctl::Opcode = opcode::read::<u8>(b'p', 0x81);
/// `PPWCONTROL`, `_IOW('p', 0x84, unsigned char)`.
const CONTROL: rustix::ioctl::Opcode = opcode::write::<u8>(b'p', 0x84);
/// `PPWDATA`, `_IOW('p', 0x86, unsigned char)`.
const DATA: rustix::ioctl::Opcode = opcode::write::<u8>(b'p', 0x86);

pub(super) fn is_driver(file: &File) -> io::Result<bool> {
    let stat = fstat(file)?;
    let is_device = FileType::from_raw_mode(stat.st_mode) == FileType::CharacterDevice;
    Ok(is_device && major(stat.st_rdev) == MAJOR)
}

pub(super) struct Driver(File);

impl Driver {
    /// Claims the port for this process.
    pub(super) fn claim(file: File) -> io::Result<Self> {
        // SAFETY: both requests take no argument (linux/ppdev.h).
        unsafe {
            ioctl(&file, NoArg::<EXCLUSIVE>::new())?;
            ioctl(&file, NoArg::<CLAIM>::new())?;
        }
        Ok(Self(file))
    }
}

impl Lines for Driver {
    fn data(&mut self, value: u8) -> io::Result<()> {
        // SAFETY: the request reads one unsigned char (linux/ppdev.h).
        unsafe { ioctl(&self.0, Setter::<DATA, u8>::new(value))? };
        Ok(())
    }

    fn control(&mut self, value: u8) -> io::Result<()> {
        // SAFETY: the request reads one unsigned char (linux/ppdev.h).
        unsafe { ioctl(&self.0, Setter::<CONTROL, u8>::new(value))? };
        Ok(())
    }

    fn status(&mut self) -> io::Result<u8> {
        // SAFETY: the request writes one unsigned char (linux/ppdev.h).
        Ok(unsafe { ioctl(&self.0, Getter::<STATUS, u8>::new())? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ppdev_request_numbers_match_the_kernel_header() {
        // As defined in linux/ppdev.h for x86-64.
        let numbers = [CLAIM, EXCLUSIVE, STATUS, CONTROL, DATA];
        assert_eq!(numbers, [0x708b, 0x708f, 0x8001_7081, 0x4001_7084, 0x4001_7086]);
        assert!(!is_driver(&tempfile::tempfile().unwrap()).unwrap());
        assert!(!is_driver(&File::open("/dev/null").unwrap()).unwrap());
        assert!(Driver::claim(File::open("/dev/null").unwrap()).is_err());
    }
}
