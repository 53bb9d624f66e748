//! Hardware outputs of this computer: a digital I/O card or a parallel port behind core's `Pins`.
//!
//! ```text
//! Pins ──▶ wires: the bits of signals ──▶ bytes ──▶ Port: byte n ──┬─ registers: /dev/port, or an ordinary file
//!          phases, STEP and DIR, sensors                           └─ parallel: data, status, control ─┬─ registers
//!                                                                                            └─ ppdev: /dev/parport0
//! ```
//!
//! Only one process drives a device at a time. A port file moves nothing: the same code writes the same
//! bytes into it.

mod bytes;
#[cfg(test)]
mod edges;
mod parallel;
mod registers;
pub(crate) mod rehearsal;
mod step_dir;
mod wires;

pub(crate) use bytes::Trouble;
pub(crate) use wires::Wires;

use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::{Machine, Output};
use std::fs::{File, TryLockError};
use std::io;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

/// How long another process may take to release the device: long enough to stop.
const LET_GO: Duration = Duration::from_secs(10);

/// Bytes of outputs and inputs.
pub(crate) trait Port: Send {
    /// Sets all eight outputs of byte `byte` at once.
    fn write(&mut self, byte: usize, value: u8) -> io::Result<()>;

    fn read(&mut self, byte: usize) -> io::Result<u8>;
}

/// Opens a port on a device; the driver reads its addresses from the machine's settings.
type OpenPort = fn(File, &Machine) -> io::Result<Box<dyn Port>>;

/// The hardware drivers. A new one is a file or folder here, a row, and its own section in the machine's
/// settings.
const DRIVERS: &[(Output, OpenPort)] = &[(Output::Card, registers::open), (Output::Parallel, parallel::open)];

/// Opens the pins of `machine`'s hardware, with everything off.
pub(crate) fn open(machine: &Machine) -> Result<Wires, Diagnostic> {
    let file = device(machine)?;
    take(&file).map_err(|error| trouble(machine, error))?;
    let port = port(machine, file)?;
    Wires::new(machine, port).map_err(|error| trouble(machine, error))
}

/// Switches everything off, after the process that drove the device died. Does not wait for another owner
/// of the device.
pub(crate) fn make_safe(machine: &Machine) -> Result<(), Diagnostic> {
    let mut port = port(machine, device(machine)?)?;
    bytes::all_off(machine.wiring(), &mut *port).map_err(|error| trouble(machine, error))
}

fn device(machine: &Machine) -> Result<File, Diagnostic> {
    let path = Path::new(&machine.wiring().device);
    rehearsal::open(path).map_err(|trouble| trouble.diagnostic(path))
}

fn port(machine: &Machine, file: File) -> Result<Box<dyn Port>, Diagnostic> {
    let driver = DRIVERS.iter().find(|(output, _)| *output == machine.output);
    let port = driver.map_or_else(|| Err(io::ErrorKind::Unsupported.into()), |(_, open)| open(file, machine));
    port.map_err(|error| trouble(machine, error))
}

fn trouble(machine: &Machine, error: io::Error) -> Diagnostic {
    rehearsal::Trouble::Io(error).diagnostic(Path::new(&machine.wiring().device))
}

/// Returns `true` if the machine's device is an ordinary file, which moves nothing.
pub(crate) fn is_rehearsal(machine: &Machine) -> bool {
    std::fs::metadata(&machine.wiring().device).is_ok_and(|device| device.is_file())
}

/// Locks the device for this process while the file is open.
fn take(file: &File) -> io::Result<()> {
    let since = Instant::now();
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(()),
            Err(TryLockError::WouldBlock) if since.elapsed() < LET_GO => {
                thread::sleep(Duration::from_millis(20));
            }
            Err(TryLockError::WouldBlock) => return Err(io::ErrorKind::ResourceBusy.into()),
            Err(TryLockError::Error(error)) => return Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::DRIVERS;
    use annulus_core::machine::{Output, ValueKind, setting};

    #[test]
    fn every_output_but_the_virtual_drill_has_one_driver() {
        let all = [Output::Virtual, Output::Card, Output::Parallel, Output::Adapter];
        // The virtual drill needs no pins, and the adapter has its own.
        let no_pins = [Output::Virtual, Output::Adapter];
        let words = setting("machine.output").map(|row| row.kind);
        assert!(matches!(words, Some(ValueKind::Choice(words)) if words.len() == all.len()), "{words:?}");
        for output in all {
            let drivers = DRIVERS.iter().filter(|(own, _)| *own == output).count();
            assert_eq!(drivers, usize::from(!no_pins.contains(&output)), "{output:?}");
        }
    }
}
