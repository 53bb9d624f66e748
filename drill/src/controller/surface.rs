//! What is known of the surface of the board on a controller: the map that was kept, and the one that is being measured.
//!
//! Comes in: files. Goes out: plain data. Does not know who touches the board.

use crate::files::{File, Files};
use crate::journal::unsealed;
use annulus_core::level::{HeightMap, ProbeGrid};
use annulus_core::units::Length;

/// A board that is being touched.
#[derive(Default)]
pub(super) struct Touching {
    pub(super) job: String,
    pub(super) now_s: u64,
    pub(super) grid: Option<ProbeGrid>,
    pub(super) heights: Vec<Option<Length>>,
    pub(super) done: usize,
    pub(super) of: usize,
}

/// What a zero of Z goes by.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct HeightSet {
    /// The board itself, where the tip was: good for what follows no map.
    pub(super) of_board: bool,
    /// The key of the height map that it goes together with.
    pub(super) map: Option<String>,
}

impl HeightSet {
    /// Whether it is the zero of a job that follows this map, or none.
    pub(super) fn suits(&self, follows: Option<&str>) -> bool {
        follows.map_or(self.of_board, |key| self.map.as_deref() == Some(key))
    }
}

/// What is known of the surface of the board.
#[derive(Default)]
pub(super) struct BoardSurface {
    /// The map that was kept.
    pub(super) map: Option<HeightMap>,
    /// It was measured since the port was opened, and the place of the zero was not lost since.
    pub(super) fresh: bool,
    pub(super) touching: Touching,
}

impl BoardSurface {
    /// As it was kept.
    pub(super) fn kept(files: &mut impl Files) -> Self {
        let bytes = files.read(File::HeightMap).unwrap_or_default();
        let map = unsealed::<Option<HeightMap>>(&bytes).ok().flatten().filter(HeightMap::is_whole);
        Self { map, ..Self::default() }
    }
}
