//! The progress of a controller's job, its tool wear, and the job itself, in files that are written in turn:
//! one half is always intact. A killed process, a pulled cable or a power cut then omits no hole, drills none
//! elsewhere, and counts each once.
//!
//! ```text
//! begin    program, text ─▶ the other half        ignored until the first entry names that half
//! advance  entry, sealed, numbered ─▶ in turn     the intact entry with the highest number holds
//! ```

use super::attended::AttendedJob;
use super::order::Order;
use crate::files::{File, Files};
use crate::journal::{sealed, unsealed};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::machine::{ToolWear, Value};
use serde::{Deserialize, Serialize};

#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Half {
    number: u64,
    /// SHA-256 of the program; empty before the first job, and for G-code without a program.
    job: String,
    /// Which half holds the program and the text.
    half: bool,
    entry: AttendedJob,
    /// Tool wear; missing in older ledgers.
    #[serde(default)]
    wear: Vec<ToolWear>,
}

/// The first contents of [`File::Done`], for progress and wear that are known from elsewhere.
pub fn first_entry(entry: AttendedJob, wear: Vec<ToolWear>) -> Vec<u8> {
    sealed(&Half { number: 1, entry, wear, ..Half::default() })
}

/// Progress, tool wear and the last job of a controller.
pub struct Ledger<F> {
    files: F,
    last: Half,
}

fn full(reason: String) -> Diagnostic {
    error!("journal.cannot_write", reason = reason)
}

impl<F: Files> Ledger<F> {
    /// The ledger in `files`.
    pub fn open(mut files: F) -> Result<Self, Diagnostic> {
        let mut last = Half::default();
        for file in [File::Done(false), File::Done(true)] {
            let unreadable = |reason| {
                let why = error!("journal.cannot_open", file = file.name(), ..);
                why.with("reason", reason)
            };
            let half = unsealed::<Half>(&files.read(file).map_err(unreadable)?).ok();
            if let Some(half) = half.filter(|half| half.number > last.number) {
                last = half;
            }
        }
        Ok(Self { files, last })
    }

    pub(super) fn entry(&self) -> &AttendedJob {
        &self.last.entry
    }

    /// Returns `true` if it was written later than `other`, which read the same files.
    pub(super) fn is_newer_than(&self, other: &Self) -> bool {
        self.last.number > other.last.number
    }

    pub fn wear(&self) -> &[ToolWear] {
        &self.last.wear
    }

    /// The last started job, if it did not end.
    pub fn interrupted(&self) -> Option<&AttendedJob> {
        Some(self.entry()).filter(|entry| !entry.ended && !entry.key.is_empty())
    }

    /// The file with the G-code of the last job, if that was written from a program.
    pub fn sent(&self) -> Option<File> {
        (!self.last.job.is_empty()).then_some(File::Sent(self.last.half))
    }

    /// The interrupted job, if the lines that were sent can still be read.
    pub(super) fn broken_off(&mut self) -> Option<Order> {
        let Half { job, half, entry, .. } = &self.last;
        if job.is_empty() || entry.ended || entry.done == 0 {
            return None;
        }
        let bytes = self.files.read(File::ControllerProgram(*half)).ok()?;
        let text = String::from_utf8(self.files.read(File::Sent(*half)).ok()?).ok()?;
        Order::read(job, &bytes, text).ok().filter(|order| order.routine.key == entry.key)
    }

    /// Writes the job into the unused half. The next entry switches to it.
    pub(super) fn bring(&mut self, order: &Order) -> Result<Bringing, Diagnostic> {
        let half = !self.last.half;
        self.files.write(File::ControllerProgram(half), &order.bytes).map_err(full)?;
        self.files.write(File::Sent(half), order.text.as_bytes()).map_err(full)?;
        Ok(Bringing { job: order.key.clone(), half })
    }

    /// Saves progress and tool wear, of the new job if there is one; durable when it returns.
    pub(super) fn write(
        &mut self,
        bringing: Option<Bringing>,
        entry: &AttendedJob,
        wear: Vec<ToolWear>,
    ) -> Result<(), Diagnostic> {
        let mut next = Half { entry: entry.clone(), wear, ..self.last.clone() };
        if entry.key != self.last.entry.key {
            next.job.clear();
        }
        if let Some(bringing) = bringing {
            (next.job, next.half) = (bringing.job, bringing.half);
        }
        self.put(next)
    }

    /// Saves progress and tool wear of a job whose G-code the caller keeps; durable when it returns.
    pub fn save(&mut self, entry: &AttendedJob, wear: Vec<ToolWear>) -> Result<(), Diagnostic> {
        self.write(None, entry, wear)
    }

    /// Saves the wear of one tool.
    pub fn keep_wear(&mut self, wear: ToolWear) -> Result<(), Diagnostic> {
        let mut next = self.last.clone();
        wear.keep(&mut next.wear);
        self.put(next)
    }

    fn put(&mut self, next: Half) -> Result<(), Diagnostic> {
        let next = Half { number: self.last.number + 1, ..next };
        self.files.write(File::Done(next.number % 2 == 1), &sealed(&next)).map_err(full)?;
        self.last = next;
        Ok(())
    }

    /// The user's settings; empty if they are damaged.
    pub(super) fn settings(&mut self) -> Vec<(String, Value)> {
        let kept = self.files.read(File::ControllerSettings).unwrap_or_default();
        unsealed(&kept).unwrap_or_default()
    }

    /// Writes `bytes` into `file`; durable when it returns.
    pub(super) fn keep(&mut self, file: File, bytes: &[u8]) -> Result<(), Diagnostic> {
        self.files.write(file, bytes).map_err(full)
    }

    pub(super) fn keep_settings(&mut self, settings: &[(String, Value)]) -> Result<(), Diagnostic> {
        self.files.write(File::ControllerSettings, &sealed(&settings)).map_err(full)
    }
}

/// A new job whose files are written, but which no entry names yet.
pub(super) struct Bringing {
    job: String,
    half: bool,
}
