//! Allows only certain devices to be driven: real ports, and port files made to replace them.
//!
//! ```text
//! port file        65,536 bytes, one for every I/O port │ "annulus rehearsal 1\n"
//! ```
//!
//! An opened device is written to. So nothing else may be opened: no document named by mistake, no disk, no
//! memory.

use annulus_core::code;
use annulus_core::diagnostic::Diagnostic;
use std::fs::{self, File, Metadata, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

/// Number of I/O ports of a PC, and so of bytes before the mark.
const PORTS: u64 = 0x1_0000;

/// Marks a file as a port file.
const MARK: &[u8] = b"annulus rehearsal 1\n";

/// Creates a port file; fails if the path exists.
pub(crate) fn make(path: &Path) -> io::Result<()> {
    let mut file = crate::own::open(path, OpenOptions::new().write(true).create_new(true))?;
    file.set_len(PORTS)?;
    file.seek(SeekFrom::Start(PORTS))?;
    file.write_all(MARK)?;
    file.sync_all()
}

/// Opens the device at `path` to drive it. Checks it before opening, because opening alone affects some
/// devices, and again afterwards, because the path may have changed.
pub(super) fn open(path: &Path) -> Result<File, Trouble> {
    let before = fs::metadata(path).map_err(Trouble::Io)?;
    if !before.is_file() && !is_port(&before) {
        return Err(Trouble::Refused(code!("output.not_a_port")));
    }
    let mut file = OpenOptions::new().read(true).write(true).open(path).map_err(Trouble::Io)?;
    let opened = file.metadata().map_err(Trouble::Io)?;
    if is_port(&opened) {
        return Ok(file);
    }
    if !opened.is_file() || !is_marked(&mut file, &opened) {
        return Err(Trouble::Refused(code!("output.not_a_rehearsal")));
    }
    crate::own::mend(path).map_err(Trouble::Io)?;
    Ok(file)
}

/// Why a device is not driven.
#[derive(Debug)]
pub(super) enum Trouble {
    Io(io::Error),
    /// Not a permitted device; the code of the reason.
    Refused(&'static str),
}

impl Trouble {
    pub(super) fn diagnostic(&self, path: &Path) -> Diagnostic {
        let code = match self {
            Self::Refused(code) => *code,
            Self::Io(error) => match error.kind() {
                io::ErrorKind::NotFound => code!("output.no_device"),
                io::ErrorKind::PermissionDenied => code!("output.no_rights"),
                io::ErrorKind::ResourceBusy => code!("output.in_use"),
                _ => code!("output.cannot_open"),
            },
        };
        let why = Diagnostic::error(code).with("device", path.display());
        if let Self::Io(error) = self { why.with("reason", error) } else { why }
    }
}

fn is_marked(file: &mut File, found: &Metadata) -> bool {
    let mut mark = vec![0; MARK.len()];
    let read = file.seek(SeekFrom::Start(PORTS)).and_then(|_| file.read_exact(&mut mark));
    read.is_ok() && found.len() == PORTS + MARK.len() as u64 && mark == MARK
}

/// `/dev/port`, or a parallel port of the kernel driver.
#[cfg(target_os = "linux")]
fn is_port(found: &Metadata) -> bool {
    use rustix::fs::{major, minor};
    use std::os::unix::fs::{FileTypeExt, MetadataExt};
    /// The memory devices; `/dev/port` has minor number 4.
    const MEMORY: (u32, u32) = (1, 4);
    let device = found.rdev();
    found.file_type().is_char_device()
        && ((major(device), minor(device)) == MEMORY || major(device) == super::parallel::MAJOR)
}

/// Other systems have no known port device.
#[cfg(not(target_os = "linux"))]
fn is_port(_: &Metadata) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    fn code(path: &Path) -> Option<String> {
        open(path).err().map(|trouble| trouble.diagnostic(path).code)
    }

    #[test]
    fn only_ports_and_simulated_ports_are_opened() {
        let folder = tempfile::tempdir().unwrap();
        let place = |name: &str| folder.path().join(name);
        make(&place("good")).unwrap();
        assert_eq!(code(&place("good")), None);
        assert!(make(&place("good")).is_err(), "nothing is written over");
        let whole = fs::read(place("good")).unwrap();
        assert_eq!(whole.len(), 65_556);
        let rows: [(&str, &[u8]); 5] = [
            ("a letter", b"Dear Sir,"),
            ("empty", b""),
            ("the mark alone", MARK),
            ("too long", &[&whole[..], b"x"].concat()),
            ("cut off", &whole[..whole.len() - 1]),
        ];
        for (name, bytes) in rows {
            fs::write(place(name), bytes).unwrap();
            assert_eq!(code(&place(name)).as_deref(), Some("output.not_a_rehearsal"), "{name}");
            assert_eq!(fs::read(place(name)).unwrap(), bytes, "{name} was left alone");
        }
        for other in ["/dev/null", "/dev/zero", "/"] {
            assert_eq!(code(Path::new(other)).as_deref(), Some("output.not_a_port"), "{other}");
        }
        assert_eq!(code(&place("nothing")).as_deref(), Some("output.no_device"));
    }
}
