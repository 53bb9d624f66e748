//! What of a controller's job is done, and what its tools have done, on the disk: so that a killed process, a pulled cable or a power cut
//! leave no hole out, none is drilled elsewhere, and each is counted once (C3).
//!
//! Comes in: the job and how many sections of it are certainly done. Goes out: the job that was interrupted. Written whole or not at
//! all; at most the section in work is made again. Does not know what a section is.

use crate::machine_file;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::ToolWear;
use annulus_drill::controller::AttendedJob;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};

/// Largest file that is read.
const LARGEST: u64 = 1024 * 1024;

/// The file.
#[derive(Debug, Default, Serialize, Deserialize)]
struct Kept {
    #[serde(flatten)]
    entry: AttendedJob,
    /// What tools have done at controllers.
    #[serde(default)]
    wear: Vec<ToolWear>,
}

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
        self.read().map(|kept| kept.entry).filter(|entry| !entry.ended && !entry.key.is_empty())
    }

    /// What tools have done at controllers.
    pub(crate) fn wear(&self) -> Vec<ToolWear> {
        self.read().unwrap_or_default().wear
    }

    /// A tool has done that much; the job stays as it is.
    pub(crate) fn keep_wear(&self, wear: ToolWear) -> Result<(), Diagnostic> {
        let Some(Kept { entry, wear: mut known }) = self.read() else { return Ok(()) };
        wear.keep(&mut known);
        self.write(&entry, &known)
    }

    fn read(&self) -> Option<Kept> {
        let small = fs::metadata(&self.path).is_ok_and(|file| file.len() <= LARGEST);
        serde_json::from_slice(&fs::read(&self.path).ok().filter(|_| small)?).ok()
    }

    /// Writes the entry, and what tools have done by then; afterwards it is on the disk.
    pub(crate) fn write(&self, entry: &AttendedJob, wear: &[ToolWear]) -> Result<(), Diagnostic> {
        let kept = Kept { entry: entry.clone(), wear: wear.to_vec() };
        let bytes = serde_json::to_vec_pretty(&kept).unwrap_or_default();
        machine_file::write_own(&self.path, &bytes).map_err(|error| {
            let why = Diagnostic::error("grbl.journal_unwritten").with("file", self.path.display());
            why.with("reason", error)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::machine::RackTool;

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
        let tool = RackTool::read("T3 drill 0.8").unwrap();
        let wear = ToolWear { hits: 17, ..ToolWear::new("mine", &tool) };
        ledger.write(&entry, std::slice::from_ref(&wear)).unwrap();
        assert_eq!((ledger.interrupted(), ledger.wear()), (Some(entry.clone()), vec![wear]));
        ledger.keep_wear(ToolWear::new("mine", &tool)).unwrap();
        assert_eq!((ledger.interrupted(), ledger.wear()[0].hits), (Some(entry.clone()), 0));
        // One that is older than tools that are counted.
        fs::write(folder.path().join("controller.json"), serde_json::to_vec(&entry).unwrap()).unwrap();
        assert_eq!((ledger.interrupted(), ledger.wear()), (Some(entry.clone()), vec![]));
        ledger.write(&AttendedJob { ended: true, ..entry }, &[]).unwrap();
        assert_eq!(ledger.interrupted(), None);
        fs::write(folder.path().join("controller.json"), b"{ half a file").unwrap();
        assert_eq!(ledger.interrupted(), None);
    }
}
