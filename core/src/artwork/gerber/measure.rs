//! Measures of a painted layer for scripts: area, islands, holes, bounding box. Ignores tiny fragments from
//! rounding.

use crate::geometry::{Bounds, Path, Region, island_area_mm2, path_area_mm2, path_bounds};

/// Smaller islands and holes are ignored, mm².
const CRUMB_MM2: f64 = 1e-6;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PaintedMeasures {
    /// Dark area, mm².
    pub area_mm2: f64,
    pub islands: usize,
    pub holes: usize,
    /// Bounding box; none if empty.
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
