//! Serial ports: which there are, and one of them opened.
//!
//! Comes in: the name of a port. Goes out: names, and bytes. A port that fails is gone for good. Does not know what is said.

use serialport::{ClearBuffer, FlowControl, SerialPort, SerialPortType};
pub(crate) use serialport::{Parity, StopBits};
use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::time::Duration;

/// How long a read waits for a byte.
const PATIENCE: Duration = Duration::from_millis(4);
/// Most bytes that wait to be written: far more than a controller holds.
const MOST_WAITING: usize = 64 * 1024;

/// A port as people know it.
#[derive(Debug, Clone)]
pub(crate) struct Listed {
    /// How it is opened.
    pub(crate) name: String,
    /// What is on it, if it says so.
    pub(crate) what: String,
    /// Its USB number: vendor and product.
    pub(crate) usb: Option<(u16, u16)>,
}

/// The ports of this computer; those that say what is on them first.
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

/// An open port.
pub(crate) struct Port {
    /// How it was opened.
    pub(crate) name: String,
    serial: Box<dyn SerialPort>,
    waiting: VecDeque<u8>,
    /// What was read and given back.
    unread: Vec<u8>,
    /// Whatever is at its other end is not to begin anew by its being opened.
    pub(crate) spares: bool,
}

/// Opens the port called `name`. Most boards begin anew with that.
pub(crate) fn open(name: &str, baud: u32) -> serialport::Result<Port> {
    open_as(name, baud, Parity::None, StopBits::One)
}

/// Opens it for words of another form: of 8 bits with this parity, and so many stop bits.
pub(crate) fn open_as(
    name: &str,
    baud: u32,
    parity: Parity,
    stop_bits: StopBits,
) -> serialport::Result<Port> {
    let builder = serialport::new(name, baud).timeout(PATIENCE).flow_control(FlowControl::None);
    let builder = builder.parity(parity).stop_bits(stop_bits);
    let (name, serial) = (name.to_owned(), builder.open()?);
    Ok(Port { name, serial, waiting: VecDeque::new(), unread: Vec::new(), spares: false })
}

/// The same, for a board that is not to begin anew with it: its lines are left as the port has them, and stay so when it is closed. Where
/// they fell with the closing before, the system raises them, and nobody can keep it from that.
pub(crate) fn open_sparing(name: &str, baud: u32) -> serialport::Result<Port> {
    let kept = lines::stay(name);
    let port = Port { spares: true, ..open(name, baud)? };
    drop(kept);
    Ok(port)
}

#[cfg(unix)]
mod lines {
    use rustix::fs::OFlags;
    use rustix::termios::{ControlModes, OptionalActions, tcgetattr, tcsetattr};
    use std::fs::{File, OpenOptions};
    use std::os::unix::fs::OpenOptionsExt;

    /// DTR and RTS of the port called `name` stay as they are when it is closed, where it lets that be set. The port, open until then.
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
    /// There the lines are as the driver sets them.
    pub(super) fn stay(_: &str) {}
}

impl Port {
    /// What came; nothing after a short wait.
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

    /// What was read is read again, by whoever does so next.
    pub(crate) fn unread(&mut self, bytes: Vec<u8>) {
        self.unread = bytes;
    }

    /// From now on at so many bits in a second; what came before is forgotten.
    pub(crate) fn set_bits_per_s(&mut self, bits_per_s: u32) -> io::Result<()> {
        self.serial.set_baud_rate(bits_per_s).map_err(io::Error::from)?;
        self.serial.clear(ClearBuffer::Input).map_err(io::Error::from)
    }

    /// Whether some of what was written waits for room.
    pub(crate) fn is_full(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Writes what has room; the rest waits for the next turn.
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
