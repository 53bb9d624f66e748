//! What of a controller's job is done, on the disk: so that a killed process, a pulled cable or a power cut leave no hole out and none
//! is drilled elsewhere.
//!
//! Comes in: the job and how many sections of it are certainly done. Goes out: the job that was interrupted. Written whole or not at
//! all; at most the section in work is made again. Does not know what a section is.

use crate::machine_file;
use annulus_core::diagnostic::Diagnostic;
use annulus_drill::controller::AttendedJob;
use std::fs;
use std::path::{Path, PathBuf};

/// Largest file that is read.
const LARGEST: u64 = 64 * 1024;

/// Where entries are kept.
#[derive(Clone, Debug)]
pub(crate) struct Ledger {
    path: PathBuf,
}

impl Ledger {
    /// The one in the folder of data.
    pub(crate) fn in_folder(folder: &Path) -> Self {
        Self { path: folder.join("controller.json") }
    }

    /// The job that was begun last and did not come to its end.
    pub(crate) fn interrupted(&self) -> Option<AttendedJob> {
        let small = fs::metadata(&self.path).is_ok_and(|file| file.len() <= LARGEST);
        let entry: AttendedJob =
            serde_json::from_slice(&fs::read(&self.path).ok().filter(|_| small)?).ok()?;
        (!entry.ended).then_some(entry)
    }

    /// Writes the entry; afterwards it is on the disk.
    pub(crate) fn write(&self, entry: &AttendedJob) -> Result<(), Diagnostic> {
        let bytes = serde_json::to_vec_pretty(entry).unwrap_or_default();
        machine_file::write_own(&self.path, &bytes).map_err(|error| {
            let why = Diagnostic::error("grbl.journal_unwritten").with("file", self.path.display());
            why.with("reason", error)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_written_is_read_and_what_ended_is_over() {
        let folder = tempfile::tempdir().unwrap();
        let ledger = Ledger::in_folder(folder.path());
        assert_eq!(ledger.interrupted(), None);
        let entry = AttendedJob {
            key: "k".to_owned(),
            done: 3,
            zero_mm: Some([1.0, -2.5, 0.0]),
            ..AttendedJob::default()
        };
        ledger.write(&entry).unwrap();
        assert_eq!(ledger.interrupted(), Some(entry.clone()));
        ledger.write(&AttendedJob { ended: true, ..entry }).unwrap();
        assert_eq!(ledger.interrupted(), None);
        fs::write(folder.path().join("controller.json"), b"{ half a file").unwrap();
        assert_eq!(ledger.interrupted(), None);
    }
}
