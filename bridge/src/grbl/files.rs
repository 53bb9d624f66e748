//! The files of a controller on disk, in a folder that only this user reads: progress, tool wear, job,
//! settings, and the height map of the board on the machine.

use crate::{machine_file, own};
use annulus_core::diagnostic::Diagnostic;
use annulus_core::error;
use annulus_core::level::HeightMap;
use annulus_core::machine::ToolWear;
use annulus_host::grbl::{AttendedJob, first_entry};
use annulus_host::journal::{sealed, unsealed};
use annulus_host::{File, Files};
use serde::Deserialize;
use std::fs::{self, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// The lock of this process on its files, until it ends.
static CLAIM: Mutex<Option<fs::File>> = Mutex::new(None);

/// Progress and tool wear as earlier versions saved them.
#[derive(Deserialize)]
struct Earlier {
    #[serde(flatten)]
    entry: AttendedJob,
    #[serde(default)]
    wear: Vec<ToolWear>,
}

/// Files in the folder `grbl` of a data folder; reads files of earlier versions until the first write.
#[derive(Clone, Debug)]
pub(crate) struct DiskFiles {
    data: PathBuf,
}

impl DiskFiles {
    pub(crate) fn in_folder(data: &Path) -> Self {
        Self { data: data.to_owned() }
    }

    pub(crate) fn path(&self, file: File) -> PathBuf {
        self.data.join("grbl").join(file.name())
    }

    /// Claims the files for this process, until it ends: of two processes that write them, each would undo
    /// what the other saved.
    pub(crate) fn claim(&self) -> Result<(), Diagnostic> {
        let mut claim = CLAIM.lock().unwrap_or_else(PoisonError::into_inner);
        if claim.is_some() {
            return Ok(());
        }
        let folder = self.data.join("grbl");
        let path = folder.join("lock");
        let cannot = |error: io::Error| {
            let why = error!("journal.cannot_open", file = path.display(), ..);
            why.with("reason", error)
        };
        own::root(&self.data).and_then(|()| own::folder(&folder)).map_err(cannot)?;
        let options = &mut OpenOptions::new();
        let file = own::open(&path, options.write(true).create(true).truncate(false)).map_err(cannot)?;
        match file.try_lock() {
            Ok(()) => *claim = Some(file),
            Err(TryLockError::WouldBlock) => return Err(error!("journal.in_use", file = folder.display())),
            Err(TryLockError::Error(error)) => return Err(cannot(error)),
        }
        Ok(())
    }

    /// The height map of the board. Fails if there is none or it is damaged.
    pub(crate) fn map(&mut self) -> Result<HeightMap, Diagnostic> {
        let none = || error!("level.none_kept");
        let bytes = self.read(File::HeightMap).ok().filter(|bytes| !bytes.is_empty()).ok_or_else(none)?;
        let damaged = || error!("level.damaged");
        let map: Option<HeightMap> = unsealed(&bytes).map_err(|_| damaged())?;
        let map = map.ok_or_else(none)?;
        if map.is_whole() { Ok(map) } else { Err(damaged()) }
    }

    /// Saves the height map; durable when it returns.
    pub(crate) fn keep_map(&mut self, map: &HeightMap) -> Result<(), Diagnostic> {
        self.write(File::HeightMap, &sealed(&Some(map))).map_err(|reason| {
            let why = error!("level.not_kept", file = self.path(File::HeightMap).display(), ..);
            why.with("reason", reason)
        })
    }

    /// Contents of `file` from the file where an earlier version saved them; empty if there are none.
    fn earlier(&self, file: File) -> Vec<u8> {
        let read = |name: &str| fs::read(self.data.join(name)).unwrap_or_default();
        match file {
            File::Done(true) if !self.path(File::Done(false)).exists() => {
                let before: Option<Earlier> = serde_json::from_slice(&read("controller.json")).ok();
                before.map(|before| first_entry(before.entry, before.wear)).unwrap_or_default()
            }
            File::HeightMap => {
                let bytes = read("height-map.json");
                let map: Result<HeightMap, _> = serde_json::from_slice(&bytes);
                // Damaged bytes are passed on, so that the damage is reported.
                map.map(|map| sealed(&Some(map))).unwrap_or(bytes)
            }
            _ => Vec::new(),
        }
    }
}

impl Files for DiskFiles {
    fn read(&mut self, file: File) -> Result<Vec<u8>, String> {
        match fs::read(self.path(file)) {
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(self.earlier(file)),
            read => read.map_err(|error| error.to_string()),
        }
    }

    fn write(&mut self, file: File, bytes: &[u8]) -> Result<(), String> {
        machine_file::write_own(&self.path(file), bytes).map_err(|error| error.to_string())
    }

    fn append(&mut self, file: File, bytes: &[u8]) -> Result<(), String> {
        let appended = own::folder(&self.data.join("grbl")).and_then(|()| {
            let mut file = own::open(&self.path(file), OpenOptions::new().create(true).append(true))?;
            file.write_all(bytes)?;
            file.sync_all()
        });
        appended.map_err(|error| error.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grbl::Ledger;
    use annulus_core::geometry::{Bounds, Point};
    use annulus_core::level::ProbeGrid;
    use annulus_core::machine::RackTool;
    use annulus_core::units::Length;

    #[test]
    fn files_are_read_back_and_unwritten_ones_are_empty() {
        let folder = tempfile::tempdir().unwrap();
        let mut files = DiskFiles::in_folder(folder.path());
        assert_eq!(files.read(File::Sent(true)), Ok(Vec::new()));
        files.write(File::Sent(true), b"G0 X0").unwrap();
        files.append(File::Sent(true), b"\nM2").unwrap();
        assert_eq!(files.clone().read(File::Sent(true)), Ok(b"G0 X0\nM2".to_vec()));
        assert_eq!(files.read(File::Sent(false)), Ok(Vec::new()));
    }

    #[test]
    fn ledger_is_read_back_and_ended_jobs_are_not_offered() {
        let folder = tempfile::tempdir().unwrap();
        let open = || Ledger::open(DiskFiles::in_folder(folder.path())).unwrap();
        assert_eq!(open().interrupted(), None);
        let entry = AttendedJob {
            key: "k".to_owned(),
            done: 3,
            zero_mm: Some([1.0, -2.5, 0.0]),
            ..AttendedJob::default()
        };
        let tool = RackTool::read("T3 drill 0.8").unwrap();
        let wear = ToolWear { hits: 17, ..ToolWear::new("mine", &tool) };
        open().save(&entry, vec![wear.clone()]).unwrap();
        assert_eq!((open().interrupted(), open().wear(), open().sent()), (Some(&entry), &[wear][..], None));
        open().keep_wear(ToolWear::new("mine", &tool)).unwrap();
        assert_eq!((open().interrupted(), open().wear()[0].hits), (Some(&entry), 0));
        open().save(&AttendedJob { ended: true, ..entry.clone() }, Vec::new()).unwrap();
        assert_eq!(open().interrupted(), None);
        // If one half is damaged, the ledger uses the other.
        fs::write(folder.path().join("grbl/controller-1"), b"half a file").unwrap();
        assert_eq!(open().interrupted(), Some(&entry));
    }

    #[test]
    fn progress_of_an_earlier_version_is_taken_over_once() {
        let folder = tempfile::tempdir().unwrap();
        let open = || Ledger::open(DiskFiles::in_folder(folder.path())).unwrap();
        let entry = AttendedJob { key: "k".to_owned(), done: 3, ..AttendedJob::default() };
        let write = |bytes: &[u8]| fs::write(folder.path().join("controller.json"), bytes).unwrap();
        write(b"{ half a file");
        assert_eq!(open().interrupted(), None);
        // The first versions counted no tool wear.
        write(&serde_json::to_vec(&entry).unwrap());
        assert_eq!((open().interrupted(), open().wear()), (Some(&entry), &[][..]));
        let wear = ToolWear { hits: 17, ..ToolWear::new("mine", &RackTool::read("T3 drill 0.8").unwrap()) };
        let mut both = serde_json::to_value(&entry).unwrap();
        both["wear"] = serde_json::json!([wear]);
        write(both.to_string().as_bytes());
        assert_eq!((open().interrupted(), open().wear()), (Some(&entry), &[wear.clone()][..]));
        let next = AttendedJob { done: 4, ..entry };
        open().save(&next, vec![wear]).unwrap();
        assert_eq!(open().interrupted(), Some(&next));
    }

    #[test]
    fn height_map_is_read_back_and_a_damaged_one_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut files = DiskFiles::in_folder(folder.path());
        assert_eq!(files.map().unwrap_err().code, "level.none_kept");
        let bounds = Bounds { min: Point::default(), max: Point::from_mm(20.0, 10.0) };
        let grid = ProbeGrid::over(bounds, Length::from_mm(10.0), Length::from_mm(1.0)).unwrap();
        let map = HeightMap {
            grid,
            heights: vec![Length::from_um(3); grid.count()],
            job: "j".to_owned(),
            zero: [Length::ZERO; 2],
            homed: true,
            measured_s: 1,
        };
        let old = folder.path().join("height-map.json");
        fs::write(&old, b"{ half a file").unwrap();
        assert_eq!(files.map().unwrap_err().code, "level.damaged");
        fs::write(&old, serde_json::to_vec(&map).unwrap()).unwrap();
        assert_eq!(files.map().unwrap(), map);
        let later = HeightMap { measured_s: 2, ..map };
        files.keep_map(&later).unwrap();
        assert_eq!(files.map().unwrap(), later);
        let bytes = files.read(File::HeightMap).unwrap();
        files.write(File::HeightMap, &bytes[..bytes.len() / 2]).unwrap();
        assert_eq!(files.map().unwrap_err().code, "level.damaged");
    }
}
