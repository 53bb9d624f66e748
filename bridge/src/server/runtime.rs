//! The note of this user's running bridge: its port, and the secret for `annulus link`.
//!
//! ```text
//! bridge  ── holds the lock on ──▶ bridge.json (0600) {"port", "secret"} ◀── reads ── annulus link
//! ```
//!
//! The lock belongs to the process: a killed bridge leaves a note without a lock, which is ignored, and
//! nothing to clean up.

use crate::refusal::Refusal;
use crate::{machine_file, own};
use annulus_core::error;
use serde::{Deserialize, Serialize};
use std::env;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};

#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Note {
    pub(crate) port: u16,
    /// Key of the proof in `POST /api/link`, in hexadecimal.
    pub(crate) secret: String,
}

/// The lock of this user's bridge, held until dropped.
pub(crate) struct Claim {
    file: File,
}

/// Folder of the note: `$ANNULUS_HOME`, else `$XDG_RUNTIME_DIR/annulus`, else the journal's.
pub(crate) fn folder() -> PathBuf {
    let set = |name| env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    match (set("ANNULUS_HOME"), set("XDG_RUNTIME_DIR")) {
        (None, Some(runtime)) => runtime.join("annulus"),
        _ => machine_file::data_folder(),
    }
}

/// Creates a folder that only this user can enter.
pub(crate) fn make_folder(folder: &Path) -> Result<(), Refusal> {
    own::root(folder).map_err(|error| trouble(folder, &error))
}

impl Claim {
    /// Claims `folder`. The inner error is the note of the running bridge, if it is written yet.
    pub(crate) fn take(folder: &Path) -> Result<Result<Self, Option<Note>>, Refusal> {
        make_folder(folder)?;
        let path = folder.join("bridge.json");
        let mut file = open(&path).map_err(|error| trouble(&path, &error))?;
        // The lock ends with its process, even after a crash; a file alone would remain.
        match file.try_lock() {
            Ok(()) => Ok(Ok(Self { file })),
            Err(TryLockError::WouldBlock) => Ok(Err(read(&mut file))),
            Err(TryLockError::Error(error)) => Err(trouble(&path, &error)),
        }
    }

    pub(crate) fn say(&mut self, note: &Note) -> Result<(), Refusal> {
        let text = serde_json::to_string(note).unwrap_or_default();
        let written = self.clear().and_then(|()| self.file.write_all(text.as_bytes()));
        written.map_err(|error| trouble(&folder(), &error))
    }

    fn clear(&mut self) -> io::Result<()> {
        self.file.set_len(0)?;
        self.file.rewind()
    }
}

impl Drop for Claim {
    /// Do not leave a useless secret behind.
    fn drop(&mut self) {
        let _ = self.clear();
    }
}

/// The note of the running bridge; `None` if no bridge runs.
pub(crate) fn running(folder: &Path) -> Option<Note> {
    let mut file = own::open(&folder.join("bridge.json"), OpenOptions::new().read(true)).ok()?;
    match file.try_lock_shared() {
        Err(TryLockError::WouldBlock) => read(&mut file),
        _ => None,
    }
}

fn read(file: &mut File) -> Option<Note> {
    let mut text = String::new();
    // A note is much shorter; this guards against a foreign file.
    file.take(4096).read_to_string(&mut text).ok()?;
    serde_json::from_str(&text).ok()
}

fn open(path: &Path) -> io::Result<File> {
    own::open(path, OpenOptions::new().read(true).write(true).create(true).truncate(false))
}

fn trouble(path: &Path, error: &io::Error) -> Refusal {
    let why = error!("serve.folder", ..);
    Refusal::surroundings(why.with("folder", path.display()).with("reason", error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn second_bridge_is_refused_and_the_note_is_cleared() {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path().join("deeper");
        assert_eq!(running(&folder), None);
        let note = Note { port: 7425, secret: "00".into() };
        let mut claim = Claim::take(&folder).unwrap().ok().unwrap();
        claim.say(&Note { port: 1, secret: "a longer secret".into() }).unwrap();
        claim.say(&note).unwrap();
        assert_eq!(running(&folder), Some(note.clone()));
        assert_eq!(Claim::take(&folder).unwrap().err(), Some(Some(note)));
        drop(claim);
        assert_eq!(running(&folder), None);
        assert_eq!(std::fs::read(folder.join("bridge.json")).unwrap(), b"");
        std::fs::write(folder.join("bridge.json"), b"left by a killed bridge").unwrap();
        assert_eq!(running(&folder), None);
        assert!(Claim::take(&folder).unwrap().is_ok());
    }

    #[cfg(unix)]
    #[test]
    fn note_is_readable_only_by_its_user() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("bridge.json");
        std::fs::write(&path, b"").unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o644)).unwrap();
        let _claim = Claim::take(folder.path()).unwrap().ok().unwrap();
        assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
    }
}
