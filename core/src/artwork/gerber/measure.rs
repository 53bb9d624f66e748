//! The numbers of a painted layer that scripts compare: area, islands, holes, box.
//!
//! Comes in: a [`Region`]. Goes out: [`PaintedMeasures`] in square millimetres. Fragments that rounding may leave are no islands.

use crate::geometry::{Bounds, Path, Region, island_area_mm2, path_area_mm2, path_bounds};

/// Pieces and holes up to this size, in mm², are not counted.
const CRUMB_MM2: f64 = 1e-6;

/// What a painted layer measures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PaintedMeasures {
    /// Dark area in mm².
    pub area_mm2: f64,
    /// Connected dark pieces.
    pub islands: usize,
    /// Holes in them.
    pub holes: usize,
    /// The box around all of it; none for nothing.
    pub bounds: Option<Bounds>,
}

/// Measures a painted layer.
pub fn painted_measures(region: &Region) -> PaintedMeasures {
    let mut found = PaintedMeasures::default();
    for island in &region.islands {
        let area = island_area_mm2(island);
        found.area_mm2 += area;
        if area > CRUMB_MM2 {
            found.islands += 1;
            let counted = |hole: &&Path| path_area_mm2(hole).abs() > CRUMB_MM2;
            found.holes += island.holes.iter().filter(counted).count();
        }
        let around = path_bounds(&island.outer);
        found.bounds = Some(found.bounds.map_or(around, |bounds| bounds.with(around.min).with(around.max)));
    }
    found
}
