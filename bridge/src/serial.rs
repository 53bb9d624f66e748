//! Serial ports: lists and opens them. A port that has failed stays unusable.

use serialport::{ClearBuffer, FlowControl, SerialPort, SerialPortType};
pub(crate) use serialport::{Parity, StopBits};
use std::collections::VecDeque;
use std::fs;
use std::io::{self, ErrorKind, Read, Write};
use std::time::Duration;

/// How long a read waits for a byte.
const PATIENCE: Duration = Duration::from_millis(4);
/// Most bytes that may wait to be written: far more than a controller buffers.
const MOST_WAITING: usize = 64 * 1024;

#[derive(Debug, Clone)]
pub(crate) struct Listed {
    pub(crate) name: String,
    pub(crate) what: String,
    pub(crate) usb: Option<(u16, u16)>,
}

impl Listed {
    /// Returns `true` if this is the port `name`, or the target of that link.
    pub(crate) fn is_named(&self, name: &str) -> bool {
        let real = fs::canonicalize(name).unwrap_or_else(|_| name.into());
        self.name == name || real.as_os_str() == self.name.as_str()
    }
}

/// The ports of this computer; described ones first.
pub(crate) fn list() -> Vec<Listed> {
    let mut found: Vec<Listed> = serialport::available_ports()
        .unwrap_or_default()
        .into_iter()
        .map(|port| {
            let usb = if let SerialPortType::UsbPort(usb) = &port.port_type {
                Some((usb.vid, usb.pid))
            } else {
                None
            };
            let what = match port.port_type {
                SerialPortType::UsbPort(usb) => {
                    let name =
                        [usb.manufacturer, usb.product].into_iter().flatten().collect::<Vec<_>>().join(" ");
                    let number = format!("USB {:04x}:{:04x}", usb.vid, usb.pid);
                    if name.is_empty() { number } else { format!("{name} ({number})") }
                }
                _ => String::new(),
            };
            Listed { name: port.port_name, what, usb }
        })
        .collect();
    found.sort_by(|a, b| (a.what.is_empty(), &a.name).cmp(&(b.what.is_empty(), &b.name)));
    found
}

pub(crate) struct Port {
    pub(crate) name: String,
    serial: Box<dyn SerialPort>,
    waiting: VecDeque<u8>,
    /// Bytes that were read and put back.
    unread: Vec<u8>,
}

/// Opens the port `name`. That resets most controllers.
pub(crate) fn open(name: &str, baud: u32) -> serialport::Result<Port> {
    open_as(name, baud, Parity::None, StopBits::One)
}

/// Opens it with words of 8 bits, this parity and these stop bits.
pub(crate) fn open_as(
    name: &str,
    baud: u32,
    parity: Parity,
    stop_bits: StopBits,
) -> serialport::Result<Port> {
    let builder = serialport::new(name, baud).timeout(PATIENCE).flow_control(FlowControl::None);
    let builder = builder.parity(parity).stop_bits(stop_bits);
    let (name, serial) = (name.to_owned(), builder.open()?);
    Ok(Port { name, serial, waiting: VecDeque::new(), unread: Vec::new() })
}

/// Opens it without resetting the controller: its control lines keep their levels, also when it is closed.
/// If they fell when it was last closed, the system raises them, which cannot be prevented.
pub(crate) fn open_sparing(name: &str, baud: u32) -> serialport::Result<Port> {
    let kept = lines::stay(name);
    let port = open(name, baud)?;
    drop(kept);
    Ok(port)
}

#[cfg(unix)]
mod lines {
    use rustix::fs::OFlags;
    use rustix::termios::{ControlModes, OptionalActions, tcgetattr, tcsetattr};
    use std::fs::{File, OpenOptions};
    use std::os::unix::fs::OpenOptionsExt;

    /// Lets DTR and RTS of the port `name` keep their levels when it is closed, if it supports that. The
    /// returned file keeps it open meanwhile.
    pub(super) fn stay(name: &str) -> Option<File> {
        let quietly = (OFlags::NOCTTY | OFlags::NONBLOCK).bits().cast_signed();
        let port = OpenOptions::new().read(true).write(true).custom_flags(quietly).open(name).ok()?;
        let mut modes = tcgetattr(&port).ok()?;
        modes.control_modes.remove(ControlModes::HUPCL);
        tcsetattr(&port, OptionalActions::Now, &modes).ok()?;
        Some(port)
    }
}

#[cfg(not(unix))]
mod lines {
    /// Other systems: the driver decides.
    pub(super) fn stay(_: &str) {}
}

impl Port {
    /// Received bytes; empty after a short wait.
    pub(crate) fn read(&mut self) -> io::Result<Vec<u8>> {
        if !self.unread.is_empty() {
            return Ok(std::mem::take(&mut self.unread));
        }
        let there = self.serial.bytes_to_read().map_err(io::Error::from)? as usize;
        let mut bytes = vec![0; there.clamp(1, 4096)];
        match self.serial.read(&mut bytes) {
            Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
            Ok(count) => {
                bytes.truncate(count);
                Ok(bytes)
            }
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {
                Ok(Vec::new())
            }
            Err(error) => Err(error),
        }
    }

    /// Puts read bytes back for the next read.
    pub(crate) fn unread(&mut self, bytes: Vec<u8>) {
        self.unread = bytes;
    }

    /// Changes the speed and drops what was received before.
    pub(crate) fn set_bits_per_s(&mut self, bits_per_s: u32) -> io::Result<()> {
        self.serial.set_baud_rate(bits_per_s).map_err(io::Error::from)?;
        self.serial.clear(ClearBuffer::Input).map_err(io::Error::from)
    }

    /// Returns `true` if written bytes still wait for room.
    pub(crate) fn is_full(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Writes as much as fits; the rest waits for the next call.
    pub(crate) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.waiting.extend(bytes);
        if self.waiting.len() > MOST_WAITING {
            return Err(ErrorKind::OutOfMemory.into());
        }
        while !self.waiting.is_empty() {
            let written = match self.serial.write(self.waiting.make_contiguous()) {
                Ok(written) => written,
                Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => break,
                Err(error) => return Err(error),
            };
            self.waiting.drain(..written);
        }
        Ok(())
    }
}
