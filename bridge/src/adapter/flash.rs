//! A firmware brought into an adapter: it is asked for its boot mode, the file is copied onto the disk that it shows then, and it is
//! asked who it is.
//!
//! Comes in: a port, a disk, bytes. Goes out: who is there afterwards. Does not know who wants it, nor whether they may.

use super::image::boot_disks;
use super::port::{Plug, adapters, named};
use crate::serial;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::pins::through;
use annulus_drill::adapter::{AdapterLine, touches, who};
use annulus_drill::executor::Time;
use annulus_link::cobs::Unstuffer;
use annulus_link::frame::{FRAME, open};
use annulus_link::message::{State, Tell, Touches, Welcome};
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, Instant};

/// An adapter whose port is opened at this speed and let go of goes into its boot mode, if it rests.
const BOOT_BITS_PER_S: u32 = 1200;
/// How long it is listened whether it moves: a status comes every 10 ms.
const LISTENS: Duration = Duration::from_millis(150);
/// How long a disk or a port may take to come.
const COMES: Duration = Duration::from_secs(15);
const LOOKS: Duration = Duration::from_millis(200);

/// What the file is called on the disk.
const NAME: &str = "annulus-adapter.uf2";

/// The first that `look` finds within so long.
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

/// Who is at the port called `name`, or at the only one with an adapter.
pub(crate) fn asked(name: &str, time: Time) -> Result<(String, Welcome), Diagnostic> {
    let (port, mut line) = line(name, time)?;
    through(who(&mut line)).map(|welcome| (port, welcome))
}

/// The same, and how often its inputs were touched for less than their filter, where it counts.
pub(crate) fn report(name: &str, time: Time) -> Result<(String, Welcome, Option<Touches>), Diagnostic> {
    let (port, mut line) = line(name, time)?;
    let welcome = through(who(&mut line))?;
    through(touches(&mut line)).map(|touches| (port, welcome, touches))
}

/// A line to the port called `name`, and what the port is called.
fn line(name: &str, time: Time) -> Result<(String, AdapterLine), Diagnostic> {
    let plug = Plug::open(name)?;
    let port = plug.port_name().to_owned();
    let session = getrandom::u32().unwrap_or(std::process::id());
    Ok((port, AdapterLine::new(Box::new(plug), session, time)))
}

/// The disk of the adapter at the port called `name`, which is not asked while it moves: saying hello would stop it.
pub(crate) fn boot_disk_of(name: &str) -> Result<PathBuf, Diagnostic> {
    shown_by(name, COMES, boot_disks)
}

/// The first of the `disks` that come within so long after the adapter was asked for its own.
fn shown_by(name: &str, patience: Duration, disks: impl Fn() -> Vec<PathBuf>) -> Result<PathBuf, Diagnostic> {
    let name = named(name)?;
    let unopened = |error: serialport::Error| {
        let why = Diagnostic::error("adapter.port_unopened").with("port", &name);
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
                return Err(Diagnostic::error("firmware.moves").with("port", &name));
            }
        }
    }
    drop(port);
    drop(serial::open(&name, BOOT_BITS_PER_S).map_err(unopened)?);
    awaited(patience, || disks().pop())
        .ok_or_else(|| Diagnostic::error("firmware.no_disk").with("port", &name))
}

/// Copies the file. A board that has all of it lets go of its disk at once: that it is gone then is no failure.
pub(crate) fn copy(bytes: &[u8], disk: &Path) -> Result<(), Diagnostic> {
    let path = disk.join(NAME);
    let copied = File::create(&path).and_then(|mut file| {
        file.write_all(bytes)?;
        let _ = file.sync_all();
        Ok(())
    });
    copied.map_err(|error| {
        let why = Diagnostic::error("firmware.not_copied").with("file", path.display());
        why.with("reason", error)
    })
}

/// Who came back; none where nobody did. It may come under another name than the one that it had, but under none of the `others`,
/// which were there before: they may be at work, and are not asked.
pub(crate) fn came_back(name: &str, others: &[String], time: Time) -> Option<(String, Welcome)> {
    awaited(COMES, || {
        let asks = |there: &String| asked(there, time).ok();
        returned(name, others, adapters()).iter().find_map(asks)
    })
}

/// Under which names it may be there again: its own, and that of the only adapter that is new.
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
    fn an_adapter_that_moves_is_not_asked_for_its_boot_mode() {
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
    fn an_adapter_that_rests_is_touched_at_1200_baud_and_its_disk_is_waited_for() {
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
    fn whoever_comes_back_under_another_name_is_found_and_nobody_else_is_asked() {
        let names = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        let rows = [
            // named, others, there, asked in this order
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
