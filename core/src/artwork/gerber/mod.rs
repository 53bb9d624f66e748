//! Just enough of Gerber to place holes: words, apertures, flashes, the centre lines of strokes. No areas.
//!
//! Comes in: text. Goes out: a [`Gerber`]: counts, pad centres, tracks with their half widths, centre lines. Does not
//! paint, and does not know drill files.

mod reader;
pub(super) mod role;

pub(super) use reader::read;

use super::{Digits, Units, Zeros};
use crate::geometry::Point;
use crate::units::Length;

/// What a layer draws with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct GerberObjects {
    /// Flashes.
    pub flashes: u32,
    /// Straight strokes.
    pub lines: u32,
    /// Arcs.
    pub arcs: u32,
    /// Filled regions.
    pub regions: u32,
}

impl GerberObjects {
    /// All together.
    pub const fn total(&self) -> u32 {
        self.flashes + self.lines + self.arcs + self.regions
    }
}

/// A stroke between two points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Track {
    /// One end.
    pub from: Point,
    /// The other.
    pub to: Point,
    /// Half of its width.
    pub half_width: Length,
}

/// A Gerber layer, read for what places holes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gerber {
    /// Units of the first coordinate.
    pub units: Option<Units>,
    /// Digits of coordinates.
    pub digits: Option<Digits>,
    /// Zeros left out.
    pub zeros: Option<Zeros>,
    /// `%IP`: whether the image is negative.
    pub negative_image: bool,
    /// X2 file function, as written.
    pub file_function: Option<String>,
    /// The program that wrote it.
    pub generator: Option<String>,
    /// Layer or image name.
    pub layer_name: Option<String>,
    /// Counts.
    pub objects: GerberObjects,
    /// Centres of flashes.
    pub pads: Vec<Point>,
    /// Strokes; arcs are cut into chords.
    pub tracks: Vec<Track>,
}
