//! Board surface data on a controller: the saved map, and a measurement in progress.

use crate::files::{File, Files};
use crate::journal::unsealed;
use annulus_core::level::{HeightMap, ProbeGrid};
use annulus_core::units::Length;

#[derive(Default)]
pub(super) struct Touching {
    pub(super) job: String,
    pub(super) now_s: u64,
    pub(super) grid: Option<ProbeGrid>,
    pub(super) heights: Vec<Option<Length>>,
    pub(super) done: usize,
    pub(super) of: usize,
}

/// Reference of a Z zero.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct HeightSet {
    /// The board itself at the tool's position: valid for jobs without a height map.
    pub(super) of_board: bool,
    pub(super) map: Option<String>,
}

impl HeightSet {
    /// Returns `true` if this zero fits a job that follows the map with this key, or no map.
    pub(super) fn suits(&self, follows: Option<&str>) -> bool {
        follows.map_or(self.of_board, |key| self.map.as_deref() == Some(key))
    }
}

#[derive(Default)]
pub(super) struct BoardSurface {
    pub(super) map: Option<HeightMap>,
    /// The map was measured since the port was opened, and the zero is still valid.
    pub(super) fresh: bool,
    pub(super) touching: Touching,
}

impl BoardSurface {
    pub(super) fn kept(files: &mut impl Files) -> Self {
        let bytes = files.read(File::HeightMap).unwrap_or_default();
        let map = unsealed::<Option<HeightMap>>(&bytes).ok().flatten().filter(HeightMap::is_whole);
        Self { map, ..Self::default() }
    }
}
