//! Job progress and tool wear of a controller, on disk. A killed process, a pulled cable or a power cut
//! then omits no hole, drills none elsewhere, and counts each once.
//!
//! Each write is atomic; at most the current section is made again.

use crate::machine_file;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::machine::ToolWear;
use annulus_host::grbl::AttendedJob;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};

/// Largest file to read, bytes.
const LARGEST: u64 = 1024 * 1024;

#[derive(Debug, Default, Serialize, Deserialize)]
struct Kept {
    #[serde(flatten)]
    entry: AttendedJob,
    /// Tool wear at controllers.
    #[serde(default)]
    wear: Vec<ToolWear>,
}

/// The progress file.
#[derive(Clone, Debug)]
pub(crate) struct Ledger {
    path: PathBuf,
}

impl Ledger {
    /// The file in the data folder.
    pub(crate) fn in_folder(folder: &Path) -> Self {
        Self { path: folder.join("controller.json") }
    }

    /// The last started job, if it did not end.
    pub(crate) fn interrupted(&self) -> Option<AttendedJob> {
        self.read().map(|kept| kept.entry).filter(|entry| !entry.ended && !entry.key.is_empty())
    }

    /// Tool wear at controllers.
    pub(crate) fn wear(&self) -> Vec<ToolWear> {
        self.read().unwrap_or_default().wear
    }

    /// Saves a tool's wear; the job entry stays unchanged.
    pub(crate) fn keep_wear(&self, wear: ToolWear) -> Result<(), Diagnostic> {
        let Some(Kept { entry, wear: mut known }) = self.read() else { return Ok(()) };
        wear.keep(&mut known);
        self.write(&entry, &known)
    }

    fn read(&self) -> Option<Kept> {
        let small = fs::metadata(&self.path).is_ok_and(|file| file.len() <= LARGEST);
        serde_json::from_slice(&fs::read(&self.path).ok().filter(|_| small)?).ok()
    }

    /// Saves job entry and tool wear; durable when it returns.
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
    fn ledger_is_read_back_and_ended_jobs_are_not_offered() {
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
        // A file from before tool wear was counted.
        fs::write(folder.path().join("controller.json"), serde_json::to_vec(&entry).unwrap()).unwrap();
        assert_eq!((ledger.interrupted(), ledger.wear()), (Some(entry.clone()), vec![]));
        ledger.write(&AttendedJob { ended: true, ..entry }, &[]).unwrap();
        assert_eq!(ledger.interrupted(), None);
        fs::write(folder.path().join("controller.json"), b"{ half a file").unwrap();
        assert_eq!(ledger.interrupted(), None);
    }
}
