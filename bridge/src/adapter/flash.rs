//! Installs firmware in an adapter: requests its boot mode, copies the file to the disk that then appears,
//! and identifies the adapter again.

use super::image::boot_disks;
use super::port::{Plug, adapters, named};
use crate::serial;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::pins::through;
use annulus_host::adapter::{AdapterLine, touches, who};
use annulus_host::executor::Time;
use annulus_link::cobs::Unstuffer;
use annulus_link::frame::{FRAME, open};
use annulus_link::message::{State, Tell, Touches, Welcome};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

/// Opening the port at this speed and closing it starts the adapter's boot mode, if it is stopped.
const BOOT_BITS_PER_S: u32 = 1200;
/// How long to listen for motion: a status arrives every 10 ms.
const LISTENS: Duration = Duration::from_millis(150);
/// How long a disk or port may take to appear.
const COMES: Duration = Duration::from_secs(15);
const LOOKS: Duration = Duration::from_millis(200);

const NAME: &str = "annulus-adapter.uf2";

/// Calls `look` until it finds something or the patience ends.
fn awaited<T>(patience: Duration, mut look: impl FnMut() -> Option<T>) -> Option<T> {
    let since = Instant::now();
    loop {
        let found = look();
        if found.is_some() || since.elapsed() >= patience {
            return found;
        }
        thread::sleep(LOOKS);
    }
}

/// Identifies the adapter at the port `name`, or at the only port with an adapter.
pub(crate) fn asked(name: &str, time: Time) -> Result<(String, Welcome), Diagnostic> {
    let (port, mut line) = line(name, time)?;
    through(who(&mut line)).map(|welcome| (port, welcome))
}

/// Identifies the adapter, and counts the touches shorter than their filter, if its firmware does.
pub(crate) fn report(name: &str, time: Time) -> Result<(String, Welcome, Option<Touches>), Diagnostic> {
    let (port, mut line) = line(name, time)?;
    let welcome = through(who(&mut line))?;
    through(touches(&mut line)).map(|touches| (port, welcome, touches))
}

/// Opens a line to the port `name`. Returns the port's real name too.
fn line(name: &str, time: Time) -> Result<(String, AdapterLine), Diagnostic> {
    let plug = Plug::open(name)?;
    let port = plug.port_name().to_owned();
    let session = getrandom::u32().unwrap_or(std::process::id());
    Ok((port, AdapterLine::new(Box::new(plug), session, time)))
}

/// The boot disk of the adapter at the port `name`. Does not say hello: that would stop a moving adapter.
pub(crate) fn boot_disk_of(name: &str) -> Result<PathBuf, Diagnostic> {
    shown_by(name, COMES, boot_disks)
}

/// Requests the boot mode, and returns the first of `disks` that appears in time.
fn shown_by(name: &str, patience: Duration, disks: impl Fn() -> Vec<PathBuf>) -> Result<PathBuf, Diagnostic> {
    let name = named(name)?;
    let unopened = |error: serialport::Error| {
        let why = error!("adapter.port_unopened", port = &name, ..);
        why.with("reason", error.description)
    };
    let mut port = serial::open(&name, 115_200).map_err(unopened)?;
    let (since, mut frames) = (Instant::now(), Unstuffer::<FRAME>::new());
    while since.elapsed() < LISTENS {
        for byte in port.read().unwrap_or_default() {
            let Some((header, payload)) = frames.take(byte).and_then(open) else { continue };
            if let Some((Tell::Status(status), _)) = Tell::take(header.kind, payload)
                && status.state == State::Running
            {
                return Err(error!("firmware.moves", port = &name));
            }
        }
    }
    drop(port);
    drop(serial::open(&name, BOOT_BITS_PER_S).map_err(unopened)?);
    awaited(patience, || disks().pop()).ok_or_else(|| error!("firmware.no_disk", port = &name))
}

/// Copies the file. A complete board removes its disk at once, so a failing sync is no error.
pub(crate) fn copy(bytes: &[u8], disk: &Path) -> Result<(), Diagnostic> {
    let path = disk.join(NAME);
    let copied = File::create(&path).and_then(|mut file| {
        file.write_all(bytes)?;
        let _ = file.sync_all();
        Ok(())
    });
    copied.map_err(|error| {
        let why = error!("firmware.not_copied", file = path.display(), ..);
        why.with("reason", error)
    })
}

/// Identifies the returned adapter; `None` if none returned in time. Its port may have a new name, but not
/// one of `others`: those adapters were there before and must not be disturbed.
pub(crate) fn came_back(name: &str, others: &[String], time: Time) -> Option<(String, Welcome)> {
    awaited(COMES, || {
        let asks = |there: &String| asked(there, time).ok();
        returned(name, others, adapters()).iter().find_map(asks)
    })
}

/// Names to try: the old one, and that of a new adapter if exactly one is new.
fn returned(name: &str, others: &[String], there: Vec<String>) -> Vec<String> {
    let mut new: Vec<String> =
        there.into_iter().filter(|there| there != name && !others.contains(there)).collect();
    new.truncate(if new.len() == 1 { 1 } else { 0 });
    let own = Some(name.to_owned()).filter(|name| !name.is_empty());
    own.into_iter().chain(new).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn moving_adapter_refuses_boot_mode() {
        use annulus_link::bytes::Writer;
        use annulus_link::frame::{Header, ON_LINE, seal};
        use annulus_link::message::Status;
        use serialport::{SerialPort, TTYPort};
        let (mut own, theirs) = TTYPort::pair().unwrap();
        let tell = Tell::from(Status { state: State::Running, ..Status::default() });
        let (mut payload, mut line) = ([0; 128], [0; ON_LINE]);
        let mut out = Writer::new(&mut payload);
        tell.put(&mut out);
        let length = out.end().unwrap();
        let header = Header { session: 1, number: 0, kind: tell.kind() };
        let length = seal(header, &payload[..length], &mut line).unwrap();
        let says = thread::spawn(move || {
            for _ in 0..30 {
                let _ = own.write_all(&line[..length]);
                thread::sleep(Duration::from_millis(10));
            }
        });
        assert_eq!(boot_disk_of(&theirs.name().unwrap()).unwrap_err().code, "firmware.moves");
        says.join().unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn idle_adapter_shows_its_boot_disk_after_1200_baud() {
        use serialport::{SerialPort, TTYPort};
        let (own, theirs) = TTYPort::pair().unwrap();
        let name = theirs.name().unwrap();
        let none = shown_by(&name, Duration::ZERO, Vec::new).unwrap_err();
        assert_eq!(none.code, "firmware.no_disk");
        let said = format!("{} {}", none.message("en"), none.advice("en"));
        assert!(said.contains(&name) && said.contains("BOOTSEL") && !said.contains('{'), "{said}");
        let disk = PathBuf::from("/media/RPI-RP2");
        let shown = || if own.baud_rate().unwrap() == 1200 { vec![disk.clone()] } else { Vec::new() };
        assert_eq!(shown_by(&name, Duration::ZERO, shown), Ok(disk.clone()));
    }

    #[test]
    fn renamed_port_is_tried_but_other_adapters_are_not() {
        let names = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        let rows = [
            // named, others, present, tried in this order
            ("", "", "A", "A"),
            ("", "", "", ""),
            ("", "", "A B", ""),
            ("", "B", "A B", "A"),
            ("A", "", "A", "A"),
            ("A", "", "C", "A C"),
            ("A", "B", "B", "A"),
            ("A", "B", "B C", "A C"),
            ("A", "", "B C", "A"),
        ];
        for (name, others, there, asked) in rows {
            assert_eq!(returned(name, &names(others), names(there)), names(asked), "{name} {others} {there}");
        }
    }
}
