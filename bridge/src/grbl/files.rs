//! The files of a controller's station, in a folder that only this user reads.

use super::ledger::Ledger;
use super::maps::Maps;
use crate::{machine_file, own};
use annulus_host::grbl::first_entry;
use annulus_host::journal::sealed;
use annulus_host::{File, Files};
use std::fs::{self, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// A folder of files.
#[derive(Clone, Debug)]
pub(crate) struct DiskFiles {
    data: PathBuf,
}

impl DiskFiles {
    /// The files below the data folder `data`.
    pub(crate) fn in_folder(data: &Path) -> Self {
        Self { data: data.to_owned() }
    }

    fn path(&self, file: File) -> PathBuf {
        self.data.join("grbl").join(file.name())
    }

    /// What `annulus grbl` saved, for a station that has saved nothing yet.
    fn earlier(&self, file: File) -> Vec<u8> {
        match file {
            File::Done(true) if !self.path(File::Done(false)).exists() => {
                let ledger = Ledger::in_folder(&self.data);
                first_entry(ledger.interrupted().unwrap_or_default(), ledger.wear())
            }
            File::HeightMap => {
                let map = Maps::in_folder(&self.data).kept();
                map.map(|map| sealed(&Some(map))).unwrap_or_default()
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
    use annulus_core::machine::{RackTool, ToolWear};
    use annulus_host::grbl::AttendedJob;
    use annulus_host::journal::unsealed;
    use serde_json::Value;

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
    fn progress_of_the_command_line_is_taken_over_once() {
        let folder = tempfile::tempdir().unwrap();
        let mut files = DiskFiles::in_folder(folder.path());
        let tool = RackTool::read("T3 drill 0.8").unwrap();
        let wear = ToolWear { hits: 17, ..ToolWear::new("mine", &tool) };
        let entry = AttendedJob { key: "k".to_owned(), done: 3, ..AttendedJob::default() };
        Ledger::in_folder(folder.path()).write(&entry, &[wear]).unwrap();
        let first: Value = unsealed(&files.read(File::Done(true)).unwrap()).unwrap();
        assert_eq!((&first["entry"]["done"], &first["wear"][0]["hits"]), (&3.into(), &17.into()), "{first}");
        // A page cannot resume it, because there is no program.
        assert_eq!(first["job"], "");
        files.write(File::Done(false), b"later").unwrap();
        assert_eq!(files.read(File::Done(true)), Ok(Vec::new()));
    }
}
