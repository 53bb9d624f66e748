//! The height map of the board on the machine, on disk. One machine holds one board, so there is one map.

use crate::machine_file;
use annulus_core::diagnostic::Diagnostic;
use annulus_core::level::HeightMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Largest file to read, bytes.
const LARGEST: u64 = 256 * 1024;

/// The map's file.
#[derive(Clone, Debug)]
pub(crate) struct Maps {
    path: PathBuf,
}

impl Maps {
    /// The file in the data folder.
    pub(crate) fn in_folder(folder: &Path) -> Self {
        Self { path: folder.join("height-map.json") }
    }

    /// Loads the map. Fails if there is none or it is damaged.
    pub(crate) fn kept(&self) -> Result<HeightMap, Diagnostic> {
        let none = || Diagnostic::error("level.none_kept");
        let size = fs::metadata(&self.path).map_err(|_| none())?.len();
        let bytes = fs::read(&self.path).ok().filter(|_| size <= LARGEST);
        let map = bytes.and_then(|bytes| serde_json::from_slice::<HeightMap>(&bytes).ok());
        map.filter(HeightMap::is_whole).ok_or_else(|| Diagnostic::error("level.damaged"))
    }

    /// Saves the map; durable when it returns.
    pub(crate) fn keep(&self, map: &HeightMap) -> Result<(), Diagnostic> {
        let bytes = serde_json::to_vec(map).unwrap_or_default();
        machine_file::write_own(&self.path, &bytes).map_err(|error| {
            let why = Diagnostic::error("level.not_kept").with("file", self.path.display());
            why.with("reason", error)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use annulus_core::geometry::{Bounds, Point};
    use annulus_core::level::ProbeGrid;
    use annulus_core::units::Length;

    #[test]
    fn height_map_is_read_back_and_a_damaged_one_refused() {
        let folder = tempfile::tempdir().unwrap();
        let maps = Maps::in_folder(folder.path());
        assert_eq!(maps.kept().unwrap_err().code, "level.none_kept");
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
        maps.keep(&map).unwrap();
        assert_eq!(maps.kept().unwrap(), map);
        let path = folder.path().join("height-map.json");
        let text = fs::read_to_string(&path).unwrap();
        fs::write(&path, &text[..text.len() / 2]).unwrap();
        assert_eq!(maps.kept().unwrap_err().code, "level.damaged");
    }
}
