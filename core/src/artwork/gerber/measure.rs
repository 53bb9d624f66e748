//! Measures of a layer: bounding boxes of the pads, and area, islands and holes of the painted layer for
//! scripts.

use super::aperture_shapes::outlines;
use super::flatten::each;
use super::object::{Gerber, ObjectShape};
use super::transform::Place;
use crate::geometry::{Bounds, Fuel, Path, Point, Region, island_area_mm2, path_area_mm2, path_bounds};
use std::collections::BTreeMap;

const CRUMB_MM2: f64 = 1e-6;

#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PaintedMeasures {
    pub area_mm2: f64,
    pub islands: usize,
    pub holes: usize,
    /// Bounding box; none if empty.
    pub bounds: Option<Bounds>,
}

/// Measures a painted layer. Ignores tiny fragments from rounding.
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

/// Work limit for the shapes of all apertures; pads beyond it have no box.
const STEPS: u64 = 200_000;

impl Gerber {
    /// The bounding box of each pad at its position. Pads in blocks count separately.
    pub(in crate::artwork) fn pad_boxes(&self) -> Vec<Bounds> {
        let mut fuel = Fuel::new(STEPS);
        let mut known: BTreeMap<(u32, bool, u64, u64), Option<Bounds>> = BTreeMap::new();
        let mut boxes = Vec::new();
        each(self, &mut |seen| {
            let ObjectShape::Flash { at } = seen.object.shape else { return };
            let held = seen.transform(self);
            let key = (seen.object.aperture, held.mirrored, held.turn_deg.to_bits(), held.scale.to_bits());
            let own = known.entry(key).or_insert_with(|| {
                let shapes = outlines(self.aperture(seen.object)?, &mut fuel)?;
                let about = Place { transform: held, at: Point::default() };
                let around = |path: &Path| path_bounds(&about.path(path));
                shapes.iter().map(around).reduce(|all, next| all.with(next.min).with(next.max))
            });
            let at = seen.place.point(at);
            let moved = |corner: Point| Point::new(corner.x + at.x, corner.y + at.y);
            boxes.extend(own.map(|own| Bounds { min: moved(own.min), max: moved(own.max) }));
        });
        boxes
    }
}
